"""The figures of the paper and their sessions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure

from vislam2tag.common.errors import SessionError
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Landmarks, Trajectory
from vislam2tag.datasets.statistics_record import PAPER_FINGERPRINTS, DatasetStatistics
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.labeling.results import ErrorRecord
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.labeling.tables import label_readings
from vislam2tag.pipeline.paper.data import PaperData, PaperWalks, read_mappable, walk_of
from vislam2tag.quality.evaluation.metrics import error_curve, frames_within_sigma, strategy_errors
from vislam2tag.quality.evaluation.paper import STRATEGIES, PaperWalk, TrajectoryByStrategy, map_all, station_settings
from vislam2tag.quality.evaluation.reliability import coverage_curve, reduce_errors
from vislam2tag.sessions.model import Session
from vislam2tag.site.model import Floor, SessionKey
from vislam2tag.views.dataset_figures import fingerprints_by_device_and_floor
from vislam2tag.views.error_figures import (
    control_point_errors,
    coverage_accuracy,
    error_by_landmark_movement,
    error_distributions,
    landmark_distances,
    local_mapping,
    station_overlay,
    strategies_compared,
)
from vislam2tag.views.site_figures import landmark_configuration, scan_labels, workflow

SPLIT = SessionKey(4, "Subtrajectory_split", "2022-01-14T16:35:30")
FLAWED = SessionKey(1, "OnePlus_ref", "2022-01-19T15:51:00")
LONG = SessionKey(1, "LG_ref", "2022-01-19T16:06:28")
TRACKED = SessionKey(4, "OnePlus_tachy", "2022-01-14T16:01:04")
SCANNED = SessionKey(4, "Galaxy", "2021-12-20T14:17:21")
"""The sessions that the paper shows."""
NO_COLLECTION = "the data contains no walk for collecting fingerprints"
SHOWN = "local-corrected"
"""The strategy of figures with only one strategy, as in the paper."""


@dataclass(frozen=True)
class PaperResults:
    """The paper's data and results for the figures."""

    data: PaperData
    walks: PaperWalks
    settings: ProcessSettings
    collected: DatasetStatistics | None
    """Counts of the paper's own data set; None if it is not in the data."""


@dataclass(frozen=True)
class ShownSession:
    """A session for a figure: with its floor, mapped, without doubtful frames."""

    floor: Floor
    landmarks: Landmarks
    session: Session
    mapped: TrajectoryByStrategy

    @classmethod
    def of(cls, results: PaperResults, key: SessionKey, mapping: MappingSettings | None = None) -> ShownSession:
        """Read and map a session; raises SessionError if it is missing or cannot be mapped locally."""
        survey, ref = results.data.find(key)
        session, landmarks = read_mappable(survey, ref, results.settings)
        mapped = map_all(session, landmarks, mapping or results.settings.mapping)
        if not any(segment.status == Status.OK for segment in mapped["local"].segments):
            raise SessionError(
                f"{key}: the session could not be mapped: it needs visits to two different surveyed landmarks"
            )
        max_sigma_m = results.settings.labels.max_sigma_m
        counted = {name: _without_doubtful(one, max_sigma_m) for name, one in mapped.items()}
        return cls(survey.site.floor(key.floor), landmarks, session, counted)


def _without_doubtful(trajectory: Trajectory, max_sigma_m: float) -> Trajectory:
    sure = frames_within_sigma(trajectory, max_sigma_m)
    return replace(trajectory, position_bcs=np.where(sure[:, None], trajectory.position_bcs, np.nan))


def _configuration(results: PaperResults) -> Figure:
    site = max(results.data.surveys, key=lambda survey: len(survey.site.landmarks.ids)).site
    return landmark_configuration(site)


def _workflow(results: PaperResults) -> Figure:
    shown = ShownSession.of(results, FLAWED)
    trajectory = shown.mapped["local-corrected"]
    wifi = label_readings(shown.session.tables["wifi"], trajectory, results.settings.labels)
    session = shown.session
    return workflow(shown.floor, shown.landmarks, session.camera, session.landmarks, trajectory, wifi)


def _visits(results: PaperResults) -> Figure:
    shown = ShownSession.of(results, SPLIT)
    session, radius_m = shown.session, results.settings.mapping.visit_radius_m
    return landmark_distances(session.camera, session.landmarks, shown.mapped["local"].visits, radius_m)


def _local_mapping(results: PaperResults) -> Figure:
    shown = ShownSession.of(results, SPLIT)
    session = shown.session
    return local_mapping(shown.floor, session.camera, session.landmarks, shown.landmarks, shown.mapped["local"])


def _flawed(results: PaperResults) -> Figure:
    shown = ShownSession.of(results, FLAWED)
    session = shown.session
    return strategies_compared(shown.floor, session.camera, session.landmarks, shown.landmarks, shown.mapped)


def _long_walk(results: PaperResults) -> Figure:
    shown = ShownSession.of(results, LONG)
    walk = walk_of(results.walks.pressed, LONG)
    if walk is None:
        raise SessionError(f"{LONG}: the session has no presses at control points")
    pairs = {name: (shown.mapped[name], walk.counted[name]) for name in STRATEGIES}
    return control_point_errors(shown.floor, shown.landmarks, pairs)


def _movement(results: PaperResults) -> Figure:
    walks = _some(results.walks.pressed, "over control points")
    errors = [walk.errors.error_m for walk in walks]
    by_strategy = {name: np.array([one[name] for one in errors]) for name in STRATEGIES}
    return error_by_landmark_movement(np.array([walk.movement_m for walk in walks]), by_strategy)


def _overlay(results: PaperResults) -> Figure:
    shown = ShownSession.of(results, TRACKED, station_settings(results.settings.mapping))
    walk = walk_of(results.walks.tracked, TRACKED)
    if walk is None:
        raise SessionError(f"{TRACKED}: the session could not be compared with the total station's track")
    return station_overlay(shown.floor, shown.landmarks, SHOWN, shown.mapped[SHOWN], walk.counted[SHOWN])


def _scans(results: PaperResults) -> Figure:
    shown = ShownSession.of(results, SCANNED)
    wifi = label_readings(shown.session.tables["wifi"], shown.mapped[SHOWN], results.settings.labels)
    if wifi["x"].count() == 0:
        raise SessionError(f"{SCANNED}: the session has no labelled Wi-Fi reading")
    return scan_labels(shown.floor, shown.landmarks, wifi)


def _fingerprints(results: PaperResults) -> Figure:
    if results.collected is None:
        raise SessionError(NO_COLLECTION)
    return fingerprints_by_device_and_floor(results.collected.technologies["wifi"])


def _press_distribution(results: PaperResults) -> Figure:
    return _distribution(_some(results.walks.pressed, "over control points"))


def _station_distribution(results: PaperResults) -> Figure:
    return _distribution(_some(results.walks.tracked, "before a total station"))


def _some(walks: list[PaperWalk], what: str) -> list[PaperWalk]:
    if not walks:
        raise SessionError(f"the data contains no walk {what}")
    return walks


def _distribution(walks: list[PaperWalk]) -> Figure:
    curves = {
        name: error_curve([strategy_errors(walk.counted[name], "", name) for walk in walks]) for name in STRATEGIES
    }
    return error_distributions({name: curve for name, curve in curves.items() if curve is not None})


def _coverage(results: PaperResults) -> Figure:
    walks = _some(results.walks.tracked, "before a total station")
    curves = {name: coverage_curve(_record(walks, name)) for name in STRATEGIES}
    return coverage_accuracy({name: curve for name, curve in curves.items() if curve is not None})


def _record(walks: list[PaperWalk], strategy: str) -> ErrorRecord:
    points = [walk.points[strategy] for walk in walks]
    covariance = np.concatenate([one.sigma_m for one in points])[:, None, None] ** 2 * np.eye(2)
    errors = np.concatenate([one.residual_bcs for one in points])
    return reduce_errors("total station", errors, covariance, np.zeros_like(covariance))


@dataclass(frozen=True)
class PaperFigure:
    """A figure: stem of its files, title, description (compared with the paper's), and drawing function."""

    stem: str
    title: str
    about: str
    draw: Callable[[PaperResults], Figure]


FIGURES = (
    PaperFigure(
        "landmarks",
        "Landmark configuration",
        "Landmarks and control points of each floor. The paper has no such figure.",
        _configuration,
    ),
    PaperFigure(
        "figure_1",
        "Figure 1: from landmarks to labelled readings",
        f"The steps of the paper's diagram on one walk ({FLAWED}): survey landmarks, record a walk in the tracker's "
        "frame, map the parts without tracking failures, and label readings.",
        _workflow,
    ),
    PaperFigure(
        "figure_2",
        "Figure 2: visits to landmarks",
        f"Distance from the camera to each landmark ({SPLIT}). A visit is the minimum of each stay within the "
        "dashed radius, and it splits the walk. The radius is 1 m, as in the paper.",
        _visits,
    ),
    PaperFigure(
        "figure_3",
        "Figure 3: local mapping, step by step",
        f"The same walk ({SPLIT}): each sub-trajectory between two landmarks (black) gets a similarity of its own.",
        _local_mapping,
    ),
    PaperFigure(
        "figure_4",
        "Figure 4: a flawed recording mapped by each strategy",
        f"One walk ({FLAWED}). In the paper, mapping the whole walk at once fails here; local mapping saves the parts "
        "with good tracking.",
        _flawed,
    ),
    PaperFigure(
        "figure_5",
        "Figure 5: a walk of 15 minutes over control points",
        f"Lines join each label at a press to the nearest control point ({LONG}); titles show mean errors. In the "
        "paper, global mapping has the smallest error on this walk, 0.57 m.",
        _long_walk,
    ),
    PaperFigure(
        "figure_6",
        "Figure 6: error against landmark movement",
        "Each point is a walk over control points mapped by one strategy. In the paper, the error of global mapping "
        "grows with the movement, up to 20.78 m; that of Local (corrected) is at most 0.87 m.",
        _movement,
    ),
    PaperFigure(
        "figure_7",
        "Figure 7: a walk before the total station",
        f"The mapped walk over the measured track ({TRACKED}), and its error. In the paper, the two almost coincide; "
        "the mean error over all such walks is 0.18 m.",
        _overlay,
    ),
    PaperFigure(
        "figure_8",
        "Figure 8: fingerprints by device and floor",
        f"Labels by {SHOWN}; pale: scans without a label, counted on the floor of their walk. The paper's set has "
        f"{PAPER_FINGERPRINTS} labelled fingerprints of four phones on five floors.",
        _fingerprints,
    ),
    PaperFigure(
        "figure_9",
        "Figure 9: labels of single scans",
        f"Positions of Wi-Fi readings ({SCANNED}), with a colour for each scan; the star is the label of the whole "
        "scan.",
        _scans,
    ),
    PaperFigure(
        "distribution_control_points",
        "Errors at control points",
        "Share of all presses with at most this error, with 95 % intervals over walks. Not in the paper.",
        _press_distribution,
    ),
    PaperFigure(
        "distribution_total_station",
        "Errors against the total station",
        "Share of all measured points with at most this error, with 95 % intervals over walks. Not in the paper.",
        _station_distribution,
    ),
    PaperFigure(
        "coverage",
        "Share labelled against error",
        "All walks before the total station. For strategies with sigma, a limit on it trades labels for accuracy; "
        "others have one point. Not in the paper.",
        _coverage,
    ),
)
