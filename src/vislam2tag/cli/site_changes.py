"""``vislam2tag site``: set, renumber, remove, align."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, SiteFolder
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.site_init import InitOptions, numbers, plan_source, print_report, reported
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.errors import UsageError

if TYPE_CHECKING:
    from vislam2tag.pipeline.site.plan_report import PlanReport

_PLACING = ("width_m", "height_m", "scale", "distance", "point", "unit_m")
_PARTS = ("area", "walls", "doors", "ignore")
_ENTRIES = {"walls": "layers", "doors": "doors", "ignore": "ignore"}
"""Options that choose parts of a file, with their entries in ``site.toml``."""
_BACK = "none"
"""Value of such an option that takes back what was chosen."""
_OF_INIT = {each.name: each for each in fields(InitOptions)}


def _as_in_init(name: str) -> Any:
    """An option of ``site init``."""
    return field(default=_OF_INIT[name].default, metadata=_OF_INIT[name].metadata)


@dataclass(frozen=True, kw_only=True)
class SetOptions:
    """Arguments and options of ``vislam2tag site set``."""

    site: SiteFolder
    floor: int | None = option(None, "Number of the floor; needed if the site has several.")
    name: str | None = option(None, "Name of the floor.")
    elevation_m: float | None = option(None, "Height of the floor above the zero level.", metavar="METRES")
    building: str | None = option(None, "Name of the building.")
    lower_left: list[float] | None = option(
        None,
        "Building coordinates of the plan's lower left corner.",
        metavar="X,Y",
        parse=numbers(2, "X,Y in metres"),
    )
    width_m: float | None = _as_in_init("width_m")
    height_m: float | None = _as_in_init("height_m")
    scale: float | None = _as_in_init("scale")
    distance: list[float] | None = _as_in_init("distance")
    point: tuple[dict[str, list[float]], ...] = _as_in_init("point")
    unit_m: float | None = _as_in_init("unit_m")
    area: list[float] | str | None = _as_in_init("area")
    walls: tuple[str, ...] = _as_in_init("walls")
    doors: tuple[str, ...] = _as_in_init("doors")
    ignore: tuple[str, ...] = _as_in_init("ignore")
    exclude_room: tuple[str, ...] = option((), "Leave this room out of tours and coverage; repeatable.", metavar="NAME")
    include_room: tuple[str, ...] = option((), "Let an excluded room count again; repeatable.", metavar="NAME")
    json: AsJson = False


@command
def set_command(given: SetOptions) -> None:
    """Change a floor: its name, its elevation, or the size and place of its plan.

    Options have the meaning that they have in `site init`. Properties without an option stay. --lower-left alone moves
    the plan and keeps its size. --walls none, --doors none and --ignore none take back what was chosen before: then the
    names in the file count again. Landmarks and recordings are not changed.

    Exit code: 0 written, 2 wrong usage or unusable files, 130 interrupted.

    \b
    Examples:
      vislam2tag site set survey --building 'Town hall'
      vislam2tag site set survey --floor 1 --name 'First floor' \\
          --elevation-m 3.6
      vislam2tag site set survey --floor 1 --width-m 73.8
      vislam2tag site set survey --floor 1 --lower-left 0,0
      vislam2tag site set survey --floor 1 --exclude-room 'Server room'
    """
    placing = {name: getattr(given, name) for name in _PLACING if getattr(given, name) not in (None, ())}
    parts = [name for name in _PARTS if getattr(given, name) not in (None, ())]
    plan, notes = _other_plan(given, placing) if placing or parts else (None, [])
    corner = None if given.lower_left is None else (given.lower_left[0], given.lower_left[1])
    changes = api.FloorChanges(
        given.name, given.elevation_m, plan, corner, exclude_rooms=given.exclude_room, include_rooms=given.include_room
    )
    done = api.site_set(given.site, given.floor, changes, given.building)
    done = api.SiteChange(done.done, (*notes, *done.notes), done.restart)
    report = None if plan is None else reported(given.site, given.floor)
    _print_changed(done, given.site, given.json, "site set", report)


def _other_plan(given: SetOptions, placing: dict[str, Any]) -> tuple[Any, list[str]]:
    """How the floor's plan is read and placed with the options, and notes."""
    from vislam2tag.pipeline.site.change import floor_part
    from vislam2tag.pipeline.site.init import settled_source
    from vislam2tag.site.plans.source import SCALES
    from vislam2tag.site.site_file import read_site_file

    before = floor_part(given.site, read_site_file(given.site), given.floor).plan
    if before is None:
        raise UsageError("the floor has no plan; remove it and add it with vislam2tag site init")
    corner = given.lower_left
    if corner is None and placing.keys().isdisjoint(("point", "unit_m")):
        old = before.extent or before.distance or before.scale
        corner = None if old is None else list(old.lower_left_m)
    back = {_ENTRIES[name] for name in _ENTRIES if getattr(given, name) == (_BACK,)}
    parts: dict[str, Any] = {name: () if _ENTRIES.get(name) in back else getattr(given, name) for name in _PARTS}
    options = InitOptions(site=given.site, lower_left=corner if placing else None, **parts, **placing)
    asked = plan_source(options, Path(before.file))
    names = asked.model_fields_set - {"file"}
    replaced = names | back | (set(SCALES) if placing else set())
    kept = {name: value for name, value in before if name not in replaced}
    if given.area == "page":
        kept["area"] = None
    source = type(before).model_validate(kept | {name: getattr(asked, name) for name in names})
    return settled_source(given.site / before.file, source, whole=source.area is None)


@command
def renumber_command(
    *,
    site: SiteFolder,
    old: int = argument("Number of the floor."),
    new: int = argument("Its new number."),
    json: AsJson = False,
) -> None:
    """Give a floor another number.

    Changes site.toml, the folder floor_K, landmark files, corrections.toml and the record of a registration. A floor
    with recorded walks is not renumbered, because recordings are never changed.

    Exit code: 0 written, 2 wrong usage or unusable files, 130 interrupted.

    \b
    Examples:
      vislam2tag site renumber survey 1 0
      vislam2tag site renumber survey 0 -1
    """
    done = api.site_renumber(site, old, new)
    _print_changed(done, site, json, "site renumber")


@command
def remove_command(
    *,
    site: SiteFolder,
    floor: int = option(..., "Number of the floor."),
    json: AsJson = False,
) -> None:
    """Take a floor out of a site.

    No file is deleted: those in floor_K are kept in the folder removed_floor_K. A floor with recorded walks is not
    removed.

    Exit code: 0 written, 2 wrong usage or unusable files, 130 interrupted.

    \b
    Example:
      vislam2tag site remove survey --floor 2
    """
    _print_changed(api.site_remove(site, floor), site, json, "site remove")


def _pair(text: str, name: str) -> tuple[tuple[float, float], tuple[float, float]]:
    form = "X,Y=X,Y: a point on the floor, then the same point on the other floor, metres"
    here, _, there = text.partition("=")
    (x, y), (other_x, other_y) = (numbers(2, form)(part, name) for part in (here, there))
    return (x, y), (other_x, other_y)


@command
def align_command(
    *,
    site: SiteFolder,
    floor: int = option(..., "Floor to move."),
    onto: int = option(..., "Floor that stays."),
    pair: tuple[tuple[tuple[float, float], tuple[float, float]], ...] = option(
        (),
        "A point on both floors in their building coordinates, such as a lift; pass two or more.",
        metavar="X,Y=X,Y",
        parse=_pair,
    ),
    page: Path | None = option(None, "Write an HTML page where you click the points on both plans.", metavar="FILE"),
    json: AsJson = False,
) -> None:
    """Lay a floor on top of another one by two common points, such as a lift and a stairwell.

    The floor is turned and moved, not scaled. A difference in scale of more than 3 % is an error. Coordinates on the
    floor stay: site.toml describes how its frame lies on the other one.

    Exit code: 0 written, 2 wrong usage or unusable files, 130 interrupted.

    \b
    Examples:
      vislam2tag site align survey --floor 1 --onto 0 --page align.html
      vislam2tag site align survey --floor 1 --onto 0 \\
          --pair 12.5,8=14,8.2 --pair 40.1,3=41.5,3.3
    """
    if page is not None:
        _write_page(page, site, floor, onto, json)
    _print_changed(api.site_align(site, floor, onto, pair), site, json, "site align")


def _write_page(page: Path, site: Path, floor: int, onto: int, json: bool) -> None:
    """Write the page to click common points on, and end."""
    import shlex

    from vislam2tag.site.discover import read_site, refuse_unknown_floors
    from vislam2tag.views.click_pages import write_align_page

    whole, _ = read_site(site)
    refuse_unknown_floors(whole, (floor, onto))
    words = ["vislam2tag", "site", "align", str(site), "--floor", str(floor), "--onto", str(onto)]
    write_align_page(page, whole.floor(floor), whole.floor(onto), shlex.join(words))
    answer({"page": page}, json, lambda: next_step("site align, page", page=page))


def _print_changed(
    change: api.SiteChange, site: Path, json: bool, after: str, report: PlanReport | None = None
) -> None:
    def show() -> None:
        for line in change.done:
            say(line)
        for note in change.notes:
            say(f"note: {note}")
        if report is not None:
            print_report(report)
        next_step("site set, planned" if change.restart else after, site=site)

    answer(asdict(change) | ({} if report is None else {"plan": report}), json, show)
