"""Maps sessions by every strategy and compares them with ground truth; runs in a worker process.

A total station's clock is estimated over all sessions of a device on a floor, so these are mapped together.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any, TypeAlias

import numpy as np

from vislam2tag.common.errors import SessionError, SurveyError, Vislam2tagError
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import BoolArray
from vislam2tag.core.tracks import Landmarks, Trajectory
from vislam2tag.core.visits import find_visits
from vislam2tag.estimation.settings import WITHOUT_TRACKER, MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.run.failures import done_or_failed, unexpected
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.quality.evaluation.dense import TruePath, dense_errors, dense_figures
from vislam2tag.quality.evaluation.metrics import frames_within_sigma, points_within_sigma, retention, strategy_errors
from vislam2tag.quality.evaluation.odd_truth import PressOffset, frame_against_walks, press_offsets
from vislam2tag.quality.evaluation.paper import landmark_movement_m
from vislam2tag.quality.evaluation.press_truth import (
    is_faulty,
    nearest_point_errors,
    press_errors,
    press_truth,
    press_truth_findings,
    read_route,
)
from vislam2tag.quality.evaluation.record import SessionEvaluation, StrategyErrors
from vislam2tag.quality.evaluation.station_clock import (
    DeviceAlignment,
    FreeParameters,
    StationWalk,
    align_device,
    station_findings,
    station_point_errors,
    with_station_sigma,
)
from vislam2tag.quality.evaluation.station_frame import (
    TRACK_FILE,
    CommonPoints,
    StationFrame,
    StationTrack,
    fit_frame,
    pressed_points,
    read_station_track,
    shot_points,
)
from vislam2tag.quality.evaluation.trajectory_files import find_truth, tum_text, tum_text_of_truth
from vislam2tag.quality.evaluation.truth import PointErrors, Truth
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.prepared import SessionTask, mappable_session
from vislam2tag.site.model import SessionRef

IDENTIFIED, WITHOUT_LEAD, NEAREST = "identified", "identified, lead removed", "nearest"
"""The methods to identify the control point of a press."""
REFERENCE = "smoother"
"""The labels of this strategy identify the control points of presses for all strategies."""
TRAJECTORIES = "trajectories"
"""Folder of the trajectories in the output."""
TRUTH = "truth"
"""Stem of a truth file in a session's folder, and name of the truth among the strategies' trajectories."""


@dataclass(frozen=True)
class EvaluationJob:
    """All that a worker needs to evaluate one session."""

    task: SessionTask
    settings: ProcessSettings
    strategies: tuple[str, ...]
    truth: Path | None
    """Folder with a truth file for each session, called by its slug; None: in the sessions' folders."""
    out: OutputFolder
    clock_drift: bool = False
    """Whether a station's clock may run at another rate than the phone's."""

    @property
    def ref(self) -> SessionRef:
        """The session's folder."""
        return self.task.ref

    @property
    def inertial(self) -> bool:
        """Whether the user chose to map walks by their inertial sensors."""
        return WITHOUT_TRACKER in self.strategies

    def max_sigma_m(self, session: Session) -> float:
        """Maximum sigma of labels that are compared, metres."""
        return self.settings.labels.for_session(without_poses=session.camera.without_poses).max_sigma_m

    @property
    def truth_place(self) -> tuple[Path, str]:
        """Folder and stem of the session's truth file."""
        return (self.ref.folder, TRUTH) if self.truth is None else (self.truth, self.ref.slug)


@dataclass
class TruthComparisons:
    """Results for each truth."""

    measured: list[StrategyErrors] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    estimates: dict[str, float | None] = field(default_factory=dict)
    presses: list[PressOffset] = field(default_factory=list)


def evaluate_session(job: EvaluationJob) -> SessionEvaluation:
    """Map and compare one session; one that cannot be read or mapped becomes a record with an error.

    Its trajectories are written. Raises OutputError if they cannot be written.
    """
    return done_or_failed(job.ref.key, lambda: _evaluate(job), lambda error: _record(job.ref, error=error))


def map_with(
    names: tuple[str, ...], session: Session, landmarks: Landmarks, settings: MappingSettings
) -> dict[str, Trajectory]:
    """Map a session with each of the strategies."""
    return {
        name: strategy_named(name, settings).map(session.camera, session.landmarks, landmarks)
        for name in dict.fromkeys(names)
    }


def _evaluate(job: EvaluationJob) -> SessionEvaluation:
    prepared = mappable_session(job.task, inertial=job.inertial)
    prepared.refuse_without_frames()
    session, landmarks = prepared.session, prepared.landmarks
    needed = ("local", "local-corrected", REFERENCE)
    everything = map_with((*job.strategies, *needed), session, landmarks, job.settings.mapping)
    chosen = {name: everything[name] for name in job.strategies}
    limit = job.max_sigma_m(session)
    sure = {name: frames_within_sigma(trajectory, limit) for name, trajectory in everything.items()}
    found = TruthComparisons()
    _at_dense_truth(job, session, landmarks, chosen, found)
    _at_control_points(job, session, chosen, everything[REFERENCE], found)
    for name, trajectory in chosen.items():
        _write(job, name, tum_text(trajectory))
    return _record(
        job.ref,
        error=_mapping_error(job, {name: sure[name] for name in chosen}),
        faulty=is_faulty(everything["local"], everything["local-corrected"]) if sure["local"].any() else None,
        movement_m=rounded(landmark_movement_m(session.landmarks)),
        retention={name: retention(sure["local"], sure[name]) for name in chosen},
        **vars(found),
    )


def _at_dense_truth(
    job: EvaluationJob, session: Session, landmarks: Landmarks, mapped: dict[str, Trajectory], found: TruthComparisons
) -> None:
    truth = _dense_truth(job, session, found)
    if truth is None:
        return
    path = TruePath.of(truth)
    passed = find_visits(session.camera, session.landmarks, job.settings.mapping.visit_radius_m)
    known = [visit.frame for visit in passed if visit.landmark in landmarks.surveyed_ids]
    visits_ns = session.camera.time_ns[known]
    for name, trajectory in mapped.items():
        points = points_within_sigma(dense_errors(trajectory, path, job.settings.truth), job.max_sigma_m(session))
        found.measured.append(strategy_errors(points, "", name, dense_figures(points, path, visits_ns)))
    _write(job, TRUTH, tum_text_of_truth(truth))


def _dense_truth(job: EvaluationJob, session: Session, found: TruthComparisons) -> Truth | None:
    """Read the truth; one that is unreadable or outside the walk is recorded as missing."""
    try:
        truth = find_truth(*job.truth_place)
    except SessionError as error:
        found.missing.append(str(error))
        return None
    if truth is None:
        if job.truth is not None:
            found.missing.append(f"--truth {job.truth}: there is no file {job.ref.slug}.tum, or with another suffix")
        return None
    found.findings += truth.findings
    time_ns = session.camera.time_ns[session.camera.usable]
    gap_s = max(truth.time_ns[0] - time_ns[-1], time_ns[0] - truth.time_ns[-1]) * 1e-9
    if gap_s > 0:
        found.missing.append(f"the truth and the camera are {gap_s:.0f} s apart; check that both use the same clock")
        return None
    return truth


def _at_control_points(
    job: EvaluationJob, session: Session, mapped: dict[str, Trajectory], reference: Trajectory, found: TruthComparisons
) -> None:
    floor, own = job.task.floor, job.settings.truth
    tracked = (job.ref.folder / TRACK_FILE).is_file()
    if not len(session.presses_ns) and (found.measured or tracked or not len(floor.control_points.ids)):
        return
    try:
        route = read_route(job.ref.folder.parents[2], job.ref.folder, floor.control_points.ids)
        truth = press_truth(reference, session.presses_ns, floor, route)
    except (SessionError, SurveyError) as error:
        found.missing.append(str(error))
        return
    methods: dict[str, Callable[[Trajectory], PointErrors]] = {
        IDENTIFIED: lambda trajectory: press_errors(trajectory, truth, own),
        NEAREST: lambda trajectory: nearest_point_errors(trajectory, session.presses_ns, floor, own),
    }
    if np.isfinite(truth.lead.lead_s):
        methods[WITHOUT_LEAD] = lambda trajectory: press_errors(trajectory, truth, own, without_lead=True)
    for method, compare in methods.items():
        for name, trajectory in mapped.items():
            points = points_within_sigma(compare(trajectory), job.max_sigma_m(session))
            found.measured.append(strategy_errors(points, method, name))
    names = [floor.control_points.ids[point] for point in truth.point[truth.identified].tolist()]
    found.presses += press_offsets(names, press_errors(reference, truth, own))
    found.findings += press_truth_findings(truth)
    found.estimates |= {"lead_s": rounded(truth.lead.lead_s), "lead_sigma_s": rounded(truth.lead.sigma_s)}


def _mapping_error(job: EvaluationJob, labelled: dict[str, BoolArray]) -> str | None:
    """Error text if no strategy labels anything, by the mask (n,) of each; None if one does."""
    if any(mask.any() for mask in labelled.values()):
        return None
    return f"{job.ref.key}: the session could not be mapped by any strategy (vislam2tag inspect shows what it has)"


def _write(job: EvaluationJob, name: str, text: str) -> None:
    job.out.put_text(f"{TRAJECTORIES}/{job.ref.slug}.{name}.tum", text)


def rounded(value: float) -> float | None:
    """Round for the record; None if the value is not known."""
    return round(value, 4) if value == value else None


def _record(ref: SessionRef, **details: Any) -> SessionEvaluation:
    """Add the session's identity."""
    return SessionEvaluation(slug=ref.slug, **vars(ref.key), **details)


AT_PRISM, AT_CAMERA = "prism", "prism offset removed"
"""Positions for comparison: of the prism, or of the camera according to the prism's offset."""
METHODS = (AT_PRISM, AT_CAMERA)
StationOutcome: TypeAlias = dict[str, TruthComparisons]
"""Results of a device's sessions by slug, without sessions that could not be read or mapped."""
FEWEST_COMMON = 2
"""With fewer shots of fixed points than this, presses in the station's view help to find its frame."""


@dataclass(frozen=True)
class _Walk:
    """A session before the station, mapped by every strategy."""

    job: EvaluationJob
    session: Session
    mapped: dict[str, Trajectory]
    track: StationTrack


def station_jobs(jobs: Sequence[EvaluationJob]) -> list[tuple[EvaluationJob, ...]]:
    """Group the sessions that a station tracked with one device on one floor."""
    devices: dict[tuple[int, str], list[EvaluationJob]] = defaultdict(list)
    for job in jobs:
        if _track_file(job).is_file():
            devices[job.ref.key.floor, job.ref.key.device].append(job)
    return [tuple(group) for group in devices.values()]


def with_station(record: SessionEvaluation, found: TruthComparisons) -> SessionEvaluation:
    """Add the results of the station to a session's record."""
    lists = {name: [*getattr(record, name), *getattr(found, name)] for name in ("missing", "findings", "measured")}
    return record.model_copy(update=lists | {"estimates": record.estimates | found.estimates})


def evaluate_station(jobs: tuple[EvaluationJob, ...]) -> StationOutcome:
    """Map a device's sessions and compare them with the station's tracks; unusable tracks are recorded as missing."""
    try:
        return _compared_walks(jobs)
    except Exception as error:  # one bad device must not end the batch; its records name the fault
        fault = unexpected("the station's track", error)
        return {job.ref.slug: TruthComparisons(missing=[fault]) for job in jobs}


def _compared_walks(jobs: tuple[EvaluationJob, ...]) -> StationOutcome:
    outcome = {job.ref.slug: TruthComparisons() for job in jobs}
    walks = [walk for job in jobs if (walk := _walk(job, outcome[job.ref.slug])) is not None]
    if not walks:
        return outcome
    try:
        frame = _frame(walks)
        standing = [StationWalk(walk.mapped[REFERENCE], walk.track, frame) for walk in walks]
        drift = jobs[0].clock_drift
        methods = {
            method: align_device(standing, FreeParameters(drift=drift, prism=method == AT_CAMERA)) for method in METHODS
        }
    except Vislam2tagError as error:
        for walk in walks:
            outcome[walk.job.ref.slug].missing.append(str(error))
        return outcome
    lag_s = _pose_lag(walks)
    odd = frame_against_walks(_reference_errors(walks, methods[AT_CAMERA]))
    for number, walk in enumerate(walks):
        found = outcome[walk.job.ref.slug]
        found.findings += station_findings(standing[number], methods[AT_PRISM], number)
        found.findings += odd if methods[AT_CAMERA].truths[number] is not None else []
        found.estimates |= _estimates(frame, methods[AT_PRISM]) | {"pose_lag_s": lag_s}
        for method, alignment in methods.items():
            _compare(walk, method, alignment, number, found)
    return outcome


def _track_file(job: EvaluationJob) -> Path:
    return job.ref.folder / TRACK_FILE


def _walk(job: EvaluationJob, found: TruthComparisons) -> _Walk | None:
    """Read and map a session; None if that fails, which the session's own record reports."""
    try:
        prepared = mappable_session(job.task, inertial=job.inertial)
        prepared.refuse_without_frames()
        track = read_station_track(_track_file(job))
    except SurveyError as error:
        found.missing.append(str(error))
        return None
    except SessionError:
        return None
    session = prepared.session
    mapped = map_with((*job.strategies, REFERENCE), session, prepared.landmarks, job.settings.mapping)
    return _Walk(job, session, mapped, track)


def _frame(walks: Sequence[_Walk]) -> StationFrame:
    """Estimate the station's frame from its shots of fixed points and, if they are too few, from presses in view."""
    job = walks[0].job
    floor = job.task.floor
    common = shot_points(job.ref.folder.parents[1], floor.number, job.task.site.landmarks, floor.control_points)
    if len(common.names) < FEWEST_COMMON:
        common = CommonPoints.joined([common, *(points for walk in walks if (points := _pressed(walk)) is not None)])
    return fit_frame(common)


def _pressed(walk: _Walk) -> CommonPoints | None:
    """Control points of the session's presses; None if there are none or they cannot be used."""
    folder, floor = walk.job.ref.folder, walk.job.task.floor
    try:
        route = read_route(folder.parents[2], folder, floor.control_points.ids)
        presses = press_truth(walk.mapped[REFERENCE], walk.session.presses_ns, floor, route)
        return pressed_points(walk.mapped[REFERENCE], walk.track, presses)
    except (SessionError, SurveyError):
        return None


def _pose_lag(walks: Sequence[_Walk]) -> float | None:
    """Median over the device's walks of the delay of pose stamps, seconds; None if unknown."""
    lags = [lag_s for walk in walks if (lag_s := walk.session.camera.pose_lag_s) is not None]
    return rounded(median(lags)) if lags else None


def _reference_errors(walks: Sequence[_Walk], alignment: DeviceAlignment) -> list[PointErrors]:
    """Labels of the walks that meet the station's track, by the reference."""
    return [
        station_point_errors(walk.mapped[REFERENCE], with_station_sigma(truth, alignment, walk.job.settings.truth))
        for walk, truth in zip(walks, alignment.truths, strict=True)
        if truth is not None
    ]


def _compare(walk: _Walk, method: str, alignment: DeviceAlignment, number: int, found: TruthComparisons) -> None:
    truth = alignment.truths[number]
    if truth is None:
        return
    known = with_station_sigma(truth, alignment, walk.job.settings.truth)
    for name in walk.job.strategies:
        points = station_point_errors(walk.mapped[name], known)
        found.measured.append(
            strategy_errors(points_within_sigma(points, walk.job.max_sigma_m(walk.session)), method, name)
        )


def _estimates(frame: StationFrame, alignment: DeviceAlignment) -> dict[str, float | None]:
    ahead, left, drift = alignment.prism_ahead_m, alignment.prism_left_m, alignment.drift_ppm
    drifting = {} if drift is None else {"station_drift_ppm": drift.value, "station_drift_sigma_ppm": drift.sigma}
    return {
        **{name: rounded(value) for name, value in drifting.items()},
        "station_clock_s": rounded(alignment.adjustment.clock_ns * 1e-9),
        "station_clock_sigma_s": rounded(alignment.clock_sigma_s),
        "station_frame_worst_m": rounded(float(frame.residual_m.max())),
        "station_frame_scale": rounded(frame.scale),
        "prism_ahead_m": rounded(ahead.value),
        "prism_ahead_sigma_m": rounded(ahead.sigma),
        "prism_left_m": rounded(left.value),
        "prism_left_sigma_m": rounded(left.sigma),
    }
