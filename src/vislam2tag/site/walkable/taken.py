"""What was taken of a plan: checks whether walls or doors are missing, and a picture."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import cv2
import numpy as np
from PIL import Image, ImageDraw

from vislam2tag.common.findings import ROWS_NAMED, counted
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.site.plans.room_labels import room_labels
from vislam2tag.site.plans.source import FloorPlan, Use
from vislam2tag.site.plans.taken_parts import TakenPart
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.painted_cells import clearance_cells, clearance_px, closed_off_cells, regions
from vislam2tag.site.walkable.space import WalkableSpace, walkable_space

LEAST_SHARE = 0.3
"""Where less of a building is walkable, something was taken for walls."""
MOST_CLOSED = 0.05
"""Where more of a building is closed off, doors may be missing."""
_WALL_M = 1.2
"""Walls between rooms are at most this thick, metres."""
_DOORS_M = (1.0, 1.5, 2.0)
"""Rooms are counted with passages of these widths closed, metres; the largest number counts."""
_ROOM_M2 = 0.25
"""What remains of a room where it is wider than a door, at least, square metres."""


_COARSE_M, _THIN_PX = 0.07, 1.3
"""Walls that are thinner, in larger pixels, get lost when a picture is made smaller."""
_FINE_M = 0.04
"""Pixels in which thin walls are two or three pixels wide, metres."""


@dataclass(frozen=True)
class PlanChecks:
    """Whether a plan's walkable space is plausible."""

    walkable_share: float
    """Of the building within its outline, 0 to 1."""
    rooms: int
    """Rooms and corridors, closed-off ones included."""
    labels: int
    """Room numbers on the plan, or room names if it has no numbers."""
    sentences: tuple[str, ...]
    """What is wrong, its cause and its cure; empty for a plausible plan."""


def plan_checks(plan: FloorPlan, space: WalkableSpace, options: Collection[str]) -> PlanChecks:
    """Check the walkable space that was found on a plan; ``options``: those of its format, which cures may name."""
    building, closed_off = _building(space), _closed_off(space)
    share, closed = (float(cells.sum() / max(building.sum(), 1)) for cells in (space.area.mask, closed_off))
    rooms = _rooms(space)
    labels = [one for one in room_labels(plan.texts) if _at(building, space, one.place_m)]
    sentences = []
    if share < LEAST_SHARE and closed < share:
        cures = {"layers": "choose the walls' layers with --walls", "ignore": "leave others out with --ignore"}
        cure = " or ".join(cure for name, cure in cures.items() if name in options) or "use a simpler plan"
        sentences.append(
            f"only {share:.0%} of the building is walkable, because other lines count as walls: {cure}, or paint the "
            "floor green in a mask"
        )
    elif share < LEAST_SHARE or closed > MOST_CLOSED:
        shut = [one.text for one in labels if _at(closed_off, space, one.place_m)]
        named = f", such as {', '.join(shut[:ROWS_NAMED])}" if shut else ""
        sentences.append(
            f"{share:.0%} of the building is walkable and {closed:.0%} is closed off{named}: doors may be drawn as "
            f"walls; {_open_doors(options)}"
        )
    if rooms < len(labels):
        drawn = len(plan.walls) or plan.polygons
        cure = (
            "check layers with --walls" if "layers" in options
            else "use a plan with all walls" if drawn else "use a plan with darker walls"
        )  # fmt: skip
        sentences.append(
            f"the plan has {len(labels)} room labels, but only {counted(rooms, 'room')}: walls may be missing; {cure}"
        )
    return PlanChecks(share, rooms, len(labels), tuple(sentences))


def picture_parts(plan: FloorPlan, space: WalkableSpace) -> tuple[tuple[TakenPart, ...], tuple[str, ...]]:
    """Which colours of a plan's picture were left out of the walls, and what to check about it, sentences; neither if
    the plan has geometry.
    """
    if len(plan.walls) or plan.polygons:
        return (), ()
    from vislam2tag.site.walkable.ink import thickness_drawn_px, wall_colours  # takes seconds to load

    lines, joined = wall_colours(plan)
    notes, pixel_m = lines.notes, max(plan.pixel_m)
    if pixel_m > _COARSE_M and thickness_drawn_px(plan) < _THIN_PX:
        side_px = int(np.ceil(max(plan.image.shape[:2]) * pixel_m / _FINE_M))
        notes += (
            f"walls are about 1 pixel wide at {pixel_m:.2f} m a pixel, so some may be missing: give a picture whose "
            f"longer side has at least {side_px:,} pixels",
        )
    if not joined or _closes(plan, space, lines.left_out):
        return lines.taken, notes
    note = (
        "coloured lines that were left out join the walls and close off no room: if they are walls, use a plan in "
        "black and white"
    )
    return lines.taken, (*notes, note)


def _closes(plan: FloorPlan, space: WalkableSpace, lines: BoolArray) -> bool:
    """Whether lines (rows, columns) on a plan's picture would close off a part of a space if they were walls."""
    image = np.where(lines[..., None], np.uint8(0 if plan.image.mean() > 127 else 255), plan.image)
    walled = walkable_space(replace(plan, image=image)).area.mask
    return bool(walled.sum() < (1 - MOST_CLOSED) * space.area.mask.sum())


def _open_doors(options: Collection[str]) -> str:
    return f"{'name their layers with --doors, or ' if 'doors' in options else ''}paint them green in a mask"


def _free(space: WalkableSpace) -> BoolArray:
    """Cells (rows, columns) that are no wall."""
    return space.area.mask if space.free is None else space.free


def _closed_off(space: WalkableSpace) -> BoolArray:
    """Cells (rows, columns) where people could walk if a door were open."""
    return closed_off_cells(_free(space), space.area.mask, space.area.grid, WalkableSettings())


def _building(space: WalkableSpace) -> BoolArray:
    """Cells (rows, columns) of the building: its floor, the walls between, and what they enclose."""
    margin = int(np.ceil(_WALL_M / space.area.cell_m))
    free = np.pad(_free(space), margin)
    near = clearance_px(~free) <= margin / 2
    closed = clearance_px(near) > margin / 2
    outside = regions(~(closed | free))
    return np.asarray((outside != outside[0, 0])[margin:-margin, margin:-margin])


def _rooms(space: WalkableSpace) -> int:
    """The number of rooms."""
    clearance_m = clearance_cells(_free(space)) * space.area.cell_m
    least = max(1.0, _ROOM_M2 / space.area.cell_m**2)
    return max(int((np.bincount(regions(clearance_m >= door / 2).ravel())[1:] >= least).sum()) for door in _DOORS_M)


def _at(cells: BoolArray, space: WalkableSpace, place_m: tuple[float, float]) -> bool:
    """Whether a place is in some of a space's cells (rows, columns)."""
    row, column = space.area.grid.cells_of(np.array([place_m]))[0].tolist()
    return 0 <= row < cells.shape[0] and 0 <= column < cells.shape[1] and bool(cells[row, column])


WALKABLE, LEFT_OUT, WALL, DOOR = (205, 235, 205), (225, 225, 225), (40, 40, 40), (0, 160, 0)
_OUTER_M = 0.3
"""Outer walls are drawn so thick, metres."""
_PIXELS = 2
"""Pixels along a cell's side."""


def taken_picture(plan: FloorPlan, space: WalkableSpace) -> Image.Image:
    """Draw what was taken: walls dark, doors green, walkable floor pale green, what was left out pale grey."""
    grid = space.area.grid
    near = clearance_px(~_building(space)) <= _OUTER_M / space.area.cell_m
    walls = near & ~_free(space)
    cells = np.select([space.area.mask[..., None], walls[..., None]], [WALKABLE, WALL], LEFT_OUT).astype(np.uint8)
    size = grid.columns * _PIXELS, grid.rows * _PIXELS
    image = Image.fromarray(np.asarray(cv2.resize(cells[::-1], size, interpolation=cv2.INTER_NEAREST)))
    canvas = ImageDraw.Draw(image)
    openings = [np.vstack((each.outline, each.outline[:1])) for each in plan.polygons if each.use is Use.OPENING]
    for line in (*plan.doors, *openings):
        canvas.line(_pixels(line, space), fill=DOOR, width=_PIXELS)
    return image


def _pixels(line: FloatArray, space: WalkableSpace) -> list[tuple[float, float]]:
    """Pixels of points (n, 2), BCS metres."""
    left, _, _, high = space.area.grid.extent_m
    placed = (line - (left, high)) / space.area.cell_m * (_PIXELS, -_PIXELS)
    return [(x, y) for x, y in placed.tolist()]
