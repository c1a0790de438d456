"""Cells of a floor: corrections painted by hand, and the region that can be walked."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.findings import ROWS_NAMED, Finding
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.intake.extents import SIZE_TOLERANCE
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.images import load_plan
from vislam2tag.site.plans.source import FloorPlan, PlanText
from vislam2tag.site.settings import WalkableSettings

Bytes = npt.NDArray[np.uint8]

GREEN, RED = (0, 160, 0), (220, 0, 0)
"""What walkable floor and anything else are painted with."""
REGION_M2 = 4.0
"""Closed-off regions smaller than this are not reported, square metres."""
_VIVID = 60
"""Green and red exceed both other colours by more than this, of 255; greyish and brownish colours say nothing."""
_MASK_PIXELS = 8192
_COMPARED_PX, _NEAR_PX = 500, 5
"""Drawings are compared in a square of so many pixels, and lines may be apart by half of so many."""
_SHOWN, _SAME = 0.01, 0.4
"""A correction with dark lines on more than this share shows a drawing: the plan's, if it has this share of its lines.
Text may be missing."""


def read_mask(path: Path) -> Bytes:
    """Read a correction (rows, columns, 4) uint8; raises SurveyError where the file is not an image or says nothing."""
    try:
        image = load_plan(path, _MASK_PIXELS).convert("RGBA")
    except OSError as error:
        raise SurveyError(f"{path}: {error}; expected an image painted green (walkable) and red (not)") from error
    image.thumbnail((_MASK_PIXELS, _MASK_PIXELS), Image.Resampling.NEAREST)
    mask = np.asarray(image)
    if not any(painted.any() for painted in _painted(mask)):
        raise SurveyError(
            f"{path}: it contains neither green (walkable) nor red (not walkable): paint with pure colours, such as "
            "those of the mask that site walkable writes"
        )
    return mask


def floor_mask(floor: Floor, given: Path | None = None) -> Bytes | None:
    """The correction of a floor: a file that is given, else the one in the floor's folder, else None.

    Raises SurveyError as :func:`read_mask`.
    """
    path = given or floor.mask
    return None if path is None else read_mask(path)


def refuse_other_plan(mask: Bytes, plan: FloorPlan) -> None:
    """Raise SurveyError if a correction (rows, columns, 3 or 4) has another shape than a plan, or shows another one."""
    (rows, columns), (left, right, low, high) = mask.shape[:2], plan.extent_m
    shape = columns / rows * (high - low) / (right - left)
    cure = "paint on the mask of this plan that vislam2tag site walkable writes"
    if max(shape, 1 / shape) > 1 + max(SIZE_TOLERANCE, 2 / min(rows, columns)):
        raise SurveyError(
            f"the mask has another shape ({columns} x {rows} pixels) than the plan ({plan.image.shape[1]} x "
            f"{plan.image.shape[0]} pixels, {right - left:.1f} m x {high - low:.1f} m), so it belongs to another "
            f"plan: {cure}"
        )
    open_ = ~np.logical_or(*_painted(mask))
    shown = _small(_dark(mask) & open_)
    lines = _small(_dark(plan.image)) & _small(open_)
    if shown.mean() < _SHOWN or not lines.any():
        return
    near = np.asarray(cv2.dilate(shown.astype(np.uint8), np.ones((_NEAR_PX, _NEAR_PX), dtype=np.uint8))) > 0
    if (share := float(near[lines].mean())) < _SAME:
        raise SurveyError(
            f"the mask shows another drawing than the plan, because it has only {share:.0%} of the plan's lines: {cure}"
        )


def _dark(image: Bytes) -> BoolArray:
    """Pixels (rows, columns) of an image that differ from most others in lightness."""
    light = image[..., :3].mean(axis=2)
    return np.asarray(np.abs(light - np.median(light)) > _VIVID)


def _small(mask: BoolArray) -> BoolArray:
    """A mask as few pixels, each set where anything in it is."""
    size = (_COMPARED_PX, _COMPARED_PX)
    return np.asarray(cv2.resize(mask.astype(np.float32), size, interpolation=cv2.INTER_AREA) > 0)


def corrected_cells(mask: Bytes | None, grid: CellGrid) -> tuple[BoolArray, BoolArray]:
    """Return which cells (rows, columns) are painted walkable and which not; the mask covers the grid's extent, row 0
    at the top.
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
    method = cv2.INTER_AREA if painted.shape[0] > grid.rows else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(painted.astype(np.float32), grid.shape[::-1], interpolation=method) >= 0.5)


_LEAST_INSIDE = 0.05
"""Where less of a plan than this share is inside, it has no outer wall."""
_CORNER = 1.42
"""A disc that fits a corner is this many radii away from it."""


def clearance_cells(free: BoolArray) -> FloatArray:
    """Distance (rows, columns) of each free cell's centre to the nearest wall's edge, in cells; beyond the grid all is
    wall.
    """
    return np.maximum(clearance_px(np.pad(free, 1))[1:-1, 1:-1].astype(np.float64) - 0.5, 0.0)


def inside_of(walls: BoolArray, cell_m: float, settings: WalkableSettings) -> tuple[BoolArray, tuple[Finding, ...]]:
    """Return which cells (rows, columns) are neither wall nor outside the building.

    The outside is what a disc as wide as an entrance reaches from beyond the plan. Where that leaves next to nothing,
    the plan has no outer wall and all of it is inside.
    """
    free = ~walls
    radius = settings.entrance_m / 2 / cell_m
    margin = int(np.ceil(radius)) + 2
    core = regions(clearance_px(~np.pad(walls, margin)) > radius)
    reached = clearance_px(core != core[0, 0])[margin:-margin, margin:-margin] <= radius
    inside = free & ~reached
    if inside.mean() >= _LEAST_INSIDE:
        return inside, ()
    message = (
        "the plan has no closed outer wall, so everything except walls counts as inside the building; paint the "
        "outside red in a mask and pass it as --mask"
    )
    return free, (Finding(kind="no_outer_wall", file="", count=1, message=message),)


def largest_region(
    free: BoolArray, grid: CellGrid, settings: WalkableSettings, labels: Sequence[PlanText] = ()
) -> tuple[BoolArray, tuple[Finding, ...]]:
    """Keep the largest region (rows, columns) that one can walk through all of; a finding names the others, with the
    room labels in them.
    """
    radius = _passing(grid, settings)
    parts = regions(free & (clearance_cells(free) >= radius))
    sizes = np.bincount(parts.ravel())
    sizes[0] = 0
    if not sizes.any():
        return np.zeros_like(free), ()
    kept = int(sizes.argmax())
    region = free & (clearance_px(parts != kept) <= _CORNER * radius)
    return region, _closed_off(parts, sizes, kept, grid, labels)


def closed_off_cells(free: BoolArray, region: BoolArray, grid: CellGrid, settings: WalkableSettings) -> BoolArray:
    """Which free cells (rows, columns) people could walk if they were not parted from a region."""
    radius = _passing(grid, settings)
    core = clearance_cells(free & ~region) >= radius
    return free & ~region & (clearance_px(~core) <= _CORNER * radius)


def _passing(grid: CellGrid, settings: WalkableSettings) -> float:
    """Half the width of the narrowest passage, cells."""
    return max(settings.passage_m / 2 / grid.cell_m, 0.5)


def _closed_off(
    parts: IntArray, sizes: IntArray, kept: int, grid: CellGrid, labels: Sequence[PlanText]
) -> tuple[Finding, ...]:
    """Name the regions, the largest first, that are not connected with the one that is kept; ``parts`` (rows,
    columns), ``sizes`` (regions,) in cells.
    """
    areas = sizes * grid.cell_m**2
    order = np.argsort(-sizes, kind="stable").tolist()
    others = [part for part in order if areas[part] >= REGION_M2 and part != kept]
    if not others:
        return ()
    named = [
        f"{_rooms_in(parts == part, grid, labels)}{areas[part]:.0f} m2 at {_place(parts, part, grid)}"
        for part in others[:ROWS_NAMED]
    ]
    more = f" and {len(others) - ROWS_NAMED} smaller ones" if len(others) > ROWS_NAMED else ""
    message = (
        f"rooms without an open door are excluded: {', '.join(named)}{more}; if people walk there, paint the doors "
        "green in a mask and pass it as --mask"
    )
    return (Finding(kind="closed_off", file="", count=len(others), message=message),)


def _rooms_in(region: BoolArray, grid: CellGrid, labels: Sequence[PlanText]) -> str:
    """The room labels in a region (rows, columns), as the start of a part; empty if there are none."""
    cells = grid.cells_of(np.array([one.place_m for one in labels]).reshape(-1, 2))
    within = np.asarray(((cells >= 0) & (cells < grid.shape)).all(axis=1)).tolist()
    rooms = [
        one.text for one, (row, column), on in zip(labels, cells, within, strict=True) if on and region[row, column]
    ]
    more = f" and {len(rooms) - ROWS_NAMED} more" if len(rooms) > ROWS_NAMED else ""
    return f"{' / '.join(rooms[:ROWS_NAMED])}{more}: " if rooms else ""


def _place(parts: IntArray, part: int, grid: CellGrid) -> str:
    """The place of a region (its innermost cell), as ``(x, y)`` in metres."""
    clearance = clearance_cells(parts == part)
    cell = np.array(np.unravel_index(int(clearance.argmax()), clearance.shape))
    x, y = grid.centres_m(cell[None])[0].tolist()
    return f"({x:.1f}, {y:.1f})"


def regions(mask: BoolArray) -> IntArray:
    """Number (rows, columns) of each cell's region, by its sides; 0 outside."""
    _, labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=4, ltype=cv2.CV_32S)
    return np.asarray(labels)


def widened(mask: BoolArray) -> BoolArray:
    """The mask (rows, columns) and all pixels beside it."""
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), dtype=np.uint8)) > 0)


def parts_of(mask: BoolArray) -> tuple[IntArray, IntArray, IntArray]:
    """Number (rows, columns) of each pixel's part, by sides and corners, 0 outside; per part the box (5,) around it,
    left, top, width, height and area, and its longer side, pixels.
    """
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    boxes: IntArray = np.asarray(stats, dtype=np.int64)
    return np.asarray(labels), boxes, boxes[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]].max(axis=1)


def clearance_px(free: BoolArray) -> FloatArray:
    """Distance (rows, columns) of each free pixel's centre to the nearest other one's, in pixels."""
    return np.asarray(cv2.distanceTransform(free.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE))
