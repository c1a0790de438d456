"""Where a floor can be walked, corrected by brush and polygon: strokes on the mask that ``site walkable`` takes."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.folder import Folder
from vislam2tag.pipeline.site.register import floor_of
from vislam2tag.site.floors import MASK_FILE
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.plans.source import FloorPlan
from vislam2tag.site.walkable.plan_cells import GREEN, RED, floor_mask, plan_grid
from vislam2tag.site.walkable.settings import WalkableSettings
from vislam2tag.site.walkable.space import walkable_space
from vislam2tag.studio.layers.walkable import rings_of
from vislam2tag.studio.prepare.messages import Stroke, WallsRequest, WallsView
from vislam2tag.studio.workspace import plan_stamp

_last: dict[str, FloorPlan] = {}
"""The plan looked at last, by what tells it."""


def corrected_floor(root: Path, request: WallsRequest, settings: WalkableSettings) -> WallsView:
    """The floor with its corrections and these strokes over them; with ``write`` they are kept beside its plan.

    Raises SurveyError where nothing can be walked then, OutputError where they cannot be written.
    """
    _, floor = floor_of(root, request.floor)
    before = None if request.anew else floor_mask(floor)
    plan = _plan_of(floor)
    mask = _painted(before, plan, request.strokes, settings)
    space = walkable_space(plan, settings, mask)
    if request.write:
        _write(root, f"floor_{floor.number}/{MASK_FILE}", mask)
    return WallsView(
        floor=floor.number,
        area_m2=float(space.area.mask.sum()) * space.area.cell_m**2,
        rings=rings_of(space),
        corrected=before is not None,
        notes=[finding.message for finding in space.findings],
    )


def _plan_of(floor: Floor) -> FloorPlan:
    key = f"{floor} {plan_stamp(floor)}"
    if key not in _last:
        _last.clear()
        _last[key] = floor_plan(floor)
    return _last[key]


def _painted(
    before: npt.NDArray[np.uint8] | None, plan: FloorPlan, strokes: list[Stroke], settings: WalkableSettings
) -> npt.NDArray[np.uint8] | None:
    """A correction (rows, columns, 4) over the plan's extent with strokes painted on it; None where there is none."""
    if before is None and not strokes:
        return None
    rows, columns = plan_grid(plan, settings).shape
    image = Image.new("RGBA", (columns, rows)) if before is None else Image.fromarray(before)
    left, right, low, high = plan.extent_m
    across, down = image.width / (right - left), image.height / (high - low)
    canvas = ImageDraw.Draw(image)
    for stroke in strokes:
        points = [((x - left) * across, (high - y) * down) for x, y in stroke.points]
        colour = (*(GREEN if stroke.walkable else RED), 255)
        if stroke.shape == "polygon":
            canvas.polygon(points, fill=colour)
        else:
            width = max(1, round(stroke.width_m * across))
            canvas.line(points, fill=colour, width=width, joint="curve")
            for x, y in (points[0], points[-1]):
                canvas.ellipse((x - width / 2, y - width / 2, x + width / 2, y + width / 2), fill=colour)
    return np.asarray(image)


def _write(root: Path, name: str, mask: npt.NDArray[np.uint8] | None) -> None:
    try:
        if mask is None:
            Folder.at(root).remove(name)
            return
        buffer = io.BytesIO()
        Image.fromarray(mask).save(buffer, "png")
        Folder.at(root).write(name, buffer.getvalue())
    except OSError as error:
        raise OutputError(f"{root / name}: cannot be written ({error.strerror}); check its permissions") from error
