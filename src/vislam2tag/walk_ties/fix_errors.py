"""How far places that others' radio scans tell a walk are off, estimated from all walks of a floor at once.

A fix differs from the walk's own path by what matching radio scans is off, by what the labels that it was learned from
are off, and by what the path itself is off. The last two are stated; of the first, size and correlation are found by
maximum likelihood (variance components; Searle et al. 1992).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.positioning.places import calibration_rows

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
        return Fixes(
            self.time_ns[rows],
            self.position[rows],
            self.path[rows],
            self.way_m[rows],
            self.path_m[rows],
            self.label_m[rows],
            self.unit_m[rows],
        )

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
