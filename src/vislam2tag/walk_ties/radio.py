"""Where other walks' radio scans say that a walk was.

A scan was taken where scans like it were taken in other walks: at the mean of the places of the nearest in signal space
(Bahl and Padmanabhan 2000), the more alike the more it counts. Nothing is fitted to one walk: scans of all walks lie in
one index, and those of the walk itself are passed over. How far such fixes are off is estimated from all walks at once
(:mod:`~vislam2tag.walk_ties.fix_errors`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from scipy.spatial import KDTree

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import PlaceTies
from vislam2tag.positioning.baselines.scan_index import Apart, NearestScans, ScanIndex, SignalDistance
from vislam2tag.positioning.scans.held_out import calibration_rows
from vislam2tag.positioning.scans.radio_scans import RadioScans, joined_scans
from vislam2tag.positioning.scans.representation import Representation, represented_levels
from vislam2tag.walk_ties.fix_errors import Fixes, promised, radio_errors
from vislam2tag.walk_ties.traces import WalkTrace

NEIGHBOURS = 5
EXPONENT, SHARPNESS = 2.2, 4.0
"""Power of levels before scans are compared, and of the distance between scans in their weights."""
LEAST_AWAY = 1e-3
"""Scans nearer in signal space than this count alike."""
OFFSET_ROUNDS = 3
"""So often a walk's levels are compared with those of the scans most like it: the more alike, the truer."""
SCAN_M = 1.0
"""How near scans place one another were their labels true: labels better than that count little more."""
GAP_M = 3.0
"""Where no other walk came nearer than this, none can say that a walk was there."""
SPREAD_SHARE, AWAY_M2, LEAST_M2 = 0.25, 0.4, 0.01
"""What a fix's variance is expected to follow, up to a factor that is estimated: this share of the variance of places
learned from, so much where the nearest scan is as far as usual, the squared distance from other walks, and a little."""
DOUBTED = 4.0
"""By so much the variance is greater: what walks have in common besides landmarks and radio is not told
(docs/results/walk-ties.md)."""
LEAST_PROMISE = 0.05
"""Ties that lower the stated sigma of a walk's path by a smaller share are left out: as often as not they harm."""
FEWEST_FIXES, MOST_LEARNED, MOST_ASKED, MOST_TIES = 5, 4000, 256, 64
"""Scans of a walk that are fewer tie nothing; most of a floor that are learned, of a walk that are asked, and most that
a walk is told: neighbouring fixes are averaged."""


def radio_ties(traces: Sequence[WalkTrace | None], scans: Sequence[RadioScans]) -> list[PlaceTies | None]:
    """Return for each walk of a floor where the others' scans put it; None where they tell nothing that helps.

    ``scans`` of each walk have times (``time_ns``, boot clock).
    """
    fixes = walk_fixes(traces, scans)
    told = [one for one in fixes if one is not None]
    if not told:
        return [None] * len(fixes)
    radio = radio_errors(told)
    return [None if one is None else _ties(one, DOUBTED * one.covariance(radio)) for one in fixes]


def walk_fixes(traces: Sequence[WalkTrace | None], scans: Sequence[RadioScans]) -> list[Fixes | None]:
    """Put each walk's scans where the others took scans like them; None where these are too few."""
    if sum(trace is not None for trace in traces) < 2:
        return [None] * len(traces)
    floor = _HeardFloor.of(traces, scans)
    learned = calibration_rows(len(floor.walk), MOST_LEARNED)
    if len(np.unique(floor.walk[learned])) < 2:
        return [None] * len(traces)
    floor = floor.levelled(learned)
    index = floor.index(learned)
    asked = [_ask(floor, index, learned, number) for number in range(len(traces))]
    away = [one.near.away[:, 0] for one in asked if one is not None]
    usual_away = float(np.median(np.concatenate(away))) if away else 1.0
    return [None if one is None else _fixes(floor, one, usual_away) for one in asked]


class _Asked(NamedTuple):
    """Scans ``rows`` (q,) of a walk, those of other walks that are ``near``, and how far the others kept away (q,)."""

    rows: IntArray
    near: NearestScans
    gap_m: FloatArray


@dataclass(frozen=True)
class _HeardFloor:
    """Scans of all walks, ``n`` of them: ``walk`` (n,) number; ``place`` (n, 2), ``sigma_m`` (n,) per axis and
    ``way_m`` (n,) until then, of the walk's trace.
    """

    scans: RadioScans
    walk: IntArray
    place: FloatArray
    sigma_m: FloatArray
    way_m: FloatArray

    @classmethod
    def of(cls, traces: Sequence[WalkTrace | None], scans: Sequence[RadioScans]) -> Self:
        """Take the scans of walks while they have a trace."""
        on_path = [_on_path(trace, heard) for trace, heard in zip(traces, scans, strict=True)]
        along = [
            _along(trace, heard.time_ns) for trace, heard in zip(traces, on_path, strict=True) if trace is not None
        ]
        columns = np.concatenate([np.empty((0, 4)), *along])
        walk = np.repeat(np.arange(len(on_path)), [len(heard) for heard in on_path])
        return cls(joined_scans(on_path), walk, columns[:, :2], columns[:, 2], columns[:, 3])

    def index(self, rows: IntArray) -> ScanIndex:
        """An index of the scans ``rows``."""
        some = self.scans[rows]
        return ScanIndex.of(some, _levels(some), SignalDistance.SORENSEN)

    def nearest(self, index: ScanIndex, learned: IntArray, rows: IntArray) -> NearestScans:
        """Of scans ``rows`` those most like them among the ``learned`` ones of other walks."""
        asked, apart = self.scans[rows], Apart(self.walk[rows, None], self.walk[learned, None])
        return index.nearest(asked, _levels(asked), NEIGHBOURS, apart)

    def levelled(self, learned: IntArray) -> _HeardFloor:
        """Take from all levels of a walk by how much it hears louder than others where scans are most alike."""
        floor = self
        for _ in range(OFFSET_ROUNDS):
            near = floor.nearest(floor.index(learned), learned, learned)
            level = floor.scans[learned].dense()
            some = np.flatnonzero(np.isfinite(near.away[:, 0]))
            louder = level[some] - level[near.which[some, 0]]
            both = np.isfinite(louder)
            walk = floor.walk[learned][some]
            total = np.bincount(walk, np.where(both, louder, 0.0).sum(axis=1), minlength=self.walk.max() + 1)
            offset = total / np.maximum(np.bincount(walk, both.sum(axis=1), minlength=len(total)), 1)
            rssi_dbm = floor.scans.rssi_dbm - offset[floor.walk][floor.scans.row]
            floor = replace(floor, scans=replace(floor.scans, rssi_dbm=rssi_dbm))
        return floor


def _ask(floor: _HeardFloor, index: ScanIndex, learned: IntArray, number: int) -> _Asked | None:
    """Look for scans like those of a walk where others were; None where there are too few."""
    rows, others = np.flatnonzero(floor.walk == number), learned[floor.walk[learned] != number]
    rows = rows[calibration_rows(len(rows), MOST_ASKED)]
    if not len(rows) or not len(others):
        return None
    near = floor.nearest(index, learned, rows)
    gap_m = np.asarray(KDTree(floor.place[others]).query(floor.place[rows])[0])
    known = np.flatnonzero((near.away[:, 0] < 1) & (gap_m < GAP_M))
    if len(known) < FEWEST_FIXES:
        return None
    away = np.asarray(np.maximum(near.away[known], LEAST_AWAY))
    return _Asked(rows[known], NearestScans(learned[near.which[known]], away), gap_m[known])


def _fixes(floor: _HeardFloor, asked: _Asked, usual_away: float) -> Fixes:
    """Place scans at the mean of the places of those like them."""
    rows, (which, away), gap_m = asked
    place, sigma_m = floor.place[which], floor.sigma_m[which]
    weight = np.where(away < 1, away**-SHARPNESS, 0.0) / (SCAN_M**2 + sigma_m**2)
    weight /= weight.sum(axis=1, keepdims=True)
    position = (weight[..., None] * place).sum(axis=1)
    spread_m2 = (weight * ((place - position[:, None]) ** 2).sum(axis=2)).sum(axis=1) / 2
    unlike_m2 = AWAY_M2 * (away[:, 0] / max(usual_away, LEAST_AWAY)) ** 2
    return Fixes(
        time_ns=floor.scans.time_ns[rows],
        position=position,
        path=floor.place[rows],
        way_m=floor.way_m[rows],
        path_m=floor.sigma_m[rows],
        label_m=(weight * sigma_m).sum(axis=1),
        unit_m=np.sqrt(SPREAD_SHARE * spread_m2 + unlike_m2 + gap_m**2 + LEAST_M2),
    )


def _ties(fixes: Fixes, covariance: FloatArray) -> PlaceTies | None:
    """Fixes with a covariance (n, n) of each axis; None where they promise little.

    What is averaged where there are many is how far the path is off.
    """
    if promised(fixes, covariance) < LEAST_PROMISE:
        return None
    group = np.arange(len(fixes)) * min(MOST_TIES, len(fixes)) // len(fixes)
    mean = (group == np.arange(group[-1] + 1)[:, None]).astype(np.float64)
    mean /= mean.sum(axis=1, keepdims=True)
    middle = np.flatnonzero(np.diff(group, prepend=-1)) + np.bincount(group) // 2
    return PlaceTies(
        time_ns=fixes.time_ns[middle],
        position_bcs=fixes.path[middle] + mean @ (fixes.position - fixes.path),
        covariance_m2=np.kron(mean @ covariance @ mean.T, np.eye(2)),
    )


def _levels(scans: RadioScans) -> FloatArray:
    """(m,) of all readings, 0 to 1."""
    return np.asarray(represented_levels(scans.rssi_dbm, Representation.POSITIVE) ** EXPONENT)


def _on_path(trace: WalkTrace | None, scans: RadioScans) -> RadioScans:
    """The scans taken where a walk has a trace, in time order; those that hear nothing are left out."""
    if trace is None:
        return scans[:0]
    order = np.argsort(scans.time_ns, kind="stable")
    time_ns = scans.time_ns[order]
    within = (time_ns >= trace.time_ns[0]) & (time_ns <= trace.time_ns[-1]) & (scans.heard[order] > 0)
    return scans[order[within]]


def _along(trace: WalkTrace, time_ns: IntArray) -> FloatArray:
    """(n, 4) x, y, their sigma and the way until then at moments (n,), metres."""
    variance = np.trace(trace.covariance_bcs, axis1=1, axis2=2) / 2
    columns = np.column_stack((trace.position_bcs, np.sqrt(variance), trace.way_m))
    known_s, at_s = (trace.time_ns - trace.time_ns[0]) * 1e-9, (time_ns - trace.time_ns[0]) * 1e-9
    return np.column_stack([np.interp(at_s, known_s, column) for column in columns.T])
