"""One session from raw files to tables and result; runs in a worker process.

Its way: read, corrected and given its landmarks (:mod:`vislam2tag.sessions.prepared`), mapped
(:mod:`vislam2tag.mapping`), labelled and written (:mod:`vislam2tag.labeling.tables`), reduced to a result
(:mod:`vislam2tag.pipeline.labels.session_result`).
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import OutputError, SessionError
from vislam2tag.common.files.folder import Folder
from vislam2tag.core.arrays import AnyArray
from vislam2tag.labeling.results import RESULTS, SessionResult
from vislam2tag.labeling.schemas import OPTIONAL, SCHEMAS, TRAJECTORY
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.labeling.tables import LabelledWalk, write_table
from vislam2tag.mapping.registry import strategy_modules
from vislam2tag.pipeline.labels.session_result import TRUTH_FILE, result_of, session_result, truth_mark
from vislam2tag.pipeline.run.failures import unexpected
from vislam2tag.pipeline.run.keys import code_key, key_of
from vislam2tag.pipeline.run.store import OutputFolder
from vislam2tag.sessions.drawn_floor import drawing_mark
from vislam2tag.sessions.prepared import SessionTask, mappable_session
from vislam2tag.sessions.registry import at_hand, format_module, hash_inputs
from vislam2tag.sessions.session_landmarks import ambiguous_landmarks
from vislam2tag.sessions.told_floors import floors_told

_JOINING = f"{__package__}.together"


@dataclass(frozen=True)
class Job:
    """All that a worker needs to process one session."""

    task: SessionTask
    settings: ProcessSettings
    out: OutputFolder
    code: str
    """Key of the source that processes it (:func:`code_of`)."""

    @property
    def slug(self) -> str:
        """File-name stem of the session's outputs."""
        return self.task.ref.slug


@dataclass(frozen=True)
class Outcome:
    """What the worker tells the main process; the rest is on disk."""

    slug: str
    error: str | None
    repeated: bool
    """False where an earlier run's result still holds."""
    rows: int


def code_of(format_name: str, settings: ProcessSettings) -> str:
    """Key of the source that processes sessions of a format: this module, reader and strategy, and what they import.

    Where walks tell one another of landmarks, also the module that joins them.
    """
    joining = (_JOINING,) if settings.together else ()
    return code_key(
        __name__, format_module(format_name), *strategy_modules(settings.strategy, settings.mapping), *joining
    )


def process_session(job: Job) -> Outcome:
    """Read, map, label and write one session; what an earlier run did and nothing changed since is not repeated.

    A session that cannot be read or mapped becomes a result with an error. Raises OutputError where nothing can be
    written, StoreError where its files lie in a store and cannot be fetched.
    """
    with at_hand(job.task.ref, TRUTH_FILE) as ref:
        return _process_at_hand(replace(job, task=replace(job.task, ref=ref)))


def fail_session(job: Job, error: str) -> Outcome:
    """Write the result of a session that could not be processed, for a cause that is not its own to tell."""
    job.out.forget(job.slug)
    return _finish(job, _failed(job, f"{job.task.ref.key}: {error}"))


def _process_at_hand(job: Job) -> Outcome:
    done = job.out.result(job.slug)
    if done is not None and still_holds(job, done):
        return outcome_of(done, repeated=False)
    job.out.forget(job.slug)
    try:
        result = _process(job)
    except OutputError:
        raise
    except SessionError as error:
        result = _failed(job, str(error))
    except Exception as error:  # one bad session must not end the batch; its result names the fault
        result = _failed(job, unexpected(job.task.ref.key, error))
    return _finish(job, result)


def _finish(job: Job, result: SessionResult) -> Outcome:
    """Write the done-mark."""
    job.out.put_text(f"{RESULTS}/{job.slug}.json", result.model_dump_json(indent=1) + "\n")
    return outcome_of(result, repeated=True)


def outcome_of(result: SessionResult, *, repeated: bool) -> Outcome:
    """What is told of a session with this result."""
    rows = sum(sum(counts.values()) for counts in result.readings.values())
    return Outcome(result.slug, result.error, repeated, rows)


def _process(job: Job) -> SessionResult:
    prepared = mappable_session(job.task, inertial=job.settings.inertial)
    session = prepared.session
    walk = LabelledWalk.of(prepared, job.settings)
    _write_tables(job, walk.tables(job.task.frames))
    hashes = {record.name: record.sha256 for record in session.files}
    fingerprint = _fingerprint(job, hashes, session.landmarks.ids, floors_told(session))
    result = session_result(prepared, walk, job.settings, fingerprint)
    return result.model_copy(update={"parts": _parts(job)})


def _failed(job: Job, error: str) -> SessionResult:
    """Write tables with zero rows for a session of which nothing could be made."""
    _write_tables(job, {name: pl.DataFrame(schema=SCHEMAS[name]) for name in SCHEMAS.keys() - OPTIONAL})
    return result_of(job.task, job.settings.strategy, fingerprint="", error=error)


def _write_tables(job: Job, tables: dict[str, pl.DataFrame]) -> None:
    strategy = job.settings.strategy
    for name, table in tables.items():
        job.out.write(f"{name}/{job.slug}.parquet", partial(_fill, table, name, strategy))


def _fill(table: pl.DataFrame, name: str, strategy: str, path: Path) -> None:
    write_table(table, name, strategy, Folder.at(path.parent), path.name)


class Reason(Enum):
    """Why a session is processed."""

    NEW = "new"
    FAILED = "failed before"
    LOST = "its tables are gone"
    CODE = "code changed"
    SETTINGS = "settings changed"
    INPUTS = "inputs changed"
    """Its own files, or what the site or the corrections say of it."""


def still_holds(job: Job, done: SessionResult, hashes: dict[str, str] | None = None) -> bool:
    """Whether an earlier result is what processing would make now, and its tables are there.

    ``hashes`` are the SHA-256 of the session's files by name, where they are known without reading the files.
    """
    if hashes is None and not _has_tables(job, done):
        return False
    try:
        known = hashes or hash_inputs(job.task.ref)
        return done.fingerprint == _fingerprint(job, known, done.landmarks_logged, done.floors_told)
    except SessionError:
        return False


def reasons_against(job: Job, done: SessionResult | None, hashes: dict[str, str] | None = None) -> tuple[Reason, ...]:
    """Why an earlier result does not hold (:func:`still_holds`); none where it does."""
    if done is None:
        return (Reason.NEW,)
    if still_holds(job, done, hashes):
        return ()
    if not done.fingerprint:
        return (Reason.FAILED,)
    if hashes is None and not _has_tables(job, done):
        return (Reason.LOST,)
    now = _parts(job)
    parts = {Reason.CODE: "code", Reason.SETTINGS: "settings"}
    changed = [reason for reason, name in parts.items() if done.parts.get(name) != now[name]]
    try:
        same_files = {file.name: file.sha256 for file in done.files} == (hashes or hash_inputs(job.task.ref))
    except SessionError:
        same_files = False
    return (*changed, *([] if same_files and changed else [Reason.INPUTS]))


def _has_tables(job: Job, done: SessionResult) -> bool:
    tables = [TRAJECTORY, *done.readings] if done.frames or done.readings else []
    return all((job.out.root / name / f"{job.slug}.parquet").is_file() for name in tables)


def _parts(job: Job) -> dict[str, str]:
    return {"code": job.code, "settings": key_of(job.settings.of_labels())}


def _fingerprint(job: Job, hashes: dict[str, str], logged: Sequence[str], told: Sequence[int]) -> str:
    """SHA-256 over everything that the session's outputs follow from; ``logged``: the ids of its landmarks; ``told``:
    the floors that its walker said to be on.
    """
    task = job.task
    marks, _ = task.candidate_landmarks(logged, told)
    storeys = marks.storeys
    ambiguous = ambiguous_landmarks(task.landmarks_of_all_floors(), task.ref.key.floor, logged)
    parts = {
        "code": job.code,
        "key": str(task.ref.key),
        "format": task.ref.format,
        "files": hashes,
        "settings": job.settings.of_labels(),
        "corrections": task.corrections.for_session(task.ref.key).model_dump(mode="json"),
        "landmarks": [marks.ids, marks.floor.tolist()],
        "ambiguous": [ambiguous.ids, ambiguous.floor.tolist(), ambiguous.source],
        "storeys": None if storeys is None else [storeys.number.tolist(), storeys.elevation_m.tolist()],
        "control_points": task.floor.control_points.position_bcs.tolist(),
        "drawing": drawing_mark(task.floor),
        "truth": truth_mark(task.ref.folder),
        "frames": [change.model_dump(mode="json") for change in task.frames.values()],
    }
    if task.ref.from_outside:
        parts["from_outside"] = True
    if task.told is not None:
        parts["told"] = [task.told.ids, task.told.floor.tolist()]
    digest = hashlib.sha256(json.dumps(parts, sort_keys=True).encode())
    for array in (marks.position_bcs, marks.covariance_bcs, marks.z_m, marks.heading_rad, marks.heading_sigma_rad):
        digest.update(np.ascontiguousarray(array).tobytes())
    if marks.joint_covariance is not None:
        digest.update(np.ascontiguousarray(marks.joint_covariance).tobytes())
    for array in _told_arrays(task):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _told_arrays(task: SessionTask) -> Iterator[AnyArray]:
    """What other sessions tell one."""
    if (told := task.told) is not None:
        yield from (told.position_bcs, told.heading_rad, told.joint_covariance)
    if (ways := task.ways) is not None:
        yield from (ways.position_bcs, ways.course_rad, ways.walk.astype(np.float64))
    if (ties := task.ties) is not None:
        yield from (ties.time_ns, ties.position_bcs, ties.covariance_m2)
    if (tracker := task.tracker) is not None:
        yield np.array((tracker.times_usual, tracker.numbers))
