"""What a plan's file shows, in the file's own coordinates, before it is placed in the BCS."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from PIL import Image

from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.core.arrays import FloatArray
from vislam2tag.site.plans.model import PlanPolygon, PlanText

Bounds = tuple[float, float, float, float]
"""Left, right, lower, upper."""
MOST_SIDE_PX = 12_000
"""Longer side of a picture of which a part is taken."""
MOST_POINTS = 1_000_000
"""Of a plan's geometry: a floor of a hundred rooms has some ten thousand."""


@dataclass(frozen=True)
class PlanDrawing:
    """A plan in its file's coordinates, but with y upwards: a picture, or polygons, walls and passages.

    ``walls`` (w, 2, 2) are segments, ``passages`` (k, 2) polylines across which people walk from one polygon to the
    next.
    """

    bounds: Bounds
    picture: Callable[[int], Image.Image] | None = None
    """Draws what is between the bounds as an RGB image of about so many pixels on its longer side; raises OSError.
    None: the geometry is all there is."""
    polygons: tuple[PlanPolygon, ...] = ()
    walls: FloatArray = field(default_factory=lambda: np.empty((0, 2, 2)))
    doors: FloatArray = field(default_factory=lambda: np.empty((0, 2, 2)))
    """(d, 2, 2) lines of door leaves, drawn pale: nobody is stopped by them."""
    passages: tuple[FloatArray, ...] = ()
    texts: tuple[PlanText, ...] = ()
    """What is written on it; each place is a point in the drawing's coordinates."""
    downwards: bool = False
    """Whether the file counts y downwards from the upper edge: known points are given so."""
    pixels: bool = False
    """Whether a unit is a pixel: more of them than units show nothing more."""
    levels: tuple[str, ...] = ()
    """Names of all levels of its file, where that has levels."""
    unit_m: float | None = None
    """Metres a unit, where the file tells; its origin is then the BCS's."""
    paper_m: float | None = None
    """Metres on paper a unit, where the file tells."""
    epsg: int | None = None
    """Reference system of the coordinates, where the file tells."""

    @property
    def point_count(self) -> int:
        """How many points its geometry has."""
        rings = (ring for each in self.polygons for ring in (each.outline, *each.holes))
        return 2 * (len(self.walls) + len(self.doors)) + sum(map(len, rings)) + sum(map(len, self.passages))


def refuse_too_many(points: int) -> None:
    """Raise OSError, whose text completes a sentence about the file, for more points than plans have."""
    if points > MOST_POINTS:
        raise OSError(f"has more than {MOST_POINTS:,} points; keep the layers that show walls only")


def bounds_of(points: FloatArray) -> Bounds:
    """Box around points (n, 2).

    Raises OSError, whose text completes a sentence about the file, where they span no area.
    """
    if not len(points) or not np.isfinite(points).all():
        raise OSError("holds nothing to draw")
    (left, low), (right, high) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    if not (left < right and low < high):
        raise OSError("spans no area: everything in it lies on one line")
    return left, right, low, high


def mapped(drawing: PlanDrawing, to: Callable[[FloatArray], FloatArray]) -> PlanDrawing:
    """Map the geometry of a drawing; ``to`` maps points (..., 2). Raises OSError as :func:`bounds_of` does."""
    polygons = tuple(
        PlanPolygon(to(each.outline), tuple(to(hole) for hole in each.holes), each.use, each.name)
        for each in drawing.polygons
    )
    walls, doors, passages = to(drawing.walls), to(drawing.doors), tuple(to(line) for line in drawing.passages)
    lines = (walls.reshape(-1, 2), doors.reshape(-1, 2), *passages)
    bounds = bounds_of(np.concatenate([*(each.outline for each in polygons), *lines]))
    return replace(
        drawing,
        bounds=bounds,
        polygons=polygons,
        walls=walls,
        doors=doors,
        passages=passages,
        texts=mapped_texts(drawing.texts, to),
    )


def mapped_texts(texts: tuple[PlanText, ...], to: Callable[[FloatArray], FloatArray]) -> tuple[PlanText, ...]:
    """Map the places of texts; ``to`` maps points (..., 2)."""
    if not texts:
        return ()
    places = to(np.array([one.place_m for one in texts])).tolist()
    return tuple(PlanText(one.text, (x, y)) for one, (x, y) in zip(texts, places, strict=True))


def cropped(drawing: PlanDrawing, area: Bounds) -> PlanDrawing:
    """Keep of a picture what lies between ``area``, in the drawing's coordinates with y upwards.

    Raises OSError, whose text completes a sentence about the file, where that is nothing, or the drawing no picture.
    """
    if drawing.picture is None:
        raise OSError("is no picture, of which area takes a part; choose layers or a level instead")
    whole, picture = drawing.bounds, drawing.picture
    left, right, low, high = (
        max(area[0], whole[0]), min(area[1], whole[1]), max(area[2], whole[2]), min(area[3], whole[3])
    )  # fmt: skip
    if not (left < right and low < high):
        raise OSError("has nothing in that area; correct area")
    size = (whole[1] - whole[0], whole[3] - whole[2])
    enlarged = max(size) / max(right - left, high - low)

    def part(side_px: int) -> Image.Image:
        image = picture(min(round(side_px * enlarged), MOST_SIDE_PX))
        across, down = image.width / size[0], image.height / size[1]
        box = (left - whole[0]) * across, (whole[3] - high) * down, (right - whole[0]) * across, (whole[3] - low) * down
        return image.crop((round(box[0]), round(box[1]), max(round(box[2]), 1), max(round(box[3]), 1)))

    return replace(drawing, bounds=(left, right, low, high), picture=part)


def file_bytes(path: Path) -> bytes:
    """Read a plan's file; raises OSError, whose text completes a sentence about the file."""
    try:
        return read_bytes(path)
    except OSError as error:
        raise OSError(f"cannot be opened ({error.strerror})") from error
