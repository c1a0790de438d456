"""Loading a floor's plan, whatever its format, into the BCS."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image
from shapely.geometry import LineString

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.folder import Folder
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.transforms import Affine2
from vislam2tag.intake.extents import FLOOR, fitting_units, too_far
from vislam2tag.site.georeference import Georeference
from vislam2tag.site.model import Floor
from vislam2tag.site.plan_formats.raster import IMAGES
from vislam2tag.site.plans.drawing import Bounds, PlanDrawing, mapped, mapped_texts, placed, read_drawing
from vislam2tag.site.plans.images import (
    GREATEST_PX,
    PIXEL_M,
    building_on_sheet,
    drawn_plan,
    is_sheet,
    load_plan,
    turned_bounds,
    upright,
)
from vislam2tag.site.plans.indoor import REACH_M
from vislam2tag.site.plans.reader_process import read_guarded
from vislam2tag.site.plans.source import Extent, FloorPlan, PlanPolygon, PlanSource, Point, ScalePoint, Use
from vislam2tag.site.plans.taken_parts import TakenPart

_TRIED_PX = 64
"""Size at which a picture is drawn only to see that it can be."""


def floor_plan(floor: Floor, side_px: int = GREATEST_PX) -> FloorPlan:
    """Load a floor's plan in its BCS, its image's longer side at most ``side_px`` pixels.

    Raises SurveyError where the floor has none, it cannot be read, has no scale, or is an image of one colour only.
    """
    if floor.plan is None:
        raise SurveyError(
            f"floor {floor.number}: has no plan; add floor_{floor.number}/floorplan.jpg, or name the plan in site.toml"
        )
    try:
        plan = read_guarded(floor.plan, _load, floor, floor.plan, side_px)
    except OSError as error:
        raise SurveyError(f"{floor.plan}: the plan of floor {floor.number} {error}") from error
    if plan.image.size and (plan.image == plan.image[:1, :1]).all():
        raise SurveyError(
            f"{floor.plan}: the plan of floor {floor.number} shows nothing: all its pixels have the same colour; "
            "replace it"
        )
    return plan


def plan_picture(floor: Floor, side_px: int) -> Image.Image:
    """Draw a floor's plan over exactly its extent, its longer side at most ``side_px`` pixels.

    Raises OSError, whose text completes a sentence about the plan's file, where it cannot be read.
    """
    if floor.plan is None:
        raise OSError("is not there")
    image = Image.fromarray(read_guarded(floor.plan, _load, floor, floor.plan, side_px).image)
    image.thumbnail((side_px, side_px), Image.Resampling.LANCZOS)
    return image


def plan_file(floor: Floor, folder: Folder) -> Path | None:
    """Return an image file that shows exactly the floor's extent: the plan's own, or one drawn into ``folder``.

    None where the floor has no plan, or one that cannot be drawn.
    """
    if floor.plan is None or floor.source is None or _is_upright_image(floor.plan, floor.source):
        return floor.plan
    name = f"floor_{floor.number}.png"
    try:
        picture = plan_picture(floor, GREATEST_PX)
    except OSError:
        return None
    with folder.writing(name) as file:
        picture.save(file, "PNG")
    return folder / name


def _is_upright_image(path: Path, source: PlanSource) -> bool:
    return source.points is None and source.area is None and path.suffix.lower() in IMAGES


def plan_extent(path: Path, source: PlanSource, georeference: Georeference | None) -> Bounds:
    """Left, right, lower and upper edge of a plan in the BCS, metres.

    Raises OSError as :func:`plan_picture` does, also for a picture whose size is known but which cannot be drawn.
    """
    return read_guarded(path, _extent, path, source, georeference)


def plan_moved(path: Path, source: PlanSource, lower_left_m: Point) -> PlanSource:
    """How to read a plan that is shifted so that its lower left corner is at a point, BCS metres.

    Raises OSError as :func:`plan_picture` does, also for a plan that is placed by its coordinates on earth.
    """
    return read_guarded(path, _moved, path, source, lower_left_m)


@dataclass(frozen=True)
class PlanLook:
    """What a plan's file shows, before it has a scale; boxes are left, right, lower and upper edge in its own
    coordinates, as it counts them.
    """

    box: Bounds
    building: Bounds | None
    """Of a sheet of paper: the box around what is drawn in its frame; None where that is the whole plan."""
    framed: bool
    is_picture: bool
    downwards: bool
    paper_m: float | None
    """Metres on paper a unit, if the file says so."""
    unit_m: float | None = None
    """Metres a unit, if the file says so."""
    door: float | None = None
    """Radius of the usual door swing in the file's units, if swings are drawn."""
    drawn: Bounds | None = None
    """Of a picture without a frame: the box around the largest drawing; None if that fills the picture."""
    levels: tuple[str, ...] = ()
    """Names of the file's levels, where it has levels."""
    taken: tuple[TakenPart, ...] = ()
    """What each part of the file became; empty for pictures."""
    notes: tuple[str, ...] = ()
    """What to check about how the file was read, sentences."""

    def box_of(self, area: Sequence[float] | None) -> Bounds:
        """The box of an ``area`` of the plan, else of all of it."""
        if area is None:
            return self.box
        return min(area[::2]), max(area[::2]), min(area[1::2]), max(area[1::2])


@contextmanager
def plan_called(name: object) -> Iterator[None]:
    """Raise SurveyError, which calls the plan by this name, in place of OSError about its file."""
    try:
        yield
    except OSError as error:
        raise SurveyError(f"{name}: the plan {error}") from error


def look_at_plan(path: Path, source: PlanSource) -> PlanLook:
    """Look at a plan's file; raises OSError as :func:`plan_picture` does."""
    return read_guarded(path, _look, path, source)


def unplaced_picture(path: Path, source: PlanSource, side_px: int) -> Image.Image:
    """Draw a plan's file between its box, before it has a scale, its longer side at most ``side_px`` pixels.

    Raises OSError as :func:`plan_picture` does.
    """
    return Image.fromarray(read_guarded(path, _unplaced, path, source, side_px))


def check_image(path: Path) -> None:
    """Raise OSError, whose text completes a sentence about the file, where it is not a whole image."""
    read_guarded(path, _decode, path)


def _decode(path: Path) -> None:
    load_plan(path, side_px=1)


def _look(path: Path, source: PlanSource) -> PlanLook:
    drawing = read_drawing(path, source)
    box, framed = (None, False) if drawing.picture is None else building_on_sheet(drawing)
    if box is not None and drawing.downwards:
        top, bottom = drawing.bounds[3], drawing.bounds[2]
        box = (*box[:2], top + bottom - box[3], top + bottom - box[2])
    certain = framed or is_sheet(drawing)
    return PlanLook(
        drawing.bounds,
        box if certain else None,
        framed,
        drawing.picture is not None,
        drawing.downwards,
        drawing.paper_m,
        drawing.unit_m,
        drawing.door,
        None if certain else box,
        drawing.levels,
        drawing.taken,
        drawing.notes,
    )


def _unplaced(path: Path, source: PlanSource, side_px: int) -> npt.NDArray[np.uint8]:
    drawing = read_drawing(path, source)
    if drawing.picture is not None:
        return np.asarray(drawing.picture(side_px).convert("RGB"))
    scale = max(drawing.bounds[1] - drawing.bounds[0], drawing.bounds[3] - drawing.bounds[2]) / (side_px * PIXEL_M)
    fine = mapped(drawing, lambda points: points / scale)  # so that its walls come out as wide as of a building
    return drawn_plan(fine.bounds, fine.polygons, fine.walls, fine.doors, side_px)


def _extent(path: Path, source: PlanSource, georeference: Georeference | None) -> Bounds:
    drawing, bcs_T_plan = placed(read_drawing(path, source), source, georeference)
    if drawing.picture is None:
        extent = mapped(drawing, lambda points: bcs_T_plan @ points).bounds
    else:
        drawing.picture(_TRIED_PX)
        extent = turned_bounds(drawing.bounds, bcs_T_plan)
    _refuse_size(extent, drawing)
    return extent


def _moved(path: Path, source: PlanSource, lower_left_m: Point) -> PlanSource:
    whole = read_drawing(path, source)
    if (source.epsg or whole.epsg) is not None:
        raise OSError("is placed by its coordinates on earth; correct the georeference of the site instead")
    drawing, bcs_T_plan = placed(whole, source, None)
    for name in ("extent", "distance", "scale"):
        if (part := getattr(source, name)) is not None:
            return source.model_copy(update={name: part.model_copy(update={"lower_left_m": lower_left_m})})
    left, right, low, high = drawing.bounds
    edges = np.array([(left, (low + high) / 2), (right, (low + high) / 2)])
    corner = turned_bounds(drawing.bounds, bcs_T_plan)
    places = bcs_T_plan @ edges - (corner[0], corner[2]) + lower_left_m
    if drawing.downwards:
        edges[:, 1] = whole.bounds[2] + whole.bounds[3] - edges[:, 1]
    first, second = (
        ScalePoint(plan=(px, py), bcs_m=(x, y))
        for (px, py), (x, y) in zip(edges.tolist(), places.tolist(), strict=True)
    )
    return source.model_copy(update={"points": (first, second), "unit_m": None})


def _refuse_size(extent: Bounds, drawing: PlanDrawing) -> None:
    """Raise OSError, whose text completes a sentence about the file, for a plan that is not a building's."""
    left, right, low, high = drawing.bounds
    fitting = "" if drawing.picture else fitting_units((right - left, high - low), drawing.door)
    left, right, low, high = extent
    if FLOOR.refuses(right - left) or FLOOR.refuses(high - low):
        raise OSError(
            f"is {right - left:g} m wide and {high - low:g} m high, from ({left:g}, {low:g}) to ({right:g}, "
            f"{high:g}); a side may be {FLOOR.least_m:g} to {FLOOR.greatest_m:g} m long: correct its scale"
            f"{f' ({fitting})' if fitting else ''}, or remove lines that are drawn far away"
        )
    if far := too_far(["a corner"], np.array([[max(map(abs, extent)), 0.0]])):
        raise OSError(f"cannot be used: {far}. For the plan, pass --lower-left 0,0")


def _load(floor: Floor, path: Path, side_px: int) -> FloorPlan:
    source = floor.source or _published(floor, path)
    drawing, bcs_T_plan = placed(read_drawing(path, source), source, floor.georeference)
    if drawing.picture is not None:
        _refuse_size(turned_bounds(drawing.bounds, bcs_T_plan), drawing)
        side_px = min(side_px, _useful_px(drawing, bcs_T_plan))
        image, extent = upright(drawing.picture(side_px), drawing.bounds, bcs_T_plan)
        return FloorPlan(extent, image, texts=mapped_texts(drawing.texts, lambda points: bcs_T_plan @ points))
    own = mapped(drawing, lambda points: bcs_T_plan @ points)
    _refuse_size(own.bounds, drawing)
    polygons = (*own.polygons, *(_opening(line) for line in own.passages))
    image = drawn_plan(own.bounds, polygons, own.walls, own.doors, side_px)
    return FloorPlan(own.bounds, image, polygons, own.walls, own.texts, own.doors)


def _useful_px(drawing: PlanDrawing, bcs_T_plan: Affine2) -> int:
    """Longer side of a picture that shows all there is: its own pixels, or those of drawn plans."""
    left, right, low, high = drawing.bounds
    if drawing.pixels:
        return math.ceil(max(right - left, high - low))
    sides_m = np.linalg.norm(bcs_T_plan.matrix, axis=0) * (right - left, high - low)
    return max(1, math.ceil(float(sides_m.max()) / PIXEL_M))


def _published(floor: Floor, path: Path) -> PlanSource:
    """A plan of the published layout covers exactly the floor's extent."""
    if floor.width_m is None or floor.height_m is None:
        raise OSError("has no scale, because no file contains the floor's size; add it to floor_dimensions.csv")
    return PlanSource(file=path.name, extent=Extent(width_m=floor.width_m, height_m=floor.height_m))


def _opening(line: FloatArray) -> PlanPolygon:
    """The polygon about a passage (k, 2), BCS metres."""
    area = LineString(line).buffer(REACH_M, cap_style="flat", join_style="mitre")
    return PlanPolygon(np.asarray(area.exterior.coords)[:-1], (), Use.OPENING)
