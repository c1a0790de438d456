"""The cells that a density over places is spread on: those near where somebody was, on every storey."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.positioning.scans.places import ScanPlaces

MEDIAN_STEPS = 12
"""Of the geometric median: a fixed number, so that an exported network takes the same ones."""
SMOOTH_M = 1.0
"""Distances below this count as this in the geometric median."""


@dataclass(frozen=True)
class DensityCells:
    """``c`` square cells, sorted by storey."""

    storey: IntArray
    """(c,) index into the model's storeys."""
    centre_m: FloatArray
    """(c, 2) BCS."""

    def __len__(self) -> int:
        return len(self.storey)

    def on(self, storey: IntArray) -> BoolArray:
        """(n, c) whether each cell lies on the storey (n,) of a scan."""
        return np.asarray(self.storey == storey[:, None])

    def label_densities(self, places: ScanPlaces, width_m: float) -> FloatArray:
        """Spread each of ``n`` places over the cells of its storey: (n, c), rows sum to 1.

        A Gaussian of this standard deviation, wider where the label is unsure.
        """
        variance = width_m**2 + np.nan_to_num(places.sigma_m) ** 2
        exponent = np.where(self.on(places.storey), -self._distance_m2(places.xy) / (2 * variance[:, None]), -np.inf)
        density = np.exp(exponent - exponent.max(axis=1, keepdims=True))
        return np.asarray(density / density.sum(axis=1, keepdims=True))

    def median(self, density: FloatArray) -> FloatArray:
        """Return geometric medians (n, 2), metres, of densities (n, c), by Weiszfeld's steps from the mean.

        Unlike the mean it is not pulled by far-off second guesses, and unlike the mode it does not jump.
        """
        pull = density
        for _ in range(MEDIAN_STEPS):
            xy = (pull @ self.centre_m) / pull.sum(axis=1, keepdims=True)
            pull = density / np.sqrt(self._distance_m2(xy) + SMOOTH_M**2)
        return np.asarray((pull @ self.centre_m) / pull.sum(axis=1, keepdims=True))

    def spread_m(self, density: FloatArray, xy: FloatArray) -> FloatArray:
        """Return the mean distances (n,), metres, of densities (n, c) from points (n, 2) in the plane."""
        distance_m = (density * np.sqrt(self._distance_m2(xy))).sum(axis=1)
        return np.asarray(distance_m / density.sum(axis=1))

    def _distance_m2(self, xy: FloatArray) -> FloatArray:
        """(n, c) squared distances of points (n, 2) from the cells' centres."""
        x, y = (xy[:, axis, None] - self.centre_m[:, axis] for axis in (0, 1))
        return np.asarray(x**2 + y**2)


def cells_near(places: ScanPlaces, side_m: float, around: int = 1) -> DensityCells:
    """Make the cells that hold a place, and those up to so many sides away; sides lie at multiples of ``side_m``."""
    near = np.unique(np.column_stack([places.storey, np.floor(places.xy / side_m).astype(np.int64)]), axis=0)
    for axis in (1, 2):
        steps = np.zeros((2 * around + 1, 3), dtype=np.int64)
        steps[:, axis] = np.arange(-around, around + 1)
        near = np.unique((near[:, None] + steps).reshape(-1, 3), axis=0)
    return DensityCells(storey=near[:, 0], centre_m=(near[:, 1:] + 0.5) * side_m)
