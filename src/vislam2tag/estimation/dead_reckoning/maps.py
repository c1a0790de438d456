"""What else than sensors and fixes says where a walk led: the walls of a plan, and the ways of other walks.

Where others walked the same corridor lengthwise, a walk is drawn onto their way sideways. Only the offset across the
way is taken from others, never a place along it, and no fix of theirs: so nothing attracts a walk to where others
tapped.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.context import WalkedWays
from vislam2tag.core.transforms import as_complex, as_points

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
        """Return whether fixes (f,), complex metres, lie where the plan says that one can walk, except for some."""
        return bool((self._into(position) > FITTING_M).mean() < MOST_OUTSIDE)

    def scatter(self, position: ComplexArray) -> FloatArray:
        """How far (k,) fixes scatter about places (k,), complex metres, in parts of the usual."""
        return np.interp(-self._into(position), ROOM_M, SCATTER)

    def _into(self, position: ComplexArray) -> FloatArray:
        from scipy.ndimage import map_coordinates

        cell = (position - as_complex(np.array(self.area.origin_m))) / self.area.cell_m - (0.5 + 0.5j)
        at = np.stack((cell.imag, cell.real))
        return np.asarray(map_coordinates(self.area.into_walls_m, at, order=1, mode="nearest"))


ASIDE_M, ALONG_M = 2.0, 1.0
"""Another walk counts at a place if it led by at most so far aside of it, and was logged there ..."""
PARALLEL = np.cos(np.radians(15))
"""... and went the same way or against it, within 15 degrees."""
SIGMA_M = 2.0
"""How far apart two walks along one corridor usually lead ..."""
MEMORY_S = 12.0
"""... and how long they stay so."""


@dataclass(frozen=True)
class SharedLines:
    """For each of k nodes a line that other walks share: through ``place`` (k,), complex metres, across ``normal``
    (k,), unit; ``precision`` (k,) of a walk's distance from it, 1 / m^2, 0 if no other walk led along.
    """

    place: ComplexArray
    normal: ComplexArray
    precision: FloatArray

    @classmethod
    def of(cls, ways: WalkedWays, position: ComplexArray, course: ComplexArray) -> SharedLines:
        """Find them for a path: ``position`` (k,) complex metres, ``course`` (k,) unit, 0 if no one walks."""
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
        """How far (k,) a path (k,), complex metres, leads aside of the lines."""
        return np.asarray(((position - self.place) * self.normal.conj()).real)
