"""Plans as images: reading, shrinking, and finding the building on a sheet of paper."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw

from vislam2tag.common.files.given_files import plain
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.transforms import Affine2
from vislam2tag.site.plans.drawing import Bounds, PlanDrawing, bounds_of
from vislam2tag.site.plans.source import PlanPolygon, Use

MOST_PIXELS = 100_000_000
"""Of an image as it is decoded, which takes 400 MB."""
_FORMATS = ("JPEG", "PNG", "BMP", "GIF", "TIFF", "WEBP")


def load_plan(path: Path, side_px: int) -> Image.Image:
    """Return a plan with all its pixels in memory.

    A JPEG is decoded at the smallest fraction of its size whose sides are still at least ``side_px``, any other
    format in full. Raises OSError, whose text completes a sentence about the file, where it is not a whole image (JPEG,
    PNG, BMP, GIF, TIFF or WebP) or would be more than :data:`MOST_PIXELS`.
    """
    try:
        with warnings.catch_warnings():
            # A huge plan is not an attack here, and odd metadata do no harm: it is the surveyor's own file.
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


_SHAPES = (2**0.5, 11 / 8.5, 17 / 11, 14 / 8.5, 24 / 18, 36 / 24)
"""Longer by shorter side of sheets: ISO A and B, letter and ANSI B to E, legal, Arch A to E."""
_SHAPE_TOLERANCE = 0.01
_SIDE_PX = 1000
_SHEET_INK = 230
"""Darkest level of what is paper: hairlines are drawn pale at this size."""
_FRAME_MARGIN = 0.12
"""Greatest margin around a frame, as a share of the sheet's side: 20 mm where an A4 is bound."""
_FRAME_DRAWN = 0.9
"""Share of each side of a frame that is drawn."""
_LINE = 0.006
"""Widest line of a frame, as a share of the sheet's longer side."""
_CLEAR_SIDES = 2
"""A title block hangs on at most two sides of a frame."""
_GAP = 0.012
"""Widest gap within a building, as a share of the sheet's longer side: a door, or a line that stops short."""
_LEAST = 0.03
"""Least share of a sheet that a building covers."""
_WHOLE = 0.97
"""Share of a sheet's width and height from which on the building fills it."""


def is_sheet(drawing: PlanDrawing) -> bool:
    """Whether a plan is a page of paper, as printers have it, not a picture cut to the building."""
    if drawing.picture is None or drawing.paper_m is None:
        return False
    left, right, low, high = drawing.bounds
    shape = max(right - left, high - low) / min(right - left, high - low)
    return any(abs(shape / usual - 1) < _SHAPE_TOLERANCE for usual in _SHAPES)


def building_on_sheet(drawing: PlanDrawing) -> tuple[Bounds | None, bool]:
    """The box around the largest drawing within a sheet's frame, in its coordinates, and whether there is a frame.

    None: the drawing fills the sheet, or there is none. Raises OSError where it cannot be drawn.
    """
    assert drawing.picture is not None
    ink = np.asarray(drawing.picture(_SIDE_PX).convert("L")) < _SHEET_INK
    ink, framed = _without_frames(ink, sure=is_sheet(drawing))
    box = _largest(ink)
    if box is None:
        return None, framed
    rows, columns = ink.shape
    left, right, low, high = drawing.bounds
    x0, x1, top, bottom = box
    if x1 - x0 >= _WHOLE * columns and bottom - top >= _WHOLE * rows:
        return None, framed
    across, up = (right - left) / columns, (high - low) / rows
    return (left + x0 * across, left + x1 * across, high - bottom * up, high - top * up), framed


def _without_frames(ink: npt.NDArray[np.bool_], *, sure: bool) -> tuple[npt.NDArray[np.bool_], bool]:
    """Remove frames, with the title blocks that hang on them, as long as a drawing remains.

    ``sure``: it is a sheet of paper; otherwise the outer wall of a building must not look like a frame.
    """
    from scipy import ndimage  # a fifth of a second, which plans without a frame do without

    kept, framed = ink, False
    labels, count = ndimage.label(ink, np.ones((3, 3)))
    for index, box in enumerate(ndimage.find_objects(labels, count), start=1):
        if not is_frame(labels[box] == index, box, ink.shape):
            continue
        without = kept & (labels != index)
        within = _largest(without)
        if within is not None and (sure or has_title_block(labels == index, box, within)):
            kept, framed = without, True
    return kept, framed


def has_title_block(frame: npt.NDArray[np.bool_], box: tuple[slice, ...], within: tuple[int, int, int, int]) -> bool:
    """Whether a title block hangs on a frame around what is ``within``; rooms hang on all sides of an outer wall."""
    x0, x1, top, bottom = within
    rows, columns = box
    near = round(_LINE * max(frame.shape))
    strips = (
        frame[rows.start + near : top, columns.start + near : columns.stop - near],
        frame[bottom : rows.stop - near, columns.start + near : columns.stop - near],
        frame[rows.start + near : rows.stop - near, columns.start + near : x0],
        frame[rows.start + near : rows.stop - near, x1 : columns.stop - near],
    )
    clear = sum(strip.size > 0 and not strip.any() for strip in strips)
    return _CLEAR_SIDES <= clear < len(strips)  # nothing hangs on an outer wall with corridors inside


def is_frame(part: npt.NDArray[np.bool_], box: tuple[slice, ...], shape: tuple[int, ...]) -> bool:
    """Whether a part of the ink is drawn along all sides of its ``box``, near the edges of a sheet of this shape."""
    for side, length in zip(box, shape, strict=True):
        if side.start > _FRAME_MARGIN * length or side.stop < (1 - _FRAME_MARGIN) * length:
            return False
    near = 2  # pixels: lines of a frame may be that thick, or lean
    sides = part[:near].any(0), part[-near:].any(0), part[:, :near].any(1), part[:, -near:].any(1)
    return all(float(side.mean()) >= _FRAME_DRAWN for side in sides)


def _largest(ink: npt.NDArray[np.bool_]) -> tuple[int, int, int, int] | None:
    """Left, right, upper and lower edge of what covers most of the sheet, in pixels; None where nothing is large."""
    from scipy import ndimage

    gap = max(1, round(_GAP * max(ink.shape)))
    joined = np.asarray(ndimage.maximum_filter(ink, size=gap))
    labels, count = ndimage.label(joined, np.ones((3, 3)))
    boxes = ndimage.find_objects(np.where(ink, labels, 0), count)
    found = [box for box in boxes if box is not None]
    if not found:
        return None
    rows, columns = max(found, key=lambda box: (box[0].stop - box[0].start) * (box[1].stop - box[1].start))
    if (rows.stop - rows.start) * (columns.stop - columns.start) < _LEAST * ink.size:
        return None
    return columns.start, columns.stop, rows.start, rows.stop
