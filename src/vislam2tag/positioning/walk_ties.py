"""Radio constraints between sessions: fixes of a walk from other walks' scans, and the errors of these fixes.

A scan gets the weighted mean of the places of the nearest scans of other walks in signal space (Bahl and Padmanabhan
2000); more similar scans have larger weights. Nothing is fitted to a single walk: scans of all walks are in one index,
and those of the walk itself are skipped.

A fix differs from the walk's own path by the error of matching radio scans, by the errors of the other walks' labels,
and by the error of the path itself. The last two are known. Size and correlation of the first are estimated for all
walks of a floor at once, by maximum likelihood (variance components; Searle et al. 1992).
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
"""Correlation length (1/e) of the errors of paths, along the path, and of labels, by distance."""
SIZES = np.geomspace(0.3, 21.0, 35)
ALIKE = ((0.0, 1.0), *product((0.2, 0.4, 0.6, 0.8, 0.95), (2.0, 5.0, 10.0, 20.0, 40.0)))
"""Candidates for the size of matching errors in units of the expected size, their correlated share, and its reach."""
FREEDOM_SHARE = 0.5
"""Degrees of freedom of Student's t, as a share of the numbers, because a walk's path may have larger errors than it
states. Fewer would give each walk its own size, and the correlation of errors would then imply their size."""
USUAL_SIZE, USUAL_COUNTS = 1.5, 20.0
"""Prior size of errors, and its weight in fixes."""
ESTIMATED_WITH, MOST_FIXES = 24, 64
"""Largest number of walks for estimating the size of errors, and of fixes of each, evenly spread."""


class MatchErrors(NamedTuple):
    """Size of matching errors in units of the expected size, correlated share of their variance, and its reach (m)."""

    size: float
    share: float
    reach_m: float


@dataclass(frozen=True)
class Fixes:
    """Fixes of ``n`` scans of a walk from other walks' scans.

    ``time_ns`` (n,) boot clock, in time order. ``position`` (n, 2) is the fix and ``path`` (n, 2) the walk's own path,
    metres. ``way_m`` (n,) is the distance walked until then. ``path_m`` (n,) and ``label_m`` (n,) are sigmas per axis
    of its own path and of the other walks' labels. ``unit_m`` (n,) is the expected matching error, up to a factor.
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
        """Return some rows (k,)."""
        return rows_of(self, rows)

    def covariance(self, errors: MatchErrors) -> FloatArray:
        """(n, n) covariance of the fixes in each axis, m^2."""
        return errors.size**2 * self.match_covariance(errors.share, errors.reach_m) + self.label_covariance()

    def match_covariance(self, share: float, reach_m: float) -> FloatArray:
        """(n, n) covariance of matching errors of size one in each axis, m^2."""
        alike = share * self._fading(reach_m) + (1 - share) * np.eye(len(self))
        return np.asarray(np.outer(self.unit_m, self.unit_m) * alike)

    def label_covariance(self) -> FloatArray:
        """(n, n) covariance of the errors of the other walks' labels in each axis, m^2.

        Errors of nearby labels are correlated, whatever their walk.
        """
        return np.asarray(np.outer(self.label_m, self.label_m) * self._fading(PATH_REACH_M))

    def path_covariance(self) -> FloatArray:
        """(n, n) covariance of the walk's own path in each axis, m^2."""
        fading = np.exp(-np.abs(self.way_m[:, None] - self.way_m) / PATH_REACH_M)
        return np.asarray(np.outer(self.path_m, self.path_m) * fading)

    def _fading(self, reach_m: float) -> FloatArray:
        """(n, n) correlation that decreases with the distance."""
        apart_m = np.hypot(*(self.path[:, None] - self.path).transpose(2, 0, 1))
        return np.asarray(np.exp(-apart_m / reach_m))


def match_errors(fixes: Sequence[Fixes]) -> MatchErrors:
    """Return the most likely matching errors for the fixes of all walks; there is at least one walk."""
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
    """Return the share by which fixes with a covariance (n, n) of each axis would reduce the stated sigma of the walk's
    own path at them.
    """
    path = fixes.path_covariance()
    gained = np.sum(path * cho_solve(cho_factor(path + covariance, lower=True), path))
    return float(1 - np.sqrt(max(1 - gained / np.trace(path), 0.0)))


def _thinned(fixes: Fixes) -> Fixes:
    return fixes[calibration_rows(len(fixes), MOST_FIXES)] if len(fixes) > MOST_FIXES else fixes


def _log_likelihoods(fixes: Fixes, known: FloatArray, share: float, reach_m: float) -> FloatArray:
    """(s,) log-likelihoods of the differences from the path, for each of the :data:`SIZES`, up to a constant.

    ``known`` (n, n) is the covariance without matching errors; both covariances are diagonalised at once.
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
"""Standard deviation of a match between scans with perfect labels; better labels count little more."""
GAP_M = 3.0
"""A walk gets no fix at places that no other walk has come this close to."""
SPREAD_SHARE, AWAY_M2, LEAST_M2 = 0.25, 0.4, 0.01
"""Expected variance of a fix, up to an estimated factor. It is this share of the variance of the matched places, plus
this value if the nearest scan is as far as usual, the squared distance from other walks, and a minimum."""
DOUBTED = 4.0
"""Factor on the variance: walks have more errors in common than landmarks and radio explain (docs/results/how-good.md).
"""
LEAST_PROMISE = 0.05
"""Constraints that reduce the stated sigma of a walk's path by a smaller share are dropped; they often do harm."""
FEWEST_FIXES, MOST_ASKED, MOST_TIES = 5, 256, 64
"""Smallest number of scans of a walk for constraints, largest number that are matched, and largest number of
constraints (neighbouring fixes are averaged)."""


def radio_ties(traces: Sequence[WalkTrace | None], scans: Sequence[RadioScans]) -> list[PlaceTies | None]:
    """Return the radio constraints of each walk of a floor; None for walks without useful ones.

    ``scans`` of each walk have times (``time_ns``, boot clock) and, if known, the phones that took them.
    """
    fixes = walk_fixes(traces, scans)
    told = [one for one in fixes if one is not None]
    if not told:
        return [None] * len(fixes)
    radio = match_errors(told)
    return [None if one is None else _ties(one, DOUBTED * one.covariance(radio)) for one in fixes]


def walk_fixes(traces: Sequence[WalkTrace | None], scans: Sequence[RadioScans]) -> list[Fixes | None]:
    """Match each walk's scans with those of the others; None if there are too few matches."""
    if sum(trace is not None for trace in traces) < 2:
        return [None] * len(traces)
    floor = HeardFloor.of(traces, scans)
    asked = [_ask(floor, number) for number in range(len(traces))]
    away = [one[1].away[:, 0] for one in asked if one is not None]
    usual_away = float(np.median(np.concatenate(away))) if away else 1.0
    return [None if one is None else _fixes(floor, one, usual_away) for one in asked]


def _ask(floor: HeardFloor, number: int) -> tuple[IntArray, NearestScans, FloatArray] | None:
    """Find scans of other walks that are similar to those of a walk; None if there are too few.

    Returns scans (q,) of the walk, the similar ones of other walks, and the distances (q,) to other walks, metres.
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
    """Put scans at the mean of the places of similar ones."""
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
    """Return fixes with a covariance (n, n) of each axis; None if they are of little use.

    If there are many, their differences from the path are averaged.
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
