"""Of all plans with the fewest landmarks a good one: small errors to expect, and landmarks that lie not on one line.

First each landmark moves along its corridors as far as the demands let it, to where the errors to expect on typical
walks are least (:mod:`walk_costs`). Then each takes one of the walls at its station, so that the landmarks near each
other lie well off one line (:func:`line_deviation_m`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.preparation.planning.demands import StationSet
from vislam2tag.preparation.planning.set_cover import row_matrix
from vislam2tag.preparation.planning.sheet_places import SheetPlaces
from vislam2tag.preparation.planning.walk_costs import GapCosts, StationPasses, WalkCosts

REACH_M = 20.0
"""A landmark is tried on stations no farther off than this."""
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
    """Indices (r,) of the rows that hold a station."""
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
    """One place (m,) for each station (m,), so that no neighbourhood lies on one line.

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
