"""How far one recorder's clock is ahead of another's, by the levels of access points that both heard on one walk."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.clock_alignment import ClockAlignment

Heard: TypeAlias = Mapping[str, tuple[IntArray, FloatArray]]
"""Times (n,), ns, sorted, and levels (n,), dBm, by BSSID."""
_HEARD_STEP_S = 0.5
_NEAR_S = 1.5
"""Two readings of one access point are compared if they are so close in time."""
_GREATEST_DB = 12.0
"""Differences count up to this: an access point that fades tells no more than that."""
_LEAST_PAIRS = 40
_LEAST_CLEAR = 1.25
"""How much worse than the best offset the best of the others must be."""
_APART_S = 10.0
_ALIKE = 0.1
"""Offsets that are worse than the best by up to this share of how much worse the others are fit as well as it."""
_COINCIDE_NS = 10_000_000
_MOST_OFFSETS = 40_000
_PARTS = 5
"""The walk is cut in so many parts; how their best offsets scatter gives the sigma."""


def align_by_levels(theirs: Heard, ours: Heard) -> ClockAlignment:
    """Align two clocks by access points that both heard; levels of two devices may differ by a constant."""
    shared = [bssid for bssid in theirs if bssid in ours]
    if not shared:
        return ClockAlignment(None, figures="no access point was heard by both")
    first = min(int(theirs[b][0][0]) for b in shared) - max(int(ours[b][0][-1]) for b in shared)
    last = max(int(theirs[b][0][-1]) for b in shared) - min(int(ours[b][0][0]) for b in shared)
    step_ns = int(_HEARD_STEP_S * 1e9)
    if not 0 < last - first <= _MOST_OFFSETS * step_ns:
        return ClockAlignment(None, figures=f"{len(shared)} access points in common, in times too far apart")
    offsets = np.arange(first, last, step_ns)
    costs = np.array([_cost(theirs, ours, shared, int(offset)) for offset in offsets])
    best = int(np.argmin(costs))
    others = costs[np.abs(offsets - offsets[best]) > _APART_S * 1e9]
    other = float(others.min(initial=np.inf))
    figures = f"{len(shared)} access points in common, {costs[best]:.1f} dB apart, {other:.1f} at the best other offset"
    if not np.isfinite(costs[best]) or other < _LEAST_CLEAR * costs[best]:
        return ClockAlignment(None, figures=figures)
    # Scans are seconds apart, so that a stretch of offsets pairs the same ones and fits alike.
    alike = (costs <= costs[best] + _ALIKE * (min(other, _GREATEST_DB) - costs[best])) & (
        np.abs(offsets - offsets[best]) <= _APART_S * 1e9
    )
    offset_ns, width_s = int(offsets[alike].mean()), float(np.ptp(offsets[alike])) * 1e-9
    coinciding = _coinciding(theirs, ours, shared, offset_ns)
    if coinciding is not None:
        return ClockAlignment(coinciding, _COINCIDE_NS * 1e-9, figures=figures)
    sigma_s = np.hypot(width_s / np.sqrt(12), _scatter_s(theirs, ours, shared, offset_ns))
    return ClockAlignment(offset_ns, float(sigma_s), figures=figures)


def _coinciding(theirs: Heard, ours: Heard, shared: Sequence[str], offset_ns: int) -> int | None:
    """The offset at which most of those readings coincide that both clocks dated, to 10 ms; None where few do."""
    apart = []
    for bssid in shared:
        (their_ns, their_dbm), (our_ns, our_dbm) = theirs[bssid], ours[bssid]
        differences = (their_ns - offset_ns)[:, None] - our_ns
        near = (np.abs(differences) <= _NEAR_S * 1e9) & (their_dbm[:, None] == our_dbm)
        apart.append(differences[near])
    found = np.round(np.concatenate(apart) / _COINCIDE_NS).astype(np.int64)
    values, counts = np.unique(found, return_counts=True)
    if not len(values) or counts.max() < _LEAST_PAIRS // 2:
        return None
    return offset_ns + int(values[np.argmax(counts)]) * _COINCIDE_NS


def _scatter_s(theirs: Heard, ours: Heard, shared: Sequence[str], offset_ns: int) -> float:
    """Sigma of an offset, seconds: how the best offsets of parts of the walk scatter about it."""
    start, end = min(ours[b][0][0] for b in shared), max(ours[b][0][-1] for b in shared)
    edges = np.linspace(start, end + 1, _PARTS + 1)
    tried = offset_ns + (np.arange(-_APART_S, _APART_S, _HEARD_STEP_S) * 1e9).astype(np.int64)
    best = []
    for left, right in pairwise(edges.tolist()):
        part = {b: _between(ours[b], left, right) for b in shared}
        costs = [_cost(theirs, part, shared, int(offset)) for offset in tried]
        if np.isfinite(min(costs)):
            best.append(float(tried[int(np.argmin(costs))] - offset_ns) * 1e-9)
    scatter_s = float(np.sqrt(np.mean(np.square(best)) / len(best))) if len(best) > 1 else _APART_S
    return max(scatter_s, _HEARD_STEP_S / 2)


def _between(heard: tuple[IntArray, FloatArray], left: float, right: float) -> tuple[IntArray, FloatArray]:
    inside = (heard[0] >= left) & (heard[0] < right)
    return heard[0][inside], heard[1][inside]


def _cost(theirs: Heard, ours: Heard, shared: Sequence[str], offset_ns: int) -> float:
    """Mean difference of levels heard at the same time, dB, were their clock ahead by this; infinite for few."""
    found = [np.empty(0)]
    for bssid in shared:
        (their_ns, their_dbm), (our_ns, our_dbm) = theirs[bssid], ours[bssid]
        if not len(our_ns):
            continue
        wanted = their_ns - offset_ns
        after = np.searchsorted(our_ns, wanted).clip(1, max(len(our_ns) - 1, 1)).clip(max=len(our_ns) - 1)
        before = np.maximum(after - 1, 0)
        nearer = np.where(np.abs(our_ns[after] - wanted) < np.abs(our_ns[before] - wanted), after, before)
        near = np.abs(our_ns[nearer] - wanted) <= _NEAR_S * 1e9
        found.append((their_dbm - our_dbm[nearer])[near])
    differences = np.concatenate(found)
    if len(differences) < _LEAST_PAIRS:
        return np.inf
    return float(np.minimum(np.abs(differences - np.median(differences)), _GREATEST_DB).mean())
