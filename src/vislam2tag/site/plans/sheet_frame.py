"""Where on a sheet of paper the building is drawn: not in the frame, the title block or the margins."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from vislam2tag.site.plans.drawing import Bounds, PlanDrawing

_SHAPES = (2**0.5, 11 / 8.5, 17 / 11, 14 / 8.5, 24 / 18, 36 / 24)
"""Longer by shorter side of sheets: ISO A and B, letter and ANSI B to E, legal, Arch A to E."""
_SHAPE_TOLERANCE = 0.01
_SIDE_PX = 1000
_INK = 230
"""Darkest level of what is paper: hairlines are drawn pale at this size."""
_FRAME_MARGIN = 0.12
"""Greatest margin around a frame, as a share of the sheet's side: 20 mm where an A4 is bound."""
_FRAME_DRAWN = 0.9
"""Share of each side of a frame that is drawn."""
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
    ink = np.asarray(drawing.picture(_SIDE_PX).convert("L")) < _INK
    ink, framed = _without_frames(ink)
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


def _without_frames(ink: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.bool_], bool]:
    """Remove frames, with the title blocks that hang on them, as long as a drawing remains."""
    from scipy import ndimage  # a fifth of a second, which plans without a frame do without

    kept, framed = ink, False
    labels, count = ndimage.label(ink, np.ones((3, 3)))
    for index, box in enumerate(ndimage.find_objects(labels, count), start=1):
        if not _is_frame(labels[box] == index, box, ink.shape):
            continue
        without = kept & (labels != index)
        if _largest(without) is not None:
            kept, framed = without, True
    return kept, framed


def _is_frame(part: npt.NDArray[np.bool_], box: tuple[slice, ...], shape: tuple[int, ...]) -> bool:
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
