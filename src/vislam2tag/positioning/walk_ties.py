"""Radio constraints between sessions: where other walks' scans say that a walk was, and how far such fixes are off.

A scan was taken where scans like it were taken in other walks: at the mean of the places of the nearest in signal space
(Bahl and Padmanabhan 2000), the more alike the more it counts. Nothing is fitted to one walk: scans of all walks lie in
one index, and those of the walk itself are passed over.

A fix differs from the walk's own path by what matching radio scans is off, by what the labels that it was learned from
are off, and by what the path itself is off. The last two are stated; of the first, size and correlation are found for
all walks of a floor at once by maximum likelihood (variance components; Searle et al. 1992).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh
from scipy.spatial import KDTree

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import PlaceTies
from vislam2tag.positioning.heard_floor import LEAST_AWAY, HeardFloor, scan_weights
from vislam2tag.positioning.places import calibration_rows
from vislam2tag.positioning.radio_scans import RadioScans, rows_of
from vislam2tag.positioning.signal_distance import NearestScans
from vislam2tag.positioning.walk_traces import WalkTrace

PATH_REACH_M = 25.0
"""Errors of paths are correlated by 1/e over such a way, and those of labels over such a distance."""
SIZES = np.geomspace(0.3, 21.0, 35)
ALIKE = ((0.0, 1.0), *product((0.2, 0.4, 0.6, 0.8, 0.95), (2.0, 5.0, 10.0, 20.0, 40.0)))
"""Tried: errors of matching in units of what is expected; the share of their variance that is alike, and its reach."""
FREEDOM_SHARE = 0.5
"""A walk's path may be farther off than it states: Student's t, of so many degrees of freedom a number. Fewer would
leave each walk a size of its own, so that how alike errors are would say how large they are."""
USUAL_SIZE, USUAL_COUNTS = 1.5, 20.0
"""Before anything is seen errors are taken to be of this size, which counts as much as so many fixes."""
ESTIMATED_WITH, MOST_FIXES = 24, 64
"""Most walks that the size of errors is estimated from, and most fixes of each, evenly spread."""


class MatchErrors(NamedTuple):
    """Size of errors of matching in units of what is expected; the share of their variance that is alike; its reach,
    m.
    """

    size: float
    share: float
    reach_m: float


@dataclass(frozen=True)
class Fixes:
    """Where other walks' scans put ``n`` scans of a walk.

    ``time_ns`` (n,) boot clock, in time order; ``position`` (n, 2) and ``path`` (n, 2), metres: where the others put
    it, and its own path; ``way_m`` (n,) walked until then; ``path_m`` (n,) and ``label_m`` (n,): sigmas per axis of its
    own path and of the places learned from; ``unit_m`` (n,) what matching is expected to be off by, up to a factor.
    """

    time_ns: IntArray
    position: FloatArray
    path: FloatArray
    way_m: FloatArray
    path_m: FloatArray
    label_m: FloatArray
    unit_m: FloatArray

    def __len__(self) -> int:
        return len(self.time_ns)

    def __getitem__(self, rows: IntArray) -> Fixes:
        """Only those of some rows (k,)."""
        return rows_of(self, rows)

    def covariance(self, errors: MatchErrors) -> FloatArray:
        """(n, n) of each axis of the fixes, m^2."""
        return errors.size**2 * self.match_covariance(errors.share, errors.reach_m) + self.label_covariance()

    def match_covariance(self, share: float, reach_m: float) -> FloatArray:
        """(n, n) of matching's errors of size one of each axis, m^2."""
        alike = share * self._fading(reach_m) + (1 - share) * np.eye(len(self))
        return np.asarray(np.outer(self.unit_m, self.unit_m) * alike)

    def label_covariance(self) -> FloatArray:
        """(n, n) of what the places learned from are off, of each axis, m^2.

        Those nearby are off alike, of whichever walk they are.
        """
        return np.asarray(np.outer(self.label_m, self.label_m) * self._fading(PATH_REACH_M))

    def path_covariance(self) -> FloatArray:
        """(n, n) of each axis of the walk's own path, m^2."""
        fading = np.exp(-np.abs(self.way_m[:, None] - self.way_m) / PATH_REACH_M)
        return np.asarray(np.outer(self.path_m, self.path_m) * fading)

    def _fading(self, reach_m: float) -> FloatArray:
        """(n, n) correlation that falls with the distance."""
        apart_m = np.hypot(*(self.path[:, None] - self.path).transpose(2, 0, 1))
        return np.asarray(np.exp(-apart_m / reach_m))


def match_errors(fixes: Sequence[Fixes]) -> MatchErrors:
    """Return under which errors of matching the fixes of all walks are likeliest; there is at least one walk."""
    rows = calibration_rows(len(fixes), ESTIMATED_WITH) if len(fixes) > 1 else (0,)
    some = [_thinned(fixes[row]) for row in rows]
    known = [one.path_covariance() + one.label_covariance() for one in some]
    likelihood = np.array(
        [sum(_log_likelihoods(one, part, *alike) for one, part in zip(some, known, strict=True)) for alike in ALIKE]
    )
    likelihood = likelihood - USUAL_COUNTS * (2 * np.log(SIZES) + (USUAL_SIZE / SIZES) ** 2)
    alike, size = np.unravel_index(likelihood.argmax(), likelihood.shape)
    return MatchErrors(float(SIZES[size]), *ALIKE[int(alike)])


def promised(fixes: Fixes, covariance: FloatArray) -> float:
    """By which share fixes with a covariance (n, n) of each axis would lower the stated sigma of the walk's own path at
    them.
    """
    path = fixes.path_covariance()
    gained = np.sum(path * cho_solve(cho_factor(path + covariance, lower=True), path))
    return float(1 - np.sqrt(max(1 - gained / np.trace(path), 0.0)))


def _thinned(fixes: Fixes) -> Fixes:
    return fixes[calibration_rows(len(fixes), MOST_FIXES)] if len(fixes) > MOST_FIXES else fixes


def _log_likelihoods(fixes: Fixes, known: FloatArray, share: float, reach_m: float) -> FloatArray:
    """(s,) of what fixes differ from the path, by each of the :data:`SIZES`; up to a constant.

    ``known`` (n, n) is the covariance of all that is not matching's; both covariances are made diagonal at once.
    """
    matching = fixes.match_covariance(share, reach_m)
    variance, vectors = eigh(known, matching)
    off = vectors.T @ (fixes.position - fixes.path)
    whole = variance[:, None] + SIZES**2
    spread = float(np.log(np.linalg.eigvalsh(matching)).sum()) + np.log(whole).sum(axis=0)
    missed = ((off**2).sum(axis=1)[:, None] / whole).sum(axis=0)
    freedom = FREEDOM_SHARE * off.size
    return np.asarray(-(off.shape[1] * spread + (freedom + off.size) * np.log1p(missed / freedom)) / 2)


SCAN_M = 1.0
"""How near scans place one another were their labels true: labels better than that count little more."""
GAP_M = 3.0
"""Where no other walk came closer than this, none can say that a walk was there."""
SPREAD_SHARE, AWAY_M2, LEAST_M2 = 0.25, 0.4, 0.01
"""What a fix's variance is expected to follow, up to a factor that is estimated: this share of the variance of places
learned from, so much where the nearest scan is as far as usual, the squared distance from other walks, and a little."""
DOUBTED = 4.0
"""By so much the variance is greater: what walks have in common besides landmarks and radio is not told
(docs/results/how-good.md)."""
LEAST_PROMISE = 0.05
"""Ties that lower the stated sigma of a walk's path by a smaller share are left out: as often as not they harm."""
FEWEST_FIXES, MOST_ASKED, MOST_TIES = 5, 256, 64
"""Scans of a walk that are fewer tie nothing; most of a walk that are asked, and most that it is told: neighbouring
fixes are averaged."""


def radio_ties(traces: Sequence[WalkTrace | None], scans: Sequence[RadioScans]) -> list[PlaceTies | None]:
    """Return for each walk of a floor where the others' scans put it; None if they tell nothing that helps.

    ``scans`` of each walk have times (``time_ns``, boot clock), and the phones that took them where they are known.
    """
    fixes = walk_fixes(traces, scans)
    told = [one for one in fixes if one is not None]
    if not told:
        return [None] * len(fixes)
    radio = match_errors(told)
    return [None if one is None else _ties(one, DOUBTED * one.covariance(radio)) for one in fixes]


def walk_fixes(traces: Sequence[WalkTrace | None], scans: Sequence[RadioScans]) -> list[Fixes | None]:
    """Put each walk's scans where the others took scans like them; None if these are too few."""
    if sum(trace is not None for trace in traces) < 2:
        return [None] * len(traces)
    floor = HeardFloor.of(traces, scans)
    asked = [_ask(floor, number) for number in range(len(traces))]
    away = [one[1].away[:, 0] for one in asked if one is not None]
    usual_away = float(np.median(np.concatenate(away))) if away else 1.0
    return [None if one is None else _fixes(floor, one, usual_away) for one in asked]


def _ask(floor: HeardFloor, number: int) -> tuple[IntArray, NearestScans, FloatArray] | None:
    """Look for scans like those of a walk where others were; None if there are too few.

    Returns scans (q,) of the walk, those of other walks that are near, and how far the others kept away (q,), metres.
    """
    rows, others = np.flatnonzero(floor.walk == number), floor.learned[floor.walk[floor.learned] != number]
    rows = rows[calibration_rows(len(rows), MOST_ASKED)]
    if not len(rows) or not len(others):
        return None
    which, away = floor.nearest(rows)
    gap_m = np.asarray(KDTree(floor.place[others]).query(floor.place[rows])[0])
    known = np.flatnonzero((away[:, 0] < 1) & (gap_m < GAP_M))
    if len(known) < FEWEST_FIXES:
        return None
    return rows[known], NearestScans(which[known], away[known]), gap_m[known]


def _fixes(floor: HeardFloor, asked: tuple[IntArray, NearestScans, FloatArray], usual_away: float) -> Fixes:
    """Place scans at the mean of the places of those like them."""
    rows, (which, away), gap_m = asked
    place, sigma_m = floor.place[which], floor.sigma_m[which]
    weight = scan_weights(away) / (SCAN_M**2 + sigma_m**2)
    weight /= weight.sum(axis=1, keepdims=True)
    position = (weight[..., None] * place).sum(axis=1)
    spread_m2 = (weight * ((place - position[:, None]) ** 2).sum(axis=2)).sum(axis=1) / 2
    unlike_m2 = AWAY_M2 * (np.maximum(away[:, 0], LEAST_AWAY) / max(usual_away, LEAST_AWAY)) ** 2
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
    """Fixes with a covariance (n, n) of each axis; None if they promise little.

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
