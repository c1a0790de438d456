"""One session as diagnosis needs it; runs in a worker process."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
import polars as pl

from vislam2tag.common.errors import SessionError
from vislam2tag.core.tracks import longest_section
from vislam2tag.estimation.dead_reckoning.bridging import bridged_observations
from vislam2tag.estimation.dead_reckoning.walk import LeftOut
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.observations import FEWEST_FRAMES
from vislam2tag.estimation.odometry import Odometry
from vislam2tag.estimation.smoother import mapped_path, solve_walk
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.checking.check_fixes import doubtful_fixes, reckoned
from vislam2tag.pipeline.labels.joining.landmark_survey import ReducedSession, reduced
from vislam2tag.pipeline.labels.kept_passes import Places, places_of
from vislam2tag.pipeline.run.failures import unexpected
from vislam2tag.quality.diagnosis.alignment import WalkPasses
from vislam2tag.quality.diagnosis.id_faults import floors_of_passes
from vislam2tag.quality.diagnosis.record import Fault, FaultKind
from vislam2tag.quality.diagnosis.stream_faults import StreamSigns, stream_signs
from vislam2tag.quality.diagnosis.wifi_clock import HeardOnWalk
from vislam2tag.quality.self_check import expected_error_m
from vislam2tag.quality.self_check_record import DoubtfulFix
from vislam2tag.sessions.id_findings import walk_id_shift
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.prepared import PreparedSession, SessionTask, mappable_session, read_corrected
from vislam2tag.sessions.session_landmarks import AmbiguousLandmarksError, clashes, floors_told
from vislam2tag.site.model import SessionKey

PATH_STEP = 15
"""Frames from one place of the way that is kept to the next."""


@dataclass(frozen=True)
class MappedShare:
    """How well a session can be mapped: its frames, those with a sigma that is certain enough, and the sum of the
    errors to expect of these, metres.
    """

    frames: int = 0
    labelled: int = 0
    expected_m: float = 0.0


@dataclass(frozen=True)
class DiagnosedSession:
    """What the worker tells."""

    key: SessionKey
    error: str | None = None
    passes: WalkPasses | None = None
    places: Places = field(default_factory=dict)
    signs: StreamSigns | None = None
    share: MappedShare = MappedShare()
    faults: tuple[Fault, ...] = ()
    """What the session tells alone."""
    heard: HeardOnWalk | None = None
    """The scans and the way in the frame of the passes."""
    fixes: int = 0
    """Known positions of a session without poses that could be compared with its others."""
    landmark_map: ReducedSession | None = None
    """Its landmarks in its own frame; None where they cannot be joined with those of others."""


def observe_session(settings: ProcessSettings, task: SessionTask) -> DiagnosedSession:
    """Read a session, reduce it and map it; one that cannot be read becomes an error."""
    try:
        return _observed_or_told(settings, task)
    except SessionError as error:
        return DiagnosedSession(task.ref.key, error=str(error))
    except Exception as error:  # one bad session must not end the batch; its record names the fault
        return DiagnosedSession(task.ref.key, error=unexpected(task.ref.key, error))


def _observed_or_told(settings: ProcessSettings, task: SessionTask) -> DiagnosedSession:
    try:
        return _observed(settings, task)
    except AmbiguousLandmarksError as error:
        faults = _floors_of_landmarks(settings, task)
        return DiagnosedSession(task.ref.key, error=None if faults else str(error), faults=faults)


def _observed(settings: ProcessSettings, task: SessionTask) -> DiagnosedSession:
    whole = mappable_session(task, inertial=settings.inertial)
    if whole.session.camera.without_poses:
        walk = reckoned(whole, settings)
        left_out = LeftOut.of(walk)
        doubtful = doubtful_fixes(walk, left_out)
        return DiagnosedSession(
            task.ref.key,
            signs=stream_signs(whole.session),
            faults=tuple(_doubtful(task.ref.key, fix) for fix in doubtful),
            fixes=int(np.isfinite(left_out.sigma_m).sum()),
        )
    prepared = whole.longest_section()
    session, landmarks = prepared.session, prepared.landmarks
    range_m = settings.mapping.smoother.sighting_range_m
    observations = bridged_observations(session.camera, session.landmarks, range_m, surveyed=landmarks.surveyed_ids)
    smoothed = solve_walk(observations, LandmarkPriors.of(observations.ids, landmarks))
    share = MappedShare(frames=int(session.camera.usable.sum()))
    if smoothed is not None:
        covariance = mapped_path(smoothed)[1]
        labelled = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2) <= settings.labels.max_sigma_m
        expected_m = float(expected_error_m(covariance[labelled]).sum())
        share = MappedShare(share.frames, int(labelled.sum()), expected_m)
    return DiagnosedSession(
        session.key,
        passes=WalkPasses.of(
            session.key, observations, walk_id_shift(session.camera, session.landmarks, prepared.landmarks)
        ),
        places=places_of(prepared),
        signs=stream_signs(whole.session),
        share=share,
        heard=_heard(session, observations.odometry),
        landmark_map=_landmark_map(settings, prepared),
    )


def _landmark_map(settings: ProcessSettings, prepared: PreparedSession) -> ReducedSession | None:
    try:
        return reduced(settings.mapping, prepared)
    except SessionError:
        return None


def _floors_of_landmarks(settings: ProcessSettings, task: SessionTask) -> tuple[Fault, ...]:
    """Tell a session that cannot be prepared, since ids of it hang on several floors, on which it passed each."""
    session, _ = read_corrected(task)
    camera, log = longest_section(session.camera, session.landmarks)
    if camera.usable.sum() < FEWEST_FRAMES:
        return ()
    considered, _ = task.candidate_landmarks(log.ids, floors_told(session))
    doubtful = {name for name, _, _ in clashes(considered, log.ids)}
    places: dict[str, complex] = {}
    sheets: dict[str, dict[int, complex]] = defaultdict(dict)
    for row in np.flatnonzero(considered.surveyed).tolist():
        name, at = considered.ids[row], complex(*considered.position_bcs[row])
        if name in doubtful:
            sheets[name][int(considered.floor[row])] = at
        else:
            places[name] = at
    observations = bridged_observations(camera, log, settings.mapping.smoother.sighting_range_m)
    return tuple(floors_of_passes(WalkPasses.of(session.key, observations), places, sheets))


def _heard(session: Session, odometry: Odometry) -> HeardOnWalk:
    """A session's scans, repeated rows left out, with the tracker's way."""
    rows = session.tables["wifi"].filter(
        ~pl.col("repeated") & pl.col("rssi_dbm").is_not_null() & pl.col("bssid").is_not_null()
    )
    start_s = float(session.camera.time_ns[session.camera.usable][0]) * 1e-9
    return HeardOnWalk(
        time_s=rows["time_ns"].to_numpy() * 1e-9,
        scan=rows["scan"].cast(pl.Int64).to_numpy(),
        bssid=rows["bssid"].to_numpy().astype(str),
        dbm=rows["rssi_dbm"].cast(pl.Float64).to_numpy(),
        way_s=start_s + odometry.time_s[::PATH_STEP],
        way=odometry.path[::PATH_STEP],
    )


def _doubtful(key: SessionKey, fix: DoubtfulFix) -> Fault:
    east, north = fix.offset_m
    return Fault(
        kind=FaultKind.DOUBTFUL_FIX,
        floor=key.floor,
        sessions=[str(key)],
        summary=f"the fix of {fix.name} of {key} is {fix.size_m:.1f} m off: tap it again, or leave it out",
        evidence=f"sensors and the other fixes put the walker {east:+.1f} m along x and {north:+.1f} m along y of it, "
        f"to {fix.sigma_m:.1f} m per axis",
    )
