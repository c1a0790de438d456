"""How far places that others' radio scans tell a walk are off, estimated from all walks of a floor at once.

A fix differs from the walk's own path by what radio is off, by what the labels that it was learned from are off, and by
what the path itself is off. The last two are stated; of the first, size and correlation are found by maximum likelihood
(variance components; Searle et al. 1992).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.positioning.scans.held_out import calibration_rows

PATH_REACH_M = 25.0
"""Errors of paths are correlated by 1/e over such a way, and those of labels over such a distance."""
SIZES = tuple(np.geomspace(0.3, 3.0, 15).tolist())
ALIKE = ((0.0, 1.0), *product((0.2, 0.4, 0.6, 0.8), (2.0, 5.0, 10.0, 20.0)))
"""Tried: radio's errors in units of what is expected; the share of their variance that is alike, and its reach."""
ESTIMATED_WITH = 40
"""Most walks that the size of errors is estimated from."""
FREEDOM = 4.0
"""A walk's path may be farther off than it states (Student's t): such a walk tells little of the size of errors."""


class RadioErrors(NamedTuple):
    """Size of radio's errors in units of what is expected; the share of their variance that is alike; its reach, m."""

    size: float
    share: float
    reach_m: float


@dataclass(frozen=True)
class Fixes:
    """Where other walks' scans put ``n`` scans of a walk.

    ``time_ns`` (n,) boot clock, in time order; ``position`` (n, 2) and ``path`` (n, 2), metres: where the others put
    it, and its own path; ``way_m`` (n,) walked until then; ``path_m`` (n,) and ``label_m`` (n,): sigmas per axis of its
    own path and of the places learned from; ``unit_m`` (n,) what radio is expected to be off by, up to a factor.
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

    def covariance(self, radio: RadioErrors) -> FloatArray:
        """(n, n) of each axis of the fixes, m^2.

        Labels are not averaged: those nearby, of whichever walk, may well be off alike.
        """
        alike = radio.share * self._fading(radio.reach_m) + (1 - radio.share) * np.eye(len(self))
        of_radio = radio.size**2 * np.outer(self.unit_m, self.unit_m) * alike
        return np.asarray(of_radio + np.outer(self.label_m, self.label_m) * self._fading(PATH_REACH_M))

    def path_covariance(self) -> FloatArray:
        """(n, n) of each axis of the walk's own path, m^2."""
        fading = np.exp(-np.abs(self.way_m[:, None] - self.way_m) / PATH_REACH_M)
        return np.asarray(np.outer(self.path_m, self.path_m) * fading)

    def _fading(self, reach_m: float) -> FloatArray:
        """(n, n) correlation that falls with the distance."""
        apart_m = np.hypot(*(self.path[:, None] - self.path).transpose(2, 0, 1))
        return np.asarray(np.exp(-apart_m / reach_m))


def radio_errors(fixes: Sequence[Fixes]) -> RadioErrors:
    """Return under which errors of radio the fixes of all walks are likeliest; there is at least one walk."""
    rows = calibration_rows(len(fixes), ESTIMATED_WITH) if len(fixes) > 1 else (0,)
    some = [fixes[row] for row in rows]
    tried = [RadioErrors(size, *alike) for size, alike in product(SIZES, ALIKE)]
    paths = [one.path_covariance() for one in some]

    def likelihood(radio: RadioErrors) -> float:
        each = zip(some, paths, strict=True)
        return sum(_log_likelihood(one.position - one.path, one.covariance(radio) + path) for one, path in each)

    return max(tried, key=likelihood)


def promised(fixes: Fixes, covariance: FloatArray) -> float:
    """By which share fixes with a covariance (n, n) would lower the stated sigma of the walk's own path."""
    path = fixes.path_covariance()
    gained = np.sum(path * cho_solve(cho_factor(path + covariance, lower=True), path))
    return float(1 - np.sqrt(max(1 - gained / np.trace(path), 0.0)))


def _log_likelihood(off_m: FloatArray, covariance: FloatArray) -> float:
    """Of residuals (n, 2), each axis with covariance (n, n), by a multivariate Student's t; up to a constant."""
    factor = cho_factor(covariance, lower=True)
    square = float(np.sum(off_m * cho_solve(factor, off_m)))
    spread = 2 * float(np.log(np.diag(factor[0])).sum())
    return -spread - (FREEDOM + off_m.size) / 2 * float(np.log1p(square / FREEDOM))
