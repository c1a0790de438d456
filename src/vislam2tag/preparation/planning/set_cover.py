"""The fewest stations that fulfil all demands, with a proven bound (integer programme, HiGHS)."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_array

from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.preparation.planning.demands import StationSet

BOUND_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Cover:
    """``chosen`` (s,) stations; ``bound``: no set of stations with fewer than this fulfils the demands."""

    chosen: BoolArray
    bound: int
    seconds: float
    cut_short: bool
    """Whether the time limit ended the search: on another machine it may end elsewhere."""

    @property
    def number(self) -> int:
        """How many stations are chosen."""
        return int(self.chosen.sum())


def cover(
    rows: Sequence[StationSet],
    fixed: BoolArray,
    more_rows: Callable[[BoolArray], set[StationSet]],
    *,
    allowed: BoolArray,
    gap: float,
    nodes: int,
    time_limit_s: float,
) -> Cover:
    """Choose the fewest stations, the ``fixed`` (s,) among them, so that each row has one.

    Only ``allowed`` (s,) stations count; each row holds some of them.

    ``more_rows`` gives the further rows that a choice (s,) breaks; they are added and the search goes on. Rows that
    were left out can only make the bound lower, so that it holds for all.
    """
    used, unique = list(dict.fromkeys(rows)), set(rows)
    bound, begun = int(fixed.sum()), time.monotonic()
    chosen, cut_short = fixed.copy(), False
    while True:
        left_s = time_limit_s - (time.monotonic() - begun)
        solved = _fewest(used, fixed, allowed, gap, nodes, max(left_s, 1.0))
        cut_short |= solved.timed_out
        bound = max(bound, solved.bound)
        chosen = solved.chosen
        broken = sorted(more_rows(chosen) - unique, key=sorted)
        if not broken:
            break
        used += broken
        unique.update(broken)
    return Cover(chosen, bound, time.monotonic() - begun, cut_short)


@dataclass(frozen=True)
class _Solved:
    chosen: BoolArray
    bound: int
    timed_out: bool


def row_matrix(rows: Sequence[StationSet], count: int) -> csr_array:
    """(rows, stations) ones where a row holds a station."""
    columns = [sorted(row) for row in rows]
    pointer = np.concatenate(([0], np.cumsum([len(row) for row in columns]))).astype(np.int64)
    index = np.array([station for row in columns for station in row], dtype=np.int64)
    return csr_array((np.ones(len(index)), index, pointer), shape=(len(rows), count))


def _fewest(
    rows: Sequence[StationSet], fixed: BoolArray, allowed: BoolArray, gap: float, nodes: int, time_s: float
) -> _Solved:
    """The fewest stations (s,) for some rows, the ``fixed`` (s,) among them."""
    if not rows:
        return _Solved(fixed.copy(), int(fixed.sum()), timed_out=False)
    count = len(fixed)
    matrix = row_matrix(rows, count)
    greedy = _greedy(matrix, fixed)
    result = milp(
        np.ones(count),
        integrality=np.ones(count, dtype=np.int64),
        bounds=Bounds(fixed.astype(np.float64), (allowed | fixed).astype(np.float64)),
        constraints=LinearConstraint(matrix, 1, np.inf),
        options={"mip_rel_gap": gap, "node_limit": nodes, "time_limit": time_s},
    )
    proven = getattr(result, "mip_dual_bound", None)
    bound = math.ceil(proven - BOUND_TOLERANCE) if proven is not None and math.isfinite(proven) else int(fixed.sum())
    chosen = greedy if result.x is None else np.asarray(result.x) > 0.5
    better = chosen if chosen.sum() <= greedy.sum() else greedy
    return _Solved(np.asarray(better), bound, timed_out=time_out(result.status, result.message))


def time_out(status: int, message: str) -> bool:
    """Whether the solver ended for want of time (it gives one status to all its limits)."""
    return status == 1 and "time" in message.lower()


def _greedy(matrix: csr_array, fixed: BoolArray) -> BoolArray:
    """Take the station that most open rows hold, again and again: mask (s,) with the ``fixed`` (s,)."""
    chosen = fixed.copy()
    open_rows: FloatArray = np.asarray((matrix @ chosen.astype(np.float64)) < 0.5, dtype=np.float64)
    turned = csr_array(matrix.T)
    while open_rows.any():
        best = int(np.argmax(turned @ open_rows))
        chosen[best] = True
        open_rows[turned.indices[turned.indptr[best] : turned.indptr[best + 1]]] = 0.0
    return chosen
