"""The radio scans of all walks of a floor, at their places on the walks, and which of them are similar."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np

from vislam2tag.common.error_statistics import draws, multiplicities
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.positioning.places import calibration_rows
from vislam2tag.positioning.radio_scans import RadioScans, Representation, joined_scans, represented_levels
from vislam2tag.positioning.signal_distance import Apart, NearestScans, ScanIndex, SignalDistance
from vislam2tag.positioning.walk_traces import WalkTrace

NEIGHBOURS = 5
EXPONENT, SHARPNESS = 2.2, 4.0
"""Exponent of levels before scans are compared, and of the distance between scans in their weights."""
LEAST_AWAY = 1e-3
"""Scans with a smaller distance in signal space have the same weight."""
OFFSET_ROUNDS = 3
"""Rounds of comparing a phone's levels with those of the most similar scans."""
MOST_LEARNED, MOST_LEVELLED = 4000, 1000
"""Largest number of scans of a floor for comparison, and for offsets of phones, evenly spread."""
LAG_STEP_S, LAG_ROUNDS = 0.5, 2
LAGS_S = np.arange(-4.0, 8.5, LAG_STEP_S)
"""Candidates for the age of scans at their times, seconds ..."""
USUAL_LAG_S = 2.0
"""... its usual value ..."""
ALIKE = 0.7
"""... estimated from scans with others this close in signal space."""


class ScanLag(NamedTuple):
    """Age of scans at their times, and its standard error, seconds."""

    seconds: float
    sigma_s: float


@dataclass(frozen=True)
class HeardFloor:
    """Scans of all walks, ``n`` of them: ``walk`` (n,) number; ``place`` (n, 2), ``sigma_m`` (n,) per axis and
    ``way_m`` (n,) distance walked, from the walk's trace; ``learned`` (k,) rows for comparison.
    """

    scans: RadioScans
    walk: IntArray
    place: FloatArray
    sigma_m: FloatArray
    way_m: FloatArray
    learned: IntArray

    @classmethod
    def of(cls, traces: Sequence[WalkTrace | None], scans: Sequence[RadioScans]) -> Self:
        """Return the scans of walks while their paths are known, at the times at which they were taken."""
        floor = cls.as_logged(traces, scans)
        lags = floor.lags(traces)
        if any(lag.seconds for lag in lags.values()):
            return cls.as_logged(traces, [_taken_before(one, lags) for one in scans])
        return floor

    @classmethod
    def as_logged(cls, traces: Sequence[WalkTrace | None], scans: Sequence[RadioScans]) -> Self:
        """Return the scans of walks while their paths are known, at their logged times."""
        on_path = [_on_path(trace, heard) for trace, heard in zip(traces, scans, strict=True)]
        along = [trace.along(heard.time_ns) for trace, heard in zip(traces, on_path, strict=True) if trace is not None]
        columns = np.concatenate([np.empty((0, 4)), *along])
        walk = np.repeat(np.arange(len(on_path)), [len(heard) for heard in on_path])
        learned = calibration_rows(len(walk), MOST_LEARNED)
        return cls(joined_scans(on_path), walk, columns[:, :2], columns[:, 2], columns[:, 3], learned)._levelled()

    def nearest(self, rows: IntArray, apart: IntArray | None = None) -> NearestScans:
        """Return for scans ``rows`` the most similar learned ones (by row) of other walks, or of other groups (n,)."""
        groups, asked = self.walk if apart is None else apart, self.scans[rows]
        kept_apart = Apart(groups[rows, None], groups[self.learned, None])
        which, away = self._index.nearest(asked, _levels(asked), NEIGHBOURS, kept_apart)
        return NearestScans(self.learned[which], away)

    @cached_property
    def _index(self) -> ScanIndex:
        some = self.scans[self.learned]
        return ScanIndex.of(some, _levels(some), SignalDistance.SORENSEN)

    def lags(self, traces: Sequence[WalkTrace | None]) -> dict[str, ScanLag]:
        """Age of the scans of each phone at their times: the one that brings similar scans closest together.

        If two walks meet head-on, each puts a late scan behind the place where it was taken. The standard error is
        estimated by bootstrap over walks.
        """
        near = self.nearest(self.learned)
        alike = np.flatnonzero(near.away[:, 0] < ALIKE)
        rows, which, weight = self.learned[alike], near.which[alike], scan_weights(near.away[alike])
        walks, walk = np.unique(self.walk[rows], return_inverse=True)
        if len(walks) < 2:
            return {}
        times = np.vstack((np.ones(len(walks)), multiplicities(draws(len(walks)))))
        place = self.place

        def off_m2(place: FloatArray) -> FloatArray:
            return np.asarray((((weight[..., None] * place[which]).sum(axis=1) - place[rows]) ** 2).sum(axis=1))

        usual_m2 = max(float(np.median(off_m2(place))), 1e-6)
        found: dict[str, ScanLag] = {}
        for phone in np.unique(self.scans.device).tolist() * LAG_ROUNDS:
            of_phone = np.unique(self.walk[self.scans.device == phone]).tolist()
            own = [self.learned[self.walk[self.learned] == number] for number in of_phone]
            by_walk = np.empty((len(LAGS_S), len(walks)))
            for number, lag_s in enumerate(LAGS_S.tolist()):
                off = off_m2(self._moved(place, own, traces, lag_s))
                by_walk[number] = np.bincount(walk, np.log1p(off / usual_m2), len(walks))
            cost = by_walk @ times.T + ((LAGS_S / USUAL_LAG_S) ** 2 / 2)[:, None]
            lags_s = LAGS_S[cost.argmin(axis=0)]
            found[phone] = ScanLag(float(lags_s[0]), float(np.hypot(lags_s[1:].std(), LAG_STEP_S / np.sqrt(12))))
            place = self._moved(place, own, traces, found[phone].seconds)
        return found

    def _moved(
        self, place: FloatArray, rows: Sequence[IntArray], traces: Sequence[WalkTrace | None], lag_s: float
    ) -> FloatArray:
        """Places (n, 2) if the scans of some walks, each one's ``rows``, were taken this long before their times."""
        moved = place.copy()
        for own in rows:
            trace = traces[self.walk[own[0]]] if len(own) else None
            if trace is not None:
                moved[own] = trace.along(self.scans.time_ns[own] - _ns(lag_s))[:, :2]
        return moved

    def _levelled(self) -> Self:
        """Subtract each phone's offset from its levels, estimated from the most similar scans of others."""
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
            offset *= 1 - 1 / len(phones)  # the other phones change, too
            rssi_dbm = floor.scans.rssi_dbm - offset[phone][floor.scans.row]
            floor = replace(floor, scans=replace(floor.scans, rssi_dbm=rssi_dbm))
        return floor


def scan_weights(away: FloatArray) -> FloatArray:
    """(q, k) weight of each neighbour, from its distance; sums are one if any neighbour has anything in common."""
    weight = np.where(away < 1, np.maximum(away, LEAST_AWAY) ** -SHARPNESS, 0.0)
    return np.asarray(weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-12))


def _taken_before(scans: RadioScans, lags: Mapping[str, ScanLag]) -> RadioScans:
    """The scans of one walk at the times at which they were taken."""
    lag = lags.get(str(scans.device[0])) if len(scans) else None
    return scans if lag is None else replace(scans, time_ns=scans.time_ns - _ns(lag.seconds))


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)


def _levels(scans: RadioScans) -> FloatArray:
    """(m,) levels of all readings, 0 to 1."""
    return np.asarray(represented_levels(scans.rssi_dbm, Representation.POSITIVE) ** EXPONENT)


def _on_path(trace: WalkTrace | None, scans: RadioScans) -> RadioScans:
    """The scans at places where a walk has a trace, in time order; scans that hear nothing are dropped."""
    if trace is None:
        return scans[:0]
    order = np.argsort(scans.time_ns, kind="stable")
    return scans[order[trace.knows(scans.time_ns[order]) & (scans.heard[order] > 0)]]
