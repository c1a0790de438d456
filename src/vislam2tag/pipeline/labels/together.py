"""``process --together``: walks tell one another where the landmarks hang that they pass.

Each session is reduced to a small map of its landmarks, all maps are joined, and every session is mapped with what the
survey and all *other* sessions say of the landmarks that it passed (:mod:`vislam2tag.landmark_survey.other_walks`). It
is a part of what the session's result follows from, rounded, so that one more session repeats others only where it
tells them something new.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from vislam2tag.common.errors import UsageError
from vislam2tag.common.progress import Progress
from vislam2tag.core.arrays import FloatArray, of_landmarks
from vislam2tag.core.context import WalkedWays
from vislam2tag.core.similarity import as_points
from vislam2tag.diagnosis.references import References
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.landmark_survey.other_walks import OtherWalks, ToldPlaces
from vislam2tag.pipeline.labels.landmark_survey import JointSurvey, ReducedSession, join_sessions, reduce_session
from vislam2tag.pipeline.labels.odd_references import references
from vislam2tag.pipeline.labels.session import code_of
from vislam2tag.pipeline.run.workers import Executor
from vislam2tag.sessions.prepared import SessionTask
from vislam2tag.sessions.registry import at_hand
from vislam2tag.sessions.told_landmarks import ToldLandmarks
from vislam2tag.survey.model import SessionKey, Survey

STRATEGY = "smoother"
"""The others map with surveyed landmarks alone, as published."""
ROUNDED_M, ROUNDED_RAD = 1e-3, 1e-3
"""Places and headings that sessions are told are rounded to this: far less than walks can tell ..."""
ROUNDED_SIGMA_M, ROUNDED_SIGMA_RAD = 1e-2, 1e-3
"""... and their covariance to squares and products of these; no direction is known better."""
SETTLED_SHARE = 0.1
"""What is rounded need not be solved to the micrometre."""
ROUNDED_WAY_M, ROUNDED_WAY_RAD = 0.01, 0.01
"""So are the ways of walks without poses."""


def refuse_together(strategy: str) -> None:
    """Raise UsageError for a strategy that does not map walks together."""
    if strategy != STRATEGY:
        raise UsageError(
            f"--together maps walks by the strategy {STRATEGY} only: {strategy} maps by surveyed landmarks as "
            "published; leave --together or --strategy out"
        )


@dataclass(frozen=True)
class ReduceJob:
    """All that a worker needs to reduce one session to a map of its landmarks."""

    task: SessionTask
    settings: ProcessSettings
    code: str

    @property
    def slug(self) -> str:
        """File-name stem of the session's outputs."""
        return self.task.ref.slug


def reduced(job: ReduceJob) -> ReducedSession:
    """Reduce a session, wherever its files lie; what ends it stands in its error."""
    with at_hand(job.task.ref) as ref:
        return reduce_session(job.settings.mapping, replace(job.task, ref=ref))


def told_tasks(
    survey: Survey,
    tasks: list[SessionTask],
    settings: ProcessSettings,
    run_all: Executor,
    progress: Progress[ReducedSession],
) -> tuple[list[SessionTask], References]:
    """Tasks with what all other sessions of the run tell each; and how all references fit one another."""
    code = {name: code_of(name, settings) for name in sorted({task.ref.format for task in tasks})}
    todo = [ReduceJob(task, settings, code[task.ref.format]) for task in tasks]
    sessions: list[ReducedSession] = []

    def keep(session: ReducedSession) -> None:
        sessions.append(session)
        progress(session, len(todo))

    run_all(reduced, todo, report=keep)
    with threadpool_limits(limits=1):  # of matrices as small as these, threads cost a hundred times what they gain
        joint = join_sessions(survey, sessions, settings.survey.landmark_sigma_m, SETTLED_SHARE * ROUNDED_M)
        told, found = _told(joint), references(joint)
    led = {session.key: session.way for session in sorted(sessions, key=lambda each: each.key) if session.way}
    with_told = [replace(task, told=told.get(task.ref.key), ways=_ways_of_others(led, task.ref.key)) for task in tasks]
    return with_told, found


def _ways_of_others(led: dict[SessionKey, WalkedWays], key: SessionKey) -> WalkedWays | None:
    """Where the other sessions on the floor of one led, rounded; None where there are none, or it has poses."""
    others = [way for other, way in led.items() if other.floor == key.floor and other != key]
    if key not in led or not others:
        return None
    return WalkedWays(
        np.concatenate([ROUNDED_WAY_M * np.round(way.position_bcs / ROUNDED_WAY_M) for way in others]),
        np.concatenate([ROUNDED_WAY_RAD * np.round(way.course_rad / ROUNDED_WAY_RAD) for way in others]),
        np.repeat(np.arange(len(others)), [len(way.walk) for way in others]),
    )


def _told(joint: JointSurvey) -> dict[SessionKey, ToldLandmarks]:
    """What each session that passed landmarks is told of them."""
    others, tied = OtherWalks(joint.joined), joint.joined.tied
    return {
        session.key: _of_session(joint, others.told(number), number, int(tied.sum() - tied[number]))
        for number, session in enumerate(joint.mapped)
    }


def _of_session(joint: JointSurvey, places: ToldPlaces, number: int, sessions: int) -> ToldLandmarks:
    """Of what is told, the landmarks that the session itself passed, rounded."""
    own = np.flatnonzero(np.isin(places.landmark, joint.joined.maps[number].landmark))
    passed = [joint.places[index] for index in places.landmark[own].tolist()]
    return ToldLandmarks(
        ids=tuple(place.landmark for place in passed),
        floor=np.array([place.floor for place in passed], dtype=np.int64),
        position_bcs=ROUNDED_M * np.round(as_points(places.position[own]) / ROUNDED_M),
        heading_rad=ROUNDED_RAD * np.round(places.heading_rad[own] / ROUNDED_RAD),
        joint_covariance=rounded_covariance(of_landmarks(places.covariance, own)),
        sessions=sessions,
    )


def rounded_covariance(covariance: FloatArray) -> FloatArray:
    """Round a covariance (3k, 3k) of x, y of each of k landmarks and then of their headings; positive definite again.

    Rounded entry by entry alone, what hardly varies in one direction could vary by less than nothing.
    """
    k = len(covariance) // 3
    unit = np.concatenate((np.full(2 * k, ROUNDED_SIGMA_M), np.full(k, ROUNDED_SIGMA_RAD)))
    squared = np.outer(unit, unit)
    rounded = np.round(covariance / squared)
    values, vectors = np.linalg.eigh(rounded)
    if values.size and values[0] < 1:
        rounded = (vectors * np.maximum(values, 1.0)) @ vectors.T
        rounded = (rounded + rounded.T) / 2
    return np.asarray(squared * rounded)
