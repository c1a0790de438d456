"""Writes sites, landmarks, labels and data sets in another layout or frame, without changing the source."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import polars as pl
from pydantic import ValidationError

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError, SurveyError, UsageError
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.given_files import AnyPath, path_or_none, read_bytes, read_json
from vislam2tag.common.files.table_files import scan_parquet
from vislam2tag.common.files.whole_output import whole_folder, write_file
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.core.transforms import Similarity2
from vislam2tag.datasets.folder import dataset_folder, is_dataset, open_dataset_to_share, sha256_of
from vislam2tag.datasets.labelled import LabelledSession, LabelledSurvey, is_labelled, open_labelled
from vislam2tag.datasets.model import Dataset, DatasetInfo, DatasetSource, FloorInfo
from vislam2tag.datasets.schema import FINGERPRINTS
from vislam2tag.datasets.statistics_record import FieldWork
from vislam2tag.labeling.new_frame import changed_result, changed_table, floors_of_result
from vislam2tag.labeling.results import RESULTS, RUN_FILE, SUMMARY_FILE, SessionResult
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.labeling.tables import SCHEMAS, write_table
from vislam2tag.pipeline.datasets.finish import finish_dataset, read_statistics
from vislam2tag.pipeline.datasets.sources import named_rooms, plan_path
from vislam2tag.pipeline.labels.label_run import floor_records, site_hashes
from vislam2tag.site.discover import read_site, site_files
from vislam2tag.site.frame_change import (
    CHANGE_FILE,
    FrameChange,
    FrameChanges,
    changed_landmarks_text,
    changed_points_text,
    changes_text,
)
from vislam2tag.site.landmark_file import CONTROL_POINT_FILE, LANDMARK_FILE, table_path
from vislam2tag.site.landmark_states import STATES_FILE, changed_states_text
from vislam2tag.site.links import CURE, is_described_from_outside, left_out_of, outside_link
from vislam2tag.site.model import Floor, SessionKey, SessionRef, Site, Survey
from vislam2tag.site.plans.images import GREATEST_PX
from vislam2tag.site.plans.load import plan_file, plan_picture
from vislam2tag.site.site_file import FLOOR_FILE
from vislam2tag.views.run_report import write_report
from vislam2tag.views.run_summary import summarise


def write_published(
    root: AnyPath, out: AnyPath, *, follow_links: bool = False
) -> tuple[FrameChanges, tuple[Finding, ...]]:
    """Write a complete site in the published layout to ``out``: plans as images, landmarks, control points.

    That layout's origin is the plan's lower left corner; ``rebase.toml`` contains the shift of positions. There are
    findings for floors without extent, which have no row in ``floor_dimensions.csv``, and for files that links lead to
    outside the survey, which are skipped without ``follow_links``. Sessions are not copied. Raises SurveyError if
    ``root`` is not a site, OutputError if ``out`` cannot be written.
    """
    root, out = Path(root), Path(out)
    site, findings = read_site(root, follow_links=follow_links)
    changes = FrameChanges(
        floors=tuple(
            FrameChange.of(floor.number, Similarity2(1 + 0j, -complex(*floor.lower_left_m))) for floor in site.floors
        )
    )
    with whole_folder(out, _ours) as folder:
        folder.write(FLOOR_FILE, _dimensions(site.floors))
        odd = []
        for floor in site.floors:
            odd += _write_plan(floor, folder.folder(f"floor_{floor.number}").make())
        _write_surveyed(root, folder, changes.by_floor, follow_links)
        folder.write(CHANGE_FILE, changes_text(changes))
    return changes, (*findings, *odd)


def write_changed_site(root: Path, out: Path, changes: FrameChanges, *, follow_links: bool = False) -> list[Finding]:
    """Write all landmark and control point files of a site in another frame to ``out``.

    Files that links lead to outside the site are skipped and named, unless ``follow_links`` is given. Raises
    SurveyError if ``root`` is not a site or a floor has no change, OutputError if ``out`` cannot be written.
    """
    _, findings = read_site(root, follow_links=follow_links)
    with whole_folder(out, _ours) as folder:
        if not _write_surveyed(root, folder, changes.by_floor, follow_links) and left_out_of(findings):
            raise SurveyError(f"{root}: links lead to all its landmark files outside it; {CURE}")
        folder.write(CHANGE_FILE, changes_text(changes))
    return left_out_of(findings)


def _ours(folder: Path) -> bool:
    """Whether these functions wrote a folder, and it has no sessions, which would not be replaced."""
    return (folder / CHANGE_FILE).is_file() and not any(folder.glob("floor_*/*/"))


def _dimensions(floors: Iterable[Floor]) -> str:
    rows: list[tuple[object, ...]] = [("id", "width", "height", "elevation", "name")]
    for floor in floors:
        if floor.width_m is not None:
            elevation = "" if floor.elevation_m is None else repr(floor.elevation_m)
            rows.append((floor.number, repr(floor.width_m), repr(floor.height_m), elevation, floor.name))
    return csv_rows(rows)


def _write_plan(floor: Floor, own: Folder) -> list[Finding]:
    drawn = plan_file(floor, own)
    if drawn is None or floor.extent_m is None:
        message = f"floor {floor.number} has no plan that can be drawn, so it is written without a plan"
        return [Finding(kind="missing_plan", file=own.path.name, count=1, message=message, severity=Severity.WARNING)]
    if drawn.parent == own.path:
        own.move(drawn.name, own, f"floorplan{drawn.suffix}")
    elif drawn.suffix.lower() in (".jpg", ".jpeg", ".png"):
        own.copy(drawn, f"floorplan{drawn.suffix.lower()}")
    else:
        with own.writing("floorplan.png") as file:
            plan_picture(floor, GREATEST_PX).save(file, "PNG")
    return []


def _write_surveyed(root: Path, out: Folder, changes: Mapping[int, FrameChange], follow_links: bool) -> int:
    """Write every existing landmark and control point file; return their number."""
    written = 0
    names = [(folder, name) for folder in sorted(root.glob("floor_*")) for name in (LANDMARK_FILE, CONTROL_POINT_FILE)]
    for folder, name in names:
        path = table_path(folder / name)
        if not path.is_file() or not (follow_links or outside_link(root, path) is None):
            continue
        number = _number(path)
        if number not in changes:
            raise SurveyError(f"{path}: there is no change for floor {number}; add it to {CHANGE_FILE}")
        if name == LANDMARK_FILE:
            text = changed_landmarks_text(root, path, changes, number)
        else:
            text = changed_points_text(root, path, changes[number])
        out.write(f"floor_{number}/{name}", text)
        if name == LANDMARK_FILE and (states := changed_states_text(root, folder, changes[number])) is not None:
            out.write(f"floor_{number}/{STATES_FILE}", states)
        written += 1
    return written


def _number(path: Path) -> int:
    try:
        return int(path.parent.name.removeprefix("floor_"))
    except ValueError as error:
        raise SurveyError(f"{path.parent}: not a floor folder such as floor_1; rename it") from error


REPORT_FILE = "report.html"


def rebase(
    source: AnyPath,
    out: AnyPath,
    changes: FrameChanges,
    new_site: AnyPath | None = None,
    building: str | None = None,
    *,
    replace: bool = False,
    follow_links: bool = False,
    tell: Callable[[Sequence[Finding]], None] = lambda _: None,
) -> str:
    """Write ``source`` in its new frame to ``out``, which appears complete or not at all; return its kind.

    ``source`` is an output folder of ``process``, a data set, a site, or a file with landmarks of several floors.
    ``new_site`` is the site of the new frame, which provides floors and plans of labels and data sets. ``building`` is
    its name in a data set with several. ``replace`` allows ``out`` to contain a data set of another command. ``tell``
    is called with files that are skipped because links lead outside a site, unless ``follow_links`` is given. Raises
    SurveyError or DatasetError if the source cannot be read or a floor has no change, UsageError if ``new_site``
    or ``building`` is missing, OutputError if ``out`` cannot be written.
    """
    source, out, new_site = Path(source), Path(out), path_or_none(new_site)
    if out.exists() and out.resolve() == source.resolve():
        raise UsageError(f"--out {out}: this is the source, which must not change; choose another folder")
    if source.is_file():
        write_file(out, changed_landmarks_text(source.parent, source, changes.by_floor, None))
        return "landmarks"
    if not is_dataset(source) and not is_labelled(source):
        tell(write_changed_site(source, out, changes, follow_links=follow_links))
        return "site"
    if new_site is None:
        raise UsageError("labels and data sets need --to with the new site, for its floors and plans")
    site, findings = read_site(new_site, follow_links=follow_links)
    tell(left_out_of(findings))
    if is_dataset(source):
        rebase_dataset(source, out, changes, new_site, building, replace=replace, follow_links=follow_links)
        return "data set"
    _rebase_labels(open_labelled(source, follow_links=True), out, changes, Survey(new_site, site, (), findings))
    return "labels"


def _rebase_labels(labelled: LabelledSurvey, out: Path, changes: FrameChanges, new: Survey) -> None:
    there = {floor for session in labelled.sessions for floor in floors_of_result(session.result())}
    _refuse_missing_change(there, changes)
    for number in sorted(there - {floor.number for floor in new.site.floors}):
        raise SurveyError(f"{new.root}: the new site has no floor {number}, but the labels do; add it")
    with whole_folder(out, _is_rebased) as folder:
        _write_run(labelled, folder, changes, new.site, new.root)
        refs = [_write_session(labelled, session, folder, changes.by_floor) for session in labelled.sessions]
        refs.sort(key=lambda ref: ref.key)
        _reduce(labelled, folder, dataclasses.replace(new, sessions=tuple(refs)))


def _is_rebased(folder: Path) -> bool:
    """Whether a folder contains rebased labels."""
    return is_labelled(folder) and (folder / CHANGE_FILE).is_file()


def _refuse_missing_change(numbers: Iterable[int], changes: FrameChanges) -> None:
    for number in sorted(numbers):
        if number not in changes.by_floor:
            raise SurveyError(f"there is no change for floor {number}; add it to {CHANGE_FILE}, or to both sites")


def _write_run(labelled: LabelledSurvey, folder: Folder, changes: FrameChanges, site: Site, new_site: Path) -> None:
    """The run's record with the new site's floors, and the changes of the labels."""
    run = read_json(labelled.root / RUN_FILE)
    run["floors"] = floor_records(site)
    run["site_from_outside"] = is_described_from_outside(new_site)
    run["site_files"] = site_hashes(new_site)
    run["rebase"] = [*run.get("rebase", []), *(change.model_dump(mode="json") for change in changes.floors)]
    folder.write(RUN_FILE, json.dumps(run, indent=2, sort_keys=True) + "\n")
    folder.write(CHANGE_FILE, changes_text(changes))


def _write_session(
    labelled: LabelledSurvey, session: LabelledSession, folder: Folder, changes: Mapping[int, FrameChange]
) -> SessionRef:
    """Write a session's tables and result, and return the session."""
    strategy = str(labelled.settings.get("strategy", ""))
    for name in SCHEMAS:
        path = labelled.root / name / f"{session.slug}.parquet"
        if path.is_file():
            table = changed_table(scan_parquet(path), changes).collect()
            write_table(table, name, strategy, folder, f"{name}/{path.name}")
    result = session.result().model_copy(update={"from_outside": session.is_from_outside()})
    folder.write(f"{RESULTS}/{session.slug}.json", changed_result(result, changes).model_dump_json(indent=1) + "\n")
    key = SessionKey(result.floor, result.device, result.session)
    return SessionRef(key, Path(), result.format, session.slug)


def _reduce(labelled: LabelledSurvey, folder: Folder, survey: Survey) -> None:
    """Write report and summary of what has been changed."""
    try:
        settings = ProcessSettings.model_validate(labelled.settings)
    except ValidationError as error:
        raise DatasetError(
            f"{labelled.root}: the labels are from another version, with other settings; run `vislam2tag process` again"
        ) from error

    def results() -> Iterator[SessionResult]:
        for ref in survey.sessions:
            yield SessionResult.model_validate_json(read_bytes(folder / f"{RESULTS}/{ref.slug}.json"))

    summary = summarise(results(), settings.strategy, labelled.version, survey.findings)
    write_report(folder / REPORT_FILE, survey, settings, results(), summary)
    folder.write(SUMMARY_FILE, json.dumps(summary.model_dump(mode="json"), indent=1) + "\n")


REBASE = "rebase"
"""Kind of the source in the manifest; its settings contain the changes."""


def rebase_dataset(
    source: Path,
    out: Path,
    changes: FrameChanges,
    new_site: Path,
    building: str | None = None,
    *,
    replace: bool = False,
    follow_links: bool = False,
) -> None:
    """Write a data set in its new frame; other buildings than ``building`` stay (None: the only building).

    Tables, floors, plans, page, statistics and card are in the new frame; splits do not change. ``replace`` allows
    ``out`` to contain a data set of another command, ``follow_links`` includes files that links lead to outside their
    folder. Raises DatasetError if ``source`` is not a data set, SurveyError if a floor has no change or is missing in
    the new site, and UsageError if there are several buildings and none is named. Raises
    OutputError if ``out`` cannot be written.
    """
    dataset = open_dataset_to_share(source, follow_links=follow_links)
    site, _ = read_site(new_site, follow_links=follow_links)
    of_site = _building(dataset.info, building)
    own = dataset.fingerprints.filter(pl.col("building").fill_null("") == of_site)
    numbers = own.select(pl.col("floor").drop_nulls().unique()).collect(engine="streaming")["floor"]
    _refuse_missing_change(numbers.to_list(), changes)
    with dataset_folder(out, "site rebase", replace) as folder, scratch_folder() as scratch:
        floors, plans = _floors(dataset, of_site, site, scratch)
        several = len({floor.building for floor in dataset.info.floors}) > 1
        only = of_site if several else None
        folder.add_tables({name: _changed(dataset, name, changes.by_floor, only) for name in dataset.tables})
        folder.add_splits(dataset.splits)
        folder.add_files(plans)
        info = _info(dataset.info, floors, changes, of_site, new_site, follow_links)
        finish_dataset(folder, info, _field_work(source), keep_splits=True)


def _building(info: DatasetInfo, wanted: str | None) -> str:
    names = sorted({floor.building for floor in info.floors})
    if wanted is None and len(names) == 1:
        return names[0]
    if wanted not in names:
        raise UsageError(
            f"--building {wanted or ''}: the data set has the buildings {', '.join(names)}; choose one of them"
        )
    return wanted


def _floors(
    dataset: Dataset, building: str, site: Site, scratch: Folder
) -> tuple[tuple[FloorInfo, ...], dict[str, Path]]:
    """Floors and plans: those of the new site for its building."""
    new = {floor.number: floor for floor in site.floors}
    infos: list[FloorInfo] = []
    plans: dict[str, Path] = {}
    for info in dataset.info.floors:
        if info.building != building:
            infos.append(info)
            if info.plan is not None and info.plan in dataset.files:
                plans[info.plan] = Path(dataset.files[info.plan])
            continue
        if info.number not in new:
            raise SurveyError(f"the new site has no floor {info.number}, which the data set has; add it")
        drawn = plan_file(new[info.number], scratch)
        path = None if drawn is None else plan_path(building, info.number, drawn)
        if path is not None and drawn is not None:
            plans[path] = drawn
        infos.append(_floor(info, new[info.number], path))
    return tuple(infos), plans


def _floor(info: FloorInfo, floor: Floor, plan: str | None) -> FloorInfo:
    taken = ("elevation_m", "width_m", "height_m", "lower_left_m", "georeference")
    own = {name: getattr(floor, name) for name in taken}
    return info.model_copy(update={"plan": plan, "rooms": named_rooms(floor), **own})


def _changed(dataset: Dataset, name: str, changes: Mapping[int, FrameChange], building: str | None) -> pl.LazyFrame:
    table = dataset.tables[name]
    columns = table.collect_schema().names()
    if "floor" not in columns:
        return table
    if building is not None and "building" not in columns:
        buildings = dataset.tables[FINGERPRINTS].select("scan_id", "building")
        table = table.join(buildings, on="scan_id", how="left", maintain_order="left")
    return changed_table(table, changes, building).select(columns)


def _info(
    info: DatasetInfo,
    floors: tuple[FloorInfo, ...],
    changes: FrameChanges,
    building: str,
    new_site: Path,
    follow_links: bool,
) -> DatasetInfo:
    files = [path for path in site_files(new_site) if follow_links or outside_link(new_site, path) is None]
    source = DatasetSource(
        kind=REBASE,
        name=new_site.resolve().name,
        version=__version__,
        settings={"building": building, "floors": [change.model_dump(mode="json") for change in changes.floors]},
        inputs={path.relative_to(new_site).as_posix(): sha256_of(path) for path in files},
    )
    return info.model_copy(update={"floors": floors, "sources": (*info.sources, source), "tables": {}, "splits": {}})


def _field_work(source: Path) -> FieldWork | None:
    """Effort of the whole survey, from the old statistics."""
    statistics = read_statistics(source)
    effort = statistics.effort if statistics is not None else None
    if effort is None or effort.people is None:
        return None
    return FieldWork(people=effort.people, hours=effort.person_hours / effort.people)
