"""What was taken from a floor's plan, and what looks wrong about it."""

from __future__ import annotations

import filecmp
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.intake.extents import LARGE_PLAN_M, fitting_units, is_other_size, scale_doubt
from vislam2tag.pipeline.site.floor_fit import floor_fit_notes
from vislam2tag.site.discover import read_site
from vislam2tag.site.links import survey_output
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.drawing import Bounds, format_of
from vislam2tag.site.plans.load import PlanLook, floor_plan, look_at_plan, plan_called
from vislam2tag.site.plans.source import SCALES, PlanSource
from vislam2tag.site.plans.taken_parts import TakenPart
from vislam2tag.site.walkable.space import walkable_space
from vislam2tag.site.walkable.taken import picture_parts, plan_checks, taken_picture

PICTURE = "plan_as_read.png"


@dataclass(frozen=True)
class PlanReport:
    """How the plan of a floor was read."""

    floor: int
    taken: tuple[TakenPart, ...]
    """What each layer or class of its file became; empty for pictures."""
    warnings: tuple[str, ...]
    """What looks wrong, with cause and cure, sentences."""
    picture: Path | None
    """Walls, doors and walkable space as they were taken; None if nothing can be walked."""


def report_plan(root: AnyPath, number: int | None = None) -> PlanReport:
    """Find the walkable space of a floor's plan, check it, and draw it to ``floor_K/plan_as_read.png``.

    No ``number``: the first floor.

    Raises SurveyError if the floor or its plan cannot be read, OutputError if the picture cannot be written.
    """
    root = Path(root)
    site, _ = read_site(root)
    floor = site.floors[0] if number is None else site.floor(number)
    if floor.plan is None or floor.source is None:
        raise SurveyError(f"{root}: floor {floor.number} has no plan; add one with vislam2tag site init --plan")
    with plan_called(floor.plan):
        look, options = look_at_plan(floor.plan, floor.source), format_of(floor.plan).options
    plan = floor_plan(floor)
    warnings = [*look.notes, *floor_fit_notes(root, floor.number)]
    if len(look.levels) > 1:
        warnings += [_same_level(floor, other) for other in site.floors if _show_the_same(floor, other)][:1]
    wrong_scale = _wrong_scale(look, floor.source, plan.extent_m)
    warnings += _other_size(look, floor.source, plan.extent_m) or wrong_scale
    left, right, low, high = plan.extent_m
    if max(right - left, high - low) > LARGE_PLAN_M and not wrong_scale:
        warnings.append(f"the plan is {right - left:,.0f} m wide and {high - low:,.0f} m high: check its unit")
    try:
        space = walkable_space(plan)
    except SurveyError as error:
        return PlanReport(floor.number, look.taken, (*warnings, *([] if wrong_scale else [str(error)])), None)
    picture = root / f"floor_{floor.number}" / PICTURE
    with survey_output(picture), Folder.at(root).writing(picture.relative_to(root).as_posix()) as file:
        taken_picture(plan, space).save(file, "PNG")
    parts, notes = picture_parts(plan, space)
    # With a wrong scale, checks would only follow from it.
    warnings += [] if wrong_scale else [*notes, *plan_checks(plan, space, options).sentences]
    return PlanReport(floor.number, (*look.taken, *parts), tuple(warnings), picture)


def _show_the_same(floor: Floor, other: Floor) -> bool:
    """Whether two floors have the same level of the same file or folder."""
    if floor is other or floor.plan is None or other.plan is None or floor.source is None or other.source is None:
        return False
    if (floor.source.level, floor.plan.name) != (other.source.level, other.plan.name):
        return False
    files, others = _files(floor.plan), _files(other.plan)
    return len(files) == len(others) and all(map(_are_equal, files, others))


def _are_equal(one: Path, other: Path) -> bool:
    return filecmp.cmp(one, other, shallow=False)


def _files(plan: Path) -> list[Path]:
    return sorted(plan.glob("*.geojson")) if plan.is_dir() else [plan]


def _same_level(floor: Floor, other: Floor) -> str:
    assert floor.source is not None
    return (
        f"floor {floor.number} and floor {other.number} show the same level {floor.source.level} of the same file: "
        "remove one of them with vislam2tag site remove, and add it with another --level"
    )


_OPTIONS = {name: f"--{name}".replace("_", "-") for name in SCALES} | {"extent": "--width-m", "points": "--point"}
"""Options that give a plan its scale."""


def _wrong_scale(look: PlanLook, source: PlanSource, extent_m: Bounds) -> list[str]:
    """Report a scale of the user's that makes no floor, with units that do."""
    option = next((_OPTIONS[name] for name in SCALES if getattr(source, name) is not None), None)
    if option is None:
        return []
    left, right, low, high = look.box_of(source.area)
    sides = right - left, high - low
    doubt = scale_doubt(sides, look.door, max(extent_m[1] - extent_m[0], extent_m[3] - extent_m[2]) / max(sides))
    fitting = "" if look.is_picture else fitting_units(sides, look.door)
    return [f"{doubt}: correct {option}{f', or use {fitting}' if fitting else ''}"] if doubt else []


def _other_size(look: PlanLook, source: PlanSource, extent_m: Bounds) -> list[str]:
    """Report if a plan has another size than its file says."""
    if look.unit_m is None or all(getattr(source, name) is None for name in SCALES):
        return []
    sides, box = (extent_m[1] - extent_m[0], extent_m[3] - extent_m[2]), look.box_of(source.area)
    stated = ((box[1] - box[0]) * look.unit_m, (box[3] - box[2]) * look.unit_m)
    if not is_other_size(max(sides) / max(stated)):
        return []
    return [
        f"the plan is {sides[0]:.2f} m x {sides[1]:.2f} m as given, but {stated[0]:.2f} m x {stated[1]:.2f} m by its "
        "file: leave the size out to use that of the file"
    ]
