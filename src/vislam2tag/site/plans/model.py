"""A floor plan in the building frame, whatever format it came in."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from vislam2tag.core.arrays import FloatArray


class Use(StrEnum):
    """What a polygon of a vector plan stands for."""

    WALKABLE = "walkable"
    """People can walk here: corridors, rooms, open areas."""
    OBSTACLE = "obstacle"
    """Nobody can walk here: shops that are closed off, columns, voids."""
    OPENING = "opening"
    """A door or passage that joins walkable polygons."""
    OUTLINE = "outline"
    """The floor as a whole."""


@dataclass(frozen=True)
class PlanPolygon:
    """One polygon: ``outline`` (n, 2) and ``holes`` (each (k, 2)), BCS metres, not closed (first point once)."""

    outline: FloatArray
    holes: tuple[FloatArray, ...]
    use: Use
    name: str = ""


@dataclass(frozen=True)
class PlanText:
    """A piece of text on a plan, and the middle of where it stands (x, y): BCS metres once the plan is placed."""

    text: str
    place_m: tuple[float, float]


@dataclass(frozen=True)
class FloorPlan:
    """One floor's plan in its BCS: an image, or polygons and walls, or both.

    ``extent_m`` is left, right, lower, upper, BCS metres. ``image`` (rows, columns, 3) uint8, row 0 at the top, covers
    exactly that extent; every format has one (vector plans are drawn). ``walls`` (w, 2, 2) are line segments that
    nobody walks through, doors left open; empty where the format tells of none.
    """

    extent_m: tuple[float, float, float, float]
    image: npt.NDArray[np.uint8]
    polygons: tuple[PlanPolygon, ...] = ()
    walls: FloatArray = field(default_factory=lambda: np.empty((0, 2, 2)))
    texts: tuple[PlanText, ...] = ()
    """What is written on the plan, where the format tells."""

    @property
    def pixel_m(self) -> tuple[float, float]:
        """Width and height of one pixel of the image, metres."""
        left, right, low, high = self.extent_m
        return (right - left) / self.image.shape[1], (high - low) / self.image.shape[0]
