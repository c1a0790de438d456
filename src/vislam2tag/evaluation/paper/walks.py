"""The paper's evaluation (section VI): each walk's errors by strategy, by the paper's own rules."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from vislam2tag.core.similarity import Similarity2
from vislam2tag.core.tracks import LandmarkLog, Landmarks, Trajectory
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.evaluation.control_points.press_truth import is_faulty, nearest_point_errors, walk_error
from vislam2tag.evaluation.metrics import points_within_sigma
from vislam2tag.evaluation.paper.tables import WalkErrors
from vislam2tag.evaluation.point_errors import PointErrors
from vislam2tag.evaluation.total_station.station_errors import JUMP_M, clock_offset, station_point_errors
from vislam2tag.evaluation.total_station.station_file import StationTrack
from vislam2tag.evaluation.truth import Truth
from vislam2tag.sessions.model import Session
from vislam2tag.survey.model import Floor, SessionKey

CLOCK_STRATEGY = "local-corrected"
"""Whose errors the clock offset makes least, as in the paper."""


@dataclass(frozen=True)
class StationWalks:
    """The walks of one phone before a total station; ``clock_ns`` is the station's wall clock minus its boot clock."""

    walks: tuple[PaperWalk, ...]
    clock_ns: int


def station_settings(settings: MappingSettings) -> MappingSettings:
    """Settings with which the paper maps walks before the total station: shorter steps are breaks."""
    return settings.model_copy(update={"max_step_m": JUMP_M})


def station_walks(
    sessions: Sequence[tuple[Session, TrajectoryByStrategy, StationTrack]],
    bcs_T_station: Similarity2,
    max_sigma_m: float,
) -> StationWalks:
    """Compare the mapped sessions of one phone with the station's tracks (see :func:`paper_walk` for the labels).

    As in the paper the clock offset is fitted to the very errors it is then used for.
    """
    clock_ns = clock_offset([(mapped[CLOCK_STRATEGY], track) for _, mapped, track in sessions], bcs_T_station)

    walks = []
    for session, mapped, track in sessions:
        truth = Truth(track.time_ns - clock_ns, bcs_T_station @ track.position)
        walks.append(paper_walk(session, mapped, partial(station_point_errors, truth=truth), max_sigma_m))
    return StationWalks(tuple(walks), clock_ns)


def landmark_movement_m(log: LandmarkLog) -> float:
    """Mean displacement of the logged landmarks in the plane of the ACS, metres; NaN where none was logged.

    A sheet hangs still, so its logged positions would be one. A landmark's displacement is the mean distance of its
    positions from their median, which is what a mapping of the whole walk takes for its place; rows of lost tracking do
    not count. Each landmark counts once.
    """
    plane = log.plane_acs
    means = []
    for index in range(len(log.ids)):
        rows = log.rows_of(index)
        logged = plane[rows][~log.lost[rows]]
        if len(logged):
            means.append(np.linalg.norm(logged - np.median(logged, axis=0), axis=1).mean())
    return float(np.mean(means)) if means else float("nan")


STRATEGIES = ("local", "local-corrected", "global-affine", "smoother")
"""The paper's three, whose least squares at control points is an affine map, and the smoother beside them."""

TrajectoryByStrategy = dict[str, Trajectory]


@dataclass(frozen=True)
class PaperWalk:
    """One walk's labels against one kind of truth, by strategy."""

    key: SessionKey
    points: dict[str, PointErrors]
    faulty: bool
    """Whether ``local-corrected`` discards anything that ``local`` maps."""
    movement_m: float
    """See :func:`~vislam2tag.evaluation.paper.walks.landmark_movement_m`."""
    max_sigma_m: float
    """Labels whose stated sigma exceeds this do not count, as the paper discards what it doubts; metres."""

    @property
    def counted(self) -> dict[str, PointErrors]:
        """The points with those labels only that count."""
        return {name: points_within_sigma(points, self.max_sigma_m) for name, points in self.points.items()}

    @property
    def errors(self) -> WalkErrors:
        """The walk's mean error by strategy."""
        means = {name: walk_error(points.error_m) for name, points in self.counted.items()}
        return WalkErrors(self.key, means, self.faulty)


def map_all(session: Session, landmarks: Landmarks, settings: MappingSettings) -> TrajectoryByStrategy:
    """Map a session with each of :data:`STRATEGIES`."""
    return {
        name: strategy_named(name, settings).map(session.camera, session.landmarks, landmarks) for name in STRATEGIES
    }


def paper_walk(
    session: Session, mapped: TrajectoryByStrategy, compare: Callable[[Trajectory], PointErrors], max_sigma_m: float
) -> PaperWalk:
    """Compare each of a session's trajectories with the truth."""
    points = {name: compare(trajectory) for name, trajectory in mapped.items()}
    faulty = is_faulty(mapped["local"], mapped["local-corrected"])
    return PaperWalk(session.key, points, faulty, landmark_movement_m(session.landmarks), max_sigma_m)


def press_walk(session: Session, floor: Floor, mapped: TrajectoryByStrategy, max_sigma_m: float) -> PaperWalk:
    """Compare a mapped session with the control points, at least one, nearest to its presses."""
    return paper_walk(session, mapped, lambda one: nearest_point_errors(one, session.presses_ns, floor), max_sigma_m)


def labelled_shares(walks: Sequence[PaperWalk]) -> dict[str, float]:
    """Share of all the walks' points that count as labelled, by strategy; nothing where there are no points."""
    counted = [walk.counted for walk in walks]
    labelled = {name: np.concatenate([one[name].labelled for one in counted]) for name in STRATEGIES if counted}
    return {name: float(mask.mean()) for name, mask in labelled.items() if len(mask)}
