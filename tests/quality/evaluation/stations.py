"""Walks in a total station's view with known clock, prism and frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.quality.evaluation.maps import trajectory_of
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import Trajectory
from vislam2tag.core.transforms import Similarity2
from vislam2tag.quality.evaluation.station_clock import StationWalk
from vislam2tag.quality.evaluation.station_frame import CommonPoints, StationFrame, StationTrack, fit_frame

BCS_T_STATION = Similarity2(complex(np.exp(0.7j)), 3 - 2j)
CLOCK_NS = 1_642_000_000_000_000_000
EDGES = np.array([[0.0, 0.0], [20.0, 0.0]])


def corridor_walk(start_s: float = 1000.0, duration_s: float = 60.0, seed: int = 0, noise_m: float = 0.0) -> Trajectory:
    """Up and down a corridor of 20 m with changing speed, 30 frames a second; errors of ``noise_m`` about 3 s long."""
    rng = np.random.default_rng(seed)
    seconds = np.arange(0.0, duration_s, 1 / 30)
    knots = np.arange(0.0, duration_s + 6.0, 3.0)
    speed = np.interp(seconds, knots, rng.uniform(0.5, 1.7, len(knots)))
    along = np.cumsum(speed) / 30
    x = 20 * np.abs(((along / 20) + 1) % 2 - 1)
    errors = [np.interp(seconds, knots, rng.normal(0, noise_m, len(knots))) for _ in range(2)]
    time_ns = ((start_s + seconds) * 1e9).astype(np.int64)
    return trajectory_of(time_ns, np.column_stack((x, 0.3 * np.sin(along))) + np.column_stack(errors))


def frame() -> StationFrame:
    return fit_frame(CommonPoints(("a", "b"), BCS_T_STATION.inverse @ EDGES, EDGES))


def measured(
    walk: Trajectory,
    clock_s: float = 0.0,
    ahead_left_m: tuple[float, float] = (0.0, 0.0),
    drift_ppm: float = 0.0,
    epoch_s: float = 0.0,
) -> StationTrack:
    """What the station sees of a walk, ten times a second; the prism is ahead and left of the camera."""
    boot_ns, plane = walk.time_ns[30:-30:3], walk.position_bcs[:, :2]
    step = np.gradient(plane, axis=0)
    ahead = step / np.linalg.norm(step, axis=1, keepdims=True)
    left = np.column_stack((-ahead[:, 1], ahead[:, 0]))
    prism: FloatArray = (plane + ahead_left_m[0] * ahead + ahead_left_m[1] * left)[30:-30:3]
    grown = (boot_ns - epoch_s * 1e9) * drift_ppm * 1e-6 + clock_s * 1e9
    return StationTrack(CLOCK_NS + boot_ns + grown.astype(np.int64), BCS_T_STATION.inverse @ prism)


def before_station(walks: list[Trajectory], clock_s: float = 0.0) -> list[StationWalk]:
    return [StationWalk(walk, measured(walk, clock_s), frame()) for walk in walks]


def with_labels_of(walk: StationWalk, labels: Trajectory) -> StationWalk:
    """The same track before other labels."""
    return replace(walk, reference=labels)
