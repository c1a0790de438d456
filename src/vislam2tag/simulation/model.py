"""Data that the parts of the simulator exchange: buildings, true walks and tracker logs, with common functions.

These functions give the walk at any time (linear between samples 5 ms apart, with errors below 0.1 mm), the walls that
a line crosses, and smooth random fields over a building. A field is a sum of cosines with normally distributed wave
vectors. With many terms its covariance becomes Gaussian (random Fourier features, Rahimi and Recht 2007).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.tracks import LandmarkLog
from vislam2tag.simulation.settings import Climb
from vislam2tag.site.walkable.space import WalkableSpace


@dataclass(frozen=True)
class SimulatedFloor:
    """One floor: walls, walkable graph, landmarks and control points, in its BCS (metres)."""

    number: int
    name: str
    width_m: float
    height_m: float
    elevation_m: float
    walls: FloatArray
    """(w, 2, 2) wall segments, doors left open."""
    nodes: FloatArray
    """(n, 2) nodes of the walkable graph (corridor turns, junctions, doors, room centres)."""
    edges: IntArray
    """(e, 2) pairs of node indices; straight, free of walls."""
    landmark_ids: tuple[str, ...]
    landmark_position: FloatArray
    """(m, 3) on a wall, z above this floor."""
    landmark_heading_rad: FloatArray
    """(m,) direction of the sheet's X axis (to the viewer's right), from the BCS x axis."""
    control_points: FloatArray
    """(p, 2) points on the walkable graph."""
    lower_left_m: tuple[float, float] = (0.0, 0.0)
    """Lower left corner of the floor's extent, BCS."""
    rooms: frozenset[int] | None = None
    """Nodes in rooms and their doors; None if the graph's shape shows them (generated floors)."""
    space: WalkableSpace | None = None
    """Walkable space of a floor that comes from a plan; None for generated floors, whose graphs avoid walls."""
    sheet_reach: FloatArray = field(default_factory=lambda: np.empty(0))
    """(m,) recognition distance of each landmark as a multiple of that of an A4 sheet; empty if all are A4."""
    surveyed_z_m: FloatArray | None = None
    """(m,) heights in a site's own files, NaN if unknown; None for generated floors."""
    surveyed_sigma_m: FloatArray | None = None
    """(m,) standard deviations in a site's own files, metres."""

    @property
    def corners_m(self) -> FloatArray:
        """Lower left and upper right corner (2, 2) of the floor's extent, BCS."""
        left, low = self.lower_left_m
        return np.array([(left, low), (left + self.width_m, low + self.height_m)])


@dataclass(frozen=True)
class SimulatedBuilding:
    """Floors over one another and the access points in them."""

    floors: tuple[SimulatedFloor, ...]
    ap_floor: IntArray
    """(a,) floor number of each access point."""
    ap_position: FloatArray
    """(a, 3) BCS position, z above that floor."""
    ap_bssid: tuple[str, ...]
    ap_ssid: tuple[str, ...]
    ap_frequency_mhz: FloatArray
    ap_power_dbm: FloatArray
    """(a,) RSSI at one metre."""

    def floor(self, number: int) -> SimulatedFloor:
        """The floor with this number; raises KeyError if the building has none."""
        return {floor.number: floor for floor in self.floors}[number]


@dataclass(frozen=True)
class FloorTour:
    """The floors that a walk may visit, the first floor first, and how it changes floors."""

    floors: tuple[SimulatedFloor, ...]
    climb: Climb

    @property
    def rise_m(self) -> FloatArray:
        """Height (f,) of each floor above the first."""
        return np.array([floor.elevation_m for floor in self.floors]) - self.floors[0].elevation_m


def floor_tour_from(building: SimulatedBuilding, start: int, climb: Climb) -> FloorTour:
    """Return the tour over all floors of a building that starts on the floor of this number."""
    return FloorTour(tuple(sorted(building.floors, key=lambda floor: (floor.number != start, floor.number))), climb)


def seen_from_first(tour: FloorTour) -> SimulatedFloor:
    """Return the first floor with the landmarks of all floors on it, with heights above that floor."""
    lifted = [
        floor.landmark_position + np.array((0.0, 0.0, rise))
        for floor, rise in zip(tour.floors, tour.rise_m, strict=True)
    ]
    return replace(
        tour.floors[0],
        landmark_ids=tuple(name for floor in tour.floors for name in floor.landmark_ids),
        landmark_position=np.vstack(lifted),
        landmark_heading_rad=np.concatenate([floor.landmark_heading_rad for floor in tour.floors]),
    )


@dataclass(frozen=True)
class TrueWalk:
    """The truth of one walk, sampled uniformly at ``rate_hz`` (200 by default), ``n`` samples.

    The phone's body frame is Android's (x right, y up along the screen, z out of the screen); its camera looks
    along -z (ARCore's camera frame is taken equal to the body frame).
    """

    floor: int
    rate_hz: float
    time_ns: IntArray
    """(n,) boot-clock ns."""
    position: FloatArray
    """(n, 3) camera in BCS, z above the floor, with gait bobbing and sway; smooth enough to differentiate twice."""
    orientation: FloatArray
    """(n, 4) quaternion (x, y, z, w), body to BCS (z up)."""
    speed: FloatArray
    """(n,) walking speed without gait, m/s."""
    presses_ns: IntArray
    """Times at which the walk passes over a control point (exact; the hand adds its error later)."""
    pressed_point: IntArray
    """Index of the control point of each press."""
    landmarks_passed: IntArray
    """Index of each landmark deliberately passed, in order."""
    blocked_ns: IntArray
    """(b, 2) start and end of each time someone blocks the camera's view."""
    floor_at: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    """(n,) floor of each sample, by its height; empty if all are on ``floor``. Heights always count above ``floor``."""
    unseen_m: FloatArray = field(default_factory=lambda: np.empty(0))
    """(n,) height gained in lifts until each sample, which no camera sees; empty without lifts."""
    rides_ns: IntArray = field(default_factory=lambda: np.empty((0, 2), dtype=np.int64))
    """(r, 2) start and end of each ride in a lift."""


@dataclass(frozen=True)
class MapShift:
    """At ``frame`` everything that came into the map after frame ``since`` moves by ``move`` (complex metres).

    It moves completely if ``even``. Otherwise younger points move more, and unevenly (a loop correction).
    """

    frame: int
    since: int
    move: complex
    even: bool


@dataclass(frozen=True)
class MapMotion:
    """How the map moved under the ``f`` frames, and the tracker's own state.

    A point fixed in the mapper's plane appears at ``factor * point + shift`` (f,), ``rise`` (f,) metres higher.
    """

    carries: tuple[MapShift, ...]
    factor: ComplexArray
    shift: ComplexArray
    rise: FloatArray
    lost: BoolArray
    """(f,) frames without tracking."""
    seen: BoolArray
    """(k,) mask of the landmark rows in which the sheet was seen."""


@dataclass(frozen=True)
class TrackerLog:
    """What the AR tracker logs on a walk: camera frames and the landmark rows of each frame (ACS)."""

    time_ns: IntArray
    """(f,) stamp of each frame (boot clock, includes the pose lag)."""
    exposure_ns: IntArray
    """(f,) time of the real exposure; the truth of the frame is the walk's pose at this time."""
    position_acs: FloatArray
    orientation_acs: FloatArray
    """(f, 4) quaternion (x, y, z, w), camera to ACS."""
    landmarks: LandmarkLog
    events: tuple[SimulatedEvent, ...]
    motion: MapMotion | None = None
    """None if traps have changed the log; only the phone app's format uses it."""


@dataclass(frozen=True)
class SimulatedEvent:
    """An event of the tracker, for tests and docs; the pipeline never reads it."""

    frame: int
    kind: str
    """map_update, loop_correction, lost, found, break, relocalise."""
    size_m: float


def position_at(walk: TrueWalk, time_ns: IntArray) -> FloatArray:
    """Camera position (k, 3) in BCS at boot-clock times (k,); constant before and after the walk."""
    return blend_at(walk, walk.position, time_ns)


def orientation_at(walk: TrueWalk, time_ns: IntArray) -> FloatArray:
    """Unit quaternions (k, 4), (x, y, z, w), body to BCS, at boot-clock times (k,)."""
    continuous = walk.orientation * continuous_signs(walk.orientation)[:, None]
    blended = blend_at(walk, continuous, time_ns)
    return np.asarray(blended / np.linalg.norm(blended, axis=1, keepdims=True))


def continuous_signs(orientation: FloatArray) -> FloatArray:
    """Signs (n,) that make a quaternion sequence (n, 4) free of sign flips."""
    flips = np.sum(orientation[1:] * orientation[:-1], axis=1) < 0
    turned = np.append(False, flips).cumsum() % 2
    return np.where(turned == 1, -1.0, 1.0)


def floor_at(walk: TrueWalk, time_ns: IntArray) -> IntArray:
    """Number of the floor (k,) at boot-clock times (k,): that of the nearest sample."""
    if not len(walk.floor_at):
        return np.full(len(time_ns), walk.floor, dtype=np.int64)
    place = np.rint((time_ns - walk.time_ns[0]) * (walk.rate_hz / 1e9)).astype(np.int64)
    return np.asarray(walk.floor_at[place.clip(0, len(walk.floor_at) - 1)])


def blend_at(walk: TrueWalk, samples: FloatArray, time_ns: IntArray) -> FloatArray:
    """Interpolate values (n, d), one for each walk sample, at boot-clock times (k,)."""
    place = np.clip((time_ns - walk.time_ns[0]) * (walk.rate_hz / 1e9), 0, len(walk.time_ns) - 1)
    before = np.minimum(place.astype(np.int64), len(walk.time_ns) - 2)
    share = (place - before)[:, None]
    return np.asarray(samples[before] * (1 - share) + samples[before + 1] * share)


_LINES_AT_ONCE = 4096


def count_crossings(start: FloatArray, end: FloatArray, walls: FloatArray) -> IntArray:
    """Count the walls (w, 2, 2) that each straight line from ``start`` (k, 2) to ``end`` (k, 2) crosses; metres."""
    count = np.zeros(len(start), dtype=np.int64)
    for first in range(0, len(start), _LINES_AT_ONCE):
        part = slice(first, first + _LINES_AT_ONCE)
        count[part] = _crossing(start[part], end[part], walls).sum(axis=1)
    return count


def _crossing(start: FloatArray, end: FloatArray, walls: FloatArray) -> BoolArray:
    """(k, w) mask: line and wall cross if the ends of each are on different sides of the other."""
    lines, wall_lines = _implicit(start, end), _implicit(walls[:, 0], walls[:, 1])
    ends_apart = (_homogeneous(start) @ wall_lines.T) * (_homogeneous(end) @ wall_lines.T) < 0
    walls_apart = (lines @ _homogeneous(walls[:, 0]).T) * (lines @ _homogeneous(walls[:, 1]).T) < 0
    return np.asarray(ends_apart & walls_apart)


def _implicit(first: FloatArray, second: FloatArray) -> FloatArray:
    """Coefficients (k, 3) of the line through two points: zero on it, signed by side."""
    dx, dy = (second - first).T
    return np.column_stack((-dy, dx, dy * first[:, 0] - dx * first[:, 1]))


def _homogeneous(points: FloatArray) -> FloatArray:
    """Points (k, 2) with a third coordinate of 1."""
    return np.column_stack((points, np.ones(len(points))))


TERMS = 32
"""Number of cosines in a field; enough for a nearly normal marginal distribution."""


@dataclass(frozen=True)
class SmoothFields:
    """``a`` independent fields: ``wave`` (a, TERMS, 3) rad/m, ``phase`` (a, TERMS) rad, ``sigma`` their unit."""

    wave: FloatArray
    phase: FloatArray
    sigma: float

    def at(self, position: FloatArray, index: IntArray) -> FloatArray:
        """Value (k,) of field ``index`` (k,) at each position (k, 3), metres."""
        angle = np.einsum("kmd,kd->km", self.wave[index], position) + self.phase[index]
        return np.asarray(self.sigma * np.sqrt(2 / TERMS) * np.cos(angle).sum(axis=1))


def make_fields(streams: list[np.random.Generator], sigma: float, length_m: float) -> SmoothFields:
    """Draw one field from each stream: standard deviation ``sigma``, correlation length ``length_m`` (metres)."""
    wave = np.stack([stream.normal(0, 1 / length_m, (TERMS, 3)) for stream in streams])
    phase = np.stack([stream.uniform(0, 2 * np.pi, TERMS) for stream in streams])
    return SmoothFields(wave, phase, sigma)
