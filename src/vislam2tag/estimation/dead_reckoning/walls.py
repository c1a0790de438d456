"""What a plan says of a walk: where there are walls, nobody walks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.similarity import as_complex

FITTING_M = 1.0
"""Fixes this far in walls speak against the plan: it may lie elsewhere, or show another floor."""
MOST_OUTSIDE = 0.5
"""Share of such fixes from which on a walk is mapped without the plan."""

ROOM_M, SCATTER = (1.1, 1.7), (0.7, 1.15)
"""Places less than 1.1 m from a wall, and more than 1.7 m, and how far fixes scatter there in parts of the usual: who
walks along the middle of a wide corridor taps its sides. By taps left out on two floors (ratios 0.6 and 0.85)."""


@dataclass(frozen=True)
class Walls:
    """Walls of an area, from which walkers keep ``distance_m`` away where there is room."""

    area: WalkableArea
    distance_m: float

    def beyond(self, position: ComplexArray) -> tuple[FloatArray, FloatArray]:
        """How far places (k,), complex metres, are beyond where people walk (k,), metres, and its slope (k, 2)."""
        step = self.area.cell_m
        east, north = (self._into(position + side) - self._into(position - side) for side in (step, 1j * step))
        slope = np.column_stack((east, north)) / (2 * step)
        return np.maximum(self._into(position) + self.distance_m, 0.0), slope

    def fit(self, position: ComplexArray) -> bool:
        """Tell whether fixes (f,), complex metres, lie where the plan says that one can walk, but for some."""
        return bool((self._into(position) > FITTING_M).mean() < MOST_OUTSIDE)

    def scatter(self, position: ComplexArray) -> FloatArray:
        """How far (k,) fixes scatter about places (k,), complex metres, in parts of the usual."""
        return np.interp(-self._into(position), ROOM_M, SCATTER)

    def _into(self, position: ComplexArray) -> FloatArray:
        from scipy.ndimage import map_coordinates

        cell = (position - as_complex(np.array(self.area.origin_m))) / self.area.cell_m - (0.5 + 0.5j)
        at = np.stack((cell.imag, cell.real))
        return np.asarray(map_coordinates(self.area.into_walls_m, at, order=1, mode="nearest"))
