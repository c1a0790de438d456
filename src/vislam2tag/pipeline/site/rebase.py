"""Carrying labels and landmarks over to a new plan, origin or resurvey; raw data and the source stay untouched."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from pydantic import ValidationError

from vislam2tag.common.errors import DatasetError, SurveyError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.plain_files import read_bytes, read_json
from vislam2tag.common.files.table_files import scan_parquet
from vislam2tag.common.files.whole_file import write_file
from vislam2tag.common.files.whole_folder import whole_folder
from vislam2tag.common.findings import Finding
from vislam2tag.common.text_paths import AnyPath, path_or_none
from vislam2tag.dataset.folder import is_dataset
from vislam2tag.dataset.labelled import LabelledSurvey, is_labelled, open_labelled
from vislam2tag.labeling.new_frame import changed_result, changed_table, floors_of_result
from vislam2tag.labeling.results import RESULTS, RUN_FILE, SUMMARY_FILE, SessionResult
from vislam2tag.labeling.schemas import SCHEMAS
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.labeling.tables import write_table
from vislam2tag.pipeline.labels.label_run import floor_records, site_hashes
from vislam2tag.pipeline.site.rebase_dataset import rebase_dataset
from vislam2tag.pipeline.site.write import write_changed_site
from vislam2tag.report.run_page.html import write_report
from vislam2tag.report.run_page.summary import summarise
from vislam2tag.survey.changed_files import changed_landmarks_text
from vislam2tag.survey.discover import read_site
from vislam2tag.survey.frame_change import CHANGE_FILE, FrameChange, FrameChanges, changes_text
from vislam2tag.survey.links import is_described_from_outside, left_out_of
from vislam2tag.survey.model import SessionKey, SessionRef, Site, Survey

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
    """Write ``source`` in its new frame to ``out``, whole or not at all; return what it is.

    ``source`` is an output folder of ``process``, a data set, a site, or a file with landmarks of several floors.
    ``new_site`` is the site that the frame is of: labels and data sets take its floors and plans; ``building`` is what
    a data set with several calls it; ``replace`` allows ``out`` to hold a data set of another command. What links lead
    to outside a site is left out, of which ``tell`` hears, unless ``follow_links`` is given. Raises
    SurveyError or DatasetError where the source cannot be read or a floor has no change, UsageError where ``new_site``
    or ``building`` is missing, OutputError where ``out`` cannot be written.
    """
    source, out, new_site = Path(source), Path(out), path_or_none(new_site)
    if out.exists() and out.resolve() == source.resolve():
        raise UsageError(f"--out {out}: is what is to be rebased, and stays as it is; choose another place")
    if source.is_file():
        write_file(out, changed_landmarks_text(source.parent, source, changes.by_floor, None))
        return "landmarks"
    if not is_dataset(source) and not is_labelled(source):
        tell(write_changed_site(source, out, changes, follow_links=follow_links))
        return "site"
    if new_site is None:
        raise UsageError("--to: labels and data sets need the new site, for its floors and plans")
    site, findings = read_site(new_site, follow_links=follow_links)
    tell(left_out_of(findings))
    if is_dataset(source):
        rebase_dataset(source, out, changes, new_site, building, replace=replace, follow_links=follow_links)
        return "data set"
    _rebase_labels(open_labelled(source, follow_links=True), out, changes, Survey(new_site, site, (), findings))
    return "labels"


def _rebase_labels(labelled: LabelledSurvey, out: Path, changes: FrameChanges, new: Survey) -> None:
    there = set()
    for session in labelled.sessions:
        there |= floors_of_result(session.result())
    _refuse_missing(there, changes, new.site, new.root)
    with whole_folder(out, _is_rebased) as folder:
        _write_run(labelled, folder, changes, new.site, new.root)
        refs = [_write_session(labelled, slug, folder, changes.by_floor) for slug in _slugs(labelled)]
        _reduce(labelled, folder, dataclasses.replace(new, sessions=tuple(refs)))


def _is_rebased(folder: Path) -> bool:
    """Whether a folder holds labels that were rebased."""
    return is_labelled(folder) and (folder / CHANGE_FILE).is_file()


def _slugs(labelled: LabelledSurvey) -> Iterator[str]:
    """Sessions in the order of the survey: by floor, device and name."""
    keyed = []
    for session in labelled.sessions:
        result = session.result()
        keyed.append((SessionKey(result.floor, result.device, result.session), session.slug))
    return (slug for _, slug in sorted(keyed))


def _refuse_missing(numbers: Iterable[int], changes: FrameChanges, site: Site, new_site: Path) -> None:
    there = {floor.number for floor in site.floors}
    for number in sorted(numbers):
        if number not in changes.by_floor:
            raise SurveyError(f"there is no change for floor {number}; add it to {CHANGE_FILE}, or to both sites")
        if number not in there:
            raise SurveyError(f"{new_site}: has no floor {number}, which the labels are on; add it")


def _write_run(labelled: LabelledSurvey, folder: Folder, changes: FrameChanges, site: Site, new_site: Path) -> None:
    """The run's record with the new site's floors, and how the labels came there."""
    run = read_json(labelled.root / RUN_FILE)
    run["floors"] = floor_records(site)
    run["site_from_outside"] = is_described_from_outside(new_site)
    run["site_files"] = site_hashes(new_site)
    run["rebase"] = [*run.get("rebase", []), *(change.model_dump(mode="json") for change in changes.floors)]
    folder.write(RUN_FILE, json.dumps(run, indent=2, sort_keys=True) + "\n")
    folder.write(CHANGE_FILE, changes_text(changes))


def _write_session(
    labelled: LabelledSurvey, slug: str, folder: Folder, changes: Mapping[int, FrameChange]
) -> SessionRef:
    """Write a session's tables and result, and say which session it is."""
    strategy = str(labelled.settings.get("strategy", ""))
    for name in SCHEMAS:
        path = labelled.root / name / f"{slug}.parquet"
        if path.is_file():
            table = changed_table(scan_parquet(path), changes).collect()
            write_table(table, name, strategy, folder, f"{name}/{path.name}")
    session = next(session for session in labelled.sessions if session.slug == slug)
    result = session.result().model_copy(update={"from_outside": session.is_from_outside()})
    folder.write(f"{RESULTS}/{slug}.json", changed_result(result, changes).model_dump_json(indent=1) + "\n")
    key = SessionKey(result.floor, result.device, result.session)
    return SessionRef(key, Path(), result.format, slug)


def _reduce(labelled: LabelledSurvey, folder: Folder, survey: Survey) -> None:
    """Write report and summary of what has been changed."""
    try:
        settings = ProcessSettings.model_validate(labelled.settings)
    except ValidationError as error:
        raise DatasetError(
            f"{labelled.root}: was made by another version, with other settings; run `vislam2tag process` again"
        ) from error

    def results() -> Iterator[SessionResult]:
        for ref in survey.sessions:
            yield SessionResult.model_validate_json(read_bytes(folder / f"{RESULTS}/{ref.slug}.json"))

    summary = summarise(results(), settings.strategy, labelled.version, survey.findings)
    write_report(folder / REPORT_FILE, survey, settings, results(), summary)
    folder.write(SUMMARY_FILE, json.dumps(summary.model_dump(mode="json"), indent=1) + "\n")
