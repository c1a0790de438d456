"""The AR tracker: from a true walk to the poses it logs.

Frames: dead reckoning in its own frame, the map built on it (:mod:`.tracker_map`), re-expressions of that map, and the
tracker's coordinates (ACS: y up, horizontal plane ``(x, -z)``).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import binary_dilation

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.tracks import LandmarkLog
from vislam2tag.core.transforms import multiply
from vislam2tag.simulation.model import MapMotion, SimulatedEvent, SimulatedFloor, TrackerLog, TrueWalk
from vislam2tag.simulation.settings import TrackerSettings
from vislam2tag.simulation.tracker_camera import CameraFrames, DeadReckoning, dead_reckon, expose, sight
from vislam2tag.simulation.tracker_faults import FaultPlan, plan_faults, vertical_errors, with_rides
from vislam2tag.simulation.tracker_map import MapLog, Mapper

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
    """Log a walk as the tracker would; ``fault_quantile`` (0 best to 1 worst) ranks it, drawn where None."""
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
    """Scale drift and sighting errors with the session's rank: some phones, halls and hands are better than others."""
    factor = 0.6 + 0.8 * quantile
    drifting = ("sighting_bias_m", "heading_drift_rad", "turning_drift", "scale_sigma", "position_drift_m")
    return settings.model_copy(update={name: factor * getattr(settings, name) for name in drifting})


def _reexpress(mapped: MapLog, odometry: DeadReckoning, faults: FaultPlan) -> tuple[MapLog, ComplexArray, ComplexArray]:
    """Apply the map updates: camera and landmarks are moved together; also returns the factor and shift (f,) of it."""
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
    """Quaternions (..., 4) of rotations about the ACS's y axis: anticlockwise in the plane ``(x, -z)``."""
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
    """For each frame (f,) the last one with tracking: the camera's pose is held while there is none."""
    frame = np.where(lost, 0, np.arange(len(lost)))
    return np.maximum.accumulate(frame)


def _landmark_log(
    ids: tuple[str, ...], mapped: MapLog, position: FloatArray, orientation: FloatArray, lost: BoolArray
) -> tuple[LandmarkLog, IntArray]:
    """Rows of every known landmark at every frame; the camera's own pose while tracking is lost.

    Also returns the column (k,) of the map that each row is of.
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
