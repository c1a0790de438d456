"""The cells that a density over places is spread on: those near where somebody was, on every storey."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.positioning.places import Places

MEDIAN_STEPS = 12
SMOOTH_M = 1.0
"""Distances below this count as this in the geometric median."""


@dataclass(frozen=True)
class DensityCells:
    """``c`` square cells, sorted by storey."""

    storey: IntArray
    """(c,) index into the model's storeys."""
    centre_m: FloatArray
    """(c, 2)"""

    def __len__(self) -> int:
        return len(self.storey)

    def on(self, storey: IntArray) -> BoolArray:
        """(n, c) whether a cell lies on the storey (n,) of a scan."""
        return np.asarray(self.storey == storey[:, None])

    def blobs(self, places: Places, width_m: float) -> FloatArray:
        """Spread each place over the cells of its storey: (n, c), rows sum to 1.

        A Gaussian of this standard deviation, wider where the label is unsure.
        """
        variance = width_m**2 + np.nan_to_num(places.sigma_m) ** 2
        exponent = np.where(self.on(places.storey), -self._away2(places.xy) / (2 * variance[:, None]), -np.inf)
        blob = np.exp(exponent - exponent.max(axis=1, keepdims=True))
        return np.asarray(blob / blob.sum(axis=1, keepdims=True))

    def median(self, density: FloatArray) -> FloatArray:
        """Return geometric medians (n, 2) of densities (n, c), by Weiszfeld's steps from the mean.

        Unlike the mean it is not pulled by far-off second guesses, and unlike the mode it does not jump.
        """
        pull = density
        for _ in range(MEDIAN_STEPS):
            xy = (pull @ self.centre_m) / pull.sum(axis=1, keepdims=True)
            pull = density / np.sqrt(self._away2(xy) + SMOOTH_M**2)
        return np.asarray((pull @ self.centre_m) / pull.sum(axis=1, keepdims=True))

    def spread_m(self, density: FloatArray, xy: FloatArray) -> FloatArray:
        """Return the mean distances (n,) of densities (n, c) from points (n, 2) in the plane."""
        away = (density * np.sqrt(self._away2(xy))).sum(axis=1)
        return np.asarray(away / density.sum(axis=1))

    def _away2(self, xy: FloatArray) -> FloatArray:
        x, y = (xy[:, axis, None] - self.centre_m[:, axis] for axis in (0, 1))
        return np.asarray(x**2 + y**2)


def cells_near(places: Places, side_m: float, around: int = 1) -> DensityCells:
    """Make the cells that hold a place, and those up to so many sides away; sides lie at multiples of ``side_m``."""
    near = np.unique(np.column_stack([places.storey, np.floor(places.xy / side_m).astype(np.int64)]), axis=0)
    for axis in (1, 2):
        steps = np.zeros((2 * around + 1, 3), dtype=np.int64)
        steps[:, axis] = np.arange(-around, around + 1)
        near = np.unique((near[:, None] + steps).reshape(-1, 3), axis=0)
    return DensityCells(storey=near[:, 0], centre_m=(near[:, 1:] + 0.5) * side_m)
