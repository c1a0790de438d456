"""The paper's evaluation (section VI): each walk's errors by strategy, by the paper's own rules."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.tracks import LandmarkLog, Landmarks, Trajectory
from vislam2tag.evaluation.control_points.press_truth import is_faulty, nearest_point_errors, walk_error
from vislam2tag.evaluation.measuring import sure_points
from vislam2tag.evaluation.paper.tables import WalkErrors
from vislam2tag.evaluation.point_errors import PointErrors
from vislam2tag.mapping.registry import strategy_named
from vislam2tag.mapping.settings import MappingSettings
from vislam2tag.sessions.model import Session
from vislam2tag.survey.model import Floor, SessionKey


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

Mapped = dict[str, Trajectory]


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
        return {name: sure_points(points, self.max_sigma_m) for name, points in self.points.items()}

    @property
    def errors(self) -> WalkErrors:
        """The walk's mean error by strategy."""
        means = {name: walk_error(points.error_m) for name, points in self.counted.items()}
        return WalkErrors(self.key, means, self.faulty)


def map_all(session: Session, landmarks: Landmarks, settings: MappingSettings) -> Mapped:
    """Map a session with each of :data:`STRATEGIES`."""
    return {
        name: strategy_named(name, settings).map(session.camera, session.landmarks, landmarks) for name in STRATEGIES
    }


def paper_walk(
    session: Session, mapped: Mapped, compare: Callable[[Trajectory], PointErrors], max_sigma_m: float
) -> PaperWalk:
    """Compare each of a session's trajectories with the truth."""
    points = {name: compare(trajectory) for name, trajectory in mapped.items()}
    faulty = is_faulty(mapped["local"], mapped["local-corrected"])
    return PaperWalk(session.key, points, faulty, landmark_movement_m(session.landmarks), max_sigma_m)


def press_walk(session: Session, floor: Floor, mapped: Mapped, max_sigma_m: float) -> PaperWalk:
    """Compare a mapped session with the control points, at least one, nearest to its presses."""
    return paper_walk(session, mapped, lambda one: nearest_point_errors(one, session.presses_ns, floor), max_sigma_m)


def labelled_shares(walks: Sequence[PaperWalk]) -> dict[str, float]:
    """Share of all the walks' points that count as labelled, by strategy; nothing where there are no points."""
    counted = [walk.counted for walk in walks]
    labelled = {name: np.concatenate([one[name].labelled for one in counted]) for name in STRATEGIES if counted}
    return {name: float(mask.mean()) for name, mask in labelled.items() if len(mask)}
