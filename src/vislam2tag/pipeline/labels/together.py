"""``process --together``: constraints between sessions from landmarks, radio scans and tracker noise.

Each session is reduced to a small map of its landmarks, and all maps are joined. Every session is then mapped with
landmark priors from the survey and all *other* sessions (:mod:`vislam2tag.estimation.landmark_survey.comparison`). If a
walk still goes far without a landmark, radio constraints from others help: each session of such a floor is mapped once
to keep its path and scans (:mod:`vislam2tag.positioning.walk_ties`). Constraints are part of the inputs of a session's
result. They are rounded, so that one more session changes others only if it adds information.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np
import polars as pl
from threadpoolctl import threadpool_limits

from vislam2tag.common.errors import UsageError
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import Progress
from vislam2tag.core.arrays import of_landmarks
from vislam2tag.core.context import PlaceTies, PlacingHints, TrackerNoise, WalkedWays
from vislam2tag.core.transforms import as_points
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.landmark_survey.comparison import OtherWalks, ToldPlaces
from vislam2tag.estimation.settings import ON_PLAN, MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.estimation.tracker_errors import noise_of_other_walks
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.landmark_survey import JointSurvey, ReducedSession, join_sessions, reduce_session
from vislam2tag.pipeline.labels.odd_references import references
from vislam2tag.pipeline.labels.session import OfSession, jobs_of
from vislam2tag.pipeline.run.failures import done_or_failed
from vislam2tag.pipeline.run.workers import Executor, outcomes_of, run_job
from vislam2tag.positioning.places import calibration_rows
from vislam2tag.positioning.radio_scans import RadioScans, scans_of_walk
from vislam2tag.positioning.walk_traces import WalkTrace, rounded_covariance
from vislam2tag.quality.diagnosis.record import References
from vislam2tag.sessions.prepared import SessionTask, mappable_session
from vislam2tag.sessions.registry import at_hand
from vislam2tag.sessions.session_landmarks import ToldLandmarks
from vislam2tag.site.model import SessionKey, Survey

MOST_KEPT = 256
"""Maximum number of scans of a session, evenly spread."""

_Told = TypeVar("_Told")


@dataclass(frozen=True)
class HeardWalk:
    """Path of a session and its scans; without both it neither gives nor gets constraints."""

    key: SessionKey
    trace: WalkTrace | None = None
    scans: RadioScans | None = None
    error: str | None = None


def heard_walk(settings: MappingSettings, task: SessionTask) -> HeardWalk:
    """Read and map a session for its constraints on others; a failure is recorded as its ``error``."""
    key = task.ref.key
    return done_or_failed(key, lambda: _heard(settings, task), lambda error: HeardWalk(key, error=error))


def _heard(settings: MappingSettings, task: SessionTask) -> HeardWalk:
    key, prepared = task.ref.key, mappable_session(task)
    camera, log, wifi = prepared.session.camera, prepared.session.landmarks, prepared.session.tables.get("wifi")
    if wifi is None or camera.without_poses:
        return HeardWalk(key)
    mapped = strategy_named(STRATEGY, settings).map(camera, log, prepared.landmarks)
    trace = WalkTrace.of(mapped, key.floor, LandmarkPriors.of(log.ids, prepared.landmarks))
    return HeardWalk(key, trace, scans_of(key.device, wifi))


def scans_of(device: str, wifi: pl.DataFrame) -> RadioScans:
    """The scans of a session's table of readings, each at the mean time of its readings, up to the maximum number."""
    table = wifi.filter(~pl.col("repeated"))
    scans = scans_of_walk(
        table["scan"].to_numpy(),
        table["bssid"].to_numpy().astype(np.str_),
        table["rssi_dbm"].to_numpy().astype(np.float64),
        table["time_ns"].to_numpy().astype(np.int64),
        device,
    )
    return scans[calibration_rows(len(scans), MOST_KEPT)]


def ties_of(walks: Sequence[HeardWalk]) -> dict[SessionKey, PlaceTies]:
    """Radio constraints of each walk of a floor, rounded, for walks that get any."""
    from vislam2tag.positioning.walk_ties import radio_ties  # SciPy, which workers alone need otherwise
    from vislam2tag.positioning.walk_traces import rounded

    known = sorted((walk for walk in walks if walk.trace is not None and walk.scans), key=lambda walk: walk.key)
    told = radio_ties([walk.trace for walk in known], [walk.scans for walk in known if walk.scans])
    return {walk.key: rounded(ties) for walk, ties in zip(known, told, strict=True) if ties is not None}


STRATEGY = "smoother"
STRATEGIES = (STRATEGY, ON_PLAN)
"""Other strategies map with surveyed landmarks only, as published."""
ROUNDED_M, ROUNDED_RAD = 1e-3, 1e-3
"""Positions and headings of priors are rounded to this, which is far below the accuracy of walks ..."""
ROUNDED_SIGMA_M, ROUNDED_SIGMA_RAD = 1e-2, 1e-3
"""... and their covariance to squares and products of these; no direction is known better."""
SETTLED_SHARE = 0.1
"""Convergence threshold, which is coarse because results are rounded."""
ROUNDED_WAY_M, ROUNDED_WAY_RAD = 0.01, 0.01
"""Rounding of the paths of walks without poses."""
FAR_M = 40.0
"""Radio constraints do not help a walk with a shorter way between landmarks (docs/results/how-good.md)."""


FEWEST_LANDMARKS = 2
"""Walks with fewer known landmarks may need the plan."""


@dataclass(frozen=True)
class TasksTogether:
    """Tasks with constraints from the other sessions, the agreement of all references, and what to ask a person."""

    tasks: list[SessionTask]
    references: References
    questions: list[Finding]


def refuse_together(strategy: str) -> None:
    """Raise UsageError for a strategy that does not map walks together."""
    if strategy not in STRATEGIES:
        raise UsageError(
            f"--together works with the strategies {' and '.join(STRATEGIES)} only; remove --together or --strategy "
            f"{strategy}"
        )


@dataclass(frozen=True)
class JoiningJob(OfSession[_Told]):
    """Input of a worker to reduce one session to its constraints on others."""

    reduce: Callable[[MappingSettings, SessionTask], _Told]
    """A function of a module; failures are in the ``error`` of its result."""
    outcome: Callable[..., _Told]
    """Creates such a result from a session's key and an ``error``."""

    @contextmanager
    def opened(self) -> Iterator[Callable[[], _Told]]:
        """Provide its files locally."""
        with at_hand(self.job.task.ref) as ref:
            yield partial(self.reduce, self.job.settings.mapping, replace(self.job.task, ref=ref))

    def given_up(self, error: str) -> _Told:
        """A session that could not be reduced is mapped without constraints."""
        return self.outcome(self.job.task.ref.key, error=error)


def told_tasks(
    survey: Survey,
    tasks: list[SessionTask],
    settings: ProcessSettings,
    run_all: Executor,
    progress: Progress[SessionKey],
) -> TasksTogether:
    """Tasks with constraints from all other sessions of the run.

    ``progress`` is called with each reduced session (twice if walks go far without a landmark, or have none) and their
    number.
    """
    todo = [JoiningJob(job, job.code, reduce_session, ReducedSession) for job in jobs_of(tasks, settings)]
    sessions = outcomes_of(run_all, run_job, todo, lambda session, total: progress(session.key, total))
    with threadpool_limits(limits=1):  # threads only slow down operations on such small matrices
        joint = join_sessions(survey, sessions, settings.survey.landmark_sigma_m, SETTLED_SHARE * ROUNDED_M)
        told, found = _told(joint), references(joint)
    led = {session.key: session.way for session in sorted(sessions, key=lambda each: each.key) if session.way}
    tracker = _tracker_noise(joint.mapped)

    def with_told(task: SessionTask) -> SessionTask:
        key = task.ref.key
        return replace(task, told=told.get(key), tracker=tracker.get(key), ways=_ways_of_others(led, key))

    tasks = list(map(with_told, tasks))
    far = {one.key.floor for one in joint.mapped if goes_far(one, told[one.key])}
    going = [task for task in tasks if task.ref.key.floor in far]
    ask = [JoiningJob(job, job.code, heard_walk, HeardWalk) for job in jobs_of(going, settings)]
    walks = outcomes_of(run_all, run_job, ask, lambda walk, total: progress(walk.key, len(todo) + total))
    ties: dict[SessionKey, PlaceTies] = {}
    with threadpool_limits(limits=1):
        for floor in {walk.key.floor for walk in walks}:
            ties |= ties_of([walk for walk in walks if walk.key.floor == floor])
    tasks = [replace(task, ties=ties.get(task.ref.key)) for task in tasks]
    hints, questions = _placed_together(tasks, settings, run_all, lambda done, all_: progress(done, len(todo) + all_))
    return TasksTogether([replace(task, hints=hints.get(task.ref.key)) for task in tasks], found, questions)


def _placed_together(
    tasks: list[SessionTask], settings: ProcessSettings, run_all: Executor, progress: Progress[SessionKey]
) -> tuple[dict[SessionKey, PlacingHints], list[Finding]]:
    """Hints for the walks that the plans of their floors place, from all walks of these floors, and what to ask for."""
    by_plan = {task.ref.key.floor for task in tasks if task.floor.plan is not None and _needs_plan(task, settings)}
    asked = [task for task in tasks if task.ref.key.floor in by_plan]
    if not asked:
        return {}, []
    from vislam2tag.pipeline.labels.placed_together import PlacedSession, placed_session, placing_hints

    reduce = partial(placed_session, settings.strategy)
    ask = [JoiningJob(job, job.code, reduce, PlacedSession) for job in jobs_of(asked, settings)]
    walks = outcomes_of(run_all, run_job, ask, lambda walk, total: progress(walk.key, total))
    hints: dict[SessionKey, PlacingHints] = {}
    questions: list[Finding] = []
    for floor in sorted(by_plan):
        of_floor, question = placing_hints([walk for walk in walks if walk.key.floor == floor])
        hints |= of_floor
        questions += question
    return hints, questions


def _needs_plan(task: SessionTask, settings: ProcessSettings) -> bool:
    """Whether a session is placed by the plan: by choice, or because landmarks do not connect it to the building."""
    return settings.strategy == ON_PLAN or task.told is None or len(task.told.ids) < FEWEST_LANDMARKS


def _tracker_noise(mapped: Sequence[ReducedSession]) -> dict[SessionKey, TrackerNoise | None]:
    """Tracker noise of a session according to the others, of its device and of other devices, on any floor."""
    known = sorted((session.key, session.noise.evidence) for session in mapped if session.noise is not None)
    keys, evidence = [key for key, _ in known], [shown for _, shown in known]
    return dict(zip(keys, noise_of_other_walks([key.device for key in keys], evidence), strict=True))


def goes_far(session: ReducedSession, told: ToldLandmarks) -> bool:
    """Whether a session goes far without a landmark with a known position."""
    known = {*zip(told.ids, told.floor.tolist(), strict=True)}
    mask = np.array([(place.landmark, place.floor) in known for place in session.places], dtype=np.bool_)
    return session.passes is not None and session.passes.longest_stretch_m(mask) > FAR_M


def _ways_of_others(led: dict[SessionKey, WalkedWays], key: SessionKey) -> WalkedWays | None:
    """Paths of the other sessions on a session's floor, rounded; None if there are none, or it has poses."""
    others = [way for other, way in led.items() if other.floor == key.floor and other != key]
    if key not in led or not others:
        return None
    return WalkedWays(
        np.concatenate([ROUNDED_WAY_M * np.round(way.position_bcs / ROUNDED_WAY_M) for way in others]),
        np.concatenate([ROUNDED_WAY_RAD * np.round(way.course_rad / ROUNDED_WAY_RAD) for way in others]),
        np.repeat(np.arange(len(others)), [len(way.walk) for way in others]),
    )


def _told(joint: JointSurvey) -> dict[SessionKey, ToldLandmarks]:
    """Landmark priors for each session that observed landmarks."""
    others, tied = OtherWalks(joint.joined), joint.joined.tied
    return {
        session.key: _of_session(joint, others.seen(number), number, int(tied.sum() - tied[number]))
        for number, session in enumerate(joint.mapped)
    }


def _of_session(joint: JointSurvey, places: ToldPlaces, number: int, sessions: int) -> ToldLandmarks:
    """Priors of the landmarks that the session itself observed, rounded."""
    own = np.flatnonzero(np.isin(places.landmark, joint.joined.maps[number].landmark))
    passed = [joint.places[index] for index in places.landmark[own].tolist()]
    # Standard deviations of x, y of each landmark come first, then those of their headings.
    units = np.repeat((ROUNDED_SIGMA_M, ROUNDED_SIGMA_RAD), (2 * len(own), len(own)))
    return ToldLandmarks(
        ids=tuple(place.landmark for place in passed),
        floor=np.array([place.floor for place in passed], dtype=np.int64),
        position_bcs=ROUNDED_M * np.round(as_points(places.position[own]) / ROUNDED_M),
        heading_rad=ROUNDED_RAD * np.round(places.heading_rad[own] / ROUNDED_RAD),
        joint_covariance=rounded_covariance(of_landmarks(places.covariance, own), units),
        sessions=sessions,
    )
