"""A total station that follows the phone's prism, with its own frame, its own wall clock, and gaps in its view."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.simulation.model import SimulatedFloor, TrueWalk, count_crossings, position_at

_CORRIDOR_M = 2.5
"""Nodes within this distance from the line between the reference points are in their corridor."""


@dataclass(frozen=True)
class StationSettings:
    """The instrument (the paper's is a Leica Nova MS50)."""

    rate_hz: float = 10.0
    noise_m: float = 0.005
    blocked_share: float = 0.05
    """Share of the time in which something blocks the line of sight, in stretches."""
    blocked_s: float = 2.0
    """Length of such a stretch, seconds."""


@dataclass(frozen=True)
class StationSetup:
    """Position of the station: ``position_bcs`` (2,) metres; its frame is turned by ``heading_rad`` against the BCS."""

    position_bcs: FloatArray
    heading_rad: float

    def local(self, position_bcs: FloatArray) -> FloatArray:
        """BCS points (k, 2) in the station's frame."""
        cos, sin = np.cos(self.heading_rad), np.sin(self.heading_rad)
        return np.asarray((position_bcs - self.position_bcs) @ np.array(((cos, sin), (-sin, cos))).T)


@dataclass(frozen=True)
class TimedPoints:
    """``position`` (k, 2) of points, metres, in the station's frame or the BCS; ``time_ns`` (k,) by the boot clock."""

    time_ns: IntArray
    position: FloatArray


def place_station(floor: SimulatedFloor, reference: FloatArray, rng: np.random.Generator) -> StationSetup:
    """Place the station at the node that sees most nodes of the corridor between two reference points (2, 2), metres.

    Ties go to the first node; the frame's heading is drawn.
    """
    nodes = floor.nodes
    targets = nodes[_distance_to_segment(nodes, reference) < _CORRIDOR_M]
    start, end = np.repeat(nodes, len(targets), axis=0), np.tile(targets, (len(nodes), 1))
    seen = (count_crossings(start, end, floor.walls) == 0).reshape(len(nodes), -1).sum(axis=1)
    return StationSetup(nodes[int(np.argmax(seen))], float(rng.uniform(-np.pi, np.pi)))


def _distance_to_segment(points: FloatArray, segment: FloatArray) -> FloatArray:
    """Distance (k,) of points (k, 2) from a segment (2, 2), metres."""
    along = segment[1] - segment[0]
    share = np.clip((points - segment[0]) @ along / max(float(along @ along), 1e-12), 0, 1)
    return np.asarray(np.linalg.norm(points - segment[0] - share[:, None] * along, axis=1))


def simulate_station(
    walk: TrueWalk, floor: SimulatedFloor, setup: StationSetup, settings: StationSettings, rng: np.random.Generator
) -> TimedPoints:
    """Measure the prism (at the camera's position) unless a wall or a person blocks the view."""
    step_ns = int(1e9 / settings.rate_hz)
    time_ns = np.arange(walk.time_ns[0] + int(rng.integers(0, step_ns)), walk.time_ns[-1], step_ns)
    time_ns = time_ns + rng.integers(-step_ns // 20, step_ns // 20, len(time_ns))
    position = position_at(walk, time_ns)[:, :2]
    start = np.broadcast_to(setup.position_bcs, position.shape)
    seen = (count_crossings(start, position, floor.walls) == 0) & ~_blocked(time_ns, settings, rng)
    measured = setup.local(position[seen]) + rng.normal(0, settings.noise_m, (int(seen.sum()), 2))
    return TimedPoints(time_ns[seen], measured)


def shoot_points(
    setup: StationSetup, points_bcs: FloatArray, settings: StationSettings, rng: np.random.Generator
) -> FloatArray:
    """Shoot fixed points (k, 2) once each; return their measured positions in the station's frame, metres."""
    return np.asarray(setup.local(points_bcs) + rng.normal(0, settings.noise_m, points_bcs.shape))


def _blocked(time_ns: IntArray, settings: StationSettings, rng: np.random.Generator) -> BoolArray:
    """(k,) mask of the stretches in which a person blocks the line of sight."""
    duration_s = (time_ns[-1] - time_ns[0]) / 1e9
    starts = rng.uniform(0, duration_s, rng.poisson(settings.blocked_share * duration_s / settings.blocked_s))
    seconds = (time_ns - time_ns[0]) / 1e9
    since = seconds[:, None] - starts
    return np.asarray(np.any((since >= 0) & (since < settings.blocked_s), axis=1))
