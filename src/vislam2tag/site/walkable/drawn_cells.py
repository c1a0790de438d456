"""Cells of a floor as its plan draws them: walls and areas, and where a plan drawn in polygons can be walked."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path, PurePosixPath

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from vislam2tag.common.errors import StoreError, SurveyError
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.cell_grid import CellGrid, WalkableArea
from vislam2tag.site.model import Floor, StoredFile
from vislam2tag.site.plan_formats.raster import IMAGES
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.plans.source import FloorPlan, PlanPolygon, Use
from vislam2tag.site.settings import WalkableSettings

WALL_M = 0.1
"""Thickness of walls that are given as lines, metres."""
_HOLDS_CELLS = 1.002
_FACES_M = 0.5
"""Lines closer beside each other are the faces of a wall: no passage is so narrow."""
_PARALLEL = 0.03
"""Sine of the greatest angle between faces of a wall."""
_ON_FACE_M = 0.01
"""Shorter stretches, and smaller differences of thickness, are none."""
_ASIDE_CELLS = 0.02
_LAP_M = 0.02
"""Openings reach this far over the walls that they open, metres."""


def plan_grid(plan: FloorPlan, settings: WalkableSettings) -> CellGrid:
    """Lay cells over a plan's extent."""
    left, right, low, high = plan.extent_m
    width, height = right - left, high - low
    cell_m = max(settings.cell_m, float(np.sqrt(width * height / settings.max_cells)))
    return CellGrid((left, low), cell_m, max(1, round(height / cell_m)), max(1, round(width / cell_m)))


def polygon_area(plan: FloorPlan, settings: WalkableSettings) -> WalkableArea | None:
    """Where a plan's polygons say that one can walk, parts that are closed off included; None where it has none."""
    if not any(polygon.use in (Use.WALKABLE, Use.OUTLINE) for polygon in plan.polygons):
        return None
    grid = plan_grid(plan, settings)
    free = polygon_floor(plan.polygons, grid) & ~drawn_walls(plan, grid)
    return WalkableArea(free, grid.origin_m, grid.cell_m)


def drawn_walls(plan: FloorPlan, grid: CellGrid) -> BoolArray:
    """Return which cells (rows, columns) lie in a plan's lines and obstacles."""
    walls = line_walls(plan.walls, grid, WALL_M) | use_cells(plan.polygons, Use.OBSTACLE, grid)
    return walls & ~use_cells(plan.polygons, Use.OPENING, grid)


def line_walls(walls: FloatArray, grid: CellGrid, thickness_m: float) -> BoolArray:
    """Return which cells lie in walls given as segments (w, 2, 2); none is thinner than a cell, so that all hold.

    Parallel lines close beside each other are the faces of one wall, which is as thick as they are apart.
    """
    least_m = _HOLDS_CELLS * grid.cell_m
    bodies, single = _bodies(walls, least_m)
    left, right, low, high = grid.extent_m
    half_m = grid.cell_m / 2
    single = single.clip((left + half_m, low + half_m), (right - half_m, high - half_m))  # the outer wall is inside
    lines = shapely.buffer(shapely.linestrings(single), max(thickness_m, least_m) / 2, cap_style="square")
    # Walls are often drawn on the borders of cells: then rounding would decide which cells are in them.
    aside_m = _ASIDE_CELLS * grid.cell_m
    aside = CellGrid((left - aside_m, low - aside_m), grid.cell_m, *grid.shape)
    return cells_in(shapely.union_all([*lines, *shapely.polygons(bodies)]), aside)


def _bodies(walls: FloatArray, least_m: float) -> tuple[FloatArray, FloatArray]:
    """Quadrilaterals (k, 4, 2) between faces of walls, and the parts (s, 2, 2) of segments (w, 2, 2) that are no face.

    Faces are at least ``least_m`` apart.
    """
    length = np.linalg.norm(walls[:, 1] - walls[:, 0], axis=1)
    walls, length = walls[length > 0], length[length > 0]
    along = (walls[:, 1] - walls[:, 0]) / length[:, None]
    across = np.column_stack((-along[:, 1], along[:, 0]))
    lines = shapely.linestrings(walls)
    one, other = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=_FACES_M)
    parallel = np.abs((across[one] * along[other]).sum(axis=1)) < _PARALLEL
    one, other = one[parallel], other[parallel]
    ends = walls[other] - walls[one, 0][:, None]
    place, offset = ((ends * axis[one][:, None]).sum(axis=2) for axis in (along, across))  # (pairs, ends) each
    low, high = place.min(axis=1).clip(min=0), np.minimum(place.max(axis=1), length[one])
    apart = offset.mean(axis=1)
    near = (high - low > _ON_FACE_M) & (np.abs(apart) > least_m - _ON_FACE_M) & (np.abs(apart) < _FACES_M)
    near[near] = _nearest(one[near], apart[near])
    one, other, low, high, place, offset, apart = (each[near] for each in (one, other, low, high, place, offset, apart))
    stretch = np.stack((low, high), axis=1)
    share = (stretch - place[:, :1]) / np.diff(place, axis=1)
    far = offset[:, :1] + share * np.diff(offset, axis=1)
    side = np.sign(apart)[:, None]
    far = side * np.maximum(side * far, least_m)
    base = walls[one, 0][:, None] + stretch[..., None] * along[one][:, None]
    opposite = base + far[..., None] * across[one][:, None]
    faces = np.concatenate((one, other))
    covered = np.concatenate((stretch, np.sort(share, axis=1) * length[other][:, None]))
    bare, parts = _uncovered(length, faces, covered)
    single: FloatArray = walls[bare, 0][:, None] + parts[..., None] * along[bare][:, None]
    return np.concatenate((base, opposite[:, ::-1]), axis=1), single


def _nearest(one: IntArray, apart: FloatArray) -> BoolArray:
    """Which pairs (n,) are those of the nearest other line on either side of ``one``."""
    side = 2 * one + (apart > 0)
    order = np.lexsort((np.abs(apart), side))
    first = np.ones(len(order), dtype=np.bool_)
    first[1:] = np.diff(side[order]) > 0
    nearest = np.zeros(len(order), dtype=np.bool_)
    nearest[order[first]] = True
    return nearest


def _uncovered(length: FloatArray, line: IntArray, covered: FloatArray) -> tuple[IntArray, FloatArray]:
    """Lines and stretches (s, 2) of lines of a ``length`` (w,) that no stretch (n, 2) of ``line`` (n,) covers."""
    every = np.arange(len(length))
    whole = np.concatenate((line, every, every))
    ends = np.column_stack((length, length))
    apart = whole * (length.max(initial=0.0) + 1.0)  # so that lines follow each other
    placed = np.concatenate((covered, 0 * ends, ends)) + apart[:, None]
    order = np.argsort(placed[:, 0], kind="stable")
    start, reached = placed[order, 0], np.maximum.accumulate(placed[order, 1])
    bare = np.flatnonzero((start[1:] - reached[:-1] > _ON_FACE_M) & (np.diff(whole[order]) == 0))
    stretches = np.stack((reached[bare], start[bare + 1]), axis=1) - apart[order[bare]][:, None]
    return whole[order[bare]], stretches


def polygon_floor(polygons: tuple[PlanPolygon, ...], grid: CellGrid) -> BoolArray:
    """Return which cells (rows, columns) polygons make walkable.

    Walkable polygons less obstacles, or the outline less obstacles where none is walkable. Openings lead through
    obstacles. Where the plan has openings, walkable polygons are walled off from each other except for their openings;
    one without any opening joins its neighbours.
    """
    by_use = {use: [_shape(polygon) for polygon in polygons if polygon.use is use] for use in Use}
    lap_m = WALL_M / 2 + _LAP_M
    openings = shapely.union_all([shapely.buffer(shape, lap_m, join_style="mitre") for shape in by_use[Use.OPENING]])
    floors = by_use[Use.WALKABLE] or by_use[Use.OUTLINE]
    if by_use[Use.OPENING]:
        floors = [_walled(shape, openings, WALL_M / 2) for shape in floors]
    floor = shapely.union_all([*floors, *([openings] if by_use[Use.WALKABLE] else [])])
    obstacles = shapely.difference(shapely.union_all(by_use[Use.OBSTACLE]), shapely.union_all(by_use[Use.OPENING]))
    return cells_in(shapely.difference(floor, obstacles), grid)


def use_cells(polygons: tuple[PlanPolygon, ...], use: Use, grid: CellGrid) -> BoolArray:
    """Return which cells (rows, columns) lie in a plan's polygons of this use."""
    return cells_in(shapely.union_all([_shape(polygon) for polygon in polygons if polygon.use is use]), grid)


def _shape(polygon: PlanPolygon) -> BaseGeometry:
    return shapely.make_valid(shapely.Polygon(polygon.outline, polygon.holes))


def _walled(shape: BaseGeometry, openings: BaseGeometry, wall_m: float) -> BaseGeometry:
    return shapely.buffer(shape, -wall_m, join_style="mitre") if shapely.intersects(shape, openings) else shape


def cells_in(shape: BaseGeometry, grid: CellGrid) -> BoolArray:
    """Return which cells (rows, columns) have their centre in polygons: an odd number of edges is to the left of it."""
    rings = [
        shapely.get_coordinates(ring)
        for part in shapely.get_parts(shape)
        if part.geom_type == "Polygon"
        for ring in (part.exterior, *part.interiors)
    ]
    if not rings:
        return np.zeros(grid.shape, dtype=np.bool_)
    placed = [(ring - grid.origin_m) / grid.cell_m - 0.5 for ring in rings]
    start = np.concatenate([ring[:-1] for ring in placed])
    stop = np.concatenate([ring[1:] for ring in placed])
    low, high = (np.ceil(pick(start[:, 1], stop[:, 1])).clip(0, grid.rows) for pick in (np.minimum, np.maximum))
    spans = (high - low).astype(np.int64)
    edge = np.repeat(np.arange(len(start)), spans)
    row = low[edge].astype(np.int64) + np.arange(len(edge)) - np.repeat(np.cumsum(spans) - spans, spans)
    slope = (stop - start)[edge]
    crossing = start[edge, 0] + (row - start[edge, 1]) / slope[:, 1] * slope[:, 0]
    column = np.ceil(crossing).clip(0, grid.columns).astype(np.int64)
    crossed = np.bincount(row * (grid.columns + 1) + column, minlength=grid.rows * (grid.columns + 1))
    odd = np.cumsum(crossed.reshape(grid.rows, -1), axis=1) % 2 == 1
    return np.asarray(odd[:, :-1])


CELL_M = 0.25
"""Walls need not be finer than steps are known."""
_PICTURE_PX = 512
"""No one looks at the picture of the plan here."""
_areas: dict[str, WalkableArea | None] = {}
"""What was read in this process, by its mark: the sessions of a floor share it."""


def drawing_mark(floor: Floor) -> str | None:
    """SHA-256 of the floor's drawing and of how it is placed; None where its plan is an image or cannot be read."""
    if floor.plan is None or floor.plan.suffix.lower() in IMAGES:
        return None
    try:
        content = floor.stored_plan.sha256 if floor.stored_plan else file_mark(floor.plan)
    except OSError:
        return None
    placing = [None if part is None else part.model_dump(mode="json") for part in (floor.source, floor.georeference)]
    placed = json.dumps([content, placing, floor.width_m, floor.height_m], sort_keys=True)
    return hashlib.sha256(placed.encode()).hexdigest()


def drawn_area(floor: Floor) -> WalkableArea | None:
    """Where the floor can be walked; None where its plan is not a drawing, or one that does not show it.

    Raises StoreError where the drawing is in a store and cannot be fetched as it was when the survey was opened.
    """
    mark = drawing_mark(floor)
    if mark is None:
        return None
    if mark not in _areas:
        with plan_at_hand(floor) as here:
            try:
                _areas[mark] = polygon_area(floor_plan(here, _PICTURE_PX), WalkableSettings(cell_m=CELL_M))
            except SurveyError:
                _areas[mark] = None
    return _areas[mark]


@contextmanager
def plan_at_hand(floor: Floor) -> Iterator[Floor]:
    """Yield the floor with its plan and mask on this machine, whichever opened the survey, while the block lasts."""
    stored_plan, stored_mask = floor.stored_plan, floor.stored_mask
    if stored_plan is None and stored_mask is None:
        yield floor
        return
    with scratch_folder() as scratch:
        plan = floor.plan if stored_plan is None else _fetched(stored_plan, scratch)
        mask = floor.mask if stored_mask is None else _fetched(stored_mask, scratch)
        yield replace(floor, plan=plan, mask=mask)


def _fetched(stored: StoredFile, scratch: Folder) -> Path:
    """Copy a file that is still as it was when the survey was opened; raises StoreError where it is not."""
    path = scratch / PurePosixPath(stored.name).name
    if stored.store.fetch(stored.name, scratch, path.name) is None or file_mark(path) != stored.sha256:
        raise StoreError(
            f"{stored.store.address}/{stored.name}: was changed during the run; run the same command again"
        )
    return path


def file_mark(path: Path) -> str:
    """SHA-256 of a file, or of the files in a folder (unpacked IMDF); raises OSError if one cannot be read."""
    if path.is_dir():
        marks = {one.name: file_mark(one) for one in path.iterdir() if one.is_file()}
        return hashlib.sha256(json.dumps(marks, sort_keys=True).encode()).hexdigest()
    return hashlib.sha256(read_bytes(path)).hexdigest()
