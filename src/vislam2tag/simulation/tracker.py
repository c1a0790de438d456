"""The AR tracker, from a true walk to the logged poses, with the map that it builds.

Frames: dead reckoning in its own frame, the map built on it (:class:`Mapper`), re-expressions of that map, and the
tracker's coordinates (ACS: y up, horizontal plane ``(x, -z)``). All is in the complex plane. The camera is
``turn * odometry + shift``, with a turn and a shift that change only at events. An anchor changes when its landmark is
seen, or when a loop correction moves it. The finished map carries the anchors that the phone app sets
(docs/reference/phone-tables.md).
"""

from __future__ import annotations

import cmath
import math
from collections import defaultdict
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.ndimage import binary_dilation

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.context import AnchorLog
from vislam2tag.core.tracks import LandmarkLog, to_plane
from vislam2tag.core.transforms import as_complex, multiply
from vislam2tag.simulation.model import MapMotion, MapShift, SimulatedEvent, SimulatedFloor, TrackerLog, TrueWalk
from vislam2tag.simulation.settings import TrackerSettings
from vislam2tag.simulation.tracker_camera import CameraFrames, DeadReckoning, Sightings, dead_reckon, expose, sight
from vislam2tag.simulation.tracker_faults import CameraJump, FaultPlan, plan_faults, vertical_errors, with_rides

UNSEEN_S = 10.0
"""A landmark seen again after this long is a revisit."""
RELOCALISE_M = 2.0
"""A revisit with a larger error of the camera relocalises it at once."""
RESUME_M = 0.3
"""Displacement of the camera when tracking is found again, per axis."""


@dataclass(frozen=True)
class MapLog:
    """State of the map at each of ``f`` frames: the camera, and ``m`` landmarks (NaN before they are known)."""

    camera: ComplexArray
    turn: ComplexArray
    """(f,) rotation from the odometry's frame to the map's."""
    anchor: ComplexArray
    heading: FloatArray
    height: FloatArray
    events: tuple[SimulatedEvent, ...]
    carries: tuple[MapShift, ...] = ()


class Mapper:
    """Processes one walk from event to event and fills its :class:`MapLog`."""

    def __init__(
        self, odometry: DeadReckoning, sightings: Sightings, settings: TrackerSettings, rng: np.random.Generator
    ) -> None:
        self._odometry, self._sightings, self._settings, self._rng = odometry, sightings, settings, rng
        landmarks = sightings.seen.shape[1]
        self._turn, self._shift = 1 + 0j, 0j
        self._undisturbed: tuple[complex, complex] | None = None
        self._broken_at = 0
        self._anchor = np.full(landmarks, np.nan + 0j)
        self._heading, self._height = np.full(landmarks, np.nan), np.full(landmarks, np.nan)
        self._last_seen = np.full(landmarks, -1)
        self._seen_turn = np.zeros(landmarks)
        self._events: list[SimulatedEvent] = []
        self._carries: list[MapShift] = []

    def run(self, faults: FaultPlan) -> MapLog:
        """Make the log of the whole walk."""
        count, landmarks = self._sightings.seen.shape
        log = MapLog(
            camera=np.empty(count, dtype=np.complex128),
            turn=np.empty(count, dtype=np.complex128),
            anchor=np.empty((count, landmarks), dtype=np.complex128),
            heading=np.empty((count, landmarks)),
            height=np.empty((count, landmarks)),
            events=(),
        )
        passes: dict[int, list[int]] = defaultdict(list)
        for landmark, start, _ in self._sightings.passes.tolist():
            passes[start].append(landmark)
        breaks = {fault.frame: fault for fault in faults.breaks}
        returns = {fault.back for fault in faults.breaks if fault.back < count}
        found = set(faults.lost[:, 1].tolist())
        marks = {0, count, *passes, *self._sightings.passes[:, 2].tolist(), *breaks, *returns, *found}
        for start, stop in pairwise(sorted(marks)):
            if start in found:
                self._resume(start)
            if start in breaks:
                self._break(breaks[start])
            if start in returns:
                self._come_back(start)
            for landmark in passes[start]:
                self._revisit(start, landmark)
            self._fill(log, start, stop)
        return replace(log, events=tuple(self._events), carries=tuple(self._carries))

    def _fill(self, log: MapLog, start: int, stop: int) -> None:
        """Log the frames up to the next event; landmarks in view follow their sightings."""
        span = slice(start, stop)
        log.turn[span] = self._turn
        log.camera[span] = self._camera(span)
        log.anchor[span], log.heading[span], log.height[span] = self._anchor, self._heading, self._height
        for landmark in np.flatnonzero(self._sightings.seen[start]).tolist():
            log.anchor[span, landmark] = self._observed(span, landmark)
            turn = np.angle(self._turn * self._odometry.factor[span])
            log.heading[span, landmark] = self._sightings.heading[span, landmark] + turn
            log.height[span, landmark] = self._sightings.up[span, landmark] + self._odometry.height[span]
            self._anchor[landmark] = log.anchor[stop - 1, landmark]
            self._heading[landmark] = log.heading[stop - 1, landmark]
            self._height[landmark] = log.height[stop - 1, landmark]
            self._last_seen[landmark], self._seen_turn[landmark] = stop - 1, turn[-1]

    def _camera(self, span: slice) -> ComplexArray:
        """The camera (f,) in the map, complex metres, over a span of frames."""
        return np.asarray(self._turn * self._odometry.plane[span] + self._shift)

    def _observed(self, span: slice, landmark: int) -> ComplexArray:
        """Where (f,) a landmark is seen in the map, complex metres, over a span of frames."""
        offset = self._odometry.factor[span] * self._sightings.offset[span, landmark]
        return np.asarray(self._camera(span) + self._turn * offset)

    def _displace(self, pivot: complex, turn_rad: float, jump: complex) -> None:
        """Turn the camera's frame about a point of the map, then move it; landmarks stay."""
        turn = cmath.exp(1j * turn_rad)
        self._shift = (self._shift - pivot) * turn + pivot + jump
        self._turn *= turn

    def _note(self, frame: int, kind: str, size_m: float) -> None:
        self._events.append(SimulatedEvent(frame, kind, size_m))

    def _break(self, fault: CameraJump) -> None:
        if self._undisturbed is None:
            self._undisturbed = (self._turn, self._shift)
        self._broken_at = fault.frame
        pivot = complex(self._camera(slice(fault.frame, fault.frame + 1))[0])
        local = self._turn * complex(self._odometry.factor[fault.frame])
        self._displace(pivot, fault.turn_rad, fault.jump * local / abs(local))
        self._note(fault.frame, "break", abs(fault.jump))

    def _come_back(self, frame: int) -> None:
        """Relocalise by a place seen before: the camera jumps back to where it would be without the break."""
        if self._undisturbed is None:
            return
        here = slice(frame, frame + 1)
        before = self._camera(here)[0]
        (self._turn, self._shift), self._undisturbed = self._undisturbed, None
        back = complex(self._camera(here)[0] - before)
        self._carry_anchors(self._last_seen > self._broken_at, back)
        self._carries.append(MapShift(frame, self._broken_at, back, even=True))
        self._note(frame, "relocalise", float(abs(self._camera(here)[0] - before)))

    def _resume(self, frame: int) -> None:
        """Resume tracking after a loss, with a small displacement."""
        spread = self._settings.severity * RESUME_M
        jump = complex(*self._rng.normal(0, spread, 2))
        pivot = complex(self._camera(slice(frame, frame + 1))[0])
        self._displace(pivot, float(self._rng.normal(0, 0.1 * spread)), jump)

    def _revisit(self, frame: int, landmark: int) -> None:
        """Correct part of the drift since this landmark was last seen, unevenly over the other landmarks."""
        since = int(self._last_seen[landmark])
        if since < 0 or frame - since < UNSEEN_S * self._settings.frame_rate_hz or self._settings.severity == 0:
            return
        seen_at = complex(self._observed(slice(frame, frame + 1), landmark)[0])
        drift = seen_at - complex(self._anchor[landmark])
        turned = float(np.angle(self._turn * self._odometry.factor[frame]) - self._seen_turn[landmark])
        turned = math.remainder(turned, math.tau)
        relocalised = abs(drift) > RELOCALISE_M
        share = 1.0 if relocalised else float(self._rng.uniform(*self._settings.loop_share))
        self._displace(seen_at, -share * turned, -share * drift)
        if relocalised:
            self._undisturbed = None
            since = max(since, self._broken_at)
            self._carry_anchors(self._last_seen > since, -drift)
        else:
            age = ((self._last_seen - since) / (frame - since)).clip(0, 1)
            self._carry_anchors(age * self._rng.uniform(0.6, 1.2, len(age)), -share * drift)
        self._carries.append(MapShift(frame, since, -share * drift, even=relocalised))
        self._note(frame, "relocalise" if relocalised else "loop_correction", abs(share * drift))

    def _carry_anchors(self, weight: FloatArray | BoolArray, move: complex) -> None:
        """Move each landmark's anchor by its share (m,) of a move, complex metres."""
        self._anchor = self._anchor + weight * move


APART_M = 5.0
"""A new anchor is set if the camera is this far from the newest one, in space."""
FOLLOWED = 8
"""Number of the newest anchors that are logged at each frame."""
LEAST_CARRIED, MOST_CARRIED = 0.6, 1.2
"""Range of the share by which a loop correction moves points of its age, as for landmarks."""


def set_anchors(tracker: TrackerLog, motion: MapMotion, rng: np.random.Generator) -> AnchorLog:
    """Set anchors as the app does and follow them; all poses are rounded to the float32 that the platform gives."""
    camera = _single(tracker.position_acs)
    ways: list[FloatArray] = []
    first: list[int] = []
    start = int(np.argmin(motion.lost))
    while start < len(camera) and not motion.lost[start]:
        first.append(start)
        ways.append(_anchor_positions(tracker, motion, start, rng))
        apart = np.linalg.norm(camera[start:] - ways[-1], axis=1)
        far = np.flatnonzero((apart >= APART_M) & ~motion.lost[start:])
        start = start + int(far[0]) if len(far) else len(camera)
    return _log(tracker, motion, first, ways)


def _anchor_positions(tracker: TrackerLog, motion: MapMotion, start: int, rng: np.random.Generator) -> FloatArray:
    """Positions (f - start, 3) of the anchor set at frame ``start``."""
    later = slice(start, None)
    here = complex(as_complex(to_plane(tracker.position_acs[start])))
    point = np.full(len(motion.factor) - start, (here - motion.shift[start]) / motion.factor[start])
    for carry in motion.carries:
        if carry.since < start < carry.frame:
            age = 1.0 if carry.even else (start - carry.since) / (carry.frame - carry.since)
            share = 1.0 if carry.even else age * rng.uniform(LEAST_CARRIED, MOST_CARRIED)
            point[carry.frame - start :] += share * carry.move
    plane: ComplexArray = motion.factor[later] * point + motion.shift[later]
    height = tracker.position_acs[start, 1] + motion.rise[later] - motion.rise[start]
    way = _single(np.stack((plane.real, height, -plane.imag), axis=-1))
    way[0] = _single(tracker.position_acs[start])
    return way


def _log(tracker: TrackerLog, motion: MapMotion, first: list[int], ways: list[FloatArray]) -> AnchorLog:
    """Poses of the followed anchors, each by its first frame and positions (f, 3)."""
    anchors, frames, positions, orientations = [], [], [], []
    stops = [*first[FOLLOWED:], *[len(motion.factor)] * FOLLOWED]
    for number, (start, stop, way) in enumerate(zip(first, stops, ways, strict=False)):
        frame = np.arange(start, stop)
        anchors.append(np.full(len(frame), number))
        frames.append(frame)
        positions.append(way[: stop - start])
        orientations.append(_turned_with_map(tracker.orientation_acs[start], motion, frame))
    if not anchors:
        none = np.empty(0, dtype=np.int64)
        return AnchorLog(none, none, np.empty((0, 3)), np.empty((0, 4)))
    return AnchorLog(*(np.concatenate(parts) for parts in (anchors, frames, positions, orientations)))


def _turned_with_map(orientation: FloatArray, motion: MapMotion, frame: IntArray) -> FloatArray:
    """Quaternions (k, 4) of an anchor that turns with the map."""
    angle = np.angle(motion.factor[frame] / motion.factor[frame[0]]) / 2
    zero = np.zeros_like(angle)
    yaw = np.stack((zero, np.sin(angle), zero, np.cos(angle)), axis=-1)
    return _single(multiply(yaw, np.broadcast_to(orientation, yaw.shape)))


def _single(values: FloatArray) -> FloatArray:
    """Values (...,) rounded to float32."""
    return values.astype(np.float32).astype(np.float64)


HALF = np.sqrt(0.5)
LYING_Q_STANDING = np.array([-HALF, 0.0, 0.0, HALF])
"""Quarter turn that takes z-up axes to y-up ones."""


def track(
    walk: TrueWalk,
    floor: SimulatedFloor,
    settings: TrackerSettings,
    rng: np.random.Generator,
    fault_quantile: float | None = None,
) -> TrackerLog:
    """Log a walk as the tracker would; ``fault_quantile`` (0 best to 1 worst) is its rank, random if None."""
    quantile = float(rng.uniform()) if fault_quantile is None else fault_quantile
    settings = of_rank(settings, quantile)
    frames = expose(walk, settings, rng)
    odometry = dead_reckon(frames, settings, rng)
    faults = plan_faults(frames, settings, quantile, rng)
    if len(walk.floor_at):
        faults = with_rides(faults, walk, frames, settings, rng)
    lost = faults.lost_frames(len(frames.plane))
    sightings = sight(frames, floor, lost, settings, rng)
    faults = faults.postponed(_about(np.asarray(sightings.seen.any(axis=1)), round(settings.frame_rate_hz)))
    together = np.zeros(len(frames.plane))
    if len(walk.floor_at):
        camera_m, map_m = vertical_errors(faults, frames, settings, rng)
        odometry, together = replace(odometry, height=odometry.height + camera_m), map_m
    mapped, factor, shift = _reexpress(Mapper(odometry, sightings, settings, rng).run(faults), odometry, faults)
    mapped = replace(mapped, height=mapped.height + together[:, None])
    odometry = replace(odometry, height=odometry.height + together)
    position, orientation = _camera_poses(frames, odometry, mapped, settings, rng)
    held = _last_tracked(lost)
    position, orientation = position[held], orientation[held]
    landmarks, column = _landmark_log(floor.landmark_ids, mapped, position, orientation, lost)
    return TrackerLog(
        time_ns=frames.stamp_ns,
        exposure_ns=frames.exposure_ns,
        position_acs=position,
        orientation_acs=orientation,
        landmarks=landmarks,
        events=_events(mapped, faults),
        motion=MapMotion(mapped.carries, factor, shift, together, lost, sightings.seen[landmarks.frame, column]),
    )


def of_rank(settings: TrackerSettings, quantile: float) -> TrackerSettings:
    """Scale drift and sighting errors by the session's rank, because phones, halls and hands differ."""
    factor = 0.6 + 0.8 * quantile
    drifting = ("sighting_bias_m", "heading_drift_rad", "turning_drift", "scale_sigma", "position_drift_m")
    return settings.model_copy(update={name: factor * getattr(settings, name) for name in drifting})


def _reexpress(mapped: MapLog, odometry: DeadReckoning, faults: FaultPlan) -> tuple[MapLog, ComplexArray, ComplexArray]:
    """Apply the map updates, which move camera and landmarks together; also return the factor and shift (f,)."""
    whole, moved = np.ones_like(mapped.camera), np.zeros_like(mapped.camera)
    camera, turn, anchor = mapped.camera.copy(), mapped.turn.copy(), mapped.anchor.copy()
    heading = mapped.heading.copy()
    for update in faults.updates:
        later = slice(update.frame, update.until)
        axis = turn[update.frame] * odometry.factor[update.frame]
        shift = camera[update.frame] * (1 - update.factor) + update.shift * axis / abs(axis)
        camera[later] = update.factor * camera[later] + shift
        anchor[later] = update.factor * anchor[later] + shift
        whole[later] *= update.factor
        moved[later] = update.factor * moved[later] + shift
        turn[later] *= update.factor
        heading[later] += np.angle(update.factor)
    reexpressed = replace(mapped, camera=camera, turn=turn, anchor=anchor, heading=heading)
    return reexpressed, whole, moved


def _camera_poses(
    frames: CameraFrames, odometry: DeadReckoning, mapped: MapLog, settings: TrackerSettings, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Camera positions (f, 3) and quaternions (f, 4) in the ACS."""
    noise = settings.pose_noise_m * rng.standard_normal((len(frames.plane), 3))
    position = _to_acs(mapped.camera, odometry.height) + noise
    yaw = _about_vertical(np.angle(mapped.turn * odometry.factor))
    standing = np.broadcast_to(LYING_Q_STANDING, yaw.shape)
    return position, multiply(yaw, multiply(standing, frames.orientation))


def _to_acs(plane: ComplexArray, height: FloatArray) -> FloatArray:
    """Positions (f, 3) in the ACS of places (f,) in the plane, complex metres, and heights (f,)."""
    return np.stack((plane.real, height, -plane.imag), axis=-1)


def _about_vertical(angle: FloatArray) -> FloatArray:
    """Quaternions (..., 4) of rotations about the ACS's y axis: counter-clockwise in the plane ``(x, -z)``."""
    zero = np.zeros_like(angle)
    return np.stack((zero, np.sin(angle / 2), zero, np.cos(angle / 2)), axis=-1)


def _sheet_orientation(heading: FloatArray) -> FloatArray:
    """Quaternions (..., 4) of sheets on a wall: +X right along ``heading``, +Y out of the wall, +Z down."""
    cos, sin = HALF * np.cos(heading / 2), HALF * np.sin(heading / 2)
    return np.stack((cos, sin, -sin, cos), axis=-1)


def _about(mask: BoolArray, reach: int) -> BoolArray:
    """Widen the runs of a mask (f,) by ``reach`` frames at both ends."""
    return np.asarray(binary_dilation(mask, iterations=reach))


def _last_tracked(lost: BoolArray) -> IntArray:
    """For each frame (f,) the last frame with tracking, because the camera's pose is constant during a loss."""
    frame = np.where(lost, 0, np.arange(len(lost)))
    return np.maximum.accumulate(frame)


def _landmark_log(
    ids: tuple[str, ...], mapped: MapLog, position: FloatArray, orientation: FloatArray, lost: BoolArray
) -> tuple[LandmarkLog, IntArray]:
    """Rows of every known landmark at every frame; the camera's own pose while tracking is lost.

    Also returns the map column (k,) of each row.
    """
    known = ~np.isnan(mapped.height)
    first = np.where(known.any(axis=0), known.argmax(axis=0), len(known))
    order = np.argsort(first, kind="stable")[: int(known.any(axis=0).sum())]
    landmark, frame = np.nonzero(known[:, order].T)
    column = order[landmark]
    gone = lost[frame]
    sheet = _to_acs(mapped.anchor[frame, column], mapped.height[frame, column])
    facing = _sheet_orientation(mapped.heading[frame, column])
    log = LandmarkLog(
        ids=tuple(ids[i] for i in order.tolist()),
        landmark=landmark.astype(np.int64),
        frame=frame.astype(np.int64),
        position_acs=np.where(gone[:, None], position[frame], sheet),
        orientation_acs=np.where(gone[:, None], orientation[frame], facing),
        lost=gone,
    )
    return log, column


def _events(mapped: MapLog, faults: FaultPlan) -> tuple[SimulatedEvent, ...]:
    events = [*mapped.events, *(SimulatedEvent(u.frame, "map_update", abs(u.shift)) for u in faults.updates)]
    events += [SimulatedEvent(u.until, "map_update", abs(u.shift)) for u in faults.updates if u.until is not None]
    for start, stop in faults.lost.tolist():
        events += [SimulatedEvent(start, "lost", 0.0), SimulatedEvent(stop, "found", 0.0)]
    return tuple(sorted(events, key=lambda event: event.frame))
