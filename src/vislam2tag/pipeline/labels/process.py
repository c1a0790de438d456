"""The main job: a survey folder goes in; tables, results, summary and report come out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from vislam2tag.common.errors import OutputError
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.text_paths import AnyPath, path_or_none
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.labeling.results import (
    Summary,
)
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.label_run import jobs_of, label_run, opened_run, outdated_findings
from vislam2tag.pipeline.labels.odd_references import odd_findings
from vislam2tag.pipeline.labels.session import Outcome, Reason, SessionJob
from vislam2tag.pipeline.labels.together import refuse_together, told_tasks
from vislam2tag.pipeline.run.claims import refuse_mixed_settings, refuse_other_labels
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.pipeline.run.selection import Selection
from vislam2tag.pipeline.run.workers import Executor, Job, process_all, run_job
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.corrections.file import read_corrections
from vislam2tag.site.model import SessionKey
from vislam2tag.site.stored_survey import survey_at_hand


def process(
    survey_root: AnyPath,
    out: AnyPath,
    settings: ProcessSettings | None = None,
    *,
    landmarks: AnyPath | None = None,
    selection: Selection | None = None,
    jobs: int = 1,
    executor: Executor | None = None,
    replace: bool = False,
    progress: Progress[Outcome] = silent,
    comparing: Progress[SessionKey] = silent,
    follow_links: bool = False,
    tell: Callable[[Sequence[Finding]], None] = lambda _: None,
) -> Summary:
    """Process a survey: map every session, label every reading, write tables, results, summary and report.

    ``survey_root`` and ``out`` are folders, or addresses of folders in object storage (``Path("s3://bucket/survey")``).
    ``landmarks`` is a file with the landmarks of all floors that replaces the floors' own. With ``jobs`` > 1 sessions
    run in that many processes (call it from under ``if __name__ == "__main__":``); an ``executor`` runs them elsewhere.
    ``replace`` allows ``out`` to hold labels of another strategy, labels that were rebased, or what another command
    wrote, which is removed. With the setting ``together`` sessions are first reduced to what they tell others, of
    which ``comparing`` hears. ``tell`` is called with what is odd about the site's own files before that. Links are
    read through, but what comes from outside the survey is drawn on pages only with ``follow_links``.

    Raises SurveyError where ``survey_root`` is no survey or ``landmarks`` no landmark file for it, UsageError for a
    selection that matches nothing, OutputError where ``out`` cannot be written or is not ours, StoreError where a store
    cannot be read or written; a bad session is only counted in ``Summary.failed``.
    """
    survey_root, out, landmarks = Path(survey_root), Path(out), path_or_none(landmarks)
    settings = settings or ProcessSettings()
    strategy_named(settings.strategy, settings.mapping)  # an unknown one is told before anything is fetched
    if settings.together:
        refuse_together(settings.strategy)
    run_all = executor or partial(process_all, workers=jobs)
    with survey_at_hand(survey_root) as root:
        survey = open_survey(root, settings.survey.landmark_sigma_m, landmarks, use_planned=settings.survey.use_planned)
        with label_run(
            survey,
            read_corrections(root),
            out,
            settings,
            landmarks=landmarks,
            selection=selection,
            replace=replace,
            follow_links=follow_links,
        ) as made:
            tell(made.shown.findings)
            tell(made.removed)
            if settings.together:
                told, found = told_tasks(made.survey, [*made.tasks, *made.others], settings, run_all, comparing)
                odd = odd_findings(found)
                tell(odd)
                made = made.with_told(told).with_conflicts(found, odd)
            outdated = outdated_findings(made.folder, made.others, settings)
            tell(outdated)
            made = made.with_findings(outdated)
            todo = jobs_of(made.tasks, settings, made.folder)
            run_all(run_job, todo, report=lambda done: progress(done, len(todo)))
            return made.reduced()


@dataclass(frozen=True)
class PlannedSession:
    """A session that a run would look at."""

    session: str
    """Floor, device and name."""
    reasons: tuple[Reason, ...]
    """Why it would be processed; none: it would not."""


@dataclass(frozen=True)
class PlannedJob(Job[PlannedSession]):
    """Looks at one session."""

    job: SessionJob
    code: str

    @property
    def slug(self) -> str:
        """File-name stem of the session's outputs."""
        return self.job.slug

    def code_here(self) -> str:
        """Key of the source that would process it in this process."""
        return self.job.code_here()

    def opened(self) -> AbstractContextManager[Callable[[], PlannedSession]]:
        """Look at it as a whole: nothing is fetched before."""
        return nullcontext(lambda: PlannedSession(str(self.job.task.ref.key), self.job.reasons()))

    def given_up(self, error: str) -> PlannedSession:
        """A dry run ends where a session cannot be looked at."""
        raise OutputError(f"{self.job.task.ref.key}: cannot be looked at: {error}")


def dry_run(
    survey_root: Path,
    out: Path,
    settings: ProcessSettings | None = None,
    *,
    landmarks: Path | None = None,
    selection: Selection | None = None,
    jobs: int = 1,
    executor: Executor | None = None,
    replace: bool = False,
) -> list[PlannedSession]:
    """Say of each session whether :func:`process` with these arguments would process it, in the survey's order.

    Nothing is written, and no session is read except to see whether it has changed. With ``settings.together`` sessions
    are read, too: what others tell of landmarks is a part of what labels follow from. Raises as :func:`process`.
    """
    settings = settings or ProcessSettings()
    run_all = executor or partial(process_all, workers=jobs)
    if not replace:
        refuse_other_labels(out, settings.strategy)
    folder = OutputFolder(out)
    with survey_at_hand(survey_root) as root:
        made = opened_run(root, settings, folder, landmarks, selection)
        refuse_mixed_settings(out, settings, [task.ref.slug for task in made.others])
        if settings.together:
            made = made.with_told(told_tasks(made.survey, [*made.tasks, *made.others], settings, run_all, silent)[0])
        found: list[PlannedSession] = []
        todo = [PlannedJob(job, job.code) for job in jobs_of(made.tasks, settings, folder)]
        run_all(run_job, todo, report=found.append)
        place = {str(task.ref.key): number for number, task in enumerate(made.tasks)}
    return sorted(found, key=lambda one: place[one.session])
