"""Builds a data set from labelled surveys: fingerprints, statistics, splits, report and card."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.given_files import AnyPath, path_or_none, paths_of
from vislam2tag.common.files.table_files import scan_parquet
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import Progress, silent
from vislam2tag.datasets.access_points import merged_radios
from vislam2tag.datasets.description import Description, with_description
from vislam2tag.datasets.fingerprints import access_points_of, tables_of
from vislam2tag.datasets.folder import FolderWriter, dataset_folder, is_dataset, open_dataset
from vislam2tag.datasets.labelled import is_labelled
from vislam2tag.datasets.model import Dataset, DatasetInfo, FloorInfo, Grouping, RoomInfo, Storey
from vislam2tag.datasets.privacy import Privacy, with_privacy
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, READINGS
from vislam2tag.datasets.settings import DatasetSettings
from vislam2tag.datasets.statistics_record import FieldWork
from vislam2tag.datasets.technologies import BLE, WIFI, parts_of
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.datasets.finish import finish_dataset
from vislam2tag.pipeline.datasets.sources import (
    LabelledSource,
    SessionJob,
    SessionOutcome,
    build_session,
    merged_floors,
    named_rooms,
    named_sessions,
    open_sources,
    survey_findings,
)
from vislam2tag.pipeline.labels.process import process
from vislam2tag.pipeline.labels.walked_floors import walked_floors
from vislam2tag.pipeline.run.claims import kept_together
from vislam2tag.pipeline.run.workers import process_all
from vislam2tag.site.links import left_out_sessions
from vislam2tag.site.model import unique_slugs
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.walked import WalkedFloor

LABEL, BUILD = "label", "build"


class SessionStep(NamedTuple):
    """Progress of a data set for a session."""

    stage: str
    """``label`` or ``build``."""
    error: str | None


@dataclass(frozen=True)
class BuildOptions:
    """How a data set is built, besides its settings."""

    name: str | None = None
    """Name of the data set; None: that of its surveys."""
    buildings: tuple[str, ...] = ()
    """Name of each source's building, in their order; none: one building without a name."""
    surveys: AnyPath | Sequence[AnyPath] = ()
    """The raw surveys of those sources that are output folders, in their order, for the plans (optional)."""
    labels: AnyPath | None = None
    """Output folder of ``process`` if the source is a survey; None: a temporary folder."""
    labelling: ProcessSettings = field(default_factory=ProcessSettings)
    """Settings of ``process`` if the source is a survey."""
    max_sigma_m: float | None = None
    """Fingerprints with a larger sigma are ``uncertain``, metres; None: as in the settings of ``process``."""
    merge_radios: bool = False
    """Combine all networks of one radio into one reading."""
    privacy: Privacy | None = field(default_factory=Privacy)
    """Data to remove or hide; None: nothing."""
    description: Description | None = None
    """Description of the data set by its authors."""
    field_work: FieldWork | None = None
    """Effort of the whole survey."""
    walkable: WalkableSettings = field(default_factory=WalkableSettings)
    """Settings for finding walkable space on the plans of the sources' surveys, for the coverage."""
    walked: Sequence[WalkedFloor] | None = None
    """Coverage, if ``check`` computed it for the only source; None: computed here."""
    replace: bool = False
    """Replace output of another command or strategy in the folders of data set or labels."""
    follow_links: bool = False
    """Include files that links lead to outside the sources and their surveys: plans, and sessions with such files."""


def build_dataset(
    sources: AnyPath | Sequence[AnyPath],
    out: AnyPath,
    settings: DatasetSettings | None = None,
    options: BuildOptions | None = None,
    *,
    jobs: int = 1,
    progress: Progress[SessionStep] = silent,
    tell: Callable[[Sequence[Finding]], None] = lambda _: None,
) -> Dataset:
    """Build a data set of surveys or of output folders of ``process``, and open it.

    A survey is processed first, together if its labels in the options' folder are so. ``tell`` is called with the names
    of files that are skipped because links lead to them outside their source. With ``jobs`` > 1 sessions are processed
    in that many processes (call it from under ``if __name__ == "__main__":``). Raises SurveyError or DatasetError if a
    source is neither, cannot be read, or conflicts with another, UsageError for options that do not fit, OutputError if
    ``out`` cannot be written.
    """
    settings, options = settings or DatasetSettings(), options or BuildOptions()
    folders, out = paths_of(sources), Path(out)
    with dataset_folder(out, "dataset", options.replace) as folder:
        with scratch_folder(folder.out) as scratch:
            opened = _labelled(folders, scratch, options, jobs, progress)
            tell(_left_out(opened, named=True))
            if settings.ble_with_wifi and not any(one.has(BLE) for each in opened for one in each.labelled.sessions):
                raise UsageError(
                    "--ble-with-wifi: no session has BLE readings; remove this option, or record BLE advertisements too"
                )
            floors, plans = merged_floors(opened)
            floors = _with_rooms(floors, opened, options)
            todo = list(_session_jobs(opened, scratch.folder("parts"), settings, options.max_sigma_m))
            outcomes = _build_sessions(todo, jobs, progress)
            info = DatasetInfo(
                name=options.name or "-".join(dict.fromkeys(source.labelled.survey for source in opened)),
                floors=floors,
                groupings=_groupings(outcomes, settings),
                sources=tuple(source.record(settings) for source in opened),
                findings=(*survey_findings(outcomes), *_left_out(opened, named=False)),
            )
            info = with_description(info, options.description) if options.description else info
            info = _add_tables(folder, scratch.folder("parts"), info, options)
            folder.add_files(plans)
        finish_dataset(folder, info, options.field_work, _walked(opened, outcomes, options))
    return open_dataset(out)


def _with_rooms(
    floors: Sequence[FloorInfo], sources: Sequence[LabelledSource], options: BuildOptions
) -> tuple[FloorInfo, ...]:
    """Add the rooms with a name on the plans of sources with a known survey."""
    found = dict[Storey, tuple[RoomInfo, ...]]()
    for source in sources:
        for floor in () if source.site is None else source.site.floors:
            found.setdefault(Storey(source.building, floor.number), named_rooms(floor, options.walkable))
    return tuple(
        floor.model_copy(update={"rooms": found.get(Storey(floor.building, floor.number), ())}) for floor in floors
    )


def _left_out(sources: Sequence[LabelledSource], *, named: bool) -> list[Finding]:
    """Count the sessions and name the plans that come from outside their survey; name the sessions, too, if wanted."""
    slugs = [slug for source in sources for slug in source.labelled.left_out]
    sessions = [left_out_sessions(slugs, named=named)] if slugs else []
    return [*sessions, *(finding for source in sources for finding in source.plans_left_out)]


def _walked(
    sources: Sequence[LabelledSource], outcomes: Sequence[SessionOutcome], options: BuildOptions
) -> dict[Storey, WalkedFloor]:
    """Coverage of the plans of sources with a known survey."""
    if options.walked is not None:
        return {Storey(sources[0].building, floor.number): floor for floor in options.walked}
    places = {outcome.session: outcome.places for outcome in outcomes}
    walks = [(source, places[name]) for name, source, _ in named_sessions(sources)]
    return {
        Storey(source.building, number): floor.record
        for source in sources
        if source.survey is not None and source.site is not None
        for number, floor in walked_floors(
            source.survey,
            source.site,
            [own for whose, own in walks if whose.building == source.building],
            options.walkable,
        ).items()
    }


def _labelled(
    folders: Sequence[Path], scratch: Folder, options: BuildOptions, jobs: int, progress: Progress[SessionStep]
) -> tuple[LabelledSource, ...]:
    """Process those sources that are surveys, and open all."""
    raw = [folder for folder in folders if not is_labelled(folder)]
    _refuse_options(raw, len(folders) - len(raw), options)
    names = dict(zip(raw, unique_slugs([folder.resolve().name for folder in raw], list(map(str, raw))), strict=True))
    kept, given = path_or_none(options.labels), iter(paths_of(options.surveys))
    outs: list[Path] = []
    surveys: list[Path | None] = []
    for folder in folders:
        if folder not in names:
            outs.append(folder)
            surveys.append(next(given, None))
            continue
        keep = kept if len(folders) == 1 else kept and kept / names[folder]
        outs.append(keep or scratch / f"labels/{names[folder]}")
        surveys.append(folder)
        process(
            folder,
            outs[-1],
            kept_together(outs[-1], options.labelling),
            jobs=jobs,
            replace=options.replace,
            follow_links=options.follow_links,
            progress=lambda done, total: progress(SessionStep(LABEL, done.error), total),
        )
    plans = scratch.folder("plans")
    return open_sources(outs, options.buildings, surveys, folders, plans, follow_links=options.follow_links)


def _refuse_options(raw: Sequence[Path], labelled: int, options: BuildOptions) -> None:
    """Raise for unusable combinations of sources and options, before anything is done."""
    for folder in raw:
        if is_dataset(folder):
            raise DatasetError(
                f"{folder}: this is already a data set; expected a survey or an output folder of `vislam2tag process`"
            )
    if options.labels is not None and not raw:
        raise UsageError("--labels: all sources are already labelled; remove this option")
    if (given := len(paths_of(options.surveys))) > labelled:
        raise UsageError(
            f"--survey: {given} surveys for {labelled} output folders of `process`; give one for each, in their order"
        )


def _add_tables(folder: FolderWriter, parts: Folder, info: DatasetInfo, options: BuildOptions) -> DatasetInfo:
    """Join the parts, apply the options, and return the completed manifest."""
    whole = FolderWriter(parts)
    _join_parts(whole)
    dataset = as_built = whole.opened(info)
    if options.merge_radios:
        dataset = merged_radios(dataset)
    if options.privacy is not None:
        dataset = with_privacy(dataset, options.privacy)
    changed = {name: table for name, table in dataset.tables.items() if table is not as_built.tables[name]}
    folder.add_tables(changed)
    for name in dataset.tables.keys() - changed:
        parts.move(f"{name}.parquet", folder.out, f"{name}.parquet")
    return dataset.info.model_copy(update={"tables": {}, "splits": {}})


def _session_jobs(
    sources: Sequence[LabelledSource], parts: Folder, settings: DatasetSettings, max_sigma_m: float | None
) -> Iterator[SessionJob]:
    for number, (name, source, labelled) in enumerate(named_sessions(sources)):
        limit_m = source.labelled.max_sigma_m if max_sigma_m is None else max_sigma_m
        yield SessionJob(
            labelled, name, source.building, number, parts, settings, limit_m, own_limit=max_sigma_m is None
        )


def _build_sessions(todo: list[SessionJob], jobs: int, progress: Progress[SessionStep]) -> list[SessionOutcome]:
    """Build all sessions' parts; return the outcomes in the data set's order."""
    outcomes: list[SessionOutcome] = []

    def note(outcome: SessionOutcome) -> None:
        outcomes.append(outcome)
        progress(SessionStep(BUILD, None), len(todo))

    process_all(build_session, todo, jobs, note)
    return sorted(outcomes, key=lambda outcome: outcome.session)


def _join_parts(folder: FolderWriter) -> None:
    """Stream the sessions' parts into the tables beside them, then count the access points."""
    folder.add_tables(tables_of(folder.root))
    fingerprints, readings = (scan_parquet(folder.root / f"{name}.parquet") for name in (FINGERPRINTS, READINGS))
    folder.add_tables({ACCESS_POINTS: access_points_of(folder.root, fingerprints, readings).lazy()})


def _groupings(outcomes: Sequence[SessionOutcome], settings: DatasetSettings) -> tuple[Grouping, ...]:
    """Rule for building fingerprints from readings, for each technology that occurs."""
    technologies = sorted({name for outcome in outcomes for name in outcome.technologies})
    return tuple(_grouping(name, settings) for name in technologies)


def _grouping(technology: str, settings: DatasetSettings) -> Grouping:
    window_s = settings.window_of(BLE if technology == BLE else WIFI)
    if window_s is not None:
        return Grouping(technology=technology, by="window", window_s=window_s)
    around_s = settings.ble_window_s if BLE in parts_of(technology) else None
    return Grouping(technology=technology, by="scan", window_s=around_s)
