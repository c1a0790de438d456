"""The main job: from a survey folder to tables, results, summary and report.

``map_walk`` does the same with one walk from tables in memory, without a folder.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Unpack

import numpy as np

from vislam2tag.common.errors import OutputError, UsageError
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.findings import Finding
from vislam2tag.common.given_tables import GivenTable
from vislam2tag.common.progress import Progress, silent
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.labeling.mapped_walk import MappedWalk
from vislam2tag.labeling.results import Summary
from vislam2tag.labeling.settings import GivenSettings, ProcessSettings
from vislam2tag.labeling.tables import LabelledWalk
from vislam2tag.pipeline.labels.findings import walk_findings
from vislam2tag.pipeline.labels.label_run import LabelRun, label_run, opened_run, outdated_findings
from vislam2tag.pipeline.labels.odd_references import odd_findings
from vislam2tag.pipeline.labels.one_walk import contradicted
from vislam2tag.pipeline.labels.session import OfSession, Outcome, Reason, jobs_of
from vislam2tag.pipeline.labels.together import TasksTogether, refuse_together, told_tasks
from vislam2tag.pipeline.run.claims import refuse_mixed_settings, refuse_other_labels
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.pipeline.run.selection import OpenedSurvey, ProcessArguments, ProcessChoices, choices_of, given_settings
from vislam2tag.pipeline.run.workers import outcomes_of, run_job
from vislam2tag.sessions.in_memory import landmarks_in_memory, session_in_memory
from vislam2tag.sessions.prepared import SessionTask, prepared_from
from vislam2tag.sessions.sighting_poses import AT_REST
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.model import ControlPoints, Floor, SessionKey, SessionRef, Site
from vislam2tag.site.stored_survey import survey_at_hand


def process(
    survey_root: AnyPath,
    out: AnyPath,
    settings: ProcessSettings | None = None,
    *,
    replace: bool = False,
    follow_links: bool = False,
    progress: Progress[Outcome] = silent,
    comparing: Progress[SessionKey] = silent,
    tell: Callable[[Sequence[Finding]], None] = lambda _: None,
    **arguments: Unpack[ProcessArguments],
) -> Summary:
    """Process a survey: map every session, label every reading, write tables, results, summary and report.

    ``survey_root`` and ``out`` are folders, or addresses of folders in object storage (``Path("s3://bucket/survey")``).
    ``landmarks``, ``selection``, ``jobs`` and ``executor`` are as
    :class:`~vislam2tag.pipeline.run.selection.ProcessChoices` says.
    Settings may also be given by keyword: ``strategy="local"`` (:class:`~vislam2tag.labeling.settings.GivenSettings`).
    ``replace`` allows ``out`` to contain labels of another strategy, labels that were rebased, or what another command
    wrote, which is removed. With the setting ``together`` sessions are first reduced to constraints for others, with
    ``comparing`` as progress. Before that, ``tell`` is called with findings about the site's own files. Links are
    followed, but files from outside the survey are shown on pages only with ``follow_links``. A bad session is only
    counted in ``Summary.failed``.

    Raises SurveyError if ``survey_root`` is not a survey or ``landmarks`` not a landmark file for it. Raises UsageError
    for a selection that matches nothing, OutputError if ``out`` cannot be written or is not ours, StoreError if a store
    cannot be read or written.
    """
    settings = (settings or ProcessSettings()).with_given(given_settings(arguments))
    strategy_named(settings.strategy, settings.mapping)  # an unknown strategy is reported before anything is fetched
    if settings.together:
        refuse_together(settings.strategy)
    with survey_at_hand(Path(survey_root)) as root:
        opened = OpenedSurvey.at(root, settings, **choices_of(arguments))
        with label_run(opened, Path(out), replace=replace, follow_links=follow_links) as made:
            tell(made.shown.findings)
            tell(made.removed)
            if settings.together:
                together = _told(made, opened, comparing)
                odd = odd_findings(together.references)
                tell([*odd, *together.questions])
                made = _with_tasks(made, together).with_conflicts(together.references, [*odd, *together.questions])
            outdated = outdated_findings(made.folder, made.others, settings)
            tell(outdated)
            made = made.with_findings(outdated)
            todo = jobs_of(made.tasks, settings, made.folder)
            opened.run_all(run_job, todo, report=lambda done: progress(done, len(todo)))
            return made.reduced(tell=tell)


def _told(made: LabelRun, opened: OpenedSurvey, comparing: Progress[SessionKey]) -> TasksTogether:
    """The tasks of the run, and of its other sessions, with the constraints between sessions."""
    return told_tasks(made.survey, [*made.tasks, *made.others], made.settings, opened.run_all, comparing)


def _with_tasks(made: LabelRun, together: TasksTogether) -> LabelRun:
    count = len(made.tasks)
    return dataclasses.replace(made, tasks=together.tasks[:count], others=together.tasks[count:])


@dataclass(frozen=True)
class PlannedSession:
    """A session that a run would process or keep."""

    session: str
    """Floor, device and name."""
    reasons: tuple[Reason, ...]
    """Why it would be processed; empty if it would not."""


@dataclass(frozen=True)
class PlannedJob(OfSession[PlannedSession]):
    """Looks at one session."""

    @property
    def waits(self) -> bool:
        """False: nothing is fetched in advance."""
        return False

    def opened(self) -> AbstractContextManager[Callable[[], PlannedSession]]:
        """Look at it as a whole."""
        return nullcontext(lambda: PlannedSession(str(self.job.task.ref.key), self.job.reasons()))

    def given_up(self, error: str) -> PlannedSession:
        """A dry run ends where a session cannot be looked at."""
        raise OutputError(f"{self.job.task.ref.key}: the session cannot be read: {error}")


def dry_run(
    survey_root: Path,
    out: Path,
    settings: ProcessSettings | None = None,
    *,
    replace: bool = False,
    **choices: Unpack[ProcessChoices],
) -> list[PlannedSession]:
    """Report for each session whether :func:`process` with these arguments would process it, in the survey's order.

    Nothing is written, and no session is read except to see whether it has changed. With ``settings.together`` sessions
    are read, too, because constraints from others are an input of labels. Raises as :func:`process`.
    """
    settings = settings or ProcessSettings()
    if not replace:
        refuse_other_labels(out, settings.strategy)
    with survey_at_hand(survey_root) as root:
        opened = OpenedSurvey.at(root, settings, **choices)
        made = opened_run(opened, OutputFolder(out))
        refuse_mixed_settings(out, settings, [task.ref.slug for task in made.others])
        if settings.together:
            made = _with_tasks(made, _told(made, opened, silent))
        todo = [PlannedJob(job, job.code) for job in jobs_of(made.tasks, settings, made.folder)]
        found = outcomes_of(opened.run_all, run_job, todo)
        place = {str(task.ref.key): number for number, task in enumerate(made.tasks)}
    return sorted(found, key=lambda one: place[one.session])


def map_walk(
    poses: GivenTable,
    sightings: GivenTable,
    landmarks: GivenTable,
    *,
    sensors: GivenTable | None = None,
    floor: int | None = None,
    settings: ProcessSettings | None = None,
    **given: Unpack[GivenSettings],
) -> MappedWalk:
    """Map one walk, from tables in memory (Polars, pandas, Arrow), as ``process`` maps a session.

        result = vislam2tag.map_walk(poses, sightings, landmarks)
        result.frames, result.findings, result.label(wifi), result.plot()

    Columns; others are ignored, and rows count from 1. Usual headers such as ``timestamp``, ``time_s``, ``px``,
    ``pos_x [mm]``, ``quat_w`` and ``marker_id`` are recognised, with their unit:

    * ``poses``: ``time_ns`` (ns; or ``time_s``, date-times, dates as text), ``tx, ty, tz`` (metres) and the unit
      quaternion ``qx, qy, qz, qw``, from the camera to the tracker's frame, whose y is up. The camera looks along its
      own -z. Frames with z up and cameras with y down are recognised if the path shows them;
    * ``sightings``: ``time_ns`` (that of a pose), ``id`` (text or whole numbers), ``tx, ty, tz`` of the landmark in
      the tracker's frame, and ``qx`` .. ``qw`` if known; or its offset ``cam_x, cam_y, cam_z`` in the camera's axes;
    * ``landmarks``: ``id``, ``x``, ``y`` (metres on the plan); optionally ``z``, ``sigma_m`` (per axis; 0.02 if
      missing), ``heading_rad`` (of the sheet's X axis, from x), ``heading_sigma_rad`` and ``floor`` (whole number);
    * ``sensors``: ``time_ns``, ``sensor``, ``v1`` .. ``v6``, as in ``sensors.csv`` (docs/reference/session-files.md):
      air pressure for floors, inertial readings for tracking losses. ``process`` uses them if they are there.

    ``strategy="local"`` and other settings may be given by keyword, as for ``process``.
    ``floor`` is the number of the floor on which the walk starts; it is needed if ``landmarks`` has several. A walk
    that cannot be mapped has frames without positions and ``findings`` with the reason. If it contradicts the landmark
    table, as one with x and y exchanged, ``findings`` say so and no frame is ``ok``. Raises UsageError, naming
    table, column and row, for unusable tables, SessionError for poses that cannot be those of a walk.
    """
    settings = (settings or ProcessSettings()).with_given(given)
    surveyed, own, site_findings = landmarks_in_memory(landmarks, floor, settings.survey.landmark_sigma_m)
    key = SessionKey(own, "in memory", "walk")
    session, times = session_in_memory(key, poses, sightings, sensors, settings.findings)
    if (session.landmarks.orientation_acs == AT_REST).all() and np.isfinite(surveyed.heading_rad).any():
        raise UsageError(
            "landmarks, column heading_rad: the sightings have no orientations to compare it with; leave the column "
            "out, or give sightings the quaternions qx, qy, qz, qw of the landmarks"
        )
    site = Site(tuple(map(_floor, sorted({own, *surveyed.floor.tolist()}))), surveyed)
    ref = SessionRef(key, Path(), "memory", "walk")
    task = SessionTask(ref, site, Corrections(), settings.survey.landmark_sigma_m, settings.findings)
    prepared = prepared_from(task, session)
    prepared.refuse_unfit(inertial=settings.inertial)
    prepared = replace(prepared, session=replace(prepared.session, tables={}))  # sensors were used, and need no labels
    walk = LabelledWalk.of(prepared, settings)
    walk, faults = contradicted(prepared, walk, settings.mapping.smoother.sighting_range_m)
    findings = (*site_findings, *walk_findings(prepared, walk, settings), *faults)
    return MappedWalk(walk, prepared.landmarks, findings, times)


def _floor(number: int) -> Floor:
    """A floor with nothing but a number."""
    return Floor(number, f"floor {number}", None, None, None, None, ControlPoints((), np.empty((0, 2))))
