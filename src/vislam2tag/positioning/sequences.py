"""Smoother and filter over the positions of a walk's scans, with the phone's own motion between them.

Positions are a Gaussian random walk observed through the model's answers (Rauch, Tung and Striebel 1965; here one
tridiagonal system for each walk). Outlying answers count less (Student-t weights). Storeys are a hidden Markov chain
that rarely changes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.linalg import solveh_banded

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.robust import StoppingRule, iterate, variance_factor
from vislam2tag.positioning.places import Positions, ScanPlaces
from vislam2tag.positioning.radio_scans import RadioScans

_SIGMA_TO_68 = 1.51
"""Radius of the 68 % circle of a Gaussian in the plane, in standard deviations per axis."""
_FREEDOM = 4.0
"""Degrees of freedom of the Student-t distribution of answers."""
_SETTLED_M = 0.01
"""Re-weighting has converged when no place moves by more than this."""
_MOST_ROUNDS = 100
"""Iteration limit, far above the usual number."""
_LOOK_BACK = 100
"""Number of scans that the filter uses, including the present one; older ones have no effect."""
_FEWEST_ANSWERS = 5
"""A stretch of track with fewer answers cannot be rotated into their frame."""
_SMOOTHED = ("storey", "xy", "z", "storey_probability", "radius_68_m", "radius_95_m")
_SPEED_M_S = 1.0
"""Rate of change of the place without a track; one standard deviation."""
_FASTEST_M_S = 2.0
"""A faster tracker has jumped, so its headings before and after may differ."""
_DRIFT = 0.1
"""Error of a track's step as a share of its length; one standard deviation per axis."""
_JITTER_M = 0.1
"""Constant part of the error of a track's step."""
_STOREY_STAY_S = 300.0
"""Mean time on one storey."""
_ANSWERS_AS_ONE = 8.0
"""Number of neighbouring answers that count as one for radii, because the same access points mislead them."""


def smoothed(found: Positions, scans: RadioScans, track_m: FloatArray | None = None) -> Positions:
    """Smooth the answers (n) to scans (n) in each session; scans without a session or a time are unchanged.

    ``track_m`` (n, 2): the position of the phone by its tracker at each scan, metres, in one level frame for each
    session with any origin and heading; NaN during tracking losses. Without a track a place follows the last one at
    walking speed. A scan without known access points gets its place from its neighbours. Radii keep the model's
    calibration for isolated scans, and shrink with the information of neighbours.
    """
    result = _copied(found)
    for rows in _walks(scans):
        if found.known[rows].any():
            _write_rows(result, rows, _smoothed_walk(found[rows], scans.time_ns[rows], _of(track_m, rows)))
    return result


def filtered(found: Positions, scans: RadioScans, track_m: FloatArray | None = None) -> Positions:
    """Smooth with earlier scans only: each of ``n`` scans gets the smoother's result for the walk until then.

    Later scans change neither an answer nor the heading of a track.
    """
    result = _copied(found)
    for rows in _walks(scans):
        for end in range(1, len(rows) + 1):
            past = rows[max(0, end - _LOOK_BACK) : end]
            if found.known[past].any():
                smooth = _smoothed_walk(found[past], scans.time_ns[past], _of(track_m, past))
                _write_rows(result, past[-1:], smooth[np.array([len(past) - 1])])
    return result


def _copied(found: Positions) -> Positions:
    return replace(found, **{name: getattr(found, name).copy() for name in _SMOOTHED})


def _write_rows(result: Positions, rows: IntArray, smooth: Positions) -> None:
    """Write the smoothed answers into rows (k,)."""
    for name in _SMOOTHED:
        getattr(result, name)[rows] = getattr(smooth, name)


def _walks(scans: RadioScans) -> Iterator[IntArray]:
    """Yield each session's scans (k,), by index, in order of time."""
    for session in np.unique(scans.session[scans.session != ""]):
        rows = np.flatnonzero(scans.session == session)
        yield rows[np.argsort(scans.time_ns[rows], kind="stable")]


def _of(track_m: FloatArray | None, rows: IntArray) -> FloatArray:
    """(k, 2) the track at rows (k,); NaN without one."""
    return np.full((len(rows), 2), np.nan) if track_m is None else track_m[rows]


def _smoothed_walk(answer: Positions, time_ns: IntArray, track_m: FloatArray) -> Positions:
    """Smooth the answers (n) of one walk at times (n,), in order, with its track (n, 2); a single one is unchanged."""
    if len(answer) == 1:
        return answer
    gap_s = np.diff(time_ns) / 1e9
    known = answer.known
    seen = np.where(known[:, None], answer.xy, 0.0)
    sigma_m = answer.radius_68_m / _SIGMA_TO_68
    alone = np.where(known, 1 / np.maximum(sigma_m, 1e-3) ** 2, 0.0)
    step, trust, tracked = _steps(seen, alone, gap_s, track_m)

    def solved(weight: FloatArray, step_weight: FloatArray) -> _WeightedWalk:
        return _WeightedWalk(_solved(weight, seen, step_weight, step), step_weight)

    def reweighted(before: _WeightedWalk, _number: int) -> _WeightedWalk:
        step_off = np.diff(before.xy, axis=0) - step
        step_weight = np.where(tracked, trust / _doubt(step_off, trust), trust)
        return solved(alone / _doubt(before.xy - seen, alone), step_weight)

    found = iterate(
        "a walk's positions",
        solved(alone, trust),
        reweighted,
        lambda before, after: float(np.abs(after.xy - before.xy).max()),
        StoppingRule(tolerance=_SETTLED_M, most_rounds=_MOST_ROUNDS),
    ).state
    together_m = np.sqrt(_variance(alone / _ANSWERS_AS_ONE, found.step_weight))
    shrunk = np.where(known, np.minimum(sigma_m, together_m), together_m)
    probability = _storeys(answer, gap_s)
    storey = probability.argmax(axis=1)
    ratio_95 = np.median(answer.radius_95_m[known] / answer.radius_68_m[known])
    return replace(
        answer,
        storey=storey,
        xy=found.xy,
        z=_heights(answer, storey),
        storey_probability=probability,
        radius_68_m=_SIGMA_TO_68 * shrunk,
        radius_95_m=ratio_95 * _SIGMA_TO_68 * shrunk,
    )


@dataclass(frozen=True)
class _WeightedWalk:
    """Places ``xy`` (n, 2) of a walk, metres, by weighted answers and by steps with ``step_weight`` (n-1,)."""

    xy: FloatArray
    step_weight: FloatArray


def _doubt(off_m: FloatArray, weight: FloatArray) -> FloatArray:
    """Factor (n,) on the variance of residuals (n, 2), metres, whose usual variance is the inverse of the weight."""
    return variance_factor((off_m**2).sum(axis=1) * weight, 2, _FREEDOM)


def _steps(
    seen: FloatArray, weight: FloatArray, gap_s: FloatArray, track_m: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return steps (n-1, 2) in the answers' frame, their weights (n-1,), 1/m^2, and which are from the track."""
    step = np.full((len(gap_s), 2), np.nan)
    sideways = np.zeros(len(gap_s))
    for piece in _unbroken_stretches(track_m, gap_s):
        inner = slice(piece.start, piece.stop - 1)
        headed, sideways[inner] = _turned_to_answers(track_m[piece], seen[piece], weight[piece] / _ANSWERS_AS_ONE)
        step[inner] = np.diff(headed, axis=0)
    tracked = np.isfinite(step).all(axis=1)
    step = np.where(tracked[:, None], step, 0.0)
    sure_m = np.hypot(_JITTER_M, np.hypot(_DRIFT, sideways) * np.hypot(*step.T))
    free_m = _SPEED_M_S * np.maximum(gap_s, 1e-3)
    return step, 1 / np.where(tracked, sure_m, free_m) ** 2, tracked


def _unbroken_stretches(track_m: FloatArray, gap_s: FloatArray) -> list[slice]:
    """Split a track (n, 2) where the tracker jumped; a gap counts as a jump."""
    own_m = np.hypot(*np.diff(track_m, axis=0).T)
    cuts = np.flatnonzero(~(own_m <= _FASTEST_M_S * gap_s)) + 1
    bounds = [0, *cuts.tolist(), len(track_m)]
    return [slice(*pair) for pair in pairwise(bounds)]


def _turned_to_answers(track_m: FloatArray, seen: FloatArray, weight: FloatArray) -> tuple[FloatArray, float]:
    """Rotate a track (n, 2) so that it fits the answers best (the rotation of Umeyama 1991, as complex numbers).

    The second value is the standard deviation of the rotation, radians, from the answers' weights (n,), 1/m^2.
    """
    both = np.isfinite(track_m).all(axis=1) & (weight > 0)
    if both.sum() < _FEWEST_ANSWERS:
        return np.full_like(track_m, np.nan), 0.0
    own, place = (points[:, 0] + 1j * points[:, 1] for points in (track_m, seen))
    share = weight[both] / weight[both].sum()
    centred = [points[both] - (share * points[both]).sum() for points in (own, place)]
    turn = (share * centred[0].conj() * centred[1]).sum()
    turned = own * (turn / abs(turn) if abs(turn) > 0 else 1.0)
    lever = float((weight[both] * np.abs(centred[0]) ** 2).sum())
    return np.column_stack([turned.real, turned.imag]), min(np.pi, lever**-0.5) if lever > 0 else np.pi


def _solved(weight: FloatArray, seen: FloatArray, step_weight: FloatArray, step: FloatArray) -> FloatArray:
    """Minimise the weighted squares of places minus answers and of moves minus steps: (n, 2)."""
    pull = step_weight[:, None] * step
    right = weight[:, None] * seen
    right[1:] += pull
    right[:-1] -= pull
    return np.asarray(
        solveh_banded(np.stack([_diagonal(weight, step_weight), np.append(-step_weight, 0.0)]), right, lower=True)
    )


def _diagonal(weight: FloatArray, step_weight: FloatArray) -> FloatArray:
    """(n,) diagonal of the system's matrix, from weights (n,) and (n-1,)."""
    return np.asarray(weight + np.append(step_weight, 0.0) + np.append(0.0, step_weight))


def _variance(weight: FloatArray, step_weight: FloatArray) -> FloatArray:
    """Diagonal (n,) of the inverse of the tridiagonal system, by a pass from each end (Usmani 1994)."""
    n = len(weight)
    before, after = np.zeros(n), np.zeros(n)
    for i in range(1, n):
        before[i] = _worth_after_step(weight[i - 1] + before[i - 1], step_weight[i - 1])
        after[n - 1 - i] = _worth_after_step(weight[n - i] + after[n - i], step_weight[n - 1 - i])
    return np.asarray(1 / (weight + before + after))


def _worth_after_step(weight: float, step_weight: float) -> float:
    """Information of a neighbour after a step."""
    return weight * step_weight / (weight + step_weight)


def _storeys(answer: Positions, gap_s: FloatArray) -> FloatArray:
    """Return (n, s) probabilities given the whole walk (forward and backward over the chain)."""
    n, count = answer.storey_probability.shape
    likely = np.where(answer.known[:, None], answer.storey_probability, 1 / count) + 1e-6
    leave = 1 - np.exp(-gap_s / _STOREY_STAY_S)
    forward, backward = likely.copy(), np.ones_like(likely)
    for i in range(1, n):
        forward[i] = likely[i] * _after_step(forward[i - 1], leave[i - 1])
        forward[i] /= forward[i].sum()
        at = n - 1 - i
        backward[at] = _after_step(likely[at + 1] * backward[at + 1], leave[at])
        backward[at] /= backward[at].sum()
    both = forward * backward
    return np.asarray(both / both.sum(axis=1, keepdims=True))


def _after_step(probability: FloatArray, leave: float) -> FloatArray:
    """Probabilities (s,) after a step with probability ``leave`` of a change of storey."""
    return np.asarray((1 - leave) * probability + leave * probability.mean())


def _heights(answer: Positions, storey: IntArray) -> FloatArray:
    """Heights (n,) as the model gave them for scans on this storey in the walk; NaN if there are none."""
    known = np.isfinite(answer.z)
    places = ScanPlaces(answer.storeys, answer.storey[known], answer.xy[known], answer.z[known], answer.z[known])
    return np.where((storey == answer.storey) & known, answer.z, places.storey_height_m[storey])
