"""Kernels between scans: how similar two of them are, by the directions of their vectors of levels.

The direction of a scan's vector stays the same where a phone hears everything fainter by a factor. Strong levels say
where on a storey a scan was taken (:class:`DirectionKernel`); which of two storeys it is, faint ones say, too: there
the direction of powed levels is joined by one of steps, who is heard at all, and who above each quartile of all levels
(:class:`StoreyKernel`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, Self

import numpy as np

from vislam2tag.core.arrays import AnyArray, BoolArray, FloatArray
from vislam2tag.positioning.checked_arrays import CheckedArrays
from vislam2tag.positioning.scans.radio_scans import RadioScans
from vislam2tag.positioning.scans.representation import Representation, represented

EXPONENT = 1.7
"""Power of levels before their direction is taken; chosen by cross-validation (docs/explanation/cell-density.md)."""
LEAST_LENGTH = 1e-9
"""A vector counts as no shorter than this where its direction is taken."""
_QUARTILES = (0.25, 0.5, 0.75)


class ScanKernel(Protocol):
    """A positive definite kernel between any scans and ``m`` scans, the centres."""

    def __call__(self, level: FloatArray) -> FloatArray:
        """Compare scans of levels (n, a) from 0 to 1 with the centres: (n, m)."""

    def among_centres(self) -> FloatArray:
        """Compare the centres among themselves: (m, m)."""


@dataclass(frozen=True)
class DirectionKernel:
    """The Gaussian of the distance between the directions of powed levels: from 0 to 1."""

    centre: FloatArray
    """(m, a) directions."""
    sharpness: float

    def __call__(self, level: FloatArray) -> FloatArray:
        """Compare scans of levels (n, a) from 0 to 1 with the centres: (n, m)."""
        return self._of(directions(level))

    def among_centres(self) -> FloatArray:
        """Compare the centres among themselves: (m, m)."""
        return self._of(self.centre)

    def _of(self, direction: FloatArray) -> FloatArray:
        return np.asarray(np.exp(2 * self.sharpness * (direction @ self.centre.T - 1)))


@dataclass(frozen=True)
class StoreyKernel:
    """The sum of two Gaussians of distances between directions: of powed levels and of steps."""

    centre: FloatArray
    """(m, a) directions of powed levels."""
    threshold: FloatArray
    """(q,) levels from 0 to 1 of which a step says whether they are exceeded; the first is 0: heard at all."""
    above: BoolArray
    """(m, a q) the centres' steps."""

    @classmethod
    def around(cls, level: FloatArray) -> Self:
        """Make the kernel around scans of levels (m, a) from 0 to 1."""
        heard = level[level > 0]
        threshold = np.array([0.0, *(np.quantile(heard, _QUARTILES) if len(heard) else ())])
        return cls(directions(level), threshold, _above(level, threshold))

    def __call__(self, level: FloatArray) -> FloatArray:
        """Compare scans of levels (n, a) from 0 to 1 with the centres: (n, m) from 0 to 2."""
        return self._of(directions(level), _unit_steps(_above(level, self.threshold)))

    def among_centres(self) -> FloatArray:
        """Compare the centres among themselves: (m, m)."""
        return self._of(self.centre, self.steps)

    @cached_property
    def steps(self) -> FloatArray:
        """(m, a q) the centres' steps, scaled to length 1."""
        return _unit_steps(self.above)

    def _of(self, direction: FloatArray, step: FloatArray) -> FloatArray:
        cosines = direction @ self.centre.T, step @ self.steps.T
        return np.asarray(sum(np.exp(2 * (cosine - 1)) for cosine in cosines))

    def arrays(self) -> dict[str, AnyArray]:
        """Return thresholds and steps, for saving; the directions are those of other kernels, too."""
        return {"storey_threshold": self.threshold, "storey_above": self.above}

    @classmethod
    def restored(cls, centre: FloatArray, arrays: CheckedArrays) -> Self:
        """Take back what :meth:`arrays` gave, with the centres' directions (m, a).

        Raises ValueError where it does not fit.
        """
        threshold = arrays.floats("storey_threshold", "q")
        return cls(centre, threshold, arrays.booleans("storey_above", "m", centre.shape[1] * len(threshold)))


def directions(level: FloatArray, exponent: float = EXPONENT) -> FloatArray:
    """Scale each scan's powed levels (n, a) to length 1."""
    powed = level**exponent
    return np.asarray(powed / np.maximum(np.linalg.norm(powed, axis=1, keepdims=True), LEAST_LENGTH))


def levels(scans: RadioScans) -> FloatArray:
    """Make the (n, a) levels that all is learned from, 0 (not heard) to 1."""
    return represented(scans, Representation.POSITIVE)


def _above(level: FloatArray, threshold: FloatArray) -> BoolArray:
    """(n, a q) which of the thresholds (q,) the levels (n, a) exceed."""
    return np.asarray((level[:, :, None] > threshold).reshape(len(level), level.shape[1] * len(threshold)))


def _unit_steps(above: BoolArray) -> FloatArray:
    """Scale steps (n, a q) to length 1."""
    return np.asarray(above / np.maximum(np.sqrt(above.sum(axis=1, keepdims=True)), LEAST_LENGTH))
