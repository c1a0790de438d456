"""Walks without a tracker: inertial sensors between a few known positions (docs/explanation/dead_reckoning.md)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import compress

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray, with_rows
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.status import EventKind, Status, TrackerEvent
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.estimation.dead_reckoning.gait import speed_model
from vislam2tag.estimation.dead_reckoning.walk import LeftOut, ReckonedWalk, SensedWalk, contradictions_m, happenings
from vislam2tag.estimation.heights import heights_by_pressure
from vislam2tag.estimation.settings import WITHOUT_TRACKER, DeadReckoningSettings, HeightSettings
from vislam2tag.estimation.strategy import TrajectoryBuilder, not_converged, register
from vislam2tag.estimation.vertical import altitude_m

APART_M = 2.0
"""Smallest distance between fixes that determine a heading, if the phone has none of its own."""


@dataclass(frozen=True)
class DeadReckoning:
    """Gives every moment between the first and the last inertial reading a position and a covariance."""

    settings: DeadReckoningSettings = field(default_factory=DeadReckoningSettings)
    heights: HeightSettings = field(default_factory=HeightSettings)
    needs: str = "accelerometer and gyroscope, and two fixes at different places"

    def map(self, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
        """Map all usable frames, or none if sensors or fixes are missing."""
        del log
        builder = TrajectoryBuilder.blank(camera, Status.NO_MAPPING)
        height = heights_by_pressure(camera.time_ns, camera.pressure, landmarks.storeys, self.heights)
        walk = self.reckoned(camera, landmarks)
        if walk is None:
            return builder.finish(camera, (), ())
        frame = np.flatnonzero(camera.usable)
        time_s = _seconds(camera.time_ns[frame], walk)
        position, spread = walk.at(time_s)
        contradiction_m = contradictions_m(walk)
        doubt_m = np.interp(time_s, walk.nodes.time_s[walk.fixes.node], contradiction_m)
        spread = spread + doubt_m[:, None, None] ** 2 / 2 * np.eye(2)
        builder.position_bcs[frame] = np.column_stack((position, height.z_m[frame]))
        builder.covariance_bcs[frame] = spread
        builder.status[frame] = Status.OK
        return replace(
            builder.finish(camera, (), ()),
            floor=height.floor,
            events=_events(camera, walk, frame, time_s),
            not_converged=not_converged("path", walk.path.unreached_m, "m"),
            fix_contradiction_m=float(np.median(contradiction_m)),
            fixes_used=len(walk.names),
        )

    def reckoned(self, camera: CameraTrack, landmarks: Landmarks) -> ReckonedWalk | None:
        """The walk through its fixes, between the walls of its floor; None if sensors or fixes are missing."""
        height = heights_by_pressure(camera.time_ns, camera.pressure, landmarks.storeys, self.heights)
        one_floor = len(np.unique(height.floor)) < 2
        return _reckoned(camera, camera.area if one_floor else None, self.settings)


def _reckoned(camera: CameraTrack, area: WalkableArea | None, settings: DeadReckoningSettings) -> ReckonedWalk | None:
    if camera.inertial is None or camera.fixes is None or not camera.usable.any():
        return None
    sensed = SensedWalk.of(camera.inertial)
    if sensed is None:
        return None
    usable = sensed.usable(camera.fixes)
    names = tuple(compress(camera.fixes.name, usable))
    fixes = replace(with_rows(camera.fixes, usable, "time_ns", "position_bcs", "sigma_m"), name=names)
    spread = np.ptp(fixes.position_bcs, axis=0).max() if usable.sum() > 1 else -1.0
    if spread < (0.0 if np.isfinite(sensed.headings.drift_rad).any() else APART_M):
        return None
    return sensed.path(fixes, speed_model(), settings, area, camera.ways)


def _seconds(time_ns: IntArray, walk: ReckonedWalk) -> FloatArray:
    return np.asarray((time_ns - walk.sensed.signals.start_ns) * 1e-9)


def _events(camera: CameraTrack, walk: ReckonedWalk, frame: IntArray, time_s: FloatArray) -> tuple[TrackerEvent, ...]:
    """Events, at their first frame, and fixes that contradict the others."""

    def frame_at(moment_s: float) -> int:
        return int(frame[min(int(np.searchsorted(time_s, moment_s)), len(frame) - 1)])

    windows_ns = walk.sensed.signals.start_ns + (walk.sensed.features.time_s * 1e9).astype(np.int64)
    altitude = None if camera.pressure is None else altitude_m(camera.pressure, windows_ns)
    events = [
        TrackerEvent(
            each.kind, frame_at(each.start_s), each.size_m, each.turn_rad, f"for {each.end_s - each.start_s:.1f} s"
        )
        for each in happenings(walk.sensed, altitude)
    ]
    left_out = LeftOut.of(walk)
    for fix in np.flatnonzero(left_out.doubtful).tolist():
        size_m = float(np.linalg.norm(left_out.error_m[fix]))
        at = frame_at(float(walk.nodes.time_s[walk.fixes.node[fix]]))
        events.append(TrackerEvent(EventKind.DOUBTFUL_FIX, at, size_m, reason=walk.names[fix]))
    return tuple(sorted(events, key=lambda event: event.frame))


register(WITHOUT_TRACKER, lambda settings: DeadReckoning(settings.dead_reckoning, settings.heights))
