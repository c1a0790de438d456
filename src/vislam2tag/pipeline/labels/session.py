"""One session from raw files to tables and result; runs in a worker process."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl

from vislam2tag import __version__
from vislam2tag.common.errors import OutputError, SessionError
from vislam2tag.common.findings import Finding
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Landmarks, Trajectory
from vislam2tag.core.uncertainty import mark_uncertain
from vislam2tag.labeling.results import RESULTS, FileAccount, SessionResult
from vislam2tag.labeling.schemas import OPTIONAL, SCHEMAS, TRAJECTORY
from vislam2tag.mapping import strategy_modules, strategy_named
from vislam2tag.pipeline.labels import statistics
from vislam2tag.pipeline.labels.accuracy import error_record, truth_mark
from vislam2tag.pipeline.labels.drawing import draw
from vislam2tag.pipeline.labels.faults import contradiction_findings, contradiction_marks, event_marks
from vislam2tag.pipeline.labels.landmark_findings import landmark_findings
from vislam2tag.pipeline.labels.tables import reading_tables, trajectory_table, write_table
from vislam2tag.pipeline.run.keys import code_key
from vislam2tag.pipeline.run.store import OutputFolder
from vislam2tag.pipeline.site.rebase_results import turned_result
from vislam2tag.pipeline.site.rebase_tables import changed_table
from vislam2tag.sessions import corrected_session, format_module, hash_inputs, read_session
from vislam2tag.sessions.floors_walked import (
    ambiguous_floor,
    ambiguous_landmarks,
    considered_landmarks,
    landmarks_of_session,
)
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.site_findings import landmarks_without_position, press_findings
from vislam2tag.settings import Settings
from vislam2tag.survey.corrections import Corrections, corrected_landmarks
from vislam2tag.survey.frame_change import FrameChange, changes_from, in_frame_of
from vislam2tag.survey.model import Floor, SessionRef, Site


@dataclass(frozen=True)
class Job:
    """All that a worker needs to process one session."""

    ref: SessionRef
    site: Site
    corrections: Corrections
    settings: Settings
    out: OutputFolder
    code: str
    """Key of the source that processes it (:func:`code_of`)."""

    @property
    def floor(self) -> Floor:
        """The floor that the session lies under."""
        return self.site.floor(self.ref.key.floor)

    def landmarks(self, logged: Sequence[str]) -> tuple[Landmarks, tuple[str, ...]]:
        """All landmarks that matter to the session if it logged these ids, corrected, and each use of a correction.

        They are in the BCS of the session's floor.
        """
        own = self.ref.key.floor
        considered = considered_landmarks(self.site, own, logged)
        sigma_m = self.settings.default_landmark_sigma_m
        corrected, uses = corrected_landmarks(considered, self.corrections, self.ref.key, sigma_m)
        return in_frame_of(corrected, self.site, own), uses

    @property
    def frames(self) -> dict[int, FrameChange]:
        """From the BCS that the session is mapped in to that of each floor; none where all share one."""
        return changes_from(self.site, self.ref.key.floor)

    def landmarks_of_all_floors(self) -> Landmarks:
        """The site's landmarks, corrected for the session; ids may repeat from floor to floor."""
        sigma_m = self.settings.default_landmark_sigma_m
        return corrected_landmarks(self.site.landmarks, self.corrections, self.ref.key, sigma_m)[0]


@dataclass(frozen=True)
class Outcome:
    """What the worker tells the main process; the rest is on disk."""

    slug: str
    error: str | None
    repeated: bool
    """False where an earlier run's result still holds."""
    rows: int


def code_of(format_name: str, settings: Settings) -> str:
    """Key of the source that processes sessions of a format: this module, reader and strategy, and what they import."""
    return code_key(__name__, format_module(format_name), *strategy_modules(settings.strategy, settings))


def process_session(job: Job) -> Outcome:
    """Read, map, label and write one session; what an earlier run did and nothing changed since is not repeated.

    A session that cannot be read or mapped becomes a result with an error. Raises OutputError where nothing can be
    written.
    """
    done = job.out.result(job.ref.slug)
    if done is not None and _still_holds(job, done):
        return _outcome(done, repeated=False)
    job.out.forget(job.ref.slug)
    try:
        result = _process(job)
    except OutputError:
        raise
    except SessionError as error:
        result = _failed(job, str(error))
    except Exception as error:  # one bad session must not end the batch; its result names the fault
        result = _failed(job, f"{job.ref.key}: unexpected {type(error).__name__}: {error}; please report this")
    job.out.write_text(f"{RESULTS}/{job.ref.slug}.json", result.model_dump_json(indent=1) + "\n")
    return _outcome(result, repeated=True)


def _outcome(result: SessionResult, *, repeated: bool) -> Outcome:
    rows = sum(sum(counts.values()) for counts in result.readings.values())
    return Outcome(result.slug, result.error, repeated, rows)


def _failed(job: Job, error: str) -> SessionResult:
    """Write tables with zero rows for a session of which nothing could be made."""
    for name in SCHEMAS.keys() - OPTIONAL:
        _write_table(job, name, pl.DataFrame(schema=SCHEMAS[name]))
    return _result(job, fingerprint="", error=error)


def _still_holds(job: Job, done: SessionResult) -> bool:
    tables = [TRAJECTORY, *done.readings] if done.frames or done.readings else []
    if not all((job.out.root / name / f"{job.ref.slug}.parquet").is_file() for name in tables):
        return False
    try:
        return done.fingerprint == _fingerprint(job, hash_inputs(job.ref), done.landmarks_logged)
    except SessionError:
        return False


def _fingerprint(job: Job, hashes: dict[str, str], logged: Sequence[str]) -> str:
    """SHA-256 over everything that the session's outputs follow from; ``logged``: the ids of its landmarks."""
    marks, _ = job.landmarks(logged)
    storeys = marks.storeys
    ambiguous = ambiguous_landmarks(job.landmarks_of_all_floors(), job.ref.key.floor, logged)
    parts = {
        "code": job.code,
        "key": str(job.ref.key),
        "format": job.ref.format,
        "files": hashes,
        "settings": job.settings.model_dump(mode="json"),
        "corrections": job.corrections.for_session(job.ref.key).model_dump(mode="json"),
        "landmarks": [marks.ids, marks.floor.tolist()],
        "ambiguous": [ambiguous.ids, ambiguous.floor.tolist(), ambiguous.source],
        "storeys": None if storeys is None else [storeys.number.tolist(), storeys.elevation_m.tolist()],
        "control_points": job.floor.control_points.position_bcs.tolist(),
        "truth": truth_mark(job.ref.folder),
        "frames": [change.model_dump(mode="json") for change in job.frames.values()],
    }
    digest = hashlib.sha256(json.dumps(parts, sort_keys=True).encode())
    for array in (marks.position_bcs, marks.covariance_bcs, marks.z_m, marks.heading_rad, marks.heading_sigma_rad):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _process(job: Job) -> SessionResult:
    """Read, correct, map, label, write the tables and reduce the rest to a result."""
    session, session_uses = corrected_session(read_session(job.ref, job.settings.findings), job.corrections)
    considered, landmark_uses = job.landmarks(session.landmarks.ids)
    mine = landmarks_of_session(considered, job.ref.key, session.camera, session.landmarks)
    landmarks = mine.landmarks
    strategy = strategy_named(job.settings.strategy, job.settings)
    mapped = strategy.map(session.camera, session.landmarks, landmarks)
    # Readings come first: between a sure and an uncertain frame each one's own sigma decides.
    labelled = reading_tables(session, mapped, job.settings.labels)
    trajectory = mark_uncertain(mapped, job.settings.labels.max_sigma_m)
    _write_table(job, TRAJECTORY, trajectory_table(job.ref.key, trajectory))
    for name, table in labelled.items():
        _write_table(job, name, table)
    pose_lag_s = session.camera.pose_lag_s
    drawings = draw(job.floor.number, session.camera, session.landmarks, landmarks, trajectory, labelled["wifi"])
    errors, truth_findings = error_record(job.ref.folder, trajectory, session.presses_ns, job.floor)
    result = _result(
        job,
        fingerprint=_fingerprint(job, {record.name: record.sha256 for record in session.files}, session.landmarks.ids),
        error=_mapping_error(session, trajectory, strategy.needs),
        files=[FileAccount(**vars(record)) for record in session.files],
        findings=[
            *session.findings,
            *press_findings(session, job.floor),
            *landmarks_without_position(session.landmarks, landmarks, mine.elsewhere),
            *ambiguous_floor(job.landmarks_of_all_floors(), job.ref.key, session.camera, session.landmarks),
            *landmark_findings(
                session.camera,
                session.landmarks,
                landmarks,
                trajectory,
                job.settings.visits.radius_m,
                strategy.needs,
            ),
            *contradiction_findings(trajectory, landmarks),
            *truth_findings,
            *_pose_lag_finding(pose_lag_s, job.settings),
        ],
        pose_lag_s=pose_lag_s,
        **statistics.walk_statistics(session.camera, trajectory, job.settings.labels.max_gap_s),
        readings={name: statistics.status_counts(table) for name, table in labelled.items()},
        visits=statistics.visit_marks(trajectory, job.floor.number),
        landmarks_logged=list(session.landmarks.ids),
        scans=statistics.scan_statistics(session.tables["wifi"]),
        recording=statistics.recording_record(session),
        events=event_marks(trajectory, job.floor.number),
        contradictions=contradiction_marks(trajectory, landmarks),
        sigma=statistics.sigma_statistics(trajectory),
        errors=errors,
        drawing=drawings.pop(job.floor.number),
        elsewhere=drawings,
        corrections=[*landmark_uses, *session_uses],
    )
    return turned_result(result, job.frames) if job.frames else result


def _write_table(job: Job, name: str, table: pl.DataFrame) -> None:
    strategy = job.settings.strategy
    if job.frames:  # it was mapped in one frame; each row is told in that of its own floor
        table = changed_table(table.lazy(), job.frames).collect()
    job.out.write(f"{name}/{job.ref.slug}.parquet", lambda path: write_table(table, name, strategy, path))


def _result(job: Job, **details: Any) -> SessionResult:
    """Fill in who the session is and what processed it."""
    key = job.ref.key
    return SessionResult(
        slug=job.ref.slug,
        floor=key.floor,
        device=key.device,
        session=key.session,
        format=job.ref.format,
        strategy=job.settings.strategy,
        version=__version__,
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


def _pose_lag_finding(lag_s: float | None, settings: Settings) -> list[Finding]:
    allowed_for = settings.strategy == "smoother" and settings.smoother.allow_for_pose_lag
    if lag_s is None or abs(lag_s) <= settings.findings.pose_lag_s or allowed_for:
        return []
    return [
        Finding(
            kind="pose_lag",
            file="",
            count=1,
            message=f"the poses are stamped {lag_s:+.2f} s after the gyroscope felt the same motion: labels are "
            f"displaced by that much walking; shift the camera clock by {-lag_s:.2f} s in corrections.toml, or let the "
            "smoother allow for it (--allow-for-pose-lag)",
        )
    ]
