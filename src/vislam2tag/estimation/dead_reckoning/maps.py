"""Constraints of a walk besides sensors and fixes: the walls of a plan, and the paths of other walks.

In a corridor that others walked lengthwise, a walk is drawn to their path sideways. Only the lateral offset is taken
from others, never a position along the path, and none of their fixes. Walks are therefore not attracted to the places
of other walks' taps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.context import WalkedWays
from vislam2tag.core.transforms import as_complex, as_points

FITTING_M = 1.0
"""Fixes this far inside walls contradict the plan: its position may be wrong, or it shows another floor."""
MOST_OUTSIDE = 0.5
"""Share of such fixes above which a walk is mapped without the plan."""

ROOM_M, SCATTER = (1.1, 1.7), (0.7, 1.15)
"""Limits of the distance from a wall, and the scatter of fixes below and above them as a multiple of the usual: people
in the middle of a wide corridor tap its sides. From left-out taps on two floors (ratios 0.6 and 0.85)."""


@dataclass(frozen=True)
class Walls:
    """Walls of an area, from which walkers keep ``distance_m`` if there is room."""

    area: WalkableArea
    distance_m: float

    def beyond(self, position: ComplexArray) -> tuple[FloatArray, FloatArray]:
        """Distance (k,) of places (k,), complex metres, beyond the usual distance from walls, and its slope (k, 2)."""
        step = self.area.cell_m
        east, north = (self._into(position + side) - self._into(position - side) for side in (step, 1j * step))
        slope = np.column_stack((east, north)) / (2 * step)
        return np.maximum(self._into(position) + self.distance_m, 0.0), slope

    def fit(self, position: ComplexArray) -> bool:
        """Return whether fixes (f,), complex metres, are in the walkable area of the plan, except for some."""
        return bool((self._into(position) > FITTING_M).mean() < MOST_OUTSIDE)

    def scatter(self, position: ComplexArray) -> FloatArray:
        """Scatter (k,) of fixes at places (k,), complex metres, as a multiple of the usual."""
        return np.interp(-self._into(position), ROOM_M, SCATTER)

    def _into(self, position: ComplexArray) -> FloatArray:
        from scipy.ndimage import map_coordinates

        cell = (position - as_complex(np.array(self.area.origin_m))) / self.area.cell_m - (0.5 + 0.5j)
        at = np.stack((cell.imag, cell.real))
        return np.asarray(map_coordinates(self.area.into_walls_m, at, order=1, mode="nearest"))


ASIDE_M, ALONG_M = 2.0, 1.0
"""Another walk counts at a place if its lateral distance and its next logged point are this close ..."""
PARALLEL = np.cos(np.radians(15))
"""... and if it has the same or the opposite direction within 15 degrees."""
SIGMA_M = 2.0
"""Usual lateral distance between two walks along one corridor ..."""
MEMORY_S = 12.0
"""... and its duration."""


@dataclass(frozen=True)
class SharedLines:
    """For each of k nodes a line from other walks: through ``place`` (k,), complex metres, with unit ``normal`` (k,);
    ``precision`` (k,) of a walk's distance from it, 1 / m^2, 0 without another walk.
    """

    place: ComplexArray
    normal: ComplexArray
    precision: FloatArray

    @classmethod
    def of(cls, ways: WalkedWays, position: ComplexArray, course: ComplexArray) -> SharedLines:
        """Find the lines of a path: ``position`` (k,) complex metres, ``course`` (k,) unit, 0 while standing."""
        from scipy.spatial import cKDTree

        others, direction = as_complex(ways.position_bcs), np.exp(1j * ways.course_rad)
        reach = float(np.hypot(ASIDE_M, ALONG_M))
        near = cKDTree(as_points(position)).query_ball_tree(cKDTree(ways.position_bcs), reach)
        place, precision = position.copy(), np.zeros(len(position))
        for k in np.flatnonzero([bool(found) for found in near]).tolist():
            found = np.array(near[k])
            offset = (others[found] - position[k]) * course[k].conjugate()
            parallel = np.abs((direction[found] * course[k].conjugate()).real) > PARALLEL
            beside = parallel & (np.abs(offset.real) < ALONG_M)
            walks, number = np.unique(ways.walk[found[beside]], return_inverse=True)
            if len(walks):
                each = np.bincount(number, offset.imag[beside]) / np.bincount(number)
                place[k] += 1j * course[k] * each.mean()
                precision[k] = 1 / (SIGMA_M**2 * (1 + 1 / len(walks)))
        return cls(place, 1j * course, precision)

    def distance_m(self, position: ComplexArray) -> FloatArray:
        """Lateral distance (k,) of a path (k,), complex metres, from the lines."""
        return np.asarray(((position - self.place) * self.normal.conj()).real)
