"""Processes all surveys of a fleet on any executor, survey after survey, and reduces each one there.

The main process opens a survey when its sessions can be handed out, and closes it after its reduction, so memory does
not grow with the fleet's sessions.

A dry run lists what ``fleet process`` would do, and why, without writing anything.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from vislam2tag import __version__
from vislam2tag.common.errors import OutputError, SurveyError, UsageError, Vislam2tagError
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.files.store import shown
from vislam2tag.common.files.stored_folder import any_store_at
from vislam2tag.common.progress import Progress, silent
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.fleet.add import described, inputs_of
from vislam2tag.pipeline.fleet.catalogue import (
    DONE,
    FAILED,
    LABELS,
    SURVEYS,
    UNREADABLE,
    Fleet,
    FleetTotals,
    fleet_status,
)
from vislam2tag.pipeline.fleet.reduction import (
    SurveyJob,
    SurveyOutcome,
    failed_survey,
    is_reduced,
    reduction_code,
    write_fleet_report,
)
from vislam2tag.pipeline.labels.label_run import LabelRun, label_run
from vislam2tag.pipeline.labels.process import dry_run
from vislam2tag.pipeline.labels.session import OfSession, Outcome, code_of, jobs_of
from vislam2tag.pipeline.run.keys import key_of
from vislam2tag.pipeline.run.selection import OpenedSurvey
from vislam2tag.pipeline.run.workers import Executor, process_all, run_job
from vislam2tag.site.links import left_out_of, shared_survey
from vislam2tag.site.model import Survey
from vislam2tag.site.stored_survey import survey_at_hand

_COMMITS = 100
"""Maximum number of intermediate writes of the catalogue: one per hundredth of the surveys."""


@dataclass(frozen=True)
class SessionOutcome:
    """Outcome of a session of a survey of the fleet."""

    survey: str
    outcome: Outcome

    @property
    def error(self) -> str | None:
        """Why it could not be read or mapped."""
        return self.outcome.error


@dataclass(frozen=True)
class FleetSession(OfSession[SessionOutcome]):
    """A session of a survey of the fleet."""

    survey: str

    @property
    def slug(self) -> str:
        """Name of its tasks."""
        return f"{self.survey}-{self.job.slug}"

    @contextmanager
    def opened(self) -> Iterator[Callable[[], SessionOutcome]]:
        """As the session itself."""
        with self.job.opened() as compute:
            yield lambda: SessionOutcome(self.survey, compute())

    def given_up(self, error: str) -> SessionOutcome:
        """As the session itself."""
        return SessionOutcome(self.survey, self.job.given_up(error))


FleetJob: TypeAlias = FleetSession | SurveyJob
FleetOutcome: TypeAlias = SessionOutcome | SurveyOutcome


def process_fleet(
    fleet: AnyPath,
    settings_for: Callable[[Path], ProcessSettings] = lambda _: ProcessSettings(),
    *,
    surveys: Sequence[str] = (),
    jobs: int = 1,
    executor: Executor | None = None,
    follow_links: bool = False,
    progress: Progress[FleetOutcome] = silent,
) -> FleetTotals:
    """Process the surveys of a fleet, or the named ones, and write labels, the fleet's tables, catalogue and report.

    ``settings_for`` returns the settings of each survey for its folder. With ``jobs`` > 1 sessions run in that
    many processes; an ``executor`` runs them elsewhere. ``follow_links`` is as that of
    :func:`~vislam2tag.pipeline.labels.process.process`. ``progress`` is called with each
    outcome and the number of sessions. A survey that cannot be opened, or with labels that cannot be overwritten, is
    ``unreadable`` in the catalogue, and the others continue. Raises UsageError if there is no fleet or no such survey,
    StoreError if a store cannot be read or written.
    """
    fleet = Path(fleet)
    at = Fleet(fleet)
    rows = {row["survey"]: row for row in chosen(at, surveys)}
    made = FleetRun(at, rows, settings_for, progress, follow_links)
    try:
        run_all: Executor = executor or partial(process_all, workers=jobs)
        run_all(run_job, made.jobs(), report=made.take)
    finally:
        made.close()
    write_fleet_report(fleet)
    return fleet_status(fleet)


def chosen(fleet: Fleet, surveys: Sequence[str]) -> list[dict[str, Any]]:
    """Rows of the named surveys, or of all; raises UsageError for an unknown one."""
    rows = fleet.catalogue().to_dicts()
    unknown = set(surveys) - {row["survey"] for row in rows}
    if unknown:
        raise UsageError(
            f"{min(unknown)}: {shown(fleet.root)} has no such survey; "
            f"list them with vislam2tag fleet list {shown(fleet.root)}"
        )
    return [row for row in rows if not surveys or row["survey"] in surveys]


@dataclass
class _Open:
    """A survey in progress."""

    stack: ExitStack
    run: LabelRun
    row: dict[str, Any]
    """Its row in the catalogue before its reduction."""
    waiting: int
    """Sessions that have not ended."""
    is_reduced: bool
    """Whether summary, tables and pages match the labels at the time when the survey was opened."""
    repeated: bool = False
    """Whether any session was processed."""


@dataclass
class FleetRun:
    """Flow of a fleet's jobs: the sessions of each survey, and the survey's own job after its last session."""

    fleet: Fleet
    rows: dict[str, dict[str, Any]]
    """Catalogue rows of the surveys to process."""
    settings_for: Callable[[Path], ProcessSettings]
    progress: Progress[FleetOutcome]
    follow_links: bool = False
    """Whether pages show what links lead to outside a survey."""
    open: dict[str, _Open] = field(default_factory=dict)
    ended: list[dict[str, object]] = field(default_factory=list)
    """Rows that are not yet in the catalogue."""

    @property
    def sessions(self) -> int:
        """Number of sessions according to the catalogue."""
        return sum(row["sessions"] for row in self.rows.values())

    def jobs(self) -> Iterator[FleetJob]:
        """Jobs of all sessions; each survey is opened in turn."""
        for name in self.rows:
            try:
                opened = self._opened(name)
            except Vislam2tagError as error:
                self._end(name, {"state": UNREADABLE, "error": str(error)})
                self.progress(failed_survey(name, error), self.sessions)
                continue
            for job in jobs_of(opened.run.tasks, opened.run.settings, opened.run.folder):
                yield FleetSession(job, job.code, name)
            if not opened.run.tasks:
                yield from self._after_the_last(name)

    def take(self, outcome: FleetOutcome) -> list[FleetJob]:
        """Record an outcome; return its follow-up jobs."""
        self.progress(outcome, self.sessions)
        opened = self.open[outcome.survey]
        if isinstance(outcome, SurveyOutcome):
            failed = {"state": FAILED, "error": outcome.error, "labels": None}
            self._end(outcome.survey, opened.row | (outcome.row if outcome.error is None else failed))
            return []
        opened.waiting -= 1
        opened.repeated |= outcome.outcome.repeated
        return self._after_the_last(outcome.survey) if not opened.waiting else []

    def close(self) -> None:
        """Close open surveys, and write finished ones to the catalogue."""
        for opened in self.open.values():
            opened.stack.close()
        self.open.clear()
        self._commit()

    def _opened(self, name: str) -> _Open:
        folder = self.fleet.root / SURVEYS / name
        inputs = inputs_of(any_store_at(folder))
        with ExitStack() as stack:
            root = stack.enter_context(survey_at_hand(folder))
            settings = self.settings_for(root)
            if settings.together:
                raise UsageError(
                    "together: a fleet processes each walk separately; remove this, or run process on the survey"
                )
            opened = OpenedSurvey.at(root, settings)
            labels = self._labels_key(opened.survey, settings, inputs)
            row = described(opened.survey) | {"inputs": inputs, "labels": labels}
            reduced = self._is_reduced(name, labels)
            out = self.fleet.root / LABELS / name
            made = label_run(opened, out, keep_summary=reduced, follow_links=self.follow_links)
            run = stack.enter_context(made)
            self.open[name] = _Open(stack.pop_all(), run, row, len(run.tasks), reduced and run.is_reduced)
        return self.open[name]

    def _labels_key(self, survey: Survey, settings: ProcessSettings, inputs: str) -> str:
        """Key of all inputs of a survey's labels, summary, tables and pages."""
        codes = sorted({code_of(name, settings) for name in {ref.format for ref in survey.sessions}})
        shown = shared_survey(survey, follow_links=self.follow_links)
        left_out = [finding.message for finding in left_out_of(shown.findings)]
        return key_of(inputs, codes, reduction_code(), settings.of_labels(), __version__, *left_out)

    def _is_reduced(self, name: str, labels: str) -> bool:
        before = self.rows[name]
        return before["state"] == DONE and before["labels"] == labels and is_reduced(self.fleet.root, name, labels)

    def _after_the_last(self, name: str) -> list[FleetJob]:
        """Job after a survey's last session; none if nothing has changed since its last reduction."""
        opened = self.open[name]
        if opened.is_reduced and not opened.repeated:
            self._end(name, {})
            return []
        run, code, labels = opened.run, reduction_code(), opened.row["labels"]
        return [SurveyJob(self.fleet.root, name, run.settings, run.folder, code, labels, self.follow_links)]

    def _end(self, name: str, row: dict[str, Any]) -> None:
        opened = self.open.pop(name, None)
        if opened is not None:
            opened.stack.close()
        if row:
            self.ended.append(self.rows[name] | {"error": None} | row)
        if len(self.ended) * _COMMITS >= len(self.rows):
            self._commit()

    def _commit(self) -> None:
        if self.ended:
            self.fleet.change(self.ended)
            self.ended.clear()


@dataclass(frozen=True)
class PlannedSurvey:
    """A survey in a dry run."""

    survey: str
    kept: int
    """Sessions that are done and unchanged."""
    reasons: dict[str, int]
    """Number of sessions to process by reason; a session may have several."""
    to_process: int
    """Number of sessions to process."""
    error: str | None
    """Why the survey cannot be opened."""


def fleet_dry_run(
    fleet: Path,
    settings_for: Callable[[Path], ProcessSettings] = lambda _: ProcessSettings(),
    *,
    surveys: Sequence[str] = (),
    jobs: int = 1,
    executor: Executor | None = None,
) -> Iterator[PlannedSurvey]:
    """Report for each survey what :func:`.process_fleet` with these arguments would process; raises as that."""
    for row in chosen(Fleet(fleet), surveys):
        name = row["survey"]
        try:
            with survey_at_hand(fleet / SURVEYS / name) as root:
                found = dry_run(root, fleet / LABELS / name, settings_for(root), jobs=jobs, executor=executor)
        except (OutputError, SurveyError) as error:
            yield PlannedSurvey(name, 0, {}, 0, str(error))
            continue
        run = [one for one in found if one.reasons]
        reasons = Counter(reason.value for one in run for reason in one.reasons)
        yield PlannedSurvey(name, len(found) - len(run), dict(sorted(reasons.items())), len(run), None)
