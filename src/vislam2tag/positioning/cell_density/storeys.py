"""How like two scans are where storeys are to be told.

Strong levels tell where on a storey a scan was taken; which of two storeys it is, faint ones tell, too. So the
direction of powed levels is joined by one of steps: who is heard at all, and who above each quartile of all levels.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from vislam2tag.core.arrays import AnyArray, BoolArray, FloatArray
from vislam2tag.positioning.cell_density.scan_kernel import SMALLEST, directions

_QUARTILES = (0.25, 0.5, 0.75)
STOREY_RIDGE = 0.1
"""Of regressions onto storeys; by cross-validation on Tampere's training part, where storeys are hardest."""


@dataclass(frozen=True)
class StoreyLikeness:
    """The sum of two Gaussians of distances between directions: of powed levels and of steps."""

    centre: FloatArray
    """(m, a) directions of powed levels."""
    threshold: FloatArray
    """(q,) levels of which a step tells whether they are exceeded; the first is 0: heard at all."""
    above: BoolArray
    """(m, a q) the centres' steps."""

    @classmethod
    def around(cls, level: FloatArray) -> Self:
        """Make kernels around scans of levels (m, a)."""
        heard = level[level > 0]
        threshold = np.array([0.0, *(np.quantile(heard, _QUARTILES) if len(heard) else ())])
        return cls(directions(level), threshold, _above(level, threshold))

    def __call__(self, level: FloatArray) -> FloatArray:
        """Compare scans of levels (n, a) from 0 to 1: (n, m) from 0 to 2."""
        return self._of(directions(level), _scaled(_above(level, self.threshold)))

    def among(self) -> FloatArray:
        """Compare the centres among themselves: (m, m)."""
        return self._of(self.centre, self.steps)

    @cached_property
    def steps(self) -> FloatArray:
        """(m, a q) the centres' steps, scaled to length 1."""
        return _scaled(self.above)

    def _of(self, direction: FloatArray, step: FloatArray) -> FloatArray:
        cosines = direction @ self.centre.T, step @ self.steps.T
        return np.asarray(sum(np.exp(2 * (cosine - 1)) for cosine in cosines))

    def arrays(self) -> dict[str, AnyArray]:
        """Return thresholds and steps, for saving; the directions are those of other kernels, too."""
        return {"storey_threshold": self.threshold, "storey_above": self.above}

    @classmethod
    def restored(cls, centre: FloatArray, arrays: Mapping[str, AnyArray]) -> Self:
        """Take back what :meth:`arrays` gave."""
        return cls(centre, arrays["storey_threshold"], arrays["storey_above"])


def _scaled(above: BoolArray) -> FloatArray:
    return np.asarray(above / np.maximum(np.sqrt(above.sum(axis=1, keepdims=True)), SMALLEST))


def _above(level: FloatArray, threshold: FloatArray) -> BoolArray:
    return np.asarray((level[:, :, None] > threshold).reshape(len(level), -1))
