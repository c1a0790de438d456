"""What ``process`` would do, and why: nothing is written, no session is read but to see whether it has changed.

With ``settings.together`` sessions are read, too: what others tell of landmarks is a part of what labels follow from.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from vislam2tag.common.errors import OutputError
from vislam2tag.common.progress import silent
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.process import jobs_of, opened_run
from vislam2tag.pipeline.labels.session import Reason
from vislam2tag.pipeline.labels.stored_session import AnyJob, code_here, reasons_to_run
from vislam2tag.pipeline.labels.together import told_tasks
from vislam2tag.pipeline.run.dask import DaskExecutor
from vislam2tag.pipeline.run.outputs import output_at, refuse_mixed_settings, refuse_other_labels
from vislam2tag.pipeline.run.selection import Selection
from vislam2tag.pipeline.run.workers import Executor, process_all
from vislam2tag.survey.stored_survey import survey_at_hand


@dataclass(frozen=True)
class PlannedSession:
    """A session that a run would look at."""

    session: str
    """Floor, device and name."""
    reasons: tuple[Reason, ...]
    """Why it would be processed; none: it would not."""


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
    """Say of each session whether :func:`.process` with these arguments would process it, in the survey's order.

    ``executor`` is one of :func:`dry_run_on_dask`. Raises as :func:`.process`.
    """
    settings = settings or ProcessSettings()
    run_all = executor or partial(process_all, workers=jobs)
    if not replace:
        refuse_other_labels(out, settings.strategy)
    folder = output_at(out)
    with survey_at_hand(survey_root) as root:
        run = opened_run(root, settings, folder, landmarks, selection)
        refuse_mixed_settings(out, settings, [task.ref.slug for task in run.others])
        if settings.together:
            run = run.with_told(told_tasks(run.survey, [*run.tasks, *run.others], settings, run_all, silent)[0])
        found: list[PlannedSession] = []
        run_all(planned, jobs_of(run.tasks, settings, folder), report=found.append)
        place = {str(task.ref.key): number for number, task in enumerate(run.tasks)}
    return sorted(found, key=lambda one: place[one.session])


def planned(job: AnyJob) -> PlannedSession:
    """Look at one session."""
    return PlannedSession(str(job.task.ref.key), reasons_to_run(job))


def dry_run_on_dask(client: Any, tell: Callable[[str], None]) -> Executor:
    """What looks at sessions on the workers of a ``distributed.Client``; ``tell`` is told which are refused."""
    return DaskExecutor(client, code_here, _give_up, tell)


def _give_up(job: AnyJob, error: str) -> PlannedSession:
    raise OutputError(f"{job.task.ref.key}: cannot be looked at: {error}")
