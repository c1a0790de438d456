"""Starts a site: adds a plan as a floor of ``site.toml``, or describes the published layout by one.

For a plan, the part of the page with the building is found, and its size is compared with its shape.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import OutputError, SurveyError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath, read_json
from vislam2tag.site.discover import read_site
from vislam2tag.site.floors import INFO_FILE, OUTLINES
from vislam2tag.site.links import survey_output, write_in_survey
from vislam2tag.site.model import ControlPoints, Floor, floor_number
from vislam2tag.site.plans.drawing import FORMATS, NO_SCALE, Bounds, format_of
from vislam2tag.site.plans.load import PlanLook, floor_plan, look_at_plan, plan_called
from vislam2tag.site.plans.reader_process import read_guarded
from vislam2tag.site.plans.source import Extent, PlanSource
from vislam2tag.site.site_file import (
    SITE_FILE,
    FloorPart,
    GeoreferencePart,
    SiteFile,
    has_site_file,
    read_site_file,
    site_file_text,
)


@dataclass(frozen=True)
class NewFloor:
    """A floor to add; ``part.plan`` specifies how to read ``plan``, a file anywhere."""

    plan: AnyPath
    part: FloorPart


def competition_floor(folder: Path, number: int | None) -> NewFloor:
    """A floor's folder of the Indoor Location Competition 2.0, with a map that fills the floor's extent.

    ``number`` is the floor's; None: from the folder's name. Raises SurveyError if its files cannot be used.
    """
    path = folder / INFO_FILE
    try:
        extent = read_json(path)["map_info"]
        source = PlanSource(file=OUTLINES, extent=Extent(width_m=extent["width"], height_m=extent["height"]))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SurveyError(f'{path}: expected {{"map_info": {{"width": ..., "height": ...}}}} in metres') from error
    name = folder.resolve().name
    number = floor_number(name) if number is None else number
    if number is None:
        raise UsageError(f"--floor: {name} is not a floor name such as F4 or B1; give its number")
    return NewFloor(folder / OUTLINES, FloorPart(number=number, name=name, plan=source))


def is_competition_floor(path: Path) -> bool:
    """Whether a path is such a folder."""
    return (path / INFO_FILE).is_file()


def add_floor(
    root: AnyPath, new: NewFloor, building: str = "", georeference: GeoreferencePart | None = None
) -> SiteFile:
    """Copy a plan to a survey's folder, unless it is already there, and describe it in ``site.toml``.

    ``building`` and ``georeference`` replace those of the file, if given. Raises SurveyError or
    UsageError if the plan cannot be used or the floor already exists, OutputError if nothing can be written.
    """
    root = Path(root)
    site = read_site_file(root) if has_site_file(root) else None
    floors = () if site is None else site.floors
    if any(floor.number == new.part.number for floor in floors):
        raise UsageError(
            f"--floor {new.part.number}: {root / SITE_FILE} already has that floor; change it with vislam2tag site set"
        )
    earth = georeference or (None if site is None else site.georeference)
    check_plan(new, earth)
    inside = _inside(root, new)
    assert new.part.plan is not None
    plan = new.part.plan.model_copy(update={"file": inside.as_posix()})
    part = new.part.model_copy(update={"plan": plan})
    whole = SiteFile(
        name=building or ("" if site is None else site.name),
        georeference=earth,
        floors=tuple(sorted((*floors, part), key=lambda floor: floor.number)),
    )
    _copy(Path(new.plan), root, inside)
    write_site(root, whole)
    return whole


def describe_published(root: Path, building: str = "", georeference: GeoreferencePart | None = None) -> SiteFile:
    """Write the ``site.toml`` of a survey in the published layout; its files stay as they are.

    Raises UsageError if it has one, SurveyError if it is not a survey.
    """
    if has_site_file(root):
        raise UsageError(f"{root / SITE_FILE}: the file already exists; edit it, or add a floor with --plan")
    site, _ = read_site(root, follow_links=True)
    parts = tuple(_published_part(root, floor) for floor in site.floors)
    whole = SiteFile(name=building, georeference=georeference, floors=parts)
    write_site(root, whole)
    return whole


def _published_part(root: Path, floor: Floor) -> FloorPart:
    plan = None
    if floor.plan is not None and floor.width_m is not None and floor.height_m is not None:
        extent = Extent(width_m=floor.width_m, height_m=floor.height_m)
        plan = PlanSource(file=floor.plan.relative_to(root).as_posix(), extent=extent)
    name = "" if floor.name == f"Floor {floor.number}" else floor.name
    return FloorPart(number=floor.number, name=name, elevation_m=floor.elevation_m, plan=plan)


def check_plan(new: NewFloor, earth: GeoreferencePart | None) -> None:
    """Load a plan with its future description; raises SurveyError or UsageError if that fails."""
    georeference = None if earth is None else earth.georeference()
    points = ControlPoints((), np.empty((0, 2)))
    floor = Floor(
        new.part.number, "", None, None, None, Path(new.plan), points, source=new.part.plan, georeference=georeference
    )
    try:
        floor_plan(floor)
    except SurveyError as error:
        if str(error.__cause__) == NO_SCALE:
            assert new.part.plan is not None
            raise UsageError(f"{new.plan}: {no_scale(Path(new.plan), new.part.plan)}") from error
        raise


def _inside(root: Path, new: NewFloor) -> Path:
    """Present or future path of the plan in the survey's folder."""
    plan = Path(new.plan).resolve()
    if plan.is_relative_to(root.resolve()):
        return plan.relative_to(root.resolve())
    return Path(f"floor_{new.part.number}") / plan.name


def _copy(source: Path, root: Path, inside: Path) -> None:
    target = root / inside
    if target.exists() and target.resolve() == source.resolve():
        return
    if target.exists():
        raise OutputError(f"{target}: the file already exists; remove it, or use it with --plan")
    files = [path for path in sorted(source.rglob("*")) if path.is_file()] if source.is_dir() else [source]
    with survey_output(target):
        for path in files:
            Folder.at(root).copy(path, (inside / path.relative_to(source)).as_posix())


def write_site(root: Path, site: SiteFile) -> None:
    """Write the ``site.toml`` of a survey; raises OutputError if that fails."""
    write_in_survey(root, root / SITE_FILE, site_file_text(site))


_SHAPE_TOLERANCE = 0.03
"""Tolerance of width by height against the picture's, because measured sizes are rounded to half a metre."""


def settled_source(
    path: Path, source: PlanSource, *, whole: bool = False, stretch: bool = False
) -> tuple[PlanSource, list[str]]:
    """Choose the part of a plan to use, and describe the decision in sentences.

    If a page shows more than the building, the building or the page is used, depending on which matches the given width
    and height; ``whole``: always the page. ``stretch``: any shape. Raises UsageError if
    width and height fit neither, there is no scale, or an option does not apply to the plan's format, SurveyError if
    the plan cannot be read.
    """
    _refuse_options(path, source)
    with plan_called(path):
        look = look_at_plan(path, source)
    if not look.is_picture:
        return source, []
    notes: list[str] = []
    if source.area is None and not whole:
        if look.building is not None:
            source, notes = _without_margins(source, look, look.building)
        elif look.drawn is not None and source.extent is not None:
            notes = [_size_of_picture(look.box, look.drawn)]
    if source.extent is not None and not stretch:
        _refuse_other_shape(path, source, look)
    return source, notes


_OPTIONS = {"layers": "--walls"} | {
    name: f"--{name}" for name in ("page", "level", "doors", "ignore", "others", "epsg", "area")
}
"""Entries of a plan's source that not every format uses, as options."""


def _refuse_options(path: Path, source: PlanSource) -> None:
    """Raise UsageError for what is given but does not apply to the plan's format."""
    with plan_called(path):
        own = read_guarded(path, format_of, path)
    for name, option in _OPTIONS.items():
        if getattr(source, name) != PlanSource.model_fields[name].default and name not in own.options:
            suitable = ", ".join(each.name for each in FORMATS.all().values() if name in each.options)
            raise UsageError(
                f"{option}: does not apply to {path}, a plan of the format {own.name}, but to {suitable}; leave it out"
            )


def _size_of_picture(whole: Bounds, drawn: Bounds) -> str:
    left, right, low, high = (round(edge) for edge in drawn)
    return (
        f"the size applies to the whole picture, which is {whole[1] - whole[0]:.0f} wide; the largest drawing on it is "
        f"{right - left} wide. If it is the size of that, add --area {left},{low},{right},{high}"
    )


def no_scale(path: Path, source: PlanSource) -> str:
    """Remedy for a plan without a known scale."""
    look = look_at_plan(path, source)
    paper = ""
    if look.paper_m is not None:
        width, height = (1000 * look.paper_m * each for each in _size(look.box))
        paper = f" ({width:.0f} mm x {height:.0f} mm on paper; with --scale, for example 1:100, that is enough)"
    return (
        f"the file has no scale{paper}. Use --width-m or --height-m or both, two --point, --distance, --scale or "
        "--unit-m; --click FILE.html writes a page for clicking a known distance"
    )


def _without_margins(source: PlanSource, look: PlanLook, building: Bounds) -> tuple[PlanSource, list[str]]:
    """Use the building on a sheet, unless only the sheet matches the given shape."""
    left, right, low, high = (round(edge, 1) for edge in building)
    asked = _shape_asked(source)
    if asked is not None and not _alike(asked, _size(building)) and _alike(asked, _size(look.box)):
        return source, [
            f"the size applies to the whole page, because their shapes match. To use only the drawing, add "
            f"--area {left:g},{low:g},{right:g},{high:g}"
        ]
    what = "has a frame" if look.framed else "is larger than the drawing"
    return source.model_copy(update={"area": (left, low, right, high)}), [
        f"the page {what}: only the drawing between {left:g},{low:g} and {right:g},{high:g} is used, and the size "
        "applies to it; use --area page for the whole page, or --area X,Y,X,Y for another part"
    ]


def _refuse_other_shape(path: Path, source: PlanSource, look: PlanLook) -> None:
    asked, size = _shape_asked(source), _size(look.box_of(source.area))
    if asked is None or _alike(asked, size):
        return
    assert source.extent is not None
    width_m, height_m = source.extent.width_m, source.extent.height_m
    assert width_m is not None
    page = "; the whole page does not match either" if source.area is not None and look.building is not None else ""
    raise UsageError(
        f"{path}: the drawing is {size[0] / size[1]:.3f} times as wide as high, but {width_m:g} m x {height_m:g} m "
        f"is {asked:.3f}{page}. Use --width-m {width_m:g} alone (the height is then "
        f"{width_m * size[1] / size[0]:.2f} m), choose the part with this size by --area, or use --stretch if the "
        "pixels are not square"
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
