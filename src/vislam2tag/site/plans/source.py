"""Which file shows a floor, which part of it, and how large that is: the table ``[floors.plan]`` of ``site.toml``."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import PurePosixPath
from typing import Annotated, Literal, Self

import numpy as np
import numpy.typing as npt
from pydantic import Field, FiniteFloat, model_validator

from vislam2tag.common.records import Record
from vislam2tag.core.arrays import FloatArray
from vislam2tag.intake.extents import FLOOR, MAX_LOCAL_M

SCALES = ("extent", "points", "distance", "scale", "unit_m")
Point = tuple[FiniteFloat, FiniteFloat]
Metres = Annotated[float, Field(gt=0, le=MAX_LOCAL_M)]
Side = Annotated[float, Field(ge=FLOOR.least_m, le=FLOOR.greatest_m)]


class _Part(Record, populate_by_name=True):
    """Keys as files have them, or as Python has."""


class Extent(_Part):
    """What the whole plan covers, or its ``area``; where one side is not given, it follows from the plan's shape."""

    width_m: Side | None = None
    height_m: Side | None = None
    lower_left_m: Point = (0.0, 0.0)
    """Where its lower left corner is, BCS metres."""

    @model_validator(mode="after")
    def _a_side(self) -> Self:
        if self.width_m is None and self.height_m is None:
            raise ValueError("specify width_m, height_m, or both")
        return self


class ScalePoint(_Part):
    """One point in the plan's own coordinates and in the BCS."""

    plan: Point
    bcs_m: Point


class ScaleDistance(_Part):
    """The distance between two points of the plan; the plan is not turned."""

    start: Point = Field(alias="from")
    end: Point = Field(alias="to")
    metres: Metres
    lower_left_m: Point = (0.0, 0.0)
    """Where the plan's lower left corner is, BCS metres."""

    @model_validator(mode="after")
    def _apart(self) -> Self:
        if self.start == self.end:
            raise ValueError("from and to are the same point; measure between two different ones")
        return self


class DrawingScale(_Part):
    """The scale a drawing is printed at, of files with a size on paper (PDF; SVG in mm, cm, in, pt or pc)."""

    one_to: Annotated[float, Field(gt=0, le=MAX_LOCAL_M)]
    """100 of a drawing at 1:100."""
    lower_left_m: Point = (0.0, 0.0)
    """Where the plan's lower left corner is, BCS metres."""


class PlanSource(_Part):
    """A plan file and its scale; at most one of :data:`SCALES`, none if the file itself contains its scale.

    The plan's own coordinates are pixels (PNG, JPG) or units of the drawing (SVG), both from the upper left corner
    downwards. Those of a PDF are points of 1/72 inch from the lower left corner upwards. Other formats have
    coordinates of their own.
    """

    file: Annotated[str, Field(min_length=1)]
    """Relative to the survey."""
    page: Annotated[int, Field(ge=1)] = 1
    """Of a PDF."""
    level: str | None = None
    """Of a file with several (GeoJSON, OSM, IMDF, IFC): its number or name; the first level where this is empty."""
    layers: tuple[str, ...] = ()
    """Of a DXF: those that contain walls (``*`` and ``?`` match); none given: those that are called so, else all whose
    names stand for nothing else."""
    doors: tuple[str, ...] = ()
    """Of a DXF: further layers that contain doors (``*`` and ``?`` match)."""
    ignore: tuple[str, ...] = ()
    """Layers, classes or categories of the file that are left out (``*`` and ``?`` match)."""
    others: Literal["walkable", "obstacle"] | None = None
    """What polygons are that do not say their use; not given: obstacles if one polygon contains them all, else
    walkable."""
    epsg: Annotated[int, Field(gt=0)] | None = None
    """Reference system of the file's coordinates, if the file does not contain it (DXF) or is wrong."""
    area: tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat] | None = None
    """Two opposite corners, x, y, x, y, of the part that counts, in the plan's own coordinates; not given: all of
    it."""
    extent: Extent | None = None
    points: tuple[ScalePoint, ScalePoint] | None = None
    distance: ScaleDistance | None = None
    scale: DrawingScale | None = None
    unit_m: Metres | None = None
    """Metres a unit of the file's coordinates, whose origin and axes are the BCS's."""

    @model_validator(mode="after")
    def _makes_sense(self) -> Self:
        path = PurePosixPath(self.file)
        if path.is_absolute() or ".." in path.parts:
            raise ValueError(f"file {self.file} is outside the survey; copy it into the survey")
        given = [name for name in SCALES if getattr(self, name) is not None]
        if len(given) > 1:
            raise ValueError(f"{' and '.join(given)} are given; keep one of them")
        first, second = self.points or (None, None)
        if first and second and (first.plan == second.plan or first.bcs_m == second.bcs_m):
            raise ValueError("points are identical, so they give no scale; specify two different ones")
        return self


class Use(StrEnum):
    """What a polygon of a vector plan stands for."""

    WALKABLE = "walkable"
    """People can walk here: corridors, rooms, open areas."""
    OBSTACLE = "obstacle"
    """No one can walk here: shops that are closed off, columns, voids."""
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
    """A piece of text on a plan, and its middle (x, y): BCS metres once the plan is placed."""

    text: str
    place_m: tuple[float, float]


@dataclass(frozen=True)
class FloorPlan:
    """One floor's plan in its BCS: an image, or polygons and walls, or both.

    ``extent_m`` is left, right, lower, upper, BCS metres. ``image`` (rows, columns, 3) uint8, row 0 at the top, covers
    exactly that extent; every format has one (vector plans are drawn). ``walls`` (w, 2, 2) are line segments that
    no one walks through, doors left open; empty if the format has none.
    """

    extent_m: tuple[float, float, float, float]
    image: npt.NDArray[np.uint8]
    polygons: tuple[PlanPolygon, ...] = ()
    walls: FloatArray = field(default_factory=lambda: np.empty((0, 2, 2)))
    texts: tuple[PlanText, ...] = ()
    """What is written on the plan, if the format contains them."""
    doors: npt.NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2, 2)))
    """(d, 2, 2) lines of door leaves, if the format contains them."""

    @property
    def pixel_m(self) -> tuple[float, float]:
        """Width and height of one pixel of the image, metres."""
        left, right, low, high = self.extent_m
        return (right - left) / self.image.shape[1], (high - low) / self.image.shape[0]
