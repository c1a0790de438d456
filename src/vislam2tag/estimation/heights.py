"""Height and floor of every frame: the tracker's vertical axis, connected to the building by sighted landmarks.

The unknowns are the offset of the vertical axis at the times of sightings, each landmark's height and each floor's
elevation, if it was not measured. All measurements are linear in them; heavy tails absorb wrong ones
(docs/explanation/heights.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray, runs_of
from vislam2tag.core.context import PressureLog, Storeys
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks
from vislam2tag.core.visits import usable_rank
from vislam2tag.estimation.least_squares import Differences, solve_robustly
from vislam2tag.estimation.map_moves import seen_rows
from vislam2tag.estimation.observations import FEWEST_FRAMES
from vislam2tag.estimation.odometry import Odometry, continuous_odometry
from vislam2tag.estimation.settings import HeightSettings
from vislam2tag.estimation.vertical import (
    VerticalTrack,
    altitude_m,
    change_around,
    vertical_track,
    with_rides_by_landmarks,
    with_rides_by_pressure,
)

UNDECIDED_M = 0.5
"""Within this distance from the middle between two storeys the floor is that before or after, as on a landing."""


def floor_of_heights(height_m: FloatArray, elevation_m: FloatArray, carried_m: float, start: int) -> IntArray:
    """Index (f,) of the storey below the phone, ``carried_m`` above its floor, at each height (f,).

    ``elevation_m`` (s,) in any order. Near the middle between two storeys the floor changes at most once; ``start`` is
    the storey before the first frame.
    """
    order = np.argsort(elevation_m, kind="stable")
    level = elevation_m[order]
    middle = (level[1:] + level[:-1]) / 2
    margin = np.minimum(UNDECIDED_M, np.diff(level) / 4)
    foot = height_m - carried_m
    nearest = np.searchsorted(middle, foot)
    undecided = (np.searchsorted(middle - margin, foot) != nearest) | (
        np.searchsorted(middle + margin, foot) != nearest
    )
    rank = np.where(undecided, -1, nearest)
    before = int(np.flatnonzero(order == start)[0])
    return order[_decided(rank, nearest, before)]


def _decided(rank: IntArray, nearest: IntArray, before: int) -> IntArray:
    """Assign each undecided run (-1) of ranks (f,): the neighbours' floor, or one change if they differ."""
    decided = rank.copy()
    for start, stop in runs_of(rank < 0):
        earlier = int(rank[start - 1]) if start else before
        later = int(rank[stop]) if stop < len(rank) else earlier
        decided[start:stop] = earlier
        if later != earlier:
            near = nearest[start:stop]
            decided[start + _change(np.abs(near - earlier) < np.abs(near - later)) : stop] = later
    return decided


def _change(early: BoolArray) -> int:
    """Index of the change for which the fewest entries of the mask (k,) are on the wrong side."""
    return int(np.argmax(np.concatenate(([0], np.cumsum(np.where(early, 1, -1))))))


CARRIED_SIGMA_M = 0.5
"""Standard deviation of the height of an unmeasured landmark, which hangs at the height of a phone in the hand."""
START_SIGMA_M = 0.25
"""Standard deviation at the start: a session starts on its own floor, phone in hand."""
STOREY_SIGMA_M = 1.0
"""Standard deviation of a storey's usual height, if elevations are unknown."""
SIGHTING_SIGMA_M = 0.1
SIGHTING_REACH_M = 2.5
CLIMB_M, CLIMB_S = 0.6, 4.0
"""Who rises or sinks more than this in this time is on stairs or in a lift."""
BLOCK_S = 1.0
"""Sightings of a landmark within this time count as one."""
PINNED_M = 1e-3
"""Tolerance of exactly known values; no height is given more precisely."""


@dataclass(frozen=True)
class Heights:
    """Heights of ``n`` frames in the building: ``z_m`` (n,) camera above its zero, ``floor`` (n,) int.

    ``z_m`` is NaN at frames that are not usable and on floors of unknown elevation; ``floor`` is empty if the landmarks
    have no storeys.
    """

    z_m: FloatArray
    floor: IntArray
    unreached_m: float = 0.0
    """Estimated distance from the limit where re-weighting did not converge, metres, else 0."""


@dataclass(frozen=True)
class _Marks:
    """Marks that show a floor: the session's landmarks, then the floors that its walker stated, ``m`` in all."""

    floor: IntArray
    """(m,) number."""
    z_m: FloatArray
    """(m,) above the floor, metres; NaN if not measured: about the height of a carried phone."""


@dataclass(frozen=True)
class _Sightings:
    """Sightings of marks, one entry for each mark and block of time, in time order."""

    landmark: IntArray
    """Index into the marks."""
    rank: IntArray
    """Usable rank of the frame."""
    height_m: FloatArray
    """Logged height of the landmark, in the continuous frame of the vertical track."""


def estimate_heights(
    camera: CameraTrack,
    log: LandmarkLog,
    landmarks: Landmarks,
    settings: HeightSettings | None = None,
    odometry: Odometry | None = None,
) -> Heights:
    """Find the height and floor of each frame of a session; linear in the number of frames.

    ``odometry`` is that of the session, if already known; a session without a step has none, and no heights.

    Uses ``landmarks.storeys``, ``landmarks.floor``, ``landmarks.z_m``, ``camera.pressure``, ``camera.told_floors``. A
    session starts on its own floor. A floor that its walker states is a mark at the height of the phone. If several
    floors are possible and none has an elevation, floors follow from the landmarks' floors and the vertical change
    between them.
    """
    settings = settings or HeightSettings()
    n, storeys = len(camera.time_ns), landmarks.storeys
    if storeys is None:
        return Heights(np.full(n, np.nan), np.empty(0, dtype=np.int64))
    floor = np.full(n, storeys.own, dtype=np.int64)
    z = np.full(n, np.nan)
    any_height = len(storeys.number) > 1 or np.isfinite(storeys.elevation_m).any()
    if camera.usable.sum() < FEWEST_FRAMES or not any_height:
        return Heights(z, floor)
    odometry = odometry or continuous_odometry(camera, log)
    track = _track(camera, log, odometry)
    stated_rank, stated_floor = _stated_floors(camera, storeys)
    unmeasured = np.full(len(stated_floor), np.nan)
    marks = _Marks(np.append(landmarks.floor, stated_floor), np.append(landmarks.z_m, unmeasured))
    seen = _sightings(camera, log, landmarks, odometry, track, stated_rank)
    track, rise = _with_rides(track, seen, marks, storeys, settings)
    seen = _Sightings(seen.landmark, seen.rank, seen.height_m + rise[seen.rank])
    height, elevation, unreached_m = _solve(track, seen, marks, storeys, settings)
    own = int(_index(storeys, np.array([storeys.own]))[0])
    place = floor_of_heights(height, elevation, _carried(height, elevation, settings), own)
    floor[track.frame] = storeys.number[place]
    z[track.frame] = np.where(np.isfinite(storeys.elevation_m[place]), height, np.nan)
    return Heights(z, _carried_on(floor, camera), unreached_m)


def vertical_span_m(camera: CameraTrack, log: LandmarkLog) -> float:
    """Vertical range of a walk by all sensors, without jumps of the tracker, metres.

    The highest and the lowest hundredth of the time are ignored.
    """
    if camera.usable.sum() < FEWEST_FRAMES:
        return 0.0
    track = _track(camera, log, continuous_odometry(camera, log))
    return float(np.ptp(np.quantile(track.height_m, (0.01, 0.99))))


def between_floors(camera: CameraTrack, log: LandmarkLog, odometry: Odometry) -> BoolArray:
    """Return (f,) at which usable frames a walk rises or sinks as on stairs or in a lift."""
    track = _track(camera, log, odometry)
    return np.asarray(np.abs(change_around(track.time_s, track.height_m, CLIMB_S)) > CLIMB_M)


def _track(camera: CameraTrack, log: LandmarkLog, odometry: Odometry) -> VerticalTrack:
    """The vertical track, with the rides that air pressure shows, if it was logged."""
    track = vertical_track(camera, log, odometry)
    if camera.pressure is None or not len(camera.pressure.time_ns):
        return track
    return with_rides_by_pressure(track, camera.time_ns[track.frame], camera.pressure)


def _carried(height: FloatArray, elevation: FloatArray, settings: HeightSettings) -> float:
    """Usual height of the phone above the floor, metres, from heights (f,) over floors with these elevations (s,)."""
    above = height[:, None] - elevation
    nearest = np.abs(above - settings.carried_m).argmin(axis=1)
    return float(np.median(above[np.arange(len(above)), nearest]).clip(*settings.carried_range_m))


def _carried_on(floor: IntArray, camera: CameraTrack) -> IntArray:
    """Give unusable frames the floor (n,) of the usable frame before."""
    before = usable_rank(camera)
    frames = np.flatnonzero(camera.usable)
    carried: IntArray = floor[frames[before.clip(0)]]
    return carried


def _index(storeys: Storeys, floor: IntArray) -> IntArray:
    """Index (k,) among the storeys of floor numbers (k,); every landmark of a session is on one of them."""
    return np.searchsorted(storeys.number, floor).astype(np.int64)


def _sightings(
    camera: CameraTrack,
    log: LandmarkLog,
    landmarks: Landmarks,
    odometry: Odometry,
    track: VerticalTrack,
    stated_rank: IntArray,
) -> _Sightings:
    """Sightings of landmarks of known floor from nearby, and the ranks (t,) at which a floor was stated.

    Reduced to one of each for each block of time.
    """
    index = np.array([landmarks.index.get(name, -1) for name in log.ids], dtype=np.int64)
    rank = usable_rank(camera)
    rows = seen_rows(log, odometry.rewritten[rank[log.frame]])
    away = np.linalg.norm(log.position_acs[rows] - camera.position_acs[log.frame[rows]], axis=1)
    rows = rows[(away < SIGHTING_REACH_M) & (index[log.landmark[rows]] >= 0)]
    rank = rank[log.frame[rows]]
    height = log.position_acs[rows, 1] + track.shift_m[rank]
    rank = np.append(rank, stated_rank)
    height = np.append(height, track.height_m[stated_rank])
    mark = np.append(index[log.landmark[rows]], len(landmarks.ids) + np.arange(len(stated_rank)))
    return _in_blocks(mark, rank, height, np.floor(track.time_s[rank] / BLOCK_S).astype(np.int64))


def _stated_floors(camera: CameraTrack, storeys: Storeys) -> tuple[IntArray, IntArray]:
    """Usable ranks (t,) at which the walker stated a floor, and its number (t,); the walk starts on its own floor."""
    stated = camera.told_floors
    if stated is None:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    known = np.isin(stated.floor, storeys.number)
    usable_ns = camera.time_ns[camera.usable]
    at = np.searchsorted(usable_ns, stated.time_ns[known]).clip(max=len(usable_ns) - 1)
    return np.append(0, at).astype(np.int64), np.append(storeys.own, stated.floor[known]).astype(np.int64)


def _in_blocks(landmark: IntArray, rank: IntArray, height: FloatArray, block: IntArray) -> _Sightings:
    """Reduce each landmark's sightings (r,) in a block of time (r,) to their middle one by height (r,), metres."""
    order = np.lexsort((height, landmark, block))
    new = np.ones(len(order), dtype=bool)
    new[1:] = (np.diff(block[order]) != 0) | (np.diff(landmark[order]) != 0)
    start = np.flatnonzero(new)
    middle = order[(start + np.append(start[1:], len(order)) - 1) // 2] if len(order) else order
    middle = middle[np.argsort(rank[middle], kind="stable")]
    return _Sightings(landmark[middle], rank[middle], height[middle])


def _with_rides(
    track: VerticalTrack, seen: _Sightings, marks: _Marks, storeys: Storeys, settings: HeightSettings
) -> tuple[VerticalTrack, FloatArray]:
    """Add the rides that the tracker missed; also return the addition (f,) to the track's height."""
    storey = _index(storeys, marks.floor[seen.landmark])
    level = _usual_elevations(storeys, settings)[storey] + _usual_height(marks, settings)[seen.landmark]
    change = np.flatnonzero((np.diff(storey) != 0) & (np.diff(seen.rank) > 0))
    sighted = np.column_stack((seen.rank[change], seen.rank[change + 1]))
    ridden = with_rides_by_landmarks(track, sighted, np.diff(level)[change], np.diff(seen.height_m)[change])
    return ridden, ridden.height_m - track.height_m


def _usual_height(marks: _Marks, settings: HeightSettings) -> FloatArray:
    """Height (m,) of each mark above its floor, metres: surveyed, or the usual one."""
    return np.where(np.isfinite(marks.z_m), marks.z_m, settings.carried_m)


def _usual_elevations(storeys: Storeys, settings: HeightSettings) -> FloatArray:
    """Elevation (s,) of each storey; unknown ones are estimated from the nearest known one, or 0 for the own floor."""
    measured = np.isfinite(storeys.elevation_m)
    if not measured.any():
        return settings.storey_m * (storeys.number - storeys.own).astype(np.float64)
    nearest = np.abs(storeys.number[:, None] - storeys.number[measured]).argmin(axis=1)
    guess: FloatArray = storeys.elevation_m[measured][nearest] + settings.storey_m * (
        storeys.number - storeys.number[measured][nearest]
    )
    return guess


def _solve(
    track: VerticalTrack, seen: _Sightings, marks: _Marks, storeys: Storeys, settings: HeightSettings
) -> tuple[FloatArray, FloatArray, float]:
    """Height (f,) of the camera and elevation (s,) of each storey, and their distance from the limit, metres.

    The unknowns are, in this order: the offset of the vertical axis at the k times of sightings, the heights of the m
    sighted marks, the s elevations.
    """
    knots, at = np.unique(np.concatenate(([0], seen.rank)), return_inverse=True)
    used, which = np.unique(seen.landmark, return_inverse=True)
    k, m = len(knots), len(used)
    elevation = _usual_elevations(storeys, settings)
    own = _index(storeys, np.array([storeys.own]))
    start = elevation[own] + settings.carried_m - track.height_m[0]
    measured = np.isfinite(marks.z_m[used])
    drift = np.sqrt(np.diff(track.variance_m2[knots]))
    hung = np.where(measured, settings.surveyed_sigma_m, CARRIED_SIGMA_M)
    storey = _index(storeys, marks.floor[used])
    equations = [
        Differences(np.arange(1, k), np.arange(k - 1), np.zeros(k - 1), drift),
        Differences(k + which, at[1:], seen.height_m, np.full(len(which), SIGHTING_SIGMA_M)),
        Differences(k + np.arange(m), k + m + storey, _usual_height(marks, settings)[used], hung),
        Differences(np.zeros(1, np.int64), k + m + own, start - elevation[own], np.array([START_SIGMA_M]), False),
        *_elevation_equations(storeys, elevation, k + m, settings.storey_m),
    ]
    logged = np.array([np.median(seen.height_m[which == i]) for i in range(m)])
    found = solve_robustly(equations, np.concatenate((np.repeat(start, k), logged + start, elevation)))
    offset = np.interp(track.variance_m2, track.variance_m2[knots], found.state[:k])
    return track.height_m + offset, found.state[k + m :], found.unreached


def _elevation_equations(storeys: Storeys, elevation: FloatArray, first: int, storey_m: float) -> list[Differences]:
    """Fix known elevations (s,), metres; unknown ones follow from the next floor's by the usual height of a storey."""
    measured = np.isfinite(storeys.elevation_m)
    pinned = np.flatnonzero(measured if measured.any() else storeys.number == storeys.own)
    none = np.full(len(pinned), -1, dtype=np.int64)
    lower = np.flatnonzero(~(measured[1:] & measured[:-1]))
    storeys_up = np.diff(storeys.number)[lower]
    return [
        Differences(first + pinned, none, elevation[pinned], np.full(len(pinned), PINNED_M), False),
        Differences(first + lower + 1, first + lower, storey_m * storeys_up, STOREY_SIGMA_M * storeys_up, False),
    ]


def heights_by_pressure(
    time_ns: IntArray, pressure: PressureLog | None, storeys: Storeys | None, settings: HeightSettings
) -> Heights:
    """Find height and floor at boot-clock times (n,) of a walk that starts on its own floor, phone in hand.

    Only floors of known elevation are distinguished; without pressure the walk stays on its own floor.
    """
    n = len(time_ns)
    if storeys is None:
        return Heights(np.full(n, np.nan), np.empty(0, dtype=np.int64))
    floor, z = np.full(n, storeys.own, dtype=np.int64), np.full(n, np.nan)
    known = np.isfinite(storeys.elevation_m)
    number, elevation = storeys.number[known], storeys.elevation_m[known]
    if storeys.own not in number.tolist() or n == 0:
        return Heights(z, floor)
    own = int(np.flatnonzero(number == storeys.own)[0])
    rise = np.zeros(n) if pressure is None else altitude_m(pressure, time_ns)
    height = elevation[own] + settings.carried_m + rise - rise[0]
    if len(number) > 1 and pressure is not None:
        floor = number[floor_of_heights(height, elevation, settings.carried_m, own)]
    return Heights(height, floor)
