"""The result of a mapped and labelled session: the input of summary and report, without tables."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from vislam2tag import __version__
from vislam2tag.common import error_statistics
from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.interpolation import label_by_interpolation
from vislam2tag.core.path_length import step_frames, step_lengths, steps_without_jumps
from vislam2tag.core.status import STATUS_LABELS, Status, counts_by_label, has_position
from vislam2tag.core.tracks import CameraTrack, Landmarks, Trajectory
from vislam2tag.labeling.new_frame import turned_result
from vislam2tag.labeling.results import (
    CandidatePath,
    ContradictionMark,
    ErrorRecord,
    EventMark,
    FileAccount,
    PlacingRecord,
    RecordingRecord,
    ScanStatistics,
    SessionResult,
    SigmaStatistics,
    VisitMark,
)
from vislam2tag.labeling.settings import USUAL_TRUTH, ProcessSettings, TruthSettings
from vislam2tag.labeling.tables import LabelledWalk, status_codes
from vislam2tag.pipeline.labels.drawing import draw
from vislam2tag.pipeline.labels.findings import walk_findings
from vislam2tag.pipeline.labels.survey_evidence import passes_record
from vislam2tag.quality.evaluation.reliability import reduce_errors
from vislam2tag.quality.evaluation.truth import (
    CONTROL_POINTS,
    MAX_GAP_S,
    Residuals,
    read_truth,
    residuals_at_presses,
    residuals_at_truth,
)
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.prepared import PreparedSession, SessionTask
from vislam2tag.sessions.readings import median_scan_interval_s
from vislam2tag.sessions.session_landmarks import floors_told
from vislam2tag.site.model import Floor


def walk_statistics(camera: CameraTrack, trajectory: Trajectory, max_gap_s: float) -> dict[str, Any]:
    """Duration, length, frame rate and frames by status, under their names in a session's result."""
    rate_hz = camera.frame_rate_hz
    return {
        "start_ns": int(camera.time_ns[0]) if camera.usable.any() else None,
        "duration_s": round(camera.duration_s, 3),
        "distance_m": round(distance_m(camera, trajectory), 2),
        "frame_rate_hz": None if rate_hz is None else round(rate_hz, 3),
        "frames": counts_by_label(trajectory.status),
        "frame_seconds": frame_seconds(camera, trajectory, max_gap_s),
    }


def frame_seconds(camera: CameraTrack, trajectory: Trajectory, max_gap_s: float) -> dict[str, float]:
    """Seconds of the walk by status: each usable frame counts for the time to the next one.

    As for readings, a mapped frame counts for at most ``max_gap_s``; the remaining time is ``gap``, or ``invalid``
    if it contains unusable frames.
    """
    frames = np.flatnonzero(camera.usable)
    seconds = np.diff(camera.time_ns[frames]) * 1e-9
    status = trajectory.status[frames[:-1]].copy()
    hole = has_position(status) & (seconds > max_gap_s)
    status[hole] = np.where(np.diff(frames)[hole] > 1, Status.INVALID, Status.GAP)
    sums = np.bincount(status, weights=seconds, minlength=len(STATUS_LABELS))
    return {label: round(float(total), 3) for label, total in zip(STATUS_LABELS, sums, strict=True) if total}


def distance_m(camera: CameraTrack, trajectory: Trajectory) -> float:
    """Length of the walk: in the BCS if both ends of a step are mapped, otherwise in the tracker's frame.

    Jumps of the tracker are skipped (:mod:`vislam2tag.core.path_length`).
    """
    frames = np.flatnonzero(camera.usable)
    frames = frames[step_frames(camera.time_ns[frames])]
    mapped = has_position(trajectory.status[frames])
    steps = np.where(
        mapped[1:] & mapped[:-1],
        step_lengths(trajectory.position_bcs[frames, :2]),
        step_lengths(camera.plane_acs[frames]),
    )
    return float(steps_without_jumps(steps, camera.time_ns[frames]).sum())


def sigma_statistics(trajectory: Trajectory) -> SigmaStatistics | None:
    """Sigma statistics of mapped frames; None if no sigma is known."""
    known = has_position(trajectory.status) & np.isfinite(trajectory.sigma_m)
    sigma_m = trajectory.sigma_m[known]
    if not len(sigma_m):
        return None
    median_m, p95_m = np.quantile(sigma_m, (0.5, 0.95)).tolist()
    return SigmaStatistics(
        median_m=round(median_m, 4),
        p95_m=round(p95_m, 4),
        uncertain_share=round(float(np.mean(trajectory.status[known] == Status.UNCERTAIN)), 6),
        frames=error_statistics.counts_of(sigma_m),
    )


def scan_statistics(wifi: pl.DataFrame) -> ScanStatistics | None:
    """Scans, their rate and stale readings (raw table, before labelling); None if there is no reading."""
    if len(wifi) == 0:
        return None
    interval_s = median_scan_interval_s(wifi)
    return ScanStatistics(
        scans=wifi["scan"].n_unique(),
        median_interval_s=None if interval_s is None else round(interval_s, 3),
        readings=len(wifi),
        repeated=int(wifi["repeated"].sum()),
        access_points=wifi["bssid"].n_unique(),
    )


def recording_record(session: Session) -> RecordingRecord | None:
    """Information from the recorder; None if there is none."""
    recording = session.recording
    if recording is None:
        return None
    return RecordingRecord(
        ended=recording.ended,
        events=recording.events,
        note=recording.note,
        scans_refused=recording.scans_refused,
        exposure_known=session.camera.exposure_known,
    )


def visit_marks(trajectory: Trajectory, own: int) -> list[VisitMark]:
    """Each visit with the position of the camera; ``own`` is the session's floor."""
    return [
        VisitMark(
            landmark=visit.landmark,
            distance_m=round(visit.distance_m, 3),
            **_when_and_where(trajectory, visit.frame, own),
        )
        for visit in trajectory.visits
    ]


def event_marks(trajectory: Trajectory, own: int) -> list[EventMark]:
    """Each event with its time and the next position of the camera; ``own`` is the session's floor."""
    return [
        EventMark(
            kind=event.kind,
            size_m=round(event.size_m, 3),
            turn_rad=None if math.isnan(event.turn_rad) else round(event.turn_rad, 4),
            reason=event.reason,
            **_when_and_where(trajectory, event.frame, own),
        )
        for event in trajectory.events
    ]


def contradiction_marks(trajectory: Trajectory, landmarks: Landmarks) -> list[ContradictionMark]:
    """Each contradiction with the floor and the surveyed place of its landmark."""
    marks = []
    for found in trajectory.contradictions:
        row = landmarks.index[found.landmark]
        marks.append(
            ContradictionMark(
                floor=int(landmarks.floor[row]),
                landmark=found.landmark,
                size_m=round(found.size_m, 3),
                sigma_m=round(found.sigma_m, 3),
                passes=found.passes,
                surveyed_m=_pair(landmarks.position_bcs[row]),
                offset_m=_pair(found.offset_bcs_m),
            )
        )
    return marks


def placing_record(trajectory: Trajectory) -> PlacingRecord | None:
    """How the walk was placed on its floor's plan; None if it was not."""
    placing = trajectory.placing
    if placing is None:
        return None
    known = math.isfinite(placing.scale)
    return PlacingRecord(
        labelled_share=round(placing.labelled_share, 4),
        reason=placing.reason.label,
        way_m=round(placing.way_m, 1),
        misfit=round(placing.misfit, 3),
        mirror=round(placing.mirror, 1),
        exchanged=round(placing.exchanged, 1),
        floors={number: round(nats, 1) for number, nats in placing.floors},
        scale=round(placing.scale, 4) if known else None,
        scale_sigma=round(placing.scale_sigma, 4) if known else None,
        time_ns=trajectory.time_ns[list(placing.frame)].tolist(),
        candidates=[
            CandidatePath(weight=round(one.weight, 3), points=[_pair(point) for point in one.position_bcs])
            for one in placing.candidates
            if len(placing.candidates) > 1
        ],
        best_tap_ns=None if placing.best_tap is None else int(trajectory.time_ns[placing.best_tap]),
    )


def _when_and_where(trajectory: Trajectory, frame: int, own: int) -> dict[str, Any]:
    """Time of a frame, position of the camera (None: not mapped), and its floor if that is not ``own``."""
    mapped = has_position(trajectory.status[frame : frame + 1]).all()
    floor = int(trajectory.floor[frame]) if len(trajectory.floor) else own
    return {
        "time_ns": int(trajectory.time_ns[frame]),
        "position": _pair(trajectory.position_bcs[frame, :2]) if mapped else None,
        "floor": None if floor == own else floor,
    }


def _pair(point: FloatArray | tuple[float, float]) -> tuple[float, float]:
    """A point (2,) in metres, to the centimetre."""
    return round(float(point[0]), 2), round(float(point[1]), 2)


TRUTH_FILE = "truth.csv"
_UNREADABLE = (
    "expected a table with the header time_ns,x,y and a number in each field. The session's errors are unknown; "
    "correct or remove the file"
)


def truth_mark(folder: Path) -> str:
    """Mark of a session's truth: the SHA-256 of its file; empty if none can be read."""
    try:
        return hashlib.sha256(read_bytes(folder / TRUTH_FILE)).hexdigest()
    except OSError:
        return ""


def error_record(
    folder: Path, trajectory: Trajectory, presses_ns: IntArray, floor: Floor, settings: TruthSettings = USUAL_TRUTH
) -> tuple[ErrorRecord | None, list[Finding]]:
    """Errors at ``truth.csv`` in the session's folder, or otherwise at the presses (k,) on the session's ``floor``.

    A press counts as its distance to the nearest control point there. None without both; an unreadable truth file
    is a finding.
    """
    findings = []
    if (folder / TRUTH_FILE).is_file():
        try:
            truth = read_truth(folder / TRUTH_FILE)
            return _counted(TRUTH_FILE, residuals_at_truth(trajectory, truth, settings)), list(truth.findings)
        except SessionError:
            findings.append(Finding(kind="unreadable_truth", file=TRUTH_FILE, count=1, message=_UNREADABLE))
    presses_ns = _on_floor(floor.number, trajectory, presses_ns)
    if not len(presses_ns) or not len(floor.control_points.ids):
        return None, findings
    at_presses = residuals_at_presses(trajectory, presses_ns, floor.control_points.position_bcs, settings)
    return _counted(CONTROL_POINTS, at_presses), findings


def _counted(source: str, found: Residuals) -> ErrorRecord:
    return reduce_errors(source, found.error_m, found.covariance_m2, found.truth_covariance_m2)


def _on_floor(number: int, trajectory: Trajectory, presses_ns: IntArray) -> IntArray:
    """Keep the presses (k,) made on this floor, which is the session's own."""
    where = label_by_interpolation(presses_ns, trajectory, MAX_GAP_S).floor
    return presses_ns[where == number] if len(where) else presses_ns


def session_result(prepared: PreparedSession, walk: LabelledWalk, settings: ProcessSettings) -> SessionResult:
    """Reduce a session to its result; its fingerprint is empty."""
    task, session, trajectory = prepared.task, prepared.session, walk.trajectory
    own = task.floor.number
    errors, truth_findings = error_record(task.ref.folder, trajectory, session.presses_ns, task.floor, settings.truth)
    findings = walk_findings(prepared, walk, settings, truth_findings)
    drawings = draw(own, session.camera, session.landmarks, prepared.landmarks, trajectory, walk.readings["wifi"])
    result = result_of(
        task,
        settings.strategy,
        fingerprint="",
        error=_mapping_error(session, trajectory, walk.needs, findings),
        files=[FileAccount(**vars(record)) for record in session.files],
        findings=findings,
        pose_lag_s=session.camera.pose_lag_s,
        **walk_statistics(session.camera, trajectory, settings.labels.max_gap_s),
        readings={name: counts_by_label(status_codes(table)) for name, table in walk.readings.items()},
        visits=visit_marks(trajectory, own),
        landmarks_logged=list(session.landmarks.ids),
        floors_told=list(floors_told(session)),
        scans=scan_statistics(session.tables["wifi"]),
        recording=recording_record(session),
        events=event_marks(trajectory, own),
        contradictions=contradiction_marks(trajectory, prepared.landmarks),
        sigma=sigma_statistics(trajectory),
        max_sigma_m=settings.labels.max_sigma_without_poses_m if session.camera.without_poses else None,
        errors=errors,
        drawing=drawings.pop(own),
        elsewhere=drawings,
        corrections=list(prepared.corrections),
        placing=placing_record(trajectory),
        passes=passes_record(prepared, settings.mapping.smoother.sighting_range_m),
    )
    return turned_result(result, task.frames) if task.frames else result


def result_of(task: SessionTask, strategy: str, **details: Any) -> SessionResult:
    """Add the session's identity and the program's version."""
    return SessionResult(
        slug=task.ref.slug,
        **vars(task.ref.key),
        format=task.ref.format,
        strategy=strategy,
        version=__version__,
        from_outside=task.ref.from_outside,
        **details,
    )


def _mapping_error(session: Session, trajectory: Trajectory, needs: str, findings: Sequence[Finding]) -> str | None:
    """Why no frame could be mapped; None if at least a part of the session was mapped."""
    usable = trajectory.status[session.camera.usable]
    if len(usable) == 0:
        return f"{session.key}: no usable camera frame; see its findings"
    if (usable == Status.NO_MAPPING).all():
        faults = [finding.message for finding in findings if finding.kind == "unusable_plan"]
        return f"{session.key}: the session could not be mapped: it needs {needs}; {(*faults, 'see its findings')[0]}"
    return None
