"""Scans whose labelled storey all the others contradict.

Who records by tapping on a plan forgets to change the floor, and phones hand out scans that they made a flight of
stairs ago. A few such labels mislead what is learned of their surroundings. They show when each scan's storey is
predicted from the others (leave-one-out residuals of a ridge regression have a closed form: Allen 1974).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.robust import iterate
from vislam2tag.positioning.cell_density.kernel_regression import STOREY_RIDGE, KernelNormalEquations
from vislam2tag.positioning.cell_density.scan_kernels import StoreyKernel, levels
from vislam2tag.positioning.scans.radio_scans import RadioScans

LEAD = 0.5
"""By so much another storey's probability exceeds the labelled one's."""
MOST_OF_STOREY = 0.1
"""More of a storey's scans than this share are not doubted: rather is it a storey that is hard to predict."""
_MOST_ROUNDS = 3
"""Doubted scans contradict others no more, so that all are looked at again, at most so often."""
_LEAST = 1e-3
"""No storey is less probable, and no scan has less weight of its own missing."""
_AT_ONCE = 1024


def mislabelled(scans: RadioScans, storey: IntArray, centres: IntArray) -> BoolArray:
    """Return which of the scans (n,), labelled with these storeys (n,), the others contradict.

    Kernels lie around the scans ``centres`` (m,), by index.
    """
    one_hot = np.eye(int(storey.max()) + 1)[storey]

    def step(doubted: BoolArray, _round: int) -> BoolArray:
        predicted = _leave_one_out(scans, one_hot, ~doubted, centres)
        return _most_contradicted((predicted - one_hot).max(axis=1) - (predicted * one_hot).sum(axis=1), storey)

    nobody = np.zeros(len(scans), dtype=np.bool_)
    return iterate("which scans others contradict", nobody, step, _changed, tolerance=1, most_rounds=_MOST_ROUNDS).state


def _changed(before: BoolArray, after: BoolArray) -> int:
    """Return of how many scans (n,) the others say another thing than before."""
    return int((before != after).sum())


def _leave_one_out(scans: RadioScans, one_hot: FloatArray, believed: BoolArray, centres: IntArray) -> FloatArray:
    """Predict storey probabilities (n, s) of each scan from the other ``believed`` (n,) ones and labels (n, s)."""
    mean = one_hot[believed].mean(axis=0)
    equations = KernelNormalEquations.empty(StoreyKernel.around(levels(scans[centres])), mean, len(centres))
    equations.add((levels(scans[rows]), one_hot[rows]) for rows in _blocks(np.flatnonzero(believed)))
    factor = cho_factor(equations.normal(STOREY_RIDGE))
    weight = cho_solve(factor, equations.moment)
    score = np.empty_like(one_hot)
    for rows in _blocks(np.arange(len(scans))):
        similarity = equations.kernel(levels(scans[rows]))
        own_share = believed[rows] * (similarity * cho_solve(factor, similarity.T).T).sum(axis=1)
        by_others = similarity @ weight - own_share[:, None] * (one_hot[rows] - mean)
        score[rows] = by_others / np.maximum(1 - own_share, _LEAST)[:, None] + mean
    score = np.maximum(score, _LEAST)
    return np.asarray(score / score.sum(axis=1, keepdims=True))


def _most_contradicted(lead: FloatArray, storey: IntArray) -> BoolArray:
    """Return which leads (n,) are large, of each storey no more than its share, the largest first."""
    chosen = np.zeros(len(lead), dtype=np.bool_)
    for number in np.unique(storey):
        rows = np.flatnonzero(storey == number)
        most = rows[np.argsort(-lead[rows], kind="stable")][: int(MOST_OF_STOREY * len(rows))]
        chosen[most] = lead[most] > LEAD
    return chosen


def _blocks(rows: IntArray) -> Iterator[IntArray]:
    """Cut rows (n,) into blocks."""
    return (rows[start : start + _AT_ONCE] for start in range(0, len(rows), _AT_ONCE))
