"""A new floor's plan before it is taken: which part of a page the building is, and whether its size fits its shape."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from vislam2tag.common.errors import UsageError
from vislam2tag.site.plans.drawing import Bounds
from vislam2tag.site.plans.load import PlanLook, look_at_plan, plan_called
from vislam2tag.site.plans.source import PlanSource

_SHAPE_TOLERANCE = 0.03
"""How far width by height may be from the picture's: whoever measures a building rounds to half a metre."""


def settled_source(
    path: Path, source: PlanSource, *, whole: bool = False, stretch: bool = False
) -> tuple[PlanSource, list[str]]:
    """Say which part of a plan counts, and what was decided, in sentences to tell.

    Of a sheet of paper that shows more than the building, the building is taken, or the page, whichever has the shape
    of the width and height given; ``whole``: always the page. ``stretch``: whatever the shape. Raises UsageError where
    width and height fit neither, or there is no scale, SurveyError where the plan cannot be read.
    """
    with plan_called(path):
        look = look_at_plan(path, source)
    if not look.is_picture:
        return source, []
    notes: list[str] = []
    if source.area is None and not whole and look.building is not None:
        source, notes = _without_margins(source, look, look.building)
    if source.extent is not None and not stretch:
        _refuse_other_shape(path, source, look)
    return source, notes


def no_scale(path: Path, source: PlanSource) -> str:
    """What to do about a plan of which no scale is known."""
    look = look_at_plan(path, source)
    paper = ""
    if look.paper_m is not None:
        width, height = (1000 * look.paper_m * each for each in _size(look.box))
        paper = f" ({width:.0f} mm x {height:.0f} mm on paper: --scale 1:100, or as it says, will do)"
    return (
        f"tells no scale{paper}; give --width-m or --height-m or both, two --point, --distance, --scale or --unit-m; "
        "--measure FILE.html writes a page to click a known distance on"
    )


def _without_margins(source: PlanSource, look: PlanLook, building: Bounds) -> tuple[PlanSource, list[str]]:
    """Take the building on a sheet, unless only the sheet has the shape given."""
    left, right, low, high = (round(edge, 1) for edge in building)
    asked = _shape_asked(source)
    if asked is not None and not _alike(asked, _size(building)) and _alike(asked, _size(look.box)):
        return source, [
            f"the size was taken for the whole page, whose shape it has; the drawing on it lies between "
            f"{left:g},{low:g} and {right:g},{high:g}: --area {left:g},{low:g},{right:g},{high:g} takes that instead"
        ]
    what = "has a frame" if look.framed else "is wider than what is drawn on it"
    return source.model_copy(update={"area": (left, low, right, high)}), [
        f"the page {what}: only the drawing between {left:g},{low:g} and {right:g},{high:g} was taken, and the size is "
        "its; --area page takes the whole page, --area X,Y,X,Y another part"
    ]


def _refuse_other_shape(path: Path, source: PlanSource, look: PlanLook) -> None:
    asked, size = _shape_asked(source), _size(look.box_of(source.area))
    if asked is None or _alike(asked, size):
        return
    assert source.extent is not None
    width_m, height_m = source.extent.width_m, source.extent.height_m
    assert width_m is not None
    page = ", nor has the page" if source.area is not None and look.building is not None else ""
    raise UsageError(
        f"{path}: what it shows is {size[0] / size[1]:.3f} times as wide as high, but {width_m:g} m x {height_m:g} m "
        f"is {asked:.3f}{page}; give --width-m {width_m:g} alone (the height is then "
        f"{width_m * size[1] / size[0]:.2f} m), the part that is so large by --area, or --stretch if its pixels are "
        "not square"
    )


def _shape_asked(source: PlanSource) -> float | None:
    extent = source.extent
    if extent is None or extent.width_m is None or extent.height_m is None:
        return None
    return extent.width_m / extent.height_m


def _alike(shape: float, size: Sequence[float]) -> bool:
    return abs(shape * size[1] / size[0] - 1) <= _SHAPE_TOLERANCE


def _size(box: Bounds) -> tuple[float, float]:
    return box[1] - box[0], box[3] - box[2]
