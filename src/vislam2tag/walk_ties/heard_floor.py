"""The radio scans of all walks of a floor, each where its walk led: which are like one another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.positioning.baselines.scan_index import Apart, NearestScans, ScanIndex, SignalDistance
from vislam2tag.positioning.scans.held_out import calibration_rows
from vislam2tag.positioning.scans.radio_scans import RadioScans, joined_scans
from vislam2tag.positioning.scans.representation import Representation, represented_levels
from vislam2tag.walk_ties.traces import WalkTrace

NEIGHBOURS = 5
EXPONENT, SHARPNESS = 2.2, 4.0
"""Power of levels before scans are compared, and of the distance between scans in their weights."""
LEAST_AWAY = 1e-3
"""Scans nearer in signal space than this count alike."""
OFFSET_ROUNDS = 3
"""So often a phone's levels are compared with those of the scans most like it: the more alike, the truer."""
MOST_LEARNED, MOST_LEVELLED = 4000, 1000
"""Scans of a floor that others are compared with, and those that tell of phones, evenly spread."""
LAGS_S = np.arange(-4.0, 8.5, 0.5)
"""Tried: how much older scans may be than their times, seconds ..."""
USUAL_LAG_S = 2.0
"""... how much that usually is ..."""
ALIKE = 0.7
"""... by scans that have others so near in signal space."""


@dataclass(frozen=True)
class HeardFloor:
    """Scans of all walks, ``n`` of them: ``walk`` (n,) number; ``place`` (n, 2), ``sigma_m`` (n,) per axis and
    ``way_m`` (n,) until then, of the walk's trace; ``learned`` (k,) rows that others are compared with.
    """

    scans: RadioScans
    walk: IntArray
    place: FloatArray
    sigma_m: FloatArray
    way_m: FloatArray
    learned: IntArray

    @classmethod
    def of(cls, traces: Sequence[WalkTrace | None], scans: Sequence[RadioScans]) -> Self:
        """Take the scans of walks while it is known where they led, at the times at which they were taken."""
        floor = cls._placed(traces, scans)
        if lag_s := floor.lag_s(traces):
            floor = cls._placed(traces, [replace(one, time_ns=one.time_ns - _ns(lag_s)) for one in scans])
        return floor._levelled()

    @classmethod
    def _placed(cls, traces: Sequence[WalkTrace | None], scans: Sequence[RadioScans]) -> Self:
        on_path = [_on_path(trace, heard) for trace, heard in zip(traces, scans, strict=True)]
        along = [trace.along(heard.time_ns) for trace, heard in zip(traces, on_path, strict=True) if trace is not None]
        columns = np.concatenate([np.empty((0, 4)), *along])
        walk = np.repeat(np.arange(len(on_path)), [len(heard) for heard in on_path])
        learned = calibration_rows(len(walk), MOST_LEARNED)
        return cls(joined_scans(on_path), walk, columns[:, :2], columns[:, 2], columns[:, 3], learned)

    def nearest(self, rows: IntArray, apart: IntArray | None = None) -> NearestScans:
        """Of scans ``rows`` those most like them among the learned ones (by row) of other walks, or of other groups
        (n,).
        """
        groups, asked = self.walk if apart is None else apart, self.scans[rows]
        kept_apart = Apart(groups[rows, None], groups[self.learned, None])
        which, away = self._index.nearest(asked, _levels(asked), NEIGHBOURS, kept_apart)
        return NearestScans(self.learned[which], away)

    @cached_property
    def _index(self) -> ScanIndex:
        some = self.scans[self.learned]
        return ScanIndex.of(some, _levels(some), SignalDistance.SORENSEN)

    def lag_s(self, traces: Sequence[WalkTrace | None]) -> float:
        """How much older scans are than their times: with it, scans like one another lie together most.

        Of walks that meet others head-on each puts what it hears late behind the place where it was.
        """
        near = self.nearest(self.learned)
        some = np.flatnonzero(near.away[:, 0] < ALIKE)
        if not len(some):
            return 0.0
        which, weight = near.which[some], scan_weights(near.away[some])
        off_m2 = np.empty((len(LAGS_S), len(some)))
        for number, lag_s in enumerate(LAGS_S.tolist()):
            place = self._places(traces, lag_s)
            off_m2[number] = (((weight[..., None] * place[which]).sum(axis=1) - place[self.learned[some]]) ** 2).sum(1)
        usual_m2 = max(float(np.median(off_m2)), 1e-6)
        cost = np.log1p(off_m2 / usual_m2).sum(axis=1) + (LAGS_S / USUAL_LAG_S) ** 2 / 2
        return float(LAGS_S[cost.argmin()])

    def _places(self, traces: Sequence[WalkTrace | None], lag_s: float) -> FloatArray:
        """(n, 2) where walks were so much before the times of their scans."""
        place = self.place.copy()
        for number, trace in enumerate(traces):
            own = np.flatnonzero(self.walk == number)
            if trace is not None and len(own):
                place[own] = trace.along(self.scans.time_ns[own] - _ns(lag_s))[:, :2]
        return place

    def _levelled(self) -> Self:
        """Take from all levels of a phone by how much it hears louder than others where scans are most alike."""
        phones, phone = np.unique(self.scans.device, return_inverse=True)
        floor = self
        for _ in range(OFFSET_ROUNDS if len(phones) > 1 else 0):
            near = floor.nearest(self.learned, phone)
            some = np.flatnonzero(near.away[:, 0] < 1)
            some = some[calibration_rows(len(some), MOST_LEVELLED)]
            louder = floor.scans[self.learned[some]].dense() - floor.scans[near.which[some, 0]].dense()
            both = np.isfinite(louder)
            own = phone[self.learned[some]]
            total = np.bincount(own, np.where(both, louder, 0.0).sum(axis=1), minlength=len(phones))
            offset = total / np.maximum(np.bincount(own, both.sum(axis=1), minlength=len(phones)), 1)
            offset *= 1 - 1 / len(phones)  # the others move, too
            rssi_dbm = floor.scans.rssi_dbm - offset[phone][floor.scans.row]
            floor = replace(floor, scans=replace(floor.scans, rssi_dbm=rssi_dbm))
        return floor


def scan_weights(away: FloatArray) -> FloatArray:
    """(q, k) how much each neighbour counts, by its distance; they add up to one where one has anything in common."""
    weight = np.where(away < 1, np.maximum(away, LEAST_AWAY) ** -SHARPNESS, 0.0)
    return np.asarray(weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-12))


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)


def _levels(scans: RadioScans) -> FloatArray:
    """(m,) of all readings, 0 to 1."""
    return np.asarray(represented_levels(scans.rssi_dbm, Representation.POSITIVE) ** EXPONENT)


def _on_path(trace: WalkTrace | None, scans: RadioScans) -> RadioScans:
    """The scans taken where a walk has a trace, in time order; those that hear nothing are left out."""
    if trace is None:
        return scans[:0]
    order = np.argsort(scans.time_ns, kind="stable")
    return scans[order[trace.knows(scans.time_ns[order]) & (scans.heard[order] > 0)]]
