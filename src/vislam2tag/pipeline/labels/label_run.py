"""A run of ``process``: its output folder, its sessions, and their summary."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import platform
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag import __version__
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.files.own_files import OwnFiles
from vislam2tag.common.findings import FaultKind, Finding, Judgement, Severity
from vislam2tag.labeling.results import (
    CONFLICTS_FILE,
    CONFLICTS_PAGE,
    RESULTS,
    SUMMARY_FILE,
    FloorRecord,
    PassesRecord,
    SessionResult,
    Summary,
)
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.session import SessionJob, jobs_of, still_holds
from vislam2tag.pipeline.labels.survey_evidence import RoomsOnPlans, faults_of, kept_walk, thinned
from vislam2tag.pipeline.run.claims import OF_RUN, claim, refuse_mixed_settings, refuse_other_labels
from vislam2tag.pipeline.run.output import COLUMNS, LOGS, REPORT_FILE, SESSION_FOLDERS, OutputFolder
from vislam2tag.pipeline.run.selection import OpenedSurvey, refuse_among_sessions
from vislam2tag.quality.diagnosis.record import Fault, References, answered
from vislam2tag.quality.diagnosis.search import judgement_of
from vislam2tag.sessions.prepared import SessionTask
from vislam2tag.site.corrections.file import CORRECTIONS_FILE, Corrections
from vislam2tag.site.corrections.unknown import unknown_landmarks
from vislam2tag.site.discover import site_files
from vislam2tag.site.frame_change import CHANGE_FILE
from vislam2tag.site.links import is_described_from_outside, shared_survey
from vislam2tag.site.model import SessionRef, Site, Survey
from vislam2tag.site.site_file import has_site_file, read_site_file
from vislam2tag.views.conflict_page import write_conflict_page
from vislam2tag.views.run_report import write_report
from vislam2tag.views.run_summary import findings_by_kind, summarise

REPORTED = (FaultKind.SHIFTED_IDS, FaultKind.PLANNED)
"""Faults that findings of the site or of sessions report already."""


@dataclass(frozen=True)
class LabelRun:
    """An output that is claimed, and the sessions that are to be processed into it."""

    survey: Survey
    settings: ProcessSettings
    folder: OutputFolder
    tasks: list[SessionTask]
    others: Sequence[SessionTask] = ()
    """Sessions of the survey outside the selection; their results in the output stay."""
    removed: Sequence[Finding] = ()
    """Results that the run removed because the survey no longer has the session."""
    conflicts: str = ""
    """The page of conflicting references next to the report; empty if there is none."""
    follow_links: bool = False
    """Whether pages show files from outside the survey."""

    @property
    def shown(self) -> Survey:
        """The survey as pages show it."""
        return shared_survey(self.survey, follow_links=self.follow_links)

    def with_findings(self, findings: Sequence[Finding]) -> LabelRun:
        """The run with more findings about the survey."""
        return dataclasses.replace(
            self, survey=dataclasses.replace(self.survey, findings=(*self.survey.findings, *findings))
        )

    def with_conflicts(self, found: References, odd: Sequence[Finding]) -> LabelRun:
        """Write the agreement of references, and add findings about outliers."""
        self.folder.write(CONFLICTS_PAGE, lambda path: write_conflict_page(path, self.shown, found))
        self.folder.put_text(CONFLICTS_FILE, found.model_dump_json(indent=1) + "\n")
        return dataclasses.replace(self.with_findings(odd), conflicts=CONFLICTS_PAGE)

    @property
    def is_reduced(self) -> bool:
        """Whether summary and report of an earlier run exist."""
        return self.folder.has(SUMMARY_FILE) and self.folder.has(REPORT_FILE)

    def reduced(
        self,
        each: Callable[[SessionResult], None] = lambda _: None,
        tell: Callable[[Sequence[Finding]], None] = lambda _: None,
    ) -> Summary:
        """Reduce the sessions' results, one at a time, to summary and report; ``each`` is called with every one.

        ``tell`` is called with corrections of landmarks that no session has.

        Results of sessions outside the selection are included, because summary and report cover the whole output.
        """
        refs = [task.ref for task in self.tasks]
        if self.others:
            there = {ref.slug for ref in refs} | (self.folder.finished() & {task.ref.slug for task in self.others})
            refs = [ref for ref in self.survey.sessions if ref.slug in there]
        return _reduce(self, refs, each, tell)


def opened_run(opened: OpenedSurvey, folder: OutputFolder, *, follow_links: bool = False) -> LabelRun:
    """The run that processes an open survey into an unclaimed output; raises as :func:`process`."""
    tasks, others = opened.tasks(opened.refs), opened.tasks(opened.others)
    survey = _with_exclusions(opened.survey, opened.corrections)
    return LabelRun(survey, opened.settings, folder, tasks, others, follow_links=follow_links)


@contextmanager
def label_run(
    opened: OpenedSurvey, out: Path, *, replace: bool = False, follow_links: bool = False, keep_summary: bool = False
) -> Iterator[LabelRun]:
    """Claim ``out`` for labels of a survey.

    Results of sessions that the survey no longer contains are removed, if the run has no selection. Results of sessions
    outside a selection stay. Summary and report of an earlier run are removed, unless ``keep_summary`` says that their
    inputs have not changed and the record of that run is the same (:attr:`LabelRun.is_reduced`).
    Raises UsageError, OutputError and StoreError as :func:`process`, and OutputError if results that would stay have
    other settings.
    """
    survey, settings, selection = opened.survey, opened.settings, opened.selection
    slugs = {ref.slug for ref in opened.refs}
    refuse_among_sessions(survey, out)
    if not replace:
        refuse_other_labels(out, settings.strategy)
    refuse_mixed_settings(out, settings, [ref.slug for ref in survey.sessions if not selection.contains(ref)])
    record = run_record(survey.root, opened.landmark_file, settings) | site_record(survey)
    excluded = {ref.slug for ref in survey.sessions if selection.contains(ref)} - slugs
    own = OwnFiles.of((*OF_RUN, CHANGE_FILE), (*SESSION_FOLDERS, LOGS, COLUMNS), slugs)
    with claim(out, record, own=own, replace=replace, keep_summary=keep_summary) as folder:
        folder.discard(CHANGE_FILE)  # it says that the labels were rebased
        gone = folder.drop(lambda slug: slug in slugs if selection.everything else slug not in excluded)
        run = opened_run(opened, folder, follow_links=follow_links)
        yield dataclasses.replace(run, removed=removed_findings(gone))


def _with_exclusions(survey: Survey, corrections: Corrections) -> Survey:
    """Add a finding for each session that corrections exclude."""
    excluded = [
        Finding(
            kind="excluded_session",
            file=CORRECTIONS_FILE,
            count=1,
            severity=Severity.INFO,
            message=f"{ref.key} is excluded{entry.because()}",
        )
        for ref in survey.sessions
        for entry in corrections.for_session(ref.key).exclude_session[:1]
    ]
    return dataclasses.replace(survey, findings=(*survey.findings, *excluded))


def run_record(root: Path, landmarks: Path | None, settings: ProcessSettings) -> dict[str, object]:
    """Inputs of a run besides the sessions' files: hashes of the site's files, settings, versions."""
    return {
        "site_files": site_hashes(root),
        "landmark_file": None if landmarks is None else {"name": landmarks.name, "sha256": _sha256(landmarks)},
        "settings": settings.of_labels(),
        "versions": {
            "vislam2tag": __version__,
            "python": platform.python_version(),
            "numpy": np.__version__,
            "polars": pl.__version__,
        },
    }


def site_hashes(root: Path) -> dict[str, str | None]:
    """SHA-256 of the site's own files, by path relative to it."""
    return {path.relative_to(root).as_posix(): _sha256(path) for path in site_files(root)}


def site_record(survey: Survey) -> dict[str, object]:
    """Name and floors of the survey, for reading the labels without it."""
    record: dict[str, object] = {"survey": survey.root.resolve().name, "floors": floor_records(survey.site)}
    if has_site_file(survey.root) and (building := read_site_file(survey.root).name):
        record["building"] = building
    if is_described_from_outside(survey.root):
        record["site_from_outside"] = True
    return record


def floor_records(site: Site) -> list[dict[str, object]]:
    """The site's floors, as ``run.json`` keeps them."""
    kept = FloorRecord.model_fields
    records = (FloorRecord(**{name: getattr(floor, name) for name in kept}) for floor in site.floors)
    return [record.model_dump(mode="json") for record in records]


def _sha256(path: Path) -> str | None:
    """Hash a file; None if it cannot be read (which the site's findings report)."""
    try:
        return hashlib.sha256(read_bytes(path)).hexdigest()
    except OSError:
        return None


def _reduce(
    run: LabelRun,
    refs: list[SessionRef],
    each: Callable[[SessionResult], None],
    tell: Callable[[Sequence[Finding]], None],
) -> Summary:
    """Reduce the sessions' results, read twice, one at a time, to summary and report."""
    settings, folder = run.settings, run.folder
    slugs, looked_at = [ref.slug for ref in refs], {ref.slug for ref in thinned(refs)}
    passes: dict[str, PassesRecord] = {}
    seen, uses = set[str](), set[str]()

    def results() -> Iterator[SessionResult]:
        for result in folder.results(slugs):
            each(result)
            seen.update(result.landmarks_logged)
            uses.update(result.corrections)
            if result.slug in looked_at and result.passes is not None:
                passes[result.slug] = result.passes
            yield result

    shown = run.shown
    rooms = RoomsOnPlans(shown.root, shown.site)
    summary = summarise(results(), settings.strategy, __version__)
    named, judgement = kept_faults(run.survey, refs, passes, rooms, summary.failed)
    ignoring = run.tasks[0].corrections.ignore_fault if run.tasks else ()
    named, judgement = answered(named, judgement, ignoring)
    faults = [fault for fault in named if not fault.ignored]
    new = [_fault_finding(fault) for fault in faults if fault.kind not in REPORTED]
    if run.tasks and len(refs) == len(run.survey.sessions) and not summary.failed:
        unknown = unknown_landmarks(run.tasks[0].corrections, run.survey.site, seen, uses)
        tell(unknown)
        new += unknown
    survey = dataclasses.replace(shown, findings=(*shown.findings, *new))
    said = {
        "faults": [fault.summary for fault in faults],
        "judgement": judgement,
        "site_findings": findings_by_kind(survey.findings),
        "contradictions": [
            one.model_copy(update={"room": rooms(one.floor, complex(*one.surveyed_m))})
            for one in summary.contradictions
        ],
    }
    summary = summary.model_copy(update=said)
    again = folder.results(slugs)
    folder.write(REPORT_FILE, lambda path: write_report(path, survey, settings, again, summary, run.conflicts))
    folder.put_text(SUMMARY_FILE, json.dumps(summary.model_dump(mode="json"), indent=1) + "\n")
    return summary


def kept_faults(
    survey: Survey,
    refs: Sequence[SessionRef],
    passes: Mapping[str, PassesRecord],
    rooms: RoomsOnPlans | None = None,
    failed: int = 0,
) -> tuple[list[Fault], Judgement]:
    """Faults of the survey according to the kept observations of walks (by slug), and whether these could show any."""
    walks = [kept_walk(ref.key, passes[ref.slug]) for ref in refs if ref.slug in passes]
    faults, evidence = faults_of(survey, walks, rooms)
    return faults, judgement_of(evidence, len(refs), failed, len(faults))


def _fault_finding(fault: Fault) -> Finding:
    if fault.kind is FaultKind.OTHER_IDS:  # corrections.toml cannot correct this
        message = f"{fault.summary}: {fault.evidence}"
        return Finding(kind="other_ids", file="", count=len(fault.landmarks), message=message, severity=Severity.ERROR)
    what = f"vislam2tag diagnose prints the lines for {CORRECTIONS_FILE} that correct it"
    message = f"{fault.summary}: {fault.evidence}; {what}"
    return Finding(kind="survey_fault", file=CORRECTIONS_FILE, count=1, message=message)


def removed_findings(slugs: Iterable[str]) -> list[Finding]:
    """Name the sessions whose results were removed."""
    return [
        Finding(
            kind="removed_labels",
            file=f"{RESULTS}/{slug}.json",
            count=1,
            message=f"the results of {slug} were removed from the output, because the survey no longer contains this "
            "session or corrections exclude it",
        )
        for slug in slugs
    ]


def outdated_findings(
    folder: OutputFolder, left_out: Sequence[SessionTask], settings: ProcessSettings
) -> list[Finding]:
    """Name the sessions outside a selection with outdated results.

    The sessions' own files are not read. For those in a store or a zip, only changes of the source code are found.
    """
    if not left_out:
        return []
    jobs = {job.slug: job for job in jobs_of(left_out, settings)}
    return list(_outdated(jobs, folder.results(jobs)))


def _outdated(jobs: dict[str, SessionJob], results: Iterable[SessionResult]) -> Iterator[Finding]:
    for result in results:
        if result.fingerprint and not _is_current(jobs[result.slug], result):
            yield Finding(
                kind="outdated_labels",
                file=f"{RESULTS}/{result.slug}.json",
                count=1,
                message=f"the labels of {result.slug} are outdated, and this run does not update them; run without "
                "--floor and --device to update them",
            )


def _is_current(job: SessionJob, result: SessionResult) -> bool:
    ref = job.task.ref
    if ref.stored is not None or ref.packed is not None:
        return result.parts.get("code") == job.code
    return still_holds(job, result, {file.name: file.sha256 for file in result.files})
