"""The result of a session that was mapped and labelled: all that summary and report read of it but its tables."""

from __future__ import annotations

from typing import Any

from vislam2tag import __version__
from vislam2tag.core.status import Status, counts_by_label
from vislam2tag.core.tracks import Trajectory
from vislam2tag.labeling.results import FileAccount, SessionResult
from vislam2tag.labeling.results_in_new_frame import turned_result
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.labeling.status_column import status_codes
from vislam2tag.labeling.tables import LabelledWalk
from vislam2tag.pipeline.labels.accuracy import error_record
from vislam2tag.pipeline.labels.drawing import draw
from vislam2tag.pipeline.labels.findings import mapping_findings, pose_lag_findings
from vislam2tag.pipeline.labels.kept_passes import passes_record
from vislam2tag.pipeline.labels.marks import contradiction_marks, event_marks, visit_marks
from vislam2tag.pipeline.labels.statistics import recording_record, scan_statistics, sigma_statistics, walk_statistics
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.prepared import PreparedSession, SessionTask
from vislam2tag.sessions.told_floors import floors_told


def session_result(
    prepared: PreparedSession, walk: LabelledWalk, settings: ProcessSettings, fingerprint: str
) -> SessionResult:
    """Reduce a session to its result."""
    task, session, trajectory = prepared.task, prepared.session, walk.trajectory
    own = task.floor.number
    errors, truth_findings = error_record(task.ref.folder, trajectory, session.presses_ns, task.floor, settings.truth)
    drawings = draw(own, session.camera, session.landmarks, prepared.landmarks, trajectory, walk.readings["wifi"])
    result = result_of(
        task,
        settings.strategy,
        fingerprint=fingerprint,
        error=_mapping_error(session, trajectory, walk.needs),
        files=[FileAccount(**vars(record)) for record in session.files],
        findings=[
            *prepared.findings(),
            *mapping_findings(prepared, trajectory, settings.mapping.visit_radius_m, walk.needs),
            *truth_findings,
            *pose_lag_findings(session.camera.pose_lag_s, settings),
        ],
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
        passes=passes_record(prepared, settings.mapping.smoother.sighting_range_m),
    )
    return turned_result(result, task.frames) if task.frames else result


def result_of(task: SessionTask, strategy: str, **details: Any) -> SessionResult:
    """Fill in who the session is and what processed it."""
    key = task.ref.key
    return SessionResult(
        slug=task.ref.slug,
        floor=key.floor,
        device=key.device,
        session=key.session,
        format=task.ref.format,
        strategy=strategy,
        version=__version__,
        from_outside=task.ref.from_outside,
        **details,
    )


def _mapping_error(session: Session, trajectory: Trajectory, needs: str) -> str | None:
    """Say why no frame could be mapped at all; None where the session was mapped, be it in parts."""
    usable = trajectory.status[session.camera.usable]
    if len(usable) == 0:
        return f"{session.key}: no usable camera frame; see its findings"
    if (usable == Status.NO_MAPPING).all():
        return f"{session.key}: could not be mapped: it needs {needs}; see its findings"
    return None
