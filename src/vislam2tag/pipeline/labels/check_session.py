"""One session checked against itself, in a worker process.

Landmarks are left out in turn and predicted from the others; of a session without poses, known positions are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vislam2tag.common.errors import SessionError
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.core.tracks import Landmarks
from vislam2tag.core.transforms import as_complex
from vislam2tag.estimation.dead_reckoning.bridging import bridged_observations
from vislam2tag.estimation.dead_reckoning.walk import LeftOut as LeftOutFixes
from vislam2tag.estimation.dead_reckoning.walk import ReckonedWalk
from vislam2tag.estimation.heights import estimate_heights
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.odometry import Odometry
from vislam2tag.estimation.settings import HeightSettings, SmootherSettings
from vislam2tag.estimation.smoother import SolvedWalk, mapped_path, solve_walk
from vislam2tag.estimation.strategies.dead_reckoning import DeadReckoning
from vislam2tag.estimation.strategies.smoother import Smoother
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.walked_floors import WalkPlaces
from vislam2tag.pipeline.run.failures import done_or_failed
from vislam2tag.quality.landmark_gain import GainMap, gains, positions_each_metre, session_gains
from vislam2tag.quality.self_check import LeftOut, error_factor, estimate_accuracy, expected_error_m, leave_out
from vislam2tag.quality.self_check_record import DoubtfulFix, LeftOutMark, SessionCheck
from vislam2tag.sessions.prepared import PreparedSession, SessionTask, mappable_session


def checked_by_fixes(prepared: PreparedSession, settings: ProcessSettings) -> dict[str, Any]:
    """Return the session's numbers under their names in its record; raises SessionError where it cannot be mapped."""
    walk, camera = reckoned(prepared, settings), prepared.session.camera
    time_s = np.asarray((camera.time_ns[camera.usable] - walk.sensed.signals.start_ns) * 1e-9, dtype=np.float64)
    covariance = walk.at(time_s)[1]
    sigma_m = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2)
    labelled = sigma_m <= settings.labels.max_sigma_without_poses_m
    left_out = LeftOutFixes.of(walk)
    marks = _left_out(walk, left_out, prepared.session.key.floor)
    found = [LeftOut(mark.landmark, 1, np.array(mark.offset_m), mark.covariance_m2[0] * np.eye(2)) for mark in marks]
    details: dict[str, Any] = {
        "fixes": len(walk.names),
        "left_out": marks,
        "doubtful_fixes": doubtful_fixes(walk, left_out),
        "frames": len(sigma_m),
        "labelled": int(labelled.sum()),
    }
    if (estimate := estimate_accuracy(covariance[labelled], found)) is not None:
        details |= estimate.rounded()
    return details


def reckoned(prepared: PreparedSession, settings: ProcessSettings) -> ReckonedWalk:
    """Map a session without poses; raises SessionError where it cannot be."""
    strategy = DeadReckoning(settings.mapping.dead_reckoning, settings.mapping.heights)
    walk = strategy.reckoned(prepared.session.camera, prepared.landmarks)
    if walk is None:
        raise SessionError(f"{prepared.session.key}: could not be mapped: it needs {strategy.needs}")
    return walk


def doubtful_fixes(walk: ReckonedWalk, left_out: LeftOutFixes) -> list[DoubtfulFix]:
    """The fixes that the others contradict, in order of time."""
    return [
        DoubtfulFix(
            name=walk.names[fix],
            fix_m=_rounded(walk.fixes.position[fix]),
            offset_m=_rounded(as_complex(left_out.error_m[fix]).item()),
            size_m=round(float(np.linalg.norm(left_out.error_m[fix])), 4),
            sigma_m=round(float(left_out.sigma_m[fix]), 4),
        )
        for fix in np.flatnonzero(left_out.doubtful).tolist()
    ]


def _rounded(place: complex) -> tuple[float, float]:
    """A place or an offset, x + iy, to a tenth of a millimetre."""
    return round(float(place.real), 4), round(float(place.imag), 4)


def _left_out(walk: ReckonedWalk, left_out: LeftOutFixes, floor: int) -> list[LeftOutMark]:
    """The fixes of which the others say something."""
    scatter_m2 = walk.fix_scatter_m**2
    return [
        LeftOutMark(
            floor=floor,
            landmark=walk.names[fix],
            passes=1,
            surveyed_m=_rounded(walk.fixes.position[fix]),
            offset_m=_rounded(as_complex(left_out.error_m[fix]).item()),
            covariance_m2=(float(left_out.sigma_m[fix] ** 2), 0.0, float(left_out.sigma_m[fix] ** 2)),
            survey_covariance_m2=(float(scatter_m2[fix]), 0.0, float(scatter_m2[fix])),
        )
        for fix in np.flatnonzero(np.isfinite(left_out.sigma_m)).tolist()
    ]


@dataclass(frozen=True)
class CheckedSession:
    """What the worker tells the main process; without ``gains`` and ``places`` if it could not be mapped."""

    record: SessionCheck
    gains: GainMap = field(default_factory=GainMap)
    places: Sequence[WalkPlaces] = ()


def check_session(settings: ProcessSettings, task: SessionTask) -> CheckedSession:
    """Read, map and check one session; one that cannot be read or mapped becomes a record with an error."""
    failed = lambda error: CheckedSession(_record(task, error=error))
    return done_or_failed(task.ref.key, lambda: _check(settings, task), failed)


def _check(settings: ProcessSettings, task: SessionTask) -> CheckedSession:
    whole = mappable_session(task, inertial=settings.inertial)
    if whole.session.camera.without_poses:
        return CheckedSession(_record(task, **checked_by_fixes(whole, settings)))
    prepared = whole.longest_section()
    smoothed = _smoothed(prepared, settings.mapping.smoother)
    left_out = leave_out(smoothed)
    path, covariance, _ = mapped_path(smoothed)
    odometry = smoothed.model.observations.odometry
    floor = _floors(prepared, settings.mapping.heights, odometry)[odometry.frame]
    positions = positions_each_metre(smoothed)
    found = session_gains(
        gains(smoothed, positions, floor[positions.at]), error_factor(left_out), floor, expected_error_m(covariance)
    )
    record = _record(task, **_accuracy(prepared, smoothed, covariance, left_out, settings.labels.max_sigma_m))
    return CheckedSession(record, found, [_places(prepared, odometry, path, floor)])


def _places(prepared: PreparedSession, odometry: Odometry, path: FloatArray, floor: IntArray) -> WalkPlaces:
    """Where a session was about each metre, and where it was when its Wi-Fi was read; ``path`` (n, 2), ``floor`` (n,)
    of the frames that the smoother used.
    """
    time_ns = prepared.session.camera.time_ns[odometry.frame]
    _, each = np.unique(np.floor(arc_lengths(path)), return_index=True)
    heard_ns = np.unique(prepared.session.tables["wifi"]["time_ns"].to_numpy())
    heard_ns = heard_ns[(heard_ns >= time_ns[0]) & (heard_ns <= time_ns[-1])]
    frame = np.searchsorted(time_ns, heard_ns)
    return WalkPlaces(path[each], floor[each], path[frame], floor[frame])


def solved(prepared: PreparedSession, range_m: float) -> tuple[WalkObservations, SolvedWalk | None]:
    """A session's observations, sightings within ``range_m``, and what the smoother makes of them, if it can."""
    session, landmarks = prepared.session, prepared.landmarks
    surveyed = landmarks.surveyed_ids
    observations = bridged_observations(session.camera, session.landmarks, range_m, surveyed=surveyed)
    return observations, solve_walk(observations, LandmarkPriors.of(observations.ids, landmarks))


def _smoothed(prepared: PreparedSession, settings: SmootherSettings) -> SolvedWalk:
    session, range_m = prepared.session, settings.sighting_range_m
    _, smoothed = solved(prepared, range_m)
    if smoothed is None:
        needs = Smoother(range_m).needs
        raise SessionError(f"{session.key}: could not be mapped: it needs {needs}; vislam2tag inspect says what it has")
    return smoothed


def _floors(prepared: PreparedSession, settings: HeightSettings, odometry: Odometry) -> IntArray:
    """Floor (n,) of each camera frame."""
    session = prepared.session
    floor = estimate_heights(session.camera, session.landmarks, prepared.landmarks, settings, odometry).floor
    return floor if len(floor) else np.full(len(session.camera.time_ns), session.key.floor)


def _accuracy(
    prepared: PreparedSession,
    smoothed: SolvedWalk,
    covariance: FloatArray,
    left_out: tuple[LeftOut, ...],
    max_sigma_m: float,
) -> dict[str, Any]:
    """The session's numbers under their names in its record; ``covariance`` (n, 2, 2) of its frames, m^2."""
    observations, priors = smoothed.model.observations, smoothed.priors
    sigma_m = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2)
    labelled = sigma_m <= max_sigma_m
    estimate = estimate_accuracy(covariance[labelled], left_out)
    details: dict[str, Any] = {
        "landmarks": int(priors.surveyed[np.unique(observations.passes.landmark)].sum()),
        "left_out": [_mark(error, prepared.landmarks) for error in left_out],
        "frames": len(sigma_m),
        "labelled": int(labelled.sum()),
    }
    return details if estimate is None else details | estimate.rounded()


def _mark(error: LeftOut, landmarks: Landmarks) -> LeftOutMark:
    row = landmarks.index[error.landmark]
    x, y = landmarks.position_bcs[row].tolist()
    return LeftOutMark(
        floor=int(landmarks.floor[row]),
        landmark=error.landmark,
        passes=error.passes,
        surveyed_m=(round(x, 4), round(y, 4)),
        offset_m=(round(float(error.offset_m[0]), 4), round(float(error.offset_m[1]), 4)),
        covariance_m2=_entries(error.covariance_m2),
        survey_covariance_m2=_entries(landmarks.covariance_bcs[row]),
    )


def _entries(covariance: FloatArray) -> tuple[float, float, float]:
    """xx, xy and yy of a covariance (2, 2)."""
    return float(covariance[0, 0]), float(covariance[0, 1]), float(covariance[1, 1])


def _record(task: SessionTask, **details: Any) -> SessionCheck:
    """Fill in who the session is."""
    return SessionCheck(slug=task.ref.slug, **vars(task.ref.key), **details)
