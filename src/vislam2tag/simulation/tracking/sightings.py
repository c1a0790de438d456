"""When the tracker sees a landmark's sheet, and where it takes it to be relative to the camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.simulation.model import SimulatedFloor
from vislam2tag.simulation.settings import TrackerSettings
from vislam2tag.simulation.tracking.dead_reckoning import CameraFrames

DETECTION_M = 2.0
"""A sheet is first recognised within this distance; later it is followed farther."""
START_UP_S = 1.0
"""The tracker recognises nothing before this time, seconds."""


@dataclass(frozen=True)
class Sightings:
    """Estimates relative to the camera, (f, m) each, in BCS axes; only those where ``seen`` mean anything."""

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
    """See the sheets in view but in ``lost`` (f,) frames; each pass has its own bias, each frame its own noise, both
    growing with distance.
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
    """Tell (f, m) which sheets are near enough, in the field of view and not too oblique."""
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
    """How many times farther than an A4 sheet each landmark (m,) is recognised."""
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
