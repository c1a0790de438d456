"""What a data set is made of: output folders of ``process``, their buildings, floors and plans."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.findings import Finding
from vislam2tag.dataset.labelled import LabelledSession, LabelledSurvey, open_labelled, without_sessions
from vislam2tag.dataset.model import DatasetSource, FloorInfo
from vislam2tag.dataset.settings import DatasetSettings
from vislam2tag.labeling.results import RUN_FILE, FloorRecord
from vislam2tag.sessions.registry import slugs_from_outside
from vislam2tag.survey.discover import read_site
from vislam2tag.survey.links import left_out_of
from vislam2tag.survey.names import unique_slugs
from vislam2tag.survey.plans.load import plan_file

PLANS = "plans"


@dataclass(frozen=True)
class LabelledSource:
    """One labelled survey, the building it is of, and its plans by floor number.

    ``floors`` are those of the labels, with the georeference that the raw survey has by now, where it is known.
    """

    labelled: LabelledSurvey
    building: str
    floors: tuple[FloorRecord, ...]
    plans: dict[int, Path]
    survey: Path | None
    """The raw survey, where it is known."""
    named: Path
    """The folder that was asked for: the labels, or the survey that they were made of on the way."""
    plans_left_out: tuple[Finding, ...] = ()
    """Names the plans that come from outside the survey."""

    def record(self, settings: DatasetSettings) -> DatasetSource:
        """What the manifest keeps of it."""
        run = self.labelled.root / RUN_FILE
        return DatasetSource(
            kind="process",
            name=self.labelled.survey,
            version=self.labelled.version,
            settings={
                "process": dict(self.labelled.settings),
                "dataset": settings.model_dump(mode="json"),
                **({"rebase": list(self.labelled.rebase)} if self.labelled.rebase else {}),
            },
            inputs={RUN_FILE: hashlib.sha256(read_bytes(run)).hexdigest()},
        )


def open_sources(
    outs: Sequence[Path],
    buildings: Sequence[str],
    surveys: Sequence[Path | None],
    named: Sequence[Path],
    scratch: Folder,
    *,
    follow_links: bool = False,
) -> tuple[LabelledSource, ...]:
    """Open output folders of ``process``; ``surveys`` are the raw ones they were made of, where known, for the plans.

    ``named`` are the folders that messages name: those that were asked for. Plans that are no images are drawn into
    ``scratch``. Plans and sessions that links lead to outside the survey are left out, unless ``follow_links``.

    Raises DatasetError where a folder is none or no session remains, UsageError where there is not one building's name
    for each, or a survey is another's.
    """
    if buildings and len(buildings) != len(outs):
        raise UsageError(
            f"--building: {len(buildings)} names for {len(outs)} sources; give one for each, in their order"
        )
    names = list(buildings) or [""] * len(outs)
    opened = [open_labelled(out, follow_links=follow_links) for out in outs]
    found = []
    for i, (labelled, building, survey, folder) in enumerate(zip(opened, names, surveys, named, strict=True)):
        if survey is None:
            found.append(LabelledSource(labelled, building, labelled.floors, {}, None, folder))
            continue
        if not follow_links:
            labelled = without_sessions(labelled, slugs_from_outside(survey))
        floors, plans, left_out = _of_survey(survey, labelled, scratch.folder(str(i)), follow_links)
        found.append(LabelledSource(labelled, building, floors, plans, survey, folder, left_out))
    return tuple(found)


def _of_survey(
    survey: Path, labelled: LabelledSurvey, scratch: Folder, follow_links: bool
) -> tuple[tuple[FloorRecord, ...], dict[int, Path], tuple[Finding, ...]]:
    """Find the plans of a survey, and where its floors lie on earth; and name what is left out.

    Raises UsageError where its floors are not those that were labelled.
    """
    site, findings = read_site(survey, follow_links=follow_links)
    for record in labelled.floors:
        floors = [floor for floor in site.floors if floor.number == record.number]
        if [floor.extent_m for floor in floors] != [_extent(record)]:
            raise UsageError(
                f"--survey {survey}: floor {record.number} is not the one that {labelled.root} was made of; "
                "give that survey, or process this one anew"
            )
    drawn = {floor.number: plan_file(floor, scratch) for floor in site.floors}
    earth = {floor.number: floor.georeference for floor in site.floors if floor.georeference is not None}
    records = tuple(
        record.model_copy(update={"georeference": earth.get(record.number, record.georeference)})
        for record in labelled.floors
    )
    plans = {number: plan for number, plan in drawn.items() if plan is not None}
    return records, plans, tuple(left_out_of(findings))


def _extent(record: FloorRecord) -> tuple[float, float, float, float] | None:
    if record.width_m is None or record.height_m is None:
        return None
    left, low = record.lower_left_m
    return left, left + record.width_m, low, low + record.height_m


def merged_floors(sources: Sequence[LabelledSource]) -> tuple[tuple[FloorInfo, ...], dict[str, Path]]:
    """List the floors of all sources, sorted, and their plans by the path that they get in the data set.

    Raises DatasetError where two sources have different floors of one number in one building.
    """
    found: dict[tuple[str, int], tuple[FloorInfo, LabelledSource]] = {}
    plans: dict[str, Path] = {}
    for source in sources:
        for record in source.floors:
            key = (source.building, record.number)
            plan = source.plans.get(record.number)
            path = None if plan is None else plan_path(source.building, record.number, plan)
            if path is not None and plan is not None:
                plans.setdefault(path, plan)
            if key in found:
                _refuse_clash(*found[key], record, source)
            if key not in found or (path and found[key][0].plan is None):
                found[key] = (_floor(record, source.building, path), source)
    return tuple(info for _, (info, _) in sorted(found.items(), key=lambda item: item[0])), plans


def plan_path(building: str, number: int, plan: Path) -> str:
    """Where a floor's plan lies in a data set's folder."""
    stem = f"floor_{number}" if not building else f"{unique_slugs([building])[0]}.floor_{number}"
    return f"{PLANS}/{stem}{plan.suffix.lower()}"


def _floor(record: FloorRecord, building: str, plan: str | None) -> FloorInfo:
    return FloorInfo(building=building, plan=plan, **record.model_dump())


def _refuse_clash(floor: FloorInfo, first: LabelledSource, record: FloorRecord, second: LabelledSource) -> None:
    for name, unit in (("width_m", "wide"), ("height_m", "deep"), ("elevation_m", "high up")):
        one, other = getattr(floor, name), getattr(record, name)
        if one != other and one is not None and other is not None:
            raise DatasetError(
                f"floor {record.number} is {one:g} m {unit} in {first.named} and {other:g} m in "
                f"{second.named}: these are two buildings; tell them apart by a --building NAME for each source"
            )


def named_sessions(sources: Sequence[LabelledSource]) -> list[tuple[str, LabelledSource, LabelledSession]]:
    """Name every session of the sources, sorted by name: its slug, behind the building's name where it has one.

    Raises DatasetError where two sources have a session of one name.
    """
    found: dict[str, tuple[LabelledSource, LabelledSession]] = {}
    for source in sources:
        prefix = f"{unique_slugs([source.building])[0]}." if source.building else ""
        for session in source.labelled.sessions:
            name = prefix + session.slug
            if name in found:
                raise DatasetError(
                    f"session {session.slug} is in {found[name][0].named} and in {source.named}: give each walk "
                    "once; two buildings are told apart by a --building NAME for each source"
                )
            found[name] = (source, session)
    return [(name, *found[name]) for name in sorted(found)]
