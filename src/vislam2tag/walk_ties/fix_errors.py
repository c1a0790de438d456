"""How far places that others tell a walk by what they sensed are off, estimated from all walks of a floor at once.

A fix differs from the walk's own path by what matching radio scans or magnetic fields is off, by what the labels that
it was learned from are off, and by what the path itself is off. The last two are stated; of the first, size and
correlation are found by maximum likelihood (variance components; Searle et al. 1992).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.positioning.scans.held_out import calibration_rows

PATH_REACH_M = 25.0
"""Errors of paths are correlated by 1/e over such a way, and those of labels over such a distance."""
SIZES = np.geomspace(0.3, 21.0, 35)
ALIKE = ((0.0, 1.0), *product((0.2, 0.4, 0.6, 0.8, 0.95), (2.0, 5.0, 10.0, 20.0, 40.0)))
"""Tried: errors of matching in units of what is expected; the share of their variance that is alike, and its reach."""
FREEDOM_SHARE = 0.5
"""A walk's path may be farther off than it states: Student's t, of so many degrees of freedom a number. Fewer would
leave each walk a size of its own, so that how alike errors are would say how large they are."""
COMMON_LABELS = 0.3
"""Share of the variance of labels that walks have in common."""
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
    """Where what other walks sensed puts a walk at ``n`` moments.

    ``time_ns`` (n,) boot clock, in time order; ``position`` (n, 2) and ``path`` (n, 2), metres: where the others put
    it, and its own path; ``way_m`` (n,) walked until then; ``path_m`` (n,) sigma per axis of its own path; ``label_m``
    (n, w) of the places learned from, each of ``w`` walks by how much it counts; ``unit_m`` (n,) what matching is
    expected to be off by, up to a factor; ``course`` (n, 2) unit vectors along which alone a fix says something; None
    where it says where a walk was in all directions.
    """

    time_ns: IntArray
    position: FloatArray
    path: FloatArray
    way_m: FloatArray
    path_m: FloatArray
    label_m: FloatArray
    unit_m: FloatArray
    course: FloatArray | None = None

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
            None if self.course is None else self.course[rows],
        )

    @property
    def off_m(self) -> FloatArray:
        """(n, a) what fixes differ from the path along each axis of which they say something: both, or the course."""
        off = self.position - self.path
        return off if self.course is None else np.einsum("ni,ni->n", off, self.course)[:, None]

    @property
    def axes(self) -> FloatArray:
        """(a, n, 2) unit vectors along which fixes say something."""
        return np.tile(np.eye(2)[:, None], (1, len(self), 1)) if self.course is None else self.course[None]

    def covariance(self, errors: MatchErrors) -> FloatArray:
        """(n, n) of each axis of the fixes, m^2."""
        return errors.size**2 * self.match_covariance(errors.share, errors.reach_m) + self.label_covariance()

    def match_covariance(self, share: float, reach_m: float) -> FloatArray:
        """(n, n) of matching's errors of size one of each axis, m^2.

        With an endless reach they are alike along the course, wherever it leads: as by a delay.
        """
        fading = np.ones((len(self), len(self))) if np.isinf(reach_m) else self._fading(reach_m)
        alike = share * fading + (1 - share) * np.eye(len(self))
        return np.asarray(np.outer(self.unit_m, self.unit_m) * alike)

    def label_covariance(self) -> FloatArray:
        """(n, n) of what the places learned from are off, of each axis, m^2.

        Those nearby of one walk are off alike, those of several walks partly so.
        """
        whole_m = self.label_m.sum(axis=1)
        alike = COMMON_LABELS * np.outer(whole_m, whole_m) + (1 - COMMON_LABELS) * self.label_m @ self.label_m.T
        return np.asarray(alike * self._fading(PATH_REACH_M))

    def path_covariance(self) -> FloatArray:
        """(n, n) of each axis of the walk's own path, m^2."""
        return np.asarray(np.outer(self.path_m, self.path_m) * self._along_way() * self._aligned())

    def _along_way(self) -> FloatArray:
        """(n, n) correlation that falls with the way."""
        return np.asarray(np.exp(-np.abs(self.way_m[:, None] - self.way_m) / PATH_REACH_M))

    def _aligned(self) -> FloatArray:
        """(n, n) how much what is off in one place along its axis is so along that of another."""
        return np.ones((len(self), len(self))) if self.course is None else self.course @ self.course.T

    def _fading(self, reach_m: float) -> FloatArray:
        """(n, n) correlation that falls with the distance."""
        apart_m = np.hypot(*(self.path[:, None] - self.path).transpose(2, 0, 1))
        return np.asarray(np.exp(-apart_m / reach_m) * self._aligned())


def match_errors(
    fixes: Sequence[Fixes], usual_size: float = USUAL_SIZE, tried: Sequence[tuple[float, float]] = ALIKE
) -> MatchErrors:
    """Return under which errors of matching the fixes of all walks are likeliest; there is at least one walk.

    ``usual_size`` is what they are taken for before anything is seen; ``tried`` the shares that are alike and reaches.
    """
    rows = calibration_rows(len(fixes), ESTIMATED_WITH) if len(fixes) > 1 else (0,)
    some = [_thinned(fixes[row]) for row in rows]
    known = [one.path_covariance() + one.label_covariance() for one in some]
    likelihood = np.array(
        [sum(_log_likelihoods(one, part, *alike) for one, part in zip(some, known, strict=True)) for alike in tried]
    )
    likelihood = likelihood - USUAL_COUNTS * (2 * np.log(SIZES) + (usual_size / SIZES) ** 2)
    alike, size = np.unravel_index(likelihood.argmax(), likelihood.shape)
    return MatchErrors(float(SIZES[size]), *tried[int(alike)])


def promised(fixes: Fixes, covariance: FloatArray) -> float:
    """By which share fixes with a covariance (n, n) of each axis would lower the stated sigma of the walk's own path at
    them.
    """
    path = fixes.path_covariance()
    seen = np.outer(fixes.path_m, fixes.path_m) * fixes._along_way()
    solve = cho_factor(path + covariance, lower=True)
    gained = sum(
        float(np.sum(told * cho_solve(solve, told)))
        for axis in fixes.axes
        for told in (axis[:, component, None] * seen for component in (0, 1))
    )
    return float(1 - np.sqrt(max(1 - gained / (2 * np.trace(path)), 0.0)))


def _thinned(fixes: Fixes) -> Fixes:
    return fixes[calibration_rows(len(fixes), MOST_FIXES)] if len(fixes) > MOST_FIXES else fixes


def _log_likelihoods(fixes: Fixes, known: FloatArray, share: float, reach_m: float) -> FloatArray:
    """(s,) of what fixes differ from the path, by each of the :data:`SIZES`; up to a constant.

    ``known`` (n, n) is the covariance of all that is not matching's; both covariances are made diagonal at once.
    """
    matching = fixes.match_covariance(share, reach_m)
    variance, vectors = eigh(known, matching)
    off = vectors.T @ fixes.off_m
    whole = variance[:, None] + SIZES**2
    spread = float(np.log(np.linalg.eigvalsh(matching)).sum()) + np.log(whole).sum(axis=0)
    missed = ((off**2).sum(axis=1)[:, None] / whole).sum(axis=0)
    freedom = FREEDOM_SHARE * off.size
    return np.asarray(-(off.shape[1] * spread + (freedom + off.size) * np.log1p(missed / freedom)) / 2)
