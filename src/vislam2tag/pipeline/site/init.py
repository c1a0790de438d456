"""Beginning a site: a plan becomes a floor of ``site.toml``, or the published layout is described by one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import OutputError, SurveyError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.plain_files import read_json
from vislam2tag.common.text_paths import AnyPath
from vislam2tag.pipeline.site.plan_scale import no_scale
from vislam2tag.site.discover import read_site
from vislam2tag.site.model import ControlPoints, Floor
from vislam2tag.site.names import floor_number
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.plans.placing import NO_SCALE
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
from vislam2tag.site.written_files import survey_output, write_in_survey

INFO, MAP = "floor_info.json", "geojson_map.json"
"""A floor of the Indoor Location Competition 2.0: its extent in metres, and its map."""


@dataclass(frozen=True)
class NewFloor:
    """A floor to add; ``part.plan`` tells how ``plan``, a file anywhere, is to be read."""

    plan: AnyPath
    part: FloorPart


def competition_floor(folder: Path, number: int | None) -> NewFloor:
    """A floor's folder of the Indoor Location Competition 2.0, whose map fills the floor's extent.

    ``number`` is the floor's; None: as the folder's name says. Raises SurveyError where its files cannot be used.
    """
    path = folder / INFO
    try:
        extent = read_json(path)["map_info"]
        source = PlanSource(file=MAP, extent=Extent(width_m=extent["width"], height_m=extent["height"]))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SurveyError(f'{path}: expected {{"map_info": {{"width": ..., "height": ...}}}} in metres') from error
    name = folder.resolve().name
    number = floor_number(name) if number is None else number
    if number is None:
        raise UsageError(f"--floor: {name} is no floor's name such as F4 or B1; give its number")
    return NewFloor(folder / MAP, FloorPart(number=number, name=name, plan=source))


def is_competition_floor(path: Path) -> bool:
    """Whether a path is such a folder."""
    return (path / INFO).is_file()


def add_floor(
    root: AnyPath, new: NewFloor, building: str = "", georeference: GeoreferencePart | None = None
) -> SiteFile:
    """Copy a plan into a survey's folder, where it is not there yet, and describe it in ``site.toml``.

    ``building`` and ``georeference`` replace what the file says, where they are given. Raises SurveyError or
    UsageError where the plan cannot be used or the floor is there already, OutputError where nothing can be written.
    """
    root = Path(root)
    site = read_site_file(root) if has_site_file(root) else None
    floors = () if site is None else site.floors
    if any(floor.number == new.part.number for floor in floors):
        raise UsageError(f"--floor {new.part.number}: {root / SITE_FILE} has that floor already; edit it there")
    earth = georeference or (None if site is None else site.georeference)
    _check(new, earth)
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
    _write(root, whole)
    return whole


def describe_published(root: Path, building: str = "", georeference: GeoreferencePart | None = None) -> SiteFile:
    """Write the ``site.toml`` of a survey in the published layout; its files stay as they are.

    Raises UsageError where it has one, SurveyError where it is no survey.
    """
    if has_site_file(root):
        raise UsageError(f"{root / SITE_FILE}: is there already; edit it, or add a floor by --plan")
    site, _ = read_site(root, follow_links=True)
    parts = tuple(_published_part(root, floor) for floor in site.floors)
    whole = SiteFile(name=building, georeference=georeference, floors=parts)
    _write(root, whole)
    return whole


def _published_part(root: Path, floor: Floor) -> FloorPart:
    plan = None
    if floor.plan is not None and floor.width_m is not None and floor.height_m is not None:
        extent = Extent(width_m=floor.width_m, height_m=floor.height_m)
        plan = PlanSource(file=floor.plan.relative_to(root).as_posix(), extent=extent)
    name = "" if floor.name == f"Floor {floor.number}" else floor.name
    return FloorPart(number=floor.number, name=name, elevation_m=floor.elevation_m, plan=plan)


def _check(new: NewFloor, earth: GeoreferencePart | None) -> None:
    """Load the plan as it will be; raises SurveyError or UsageError where that fails."""
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
    """Where the plan lies in the survey's folder, or will."""
    plan = Path(new.plan).resolve()
    if plan.is_relative_to(root.resolve()):
        return plan.relative_to(root.resolve())
    return Path(f"floor_{new.part.number}") / plan.name


def _copy(source: Path, root: Path, inside: Path) -> None:
    target = root / inside
    if target.exists() and target.resolve() == source.resolve():
        return
    if target.exists():
        raise OutputError(f"{target}: is there already; remove it, or give it as --plan")
    files = [path for path in sorted(source.rglob("*")) if path.is_file()] if source.is_dir() else [source]
    with survey_output(target):
        for path in files:
            Folder.at(root).copy(path, (inside / path.relative_to(source)).as_posix())


def _write(root: Path, site: SiteFile) -> None:
    write_in_survey(root, root / SITE_FILE, site_file_text(site))
