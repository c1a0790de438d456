"""A drawn correction of a plan: what is painted green can be walked, what is painted red cannot."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import BoolArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.images import load_plan

Bytes = npt.NDArray[np.uint8]

GREEN, RED = (0, 160, 0), (220, 0, 0)
"""What walkable floor and anything else are painted with."""
_VIVID = 60
"""Green and red exceed both other colours by more than this, of 255; greyish and brownish colours say nothing."""
_MASK_PIXELS = 8192


def read_mask(path: Path) -> Bytes:
    """Read a correction (rows, columns, 4) uint8; raises SurveyError where the file is no image or says nothing."""
    try:
        image = load_plan(path, _MASK_PIXELS).convert("RGBA")
    except OSError as error:
        raise SurveyError(f"{path}: {error}; expected an image painted green (walkable) and red (not)") from error
    image.thumbnail((_MASK_PIXELS, _MASK_PIXELS), Image.Resampling.NEAREST)
    mask = np.asarray(image)
    if not any(painted.any() for painted in _painted(mask)):
        raise SurveyError(
            f"{path}: nothing in it is green (walkable) or red (not): paint with pure colours, such as those of the "
            "mask that site walkable writes"
        )
    return mask


def floor_mask(floor: Floor, given: Path | None = None) -> Bytes | None:
    """The correction of a floor: a file that is given, else the one in the floor's folder, else None.

    Raises SurveyError as :func:`read_mask`.
    """
    path = given or floor.mask
    return None if path is None else read_mask(path)


def corrected_cells(mask: Bytes | None, grid: CellGrid) -> tuple[BoolArray, BoolArray]:
    """Tell which cells (rows, columns) are painted walkable and which not; the mask covers the grid's extent, row 0 at
    the top.
    """
    if mask is None:
        return np.zeros(grid.shape, dtype=np.bool_), np.zeros(grid.shape, dtype=np.bool_)
    walkable, blocked = _painted(mask[::-1])
    return _on(grid, walkable), _on(grid, blocked)


def _painted(mask: Bytes) -> tuple[BoolArray, BoolArray]:
    """Which pixels (rows, columns) are green and which are red; what is transparent is neither."""
    colour = mask[..., :3].astype(np.int16)
    opaque = mask[..., 3] > 127 if mask.shape[2] == 4 else np.ones(mask.shape[:2], dtype=np.bool_)
    red, green, blue = colour[..., 0], colour[..., 1], colour[..., 2]
    return opaque & (green - np.maximum(red, blue) > _VIVID), opaque & (red - np.maximum(green, blue) > _VIVID)


def _on(grid: CellGrid, painted: BoolArray) -> BoolArray:
    """Cells (rows, columns) of which at least half are painted."""
    share = cv2.resize(painted.astype(np.float32), grid.shape[::-1], interpolation=_method(painted.shape, grid.shape))
    return np.asarray(share >= 0.5)


def _method(old: tuple[int, ...], new: tuple[int, int]) -> int:
    return cv2.INTER_AREA if old[0] > new[0] else cv2.INTER_LINEAR
