"""Images of plans: loaded, turned upright in the BCS, or drawn there from geometry."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw

from vislam2tag.common.files.plain_files import plain
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.similarity import Affine2
from vislam2tag.site.plans.drawing import Bounds, bounds_of
from vislam2tag.site.plans.model import PlanPolygon, Use

MOST_PIXELS = 100_000_000
"""Of an image as it is decoded, which takes 400 MB."""
_FORMATS = ("JPEG", "PNG", "BMP", "GIF", "TIFF", "WEBP")


def load_plan(path: Path, side_px: int) -> Image.Image:
    """Return a plan with all its pixels in memory.

    A JPEG is decoded at the smallest fraction of its size whose sides are still at least ``side_px``, any other
    format in full. Raises OSError, whose text completes a sentence about the file, where it is no whole image (JPEG,
    PNG, BMP, GIF, TIFF or WebP) or would be more than :data:`MOST_PIXELS`.
    """
    try:
        with warnings.catch_warnings():
            # A huge plan is no attack here, and odd metadata no harm: it is the surveyor's own file.
            warnings.simplefilter("ignore")
            with Image.open(plain(path), formats=_FORMATS) as image:
                image.draft("RGB", (side_px, side_px))
                if image.width * image.height > MOST_PIXELS:
                    raise Image.DecompressionBombError
                image.load()
                return image
    except Image.DecompressionBombError as error:
        raise OSError(f"has more than {MOST_PIXELS // 1_000_000} million pixels; make a smaller one") from error
    except (OSError, ValueError, SyntaxError) as error:
        raise OSError("cannot be read as an image") from error


def on_paper(plan: Image.Image, side_px: int) -> Image.Image:
    """Return a plan on white ground, scaled down to at most ``side_px`` along its longer side."""
    coloured = plan if plan.mode in ("RGB", "RGBA") else plan.convert("RGBA")
    coloured.thumbnail((side_px, side_px), Image.Resampling.LANCZOS)
    if coloured.mode == "RGB":
        return coloured
    paper = Image.new("RGB", coloured.size, "white")
    paper.paste(coloured, mask=coloured.getchannel("A"))
    return paper


PIXEL_M = 0.05
"""Side of a pixel of drawn plans, metres: a wall of 0.1 m is still a line."""
GREATEST_PX = 6000
"""Longer side of a plan's image, pixels; a larger plan gets larger pixels."""
_WALL_M = 0.1
_PAPER, _OUTSIDE, _INK, _PALE = (255, 255, 255), (235, 235, 235), (40, 40, 40), (200, 200, 200)
_FILLS = {Use.OUTLINE: _PAPER, Use.WALKABLE: _PAPER, Use.OBSTACLE: (205, 225, 235)}


def drawn_plan(
    bounds: Bounds, polygons: Sequence[PlanPolygon], walls: FloatArray, doors: FloatArray, side_px: int
) -> npt.NDArray[np.uint8]:
    """Draw geometry in BCS metres between bounds: an image (rows, columns, 3), row 0 at the top.

    Edges of polygons and walls are dark, door leaves pale; openings cut through edges.
    """
    left, right, low, high = bounds
    pixel_m = max(PIXEL_M, max(right - left, high - low) / side_px)
    size = (max(1, round((right - left) / pixel_m)), max(1, round((high - low) / pixel_m)))
    outlined = any(each.use == Use.OUTLINE for each in polygons)
    image = Image.new("RGB", size, _OUTSIDE if outlined else _PAPER)
    canvas = ImageDraw.Draw(image)
    scale = np.array([size[0] / (right - left), -size[1] / (high - low)])

    def pixels(points: FloatArray) -> list[tuple[float, float]]:
        """Pixels (n, 2) of points (n, 2), metres."""
        inside = ((points - (left, high)) * scale).clip(0, np.array(size) - 1)
        return [(x, y) for x, y in inside.tolist()]

    width = max(1, round(_WALL_M / pixel_m))
    for use in (Use.OUTLINE, Use.WALKABLE, Use.OBSTACLE):
        for each in (each for each in polygons if each.use == use):
            canvas.polygon(pixels(each.outline), fill=_FILLS[use], outline=_INK, width=width)
            for hole in each.holes:
                canvas.polygon(pixels(hole), fill=_PAPER if use == Use.OBSTACLE else _OUTSIDE, outline=_INK)
    for line in doors:
        canvas.line(pixels(line), fill=_PALE, width=1)
    for line in walls:
        canvas.line(pixels(line), fill=_INK, width=width)
    for each in (each for each in polygons if each.use == Use.OPENING):
        canvas.polygon(pixels(each.outline), fill=_PAPER)
    return np.asarray(image)


def upright(picture: Image.Image, bounds: Bounds, bcs_T_plan: Affine2) -> tuple[npt.NDArray[np.uint8], Bounds]:
    """Turn a picture between bounds (y upwards) into an image (rows, columns, 3) parallel to the BCS axes, and its
    extent there.

    What the picture does not cover is white.
    """
    left, right, low, high = bounds
    x0, x1, y0, y1 = turned_bounds(bounds, bcs_T_plan)
    matrix = bcs_T_plan.matrix
    if matrix[0, 1] == matrix[1, 0] == 0 and (np.diag(matrix) > 0).all():
        return np.asarray(picture.convert("RGB")), (x0, x1, y0, y1)
    pixel = np.array([(right - left) / picture.width, (high - low) / picture.height])
    pixel_m = float(np.sqrt(abs(np.linalg.det(matrix)) * pixel.prod()))
    pixel_m = max(pixel_m, max(x1 - x0, y1 - y0) / GREATEST_PX)
    size = (max(1, round((x1 - x0) / pixel_m)), max(1, round((y1 - y0) / pixel_m)))
    step = np.array([(x1 - x0) / size[0], -(y1 - y0) / size[1]])
    # Where in the picture each pixel of the image comes from: pixel -> BCS -> plan -> picture.
    to_picture = np.diag([1 / pixel[0], -1 / pixel[1]]) @ np.linalg.inv(matrix)
    linear = to_picture @ np.diag(step)
    shift = to_picture @ (np.array([x0, y1]) - bcs_T_plan.translation) - (left / pixel[0], -high / pixel[1])
    coefficients = (*linear[0], shift[0], *linear[1], shift[1])
    turned = picture.convert("RGB").transform(
        size, Image.Transform.AFFINE, tuple(map(float, coefficients)), Image.Resampling.BICUBIC, fillcolor=_PAPER
    )
    return np.asarray(turned), (x0, x1, y0, y1)


def turned_bounds(bounds: Bounds, bcs_T_plan: Affine2) -> Bounds:
    """Box around a mapped box."""
    left, right, low, high = bounds
    corners = bcs_T_plan @ np.array([(left, low), (right, low), (right, high), (left, high)])
    return bounds_of(corners)
