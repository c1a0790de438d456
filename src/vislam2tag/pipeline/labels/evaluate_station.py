"""One device's sessions before a total station, compared with its tracks; runs in a worker process.

The station's clock is estimated over all sessions of a device on a floor, so these are mapped together.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import TypeAlias

from vislam2tag.common.errors import SessionError, SurveyError, Vislam2tagError
from vislam2tag.core.tracks import Trajectory
from vislam2tag.pipeline.labels.evaluate_session import REFERENCE, EvaluationJob, TruthComparisons, map_with, rounded
from vislam2tag.pipeline.run.failures import unexpected
from vislam2tag.quality.evaluation.metrics import points_within_sigma, strategy_errors
from vislam2tag.quality.evaluation.odd_truth import frame_against_walks
from vislam2tag.quality.evaluation.press_truth import press_truth, read_route
from vislam2tag.quality.evaluation.record import SessionEvaluation
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
from vislam2tag.quality.evaluation.truth import PointErrors
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.prepared import mappable_session

AT_PRISM, AT_CAMERA = "prism", "prism offset removed"
"""What labels are compared with: where the prism was, or where the camera was by the prism's offset from it."""
METHODS = (AT_PRISM, AT_CAMERA)
StationOutcome: TypeAlias = dict[str, TruthComparisons]
"""What a device's sessions show, by slug; no session that could not be read or mapped."""
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
    """Put those sessions together that a station tracked with one device on one floor."""
    devices: dict[tuple[int, str], list[EvaluationJob]] = defaultdict(list)
    for job in jobs:
        if _track_file(job).is_file():
            devices[job.ref.key.floor, job.ref.key.device].append(job)
    return [tuple(group) for group in devices.values()]


def with_station(record: SessionEvaluation, found: TruthComparisons) -> SessionEvaluation:
    """Add to a session's record what the station shows."""
    lists = {name: [*getattr(record, name), *getattr(found, name)] for name in ("missing", "findings", "measured")}
    return record.model_copy(update=lists | {"estimates": record.estimates | found.estimates})


def evaluate_station(jobs: tuple[EvaluationJob, ...]) -> StationOutcome:
    """Map a device's sessions and compare them with the station's tracks; what cannot be used is said to be missing."""
    try:
        return _evaluate(jobs)
    except Exception as error:  # one bad device must not end the batch; its records name the fault
        fault = unexpected("the station's track", error)
        return {job.ref.slug: TruthComparisons(missing=[fault]) for job in jobs}


def _evaluate(jobs: tuple[EvaluationJob, ...]) -> StationOutcome:
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
    """Read and map a session; None where that cannot be, which the session's own record tells."""
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
    """Find the station's frame by its shots of fixed points, else also by presses in its view."""
    job = walks[0].job
    floor = job.task.floor
    common = shot_points(job.ref.folder.parents[1], floor.number, job.task.site.landmarks, floor.control_points)
    if len(common.names) < FEWEST_COMMON:
        common = CommonPoints.joined([common, *(points for walk in walks if (points := _pressed(walk)) is not None)])
    return fit_frame(common)


def _pressed(walk: _Walk) -> CommonPoints | None:
    """Control points that the session pressed at; None where it did at none, or they cannot be used."""
    folder, floor = walk.job.ref.folder, walk.job.task.floor
    try:
        route = read_route(folder.parents[2], folder, floor.control_points.ids)
        presses = press_truth(walk.mapped[REFERENCE], walk.session.presses_ns, floor, route)
        return pressed_points(walk.mapped[REFERENCE], walk.track, presses)
    except (SessionError, SurveyError):
        return None


def _pose_lag(walks: Sequence[_Walk]) -> float | None:
    """Median over the device's walks of how late its poses are stamped, seconds; None where none can tell."""
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
