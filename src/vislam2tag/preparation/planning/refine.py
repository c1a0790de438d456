"""Of all plans with the fewest landmarks a good one: small errors to expect, and landmarks that lie not on one line.

First each landmark moves along its corridors as far as the demands let it, to where the errors to expect on typical
walks are least. Then each takes one of the walls at its station, so that the landmarks near each other lie well off one
line (:func:`line_deviation_m`). ``further_landmarks`` finds the places where one more landmark would help most;
``sigma_map`` gathers the expected errors in cells and by distance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter
from scipy.sparse import csr_array
from scipy.spatial.distance import cdist

from vislam2tag.common.records import Record
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.core.limits import MAX_CELLS
from vislam2tag.preparation.planning.demands import StationSet, row_matrix
from vislam2tag.preparation.planning.prediction import (
    ExpectedLabels,
    GapCosts,
    PassedLandmarks,
    StationPasses,
    WalkCosts,
    expected_along,
    passing,
    smoothed_walk,
)
from vislam2tag.preparation.planning.sheet_places import SheetPlaces, Stations
from vislam2tag.quality.landmark_gain import (
    APART_M,
    BESIDE_M,
    CELL_M,
    GainMap,
    gains,
    positions_each_metre,
    session_gains,
)
from vislam2tag.quality.self_check import expected_error_m
from vislam2tag.site.walkable.space import WalkableSpace
from vislam2tag.site.walkable.walking_distances import WalkingDistances

REACH_M = 20.0
"""A landmark is tried on stations no further off than this."""
ROUNDS = 8
"""Most rounds over all landmarks; it ends before where none moves any more."""
LEAST_GAIN = 1e-9
"""A smaller gain is rounding."""
NEIGHBOURS = 3
"""A landmark's neighbourhood is itself and so many nearest ones, by walking distance."""
WIDE_M = 1.0
"""Landmarks that lie so far off one line, root mean square, are spread well enough."""
NARROW_M = 0.3
"""... and less than this is next to one line: of the order of a sighting's error."""


def improve_stations(
    chosen: BoolArray,
    movable: BoolArray,
    usable: BoolArray,
    rows: Sequence[StationSet],
    distance_m: FloatArray,
    passes: StationPasses,
    costs: GapCosts,
) -> BoolArray:
    """Move the ``movable`` ones of the ``chosen`` (s,) stations to better ``usable`` ones; all rows stay fulfilled.

    ``distance_m`` (s, s) are walking distances between all stations; ``passes`` is where walks come by them.
    """
    now = chosen.copy()
    held = csr_array(row_matrix(rows, len(chosen)).T)
    count = np.asarray(row_matrix(rows, len(chosen)) @ now.astype(np.float64))
    walks = WalkCosts(passes, costs, now)
    for _ in range(ROUNDS):
        moved = False
        for old in np.flatnonzero(now & movable).tolist():
            candidates = _candidates(old, now, usable, held, count, distance_m)
            gains = [walks.gain(old, new) for new in candidates]
            if not gains or max(gains) <= LEAST_GAIN:
                continue
            best = candidates[int(np.argmax(gains))]
            walks.move(old, best)
            now[old], now[best] = False, True
            count[_rows_of(held, old)] -= 1
            count[_rows_of(held, best)] += 1
            moved = True
        if not moved:
            break
    return now


def _rows_of(held: csr_array, station: int) -> IntArray:
    """Indices (r,) of the rows that contain a station."""
    return np.asarray(held.indices[held.indptr[station] : held.indptr[station + 1]])


def _candidates(
    old: int, now: BoolArray, usable: BoolArray, held: csr_array, count: FloatArray, distance_m: FloatArray
) -> list[int]:
    """Stations to which the landmark of ``old`` can move without breaking a row: ``usable`` (s,), not taken ``now``
    (s,), near by ``distance_m`` (s, s); ``count`` (r,) landmarks fulfil each row.
    """
    needed = _rows_of(held, old)
    needed = needed[count[needed] < 1.5]
    candidates = np.flatnonzero(usable & ~now & (distance_m[old] <= REACH_M)).tolist()
    return [new for new in candidates if np.isin(needed, _rows_of(held, new)).all()]


def line_deviation_m(points: FloatArray) -> float:
    """How far points (k, 2) lie off their best line, root mean square, metres; 0 for two or fewer."""
    if len(points) < 3:
        return 0.0
    centred = points - points.mean(axis=0)
    return float(np.linalg.svd(centred, compute_uv=False)[-1] / np.sqrt(len(points)))


def neighbourhoods(station: IntArray, distance_m: FloatArray) -> list[IntArray]:
    """For each of some landmarks, by their stations (m,), itself and its nearest ones: indices among them."""
    between = distance_m[np.ix_(station, station)]
    count = min(NEIGHBOURS + 1, len(station))
    return [np.argsort(row, kind="stable")[:count] for row in between]


def line_deviations_m(position: FloatArray, station: IntArray, distance_m: FloatArray) -> FloatArray:
    """How far (m,) each landmark and its nearest ones lie off their best line, metres; positions (m, 2)."""
    return np.array([line_deviation_m(position[group]) for group in neighbourhoods(station, distance_m)])


def choose_walls(
    station: IntArray, places: SheetPlaces, held: FloatArray, held_station: IntArray, distance_m: FloatArray
) -> IntArray:
    """One place (m,) for each station (m,), so that no neighbourhood is on one line.

    ``held`` (h, 2) are positions of fixed landmarks at the stations ``held_station`` (h,), which count as neighbours.
    Of walls that spread alike the one that is longer in view counts, then the smaller sheet.
    """
    options = [np.flatnonzero(places.station == one) for one in station.tolist()]
    fine = [
        sorted(rows.tolist(), key=lambda row: (places.pass_m[row], -places.visible_m[row], row)) for rows in options
    ]
    chosen = np.array([rows[0] for rows in fine], dtype=np.int64)
    groups = neighbourhoods(np.concatenate((station, held_station)), distance_m)
    inside = [[g for g, group in enumerate(groups) if i in group] for i in range(len(station))]
    points = np.vstack((places.position[chosen], held))
    for _ in range(ROUNDS):
        moved = False
        for i, rows in enumerate(fine):
            spread = []
            for row in rows:
                points[i] = places.position[row]
                spread.append(sum(min(line_deviation_m(points[groups[g]]), WIDE_M) for g in inside[i]))
            best = rows[int(np.argmax(np.round(spread, 3)))]
            if spread[rows.index(int(chosen[i]))] >= max(spread) - 1e-3:
                best = int(chosen[i])
            moved |= best != chosen[i]
            chosen[i] = best
            points[i] = places.position[best]
        if not moved:
            break
    return chosen


MOST_WALKS = 12
"""Gains are looked for on so many walks, spread evenly over all."""


def further_landmarks(
    paths: Sequence[FloatArray],
    sheets: PassedLandmarks,
    places: SheetPlaces,
    stations: Stations,
    free: BoolArray,
    count: int,
    survey_sigma_m: float,
) -> list[tuple[int, float]]:
    """Propose ``count`` more landmarks at ``free`` (p,) places, the best first.

    With each place comes by how much, metres, the mean error to expect falls with it and those before it.
    """
    found: list[tuple[int, float]] = []
    errors = [_errors_m(path, sheets, survey_sigma_m) for path in paths]
    promised = _first_order_gains(paths, sheets, survey_sigma_m)
    feet = stations.point[places.station]
    value = np.array([promised.get(cell, 0.0) for cell in map(tuple, np.floor(feet / CELL_M).astype(int).tolist())])
    beside = cdist(places.position, sheets.position).min(axis=1, initial=np.inf) < BESIDE_M
    value = np.where(free & ~beside, value, 0.0)
    for _ in range(count):
        if not len(value) or value.max() <= 0:
            break
        best = int(np.argmax(value))
        sheets = sheets.with_one(places.position[best], feet[best], float(places.pass_m[best]))
        after = [
            _errors_m(path, sheets, survey_sigma_m) if passes else error
            for path, error, (passes,) in zip(paths, errors, passing(paths, feet[[best]]).tolist(), strict=True)
        ]
        found.append((best, _mean(errors) - _mean(after)))
        errors = after
        value[np.linalg.norm(feet - feet[best], axis=1) < APART_M] = 0.0
    return found


def _errors_m(path: FloatArray, sheets: PassedLandmarks, survey_sigma_m: float) -> FloatArray:
    """Mean lengths (n,) of the errors to expect along a walk; empty where it cannot be mapped."""
    expected = expected_along(path, sheets, survey_sigma_m)
    return np.zeros(0) if expected is None else expected_error_m(expected.covariance)


def _mean(errors: Sequence[FloatArray]) -> float:
    """Mean of all errors, (n,) each, metres."""
    return float(np.concatenate([*errors, np.zeros(0)]).mean())


def _first_order_gains(
    paths: Sequence[FloatArray], sheets: PassedLandmarks, survey_sigma_m: float
) -> dict[tuple[int, int], float]:
    """By how much the mean expected error on walks, (n, 2) each, falls with a landmark in each cell, to first order."""
    total = GainMap()
    for number in sorted(set(np.linspace(0, len(paths) - 1, min(MOST_WALKS, len(paths))).astype(int).tolist())):
        path = paths[number]
        smoothed = smoothed_walk(path, sheets, survey_sigma_m)
        if smoothed is None:
            continue
        positions = positions_each_metre(smoothed)
        here = gains(smoothed, positions, np.zeros(len(positions.at), dtype=np.int64))
        total.add(session_gains(here, 1.0, np.zeros(len(path), dtype=np.int64), np.ones(len(path))))
    return total.mean_gain_m(0) if total.frames else {}


MAP_CELL_M = 0.25
"""Side of a cell of the map, metres; of a floor with more than :data:`MAX_CELLS` of them, larger."""
CLASS_M = 5.0
"""Width of a class of distances to the nearest landmark."""


@dataclass(frozen=True)
class SigmaMap:
    """``sigma_m`` (rows, columns) per axis, NaN where no one walks."""

    grid: CellGrid
    sigma_m: FloatArray


class DistanceClass(Record):
    """What is expected of labels this far from the nearest landmark; ``sigma_m`` per axis, ``error_m`` mean length."""

    from_m: float
    to_m: float
    share: float
    sigma_m: float
    error_m: float


def sigma_map(space: WalkableSpace, expected: Sequence[ExpectedLabels]) -> SigmaMap:
    """Gather the variances of all walks in cells. What is beside the walks takes its neighbours' values, not through
    walls: the inner end of a deep room has the value of the place from which one goes there.
    """
    left, right, low, high = space.area.grid.extent_m
    cell_m = max(MAP_CELL_M, float(np.sqrt((right - left) * (high - low) / MAX_CELLS)))
    grid = CellGrid((left, low), cell_m, int(np.ceil((high - low) / cell_m)), int(np.ceil((right - left) / cell_m)))
    total, count = np.zeros(grid.shape), np.zeros(grid.shape)
    for one in expected:
        rows, columns = grid.cells_of(one.path).clip(0, np.array(grid.shape) - 1).T
        np.add.at(total, (rows, columns), one.variance_m2)
        np.add.at(count, (rows, columns), 1.0)
    cells = np.argwhere(np.ones(grid.shape, dtype=np.bool_))
    walkable = (space.clearance_at(grid.centres_m(cells)) > cell_m / 2).reshape(grid.shape)
    variance = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return SigmaMap(grid, np.sqrt(_filled(variance, walkable)))


def _filled(values: FloatArray, allowed: BoolArray) -> FloatArray:
    """Give ``allowed`` (rows, columns) cells without a value, ring after ring, the mean of their neighbours that have
    one.
    """
    while True:
        known = np.isfinite(values)
        weight = uniform_filter(known.astype(np.float64), 3, mode="constant")
        reached = allowed & ~known & (weight > 1e-6)
        if not reached.any():
            return values
        sums = uniform_filter(np.where(known, values, 0.0), 3, mode="constant")
        values = np.where(reached, sums / np.maximum(weight, 1e-9), values)


def distance_classes(
    space: WalkableSpace, landmarks: FloatArray, expected: Sequence[ExpectedLabels]
) -> list[DistanceClass]:
    """What is expected by the walking distance to the nearest of the landmarks (m, 2), in classes of 5 m."""
    if not expected:
        return []
    path = np.vstack([one.path for one in expected])
    variance = np.concatenate([one.variance_m2 for one in expected])
    error = np.concatenate([expected_error_m(one.covariance) for one in expected])
    away = WalkingDistances(space).to_nearest(path, landmarks)
    known = np.isfinite(away)
    number = np.floor(away[known] / CLASS_M).astype(np.int64)
    variance, error = variance[known], error[known]
    return [
        DistanceClass(
            from_m=k * CLASS_M,
            to_m=(k + 1) * CLASS_M,
            share=round(float((number == k).mean()), 4),
            sigma_m=round(float(np.sqrt(variance[number == k].mean())), 4),
            error_m=round(float(error[number == k].mean()), 4),
        )
        for k in np.unique(number).tolist()
    ]
