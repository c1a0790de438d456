"""Which control point each press was made at: by a written route (``route.csv``) and all presses of a session together.

The presses are a hidden Markov chain over the points. A label's distance from the point pressed at is either small and
drawn independently, or much like that of the press before: labels that are wrong stay wrong in the same way for a
while. So a walk whose labels are all shifted still finds its points, where the nearest point would be the wrong one.
Forward and backward recursion give each point's probability at each press (Rabiner 1989, section III).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.intake.ids import compare_ids
from vislam2tag.site.site_table import SiteTable, is_file, read_site_table

ROUTE_FILE = "route.csv"


def read_route(root: Path, session: Path, ids: Sequence[str]) -> IntArray | None:
    """Indices (r,) among the control points ``ids`` in walking order; None where no route is written down.

    The file in the ``session`` folder counts, else that of its floor (``floor_K/route.csv``). Its header is ``point``,
    then one id a line. Raises SurveyError where it cannot be read, has another header or names an unknown point.
    """
    paths = [folder / ROUTE_FILE for folder in (session, session.parent.parent)]
    path = next(filter(is_file, paths), None)
    if path is None:
        return None
    try:
        table = read_site_table(root, path)
    except OSError as error:
        raise SurveyError(f"{path}: cannot be opened ({error.strerror}); check its permissions") from error
    if table.header[:1] != ("point",) or not table.rows:
        raise SurveyError(f"{path}: expected the header 'point', then the ids of control points in walking order")
    return np.array([_index(path, table, row, ids) for row in range(len(table.rows))], dtype=np.int64)


def _index(path: Path, table: SiteTable, row: int, ids: Sequence[str]) -> int:
    line, fields = table.rows[row]
    if fields[0] not in ids:
        named = tuple(dict.fromkeys(row[0] for _, row in table.rows))
        found = compare_ids(ids, named, ("refmarker.csv", "the route"))
        from_one = {str(number) for number in range(1, len(ids) + 1)}
        counting = "; control points are counted from 0" if ids and from_one.issuperset(named) else ""
        raise SurveyError(
            f"{path}:{line}: there is no control point '{fields[0]}' on this floor: {found.text}{counting}; correct "
            "the route"
        )
    return list(ids).index(fields[0])


HAND_M = 0.5
"""How far the label at a press may usually lie from the point: a finger some tenths of a second off, metres."""
DRIFT_M_PER_S = 0.02
"""How fast the labels' own error may usually change, metres per second."""
ANEW = 0.5
"""Probability that a label's error is drawn anew instead of like the one before."""
AGAIN = 0.02
"""Probability that a press is at the same point as the one before (a second tap)."""
SKIPPED = 0.03
"""Probability that a point of a given route is passed without a press."""
CLEAR = 10.0
"""A press is identified where its best point is so many times as probable as the second best."""


@dataclass(frozen=True)
class _Chain:
    """States ``s``: the point (s,) that each stands for, probabilities to start in (s,) and to go on to (s, s)."""

    point: IntArray
    start: FloatArray
    onward: FloatArray


def identify_presses(
    time_ns: IntArray,
    label_bcs: FloatArray,
    sigma_m: FloatArray,
    points_bcs: FloatArray,
    route: IntArray | None = None,
) -> tuple[IntArray, FloatArray]:
    """At which of the points (p, 2) each press was made: their indices (k,), -1 where it is not clear, and the
    probability (k,) of the best one, clear or not.

    ``time_ns`` (k,) of the presses, rising; ``label_bcs`` (k, 2) metres, NaN without a label, and ``sigma_m`` (k,),
    NaN where not stated, are where a strategy puts them; ``route`` (r,) are the indices of the points in the order in
    which they were passed, where that is known: presses may then be missing or double, but not out of order.
    """
    chain = _free_chain(len(points_bcs)) if route is None else _route_chain(route)
    if not len(time_ns):
        return np.empty(0, dtype=np.int64), np.empty(0)
    errors = label_bcs[:, None] - points_bcs[chain.point]
    found = _posterior(chain, errors, np.nan_to_num(sigma_m), np.diff(time_ns) * 1e-9)
    posterior = np.zeros((len(time_ns), len(points_bcs)))
    np.add.at(posterior.T, chain.point, found.T)
    return _clear_ones(posterior)


def _free_chain(points: int) -> _Chain:
    """Any point may follow any other; seldom the same."""
    onward = np.full((points, points), (1 - AGAIN) / max(points - 1, 1))
    np.fill_diagonal(onward, AGAIN if points > 1 else 1.0)
    return _Chain(np.arange(points), np.full(points, 1 / max(points, 1)), onward)


def _route_chain(route: IntArray) -> _Chain:
    """The states are the places of the route (r,): on to the next, seldom to one after it or the same."""
    place = np.arange(len(route), dtype=np.float64)
    ahead = place - place[:, None]
    onward = np.where(ahead > 0, (1 - AGAIN) * (1 - SKIPPED) * SKIPPED ** np.maximum(ahead - 1, 0), 0.0)
    return _Chain(route, (1 - SKIPPED) * SKIPPED**place, onward + AGAIN * np.eye(len(route)))


def _between(error_bcs: FloatArray, sigma_m: FloatArray, gap_s: FloatArray, press: int) -> FloatArray:
    """Density (s, s) of the labels' errors (k, s, 2) at a press in each state, from each state of the one before."""
    alone = np.broadcast_to(_alone(error_bcs[press], sigma_m[press]), (error_bcs.shape[1],) * 2)
    change = error_bcs[press] - error_bcs[press - 1][:, None]
    if not np.isfinite(change).all():
        return alone
    scale = np.hypot(np.sqrt(2) * HAND_M, DRIFT_M_PER_S * gap_s[press - 1])
    return ANEW * alone + (1 - ANEW) * _heavy_tailed(change, float(scale))


def _alone(error_bcs: FloatArray, sigma_m: float) -> FloatArray:
    """Density (s,) of the errors (s, 2) at a press, whatever they were at the one before."""
    if not np.isfinite(error_bcs).all():
        return np.ones(len(error_bcs))
    return _heavy_tailed(error_bcs, float(np.hypot(HAND_M, sigma_m)))


def _heavy_tailed(error_m: FloatArray, scale_m: float) -> FloatArray:
    """Density (...) of errors (..., 2): Student's t in the plane with two degrees of freedom."""
    squared = (error_m**2).sum(axis=-1) / scale_m**2
    return np.asarray((1 + squared / 2) ** -2 / (2 * np.pi * scale_m**2))


def _posterior(chain: _Chain, error_bcs: FloatArray, sigma_m: FloatArray, gap_s: FloatArray) -> FloatArray:
    """Probability (k, s) of each state at each press, given all labels."""
    between = partial(_between, error_bcs, sigma_m, gap_s)
    presses = len(error_bcs)
    forward = np.empty((presses, len(chain.point)))
    forward[0] = _normalised(chain.start * _alone(error_bcs[0], sigma_m[0]))
    for press in range(1, presses):
        forward[press] = _normalised(forward[press - 1] @ (chain.onward * between(press)))
    backward = np.ones(len(chain.point))
    posterior = forward.copy()
    for press in range(presses - 1, 0, -1):
        backward = _normalised((chain.onward * between(press)) @ backward)
        posterior[press - 1] = _normalised(forward[press - 1] * backward)
    return posterior


def _normalised(values: FloatArray) -> FloatArray:
    """Scale values (s,) to a sum of one."""
    return np.asarray(values / values.sum())


def _clear_ones(posterior: FloatArray) -> tuple[IntArray, FloatArray]:
    """The best point (k,) of each press by its probabilities (k, p), and its own."""
    best = posterior.argmax(axis=1)
    ranked = np.sort(np.column_stack((np.zeros(len(posterior)), posterior)), axis=1)
    clear = ranked[:, -1] >= CLEAR * ranked[:, -2]
    return np.where(clear, best, -1).astype(np.int64), ranked[:, -1]
