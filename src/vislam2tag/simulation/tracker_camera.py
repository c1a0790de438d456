"""What the tracker's camera measures: exposed frames, dead reckoning with drift, and the landmarks in view."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.simulation.model import SimulatedFloor, TrueWalk, blend_at, orientation_at, position_at
from vislam2tag.simulation.settings import TrackerSettings

RUNNING_M_S = 1.7


@dataclass(frozen=True)
class CameraFrames:
    """The truth at each camera frame, ``f`` frames."""

    exposure_ns: IntArray
    stamp_ns: IntArray
    plane: ComplexArray
    """(f,) camera in the BCS plane, x + iy, metres."""
    height: FloatArray
    orientation: FloatArray
    """(f, 4) quaternion (x, y, z, w), camera to BCS."""
    looking: FloatArray
    """(f, 3) unit vector along the camera's axis, BCS."""
    speed: FloatArray
    blocked: BoolArray
    """(f,) whether someone is in the camera's view."""
    unseen: FloatArray
    """(f,) part of the height that was gained in lifts, metres."""


@dataclass(frozen=True)
class DeadReckoning:
    """Dead reckoning without any map: camera ``plane`` (f,), complex metres, and the local similarity from the BCS.

    ``factor`` (f,) is the scale times the rotation that turns a true displacement near frame i into this frame.
    """

    plane: ComplexArray
    factor: ComplexArray
    height: FloatArray


def expose(walk: TrueWalk, settings: TrackerSettings, rng: np.random.Generator) -> CameraFrames:
    """Sample a walk at the camera's frames; time stamps are late by the pose lag, with jitter."""
    last = (walk.time_ns[-1] - walk.time_ns[0]) * 1e-9 - settings.pose_lag_s - 6 * settings.frame_jitter_s
    count = int(last * settings.frame_rate_hz)
    ticks = np.arange(count) / settings.frame_rate_hz
    jitter = rng.normal(0, settings.frame_jitter_s, (2, count)).clip(-2 / 1000, 2 / 1000)
    exposure_s = (ticks + jitter[0]).clip(0)
    stamp_s = ticks + jitter[1] + settings.pose_lag_s
    exposure_ns = walk.time_ns[0] + (exposure_s * 1e9).astype(np.int64)
    orientation = orientation_at(walk, exposure_ns)
    position = position_at(walk, exposure_ns)
    inside = (exposure_ns[:, None] >= walk.blocked_ns[:, 0]) & (exposure_ns[:, None] < walk.blocked_ns[:, 1])
    return CameraFrames(
        exposure_ns=exposure_ns,
        stamp_ns=walk.time_ns[0] + (stamp_s * 1e9).astype(np.int64),
        plane=position[:, 0] + 1j * position[:, 1],
        height=position[:, 2],
        orientation=orientation,
        looking=_camera_axis(orientation),
        speed=blend_at(walk, walk.speed[:, None], exposure_ns)[:, 0],
        blocked=inside.any(axis=1),
        unseen=blend_at(walk, walk.unseen_m[:, None], exposure_ns)[:, 0] if len(walk.unseen_m) else np.zeros(count),
    )


def _camera_axis(orientation: FloatArray) -> FloatArray:
    """The camera's viewing direction (f, 3): its -z axis."""
    x, y, z, w = orientation.T
    return -np.column_stack((2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)))


def dead_reckon(frames: CameraFrames, settings: TrackerSettings, rng: np.random.Generator) -> DeadReckoning:
    """Integrate the walk with random walks of heading, position and height and a wandering scale."""
    count, severity = len(frames.plane), settings.severity
    step = np.diff(frames.plane, prepend=frames.plane[0])
    walked = frames.speed / settings.frame_rate_hz
    yaw = np.unwrap(np.arctan2(frames.looking[:, 1], frames.looking[:, 0]))
    turned = np.abs(np.diff(yaw, prepend=yaw[0]))
    effort = severity * np.where(frames.speed > RUNNING_M_S, settings.running_factor, 1.0)
    spread = effort * np.hypot(settings.heading_drift_rad * np.sqrt(walked), settings.turning_drift * np.sqrt(turned))
    heading = np.cumsum(spread * rng.standard_normal(count)) + rng.uniform(-np.pi, np.pi)
    scale = 1 + severity * settings.scale_sigma * _wander(count, walked.mean() / settings.scale_length_m, rng)
    factor = scale * np.exp(1j * heading)
    slip = effort * settings.position_drift_m * np.sqrt(walked)
    noise = rng.standard_normal((3, count)) * slip
    plane = np.cumsum(factor * step + noise[0] + 1j * noise[1])
    seen = frames.height - frames.unseen
    return DeadReckoning(plane, factor, seen - seen[0] + 0.3 * np.cumsum(noise[2]))


def _wander(count: int, forget: float, rng: np.random.Generator) -> FloatArray:
    """First-order Gauss-Markov noise (count,) of unit variance that loses a share ``forget`` in each frame."""
    keep = np.exp(-max(forget, 1e-6))
    start = rng.standard_normal()
    drive = np.sqrt(1 - keep * keep) * rng.standard_normal(count)
    filtered, _ = lfilter([1.0], [1.0, -keep], drive, zi=[keep * start])
    return np.asarray(filtered)


DETECTION_M = 2.0
"""Distance of the first recognition of a sheet; later it is followed from farther away."""
START_UP_S = 1.0
"""The tracker recognises nothing before this time, seconds."""


@dataclass(frozen=True)
class Sightings:
    """Estimates relative to the camera, (f, m) each, in BCS axes, valid only if ``seen``."""

    seen: BoolArray
    offset: ComplexArray
    """From the camera to the sheet, x + iy, metres."""
    up: FloatArray
    """Height of the sheet above the camera, metres."""
    heading: FloatArray
    """Direction of the sheet's X axis, rad."""
    passes: IntArray
    """(p, 3) runs of frames in which a landmark is seen: landmark, start, stop; by start."""


def sight(
    frames: CameraFrames, floor: SimulatedFloor, lost: BoolArray, settings: TrackerSettings, rng: np.random.Generator
) -> Sightings:
    """Simulate sightings of the sheets in view, except in ``lost`` (f,) frames. Each pass has its own bias, each frame
    its own noise, and both grow with distance.
    """
    sheets = floor.landmark_position
    offset = (sheets[:, 0] + 1j * sheets[:, 1]) - frames.plane[:, None]
    up = sheets[:, 2] - frames.height[:, None]
    distance = np.sqrt(np.abs(offset) ** 2 + up**2)
    seen = _in_view(frames, floor, offset, up, distance, settings) & ~(frames.blocked | lost)[:, None]
    seen[: round(START_UP_S * settings.frame_rate_hz)] = False
    if floor.space is not None:
        frame, landmark = np.nonzero(seen)
        here = np.column_stack((frames.plane.real, frames.plane.imag))
        seen[frame, landmark] = floor.space.clear_line(here[frame], sheets[landmark, :2])
    found = np.logical_or.accumulate(seen & (distance < DETECTION_M * _reach(floor)), axis=0)
    seen &= found
    passes = _runs(seen)
    heading = np.broadcast_to(floor.landmark_heading_rad, seen.shape).copy()
    noise = settings.sighting_noise_m * rng.standard_normal((3, *seen.shape)) * distance
    offset, up = offset + noise[0] + 1j * noise[1], up + noise[2]
    bias = settings.severity * settings.sighting_bias_m * rng.standard_normal((3, len(passes)))
    turn = settings.severity * settings.sighting_heading_sigma_rad * rng.standard_normal(len(passes))
    for (landmark, start, stop), (east, north, high), turned in zip(passes.tolist(), bias.T, turn, strict=True):
        run = slice(start, stop)
        growth = 0.5 + 0.5 * distance[run, landmark]
        offset[run, landmark] += (east + 1j * north) * growth
        up[run, landmark] += 0.3 * high * growth
        heading[run, landmark] += turned * growth
    return Sightings(seen, offset, up, heading, passes)


def _in_view(
    frames: CameraFrames,
    floor: SimulatedFloor,
    offset: ComplexArray,
    up: FloatArray,
    distance: FloatArray,
    settings: TrackerSettings,
) -> BoolArray:
    """Return (f, m) which sheets are close enough, in the field of view and not too oblique."""
    ahead = (
        offset.real * frames.looking[:, :1] + offset.imag * frames.looking[:, 1:2] + up * frames.looking[:, 2:]
    ) / distance
    normal = np.exp(1j * (floor.landmark_heading_rad - np.pi / 2))
    facing = -(offset * normal.conj()).real / distance
    visible: BoolArray = (
        (distance < settings.sighting_range_m * _reach(floor))
        & (ahead > np.cos(settings.field_of_view_rad / 2))
        & (facing > np.cos(settings.sighting_angle_rad))
    )
    return visible


def _reach(floor: SimulatedFloor) -> FloatArray:
    """Recognition distance of each landmark (m,) as a multiple of that of an A4 sheet."""
    return floor.sheet_reach if len(floor.sheet_reach) else np.ones(len(floor.landmark_ids))


def _runs(seen: BoolArray) -> IntArray:
    """Maximal runs (p, 3) of true frames in each column: column, start, stop; sorted by start."""
    padded = np.zeros((len(seen) + 2, seen.shape[1]), dtype=np.int8)
    padded[1:-1] = seen
    edge = np.diff(padded, axis=0).T
    column, start = np.nonzero(edge == 1)
    stop = np.nonzero(edge == -1)[1]
    order = np.lexsort((column, start))
    return np.column_stack((column, start, stop))[order].astype(np.int64)
