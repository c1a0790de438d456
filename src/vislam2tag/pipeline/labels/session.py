"""One session from raw files to tables and result; runs in a worker process.

Steps: read, correct and add landmarks (:mod:`vislam2tag.sessions.prepared`), map
(:mod:`vislam2tag.estimation`), label and write (:mod:`vislam2tag.labeling.tables`), reduce to a result
(:mod:`vislam2tag.pipeline.labels.session_result`). Files in a store come and go while other sessions compute.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import Enum
from functools import cache, partial
from pathlib import Path
from typing import TypeVar

import numpy as np
import polars as pl

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.core.arrays import AnyArray
from vislam2tag.core.status import frames_placed
from vislam2tag.estimation.settings import BY_LANDMARKS, ON_PLAN
from vislam2tag.estimation.strategy import strategy_modules
from vislam2tag.labeling.results import SessionResult
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.labeling.tables import OPTIONAL, SCHEMAS, LabelledWalk, write_table
from vislam2tag.pipeline.labels.session_result import TRUTH_FILE, result_of, session_result, truth_mark
from vislam2tag.pipeline.run.failures import reason
from vislam2tag.pipeline.run.keys import code_key, key_of
from vislam2tag.pipeline.run.output import (
    Kept,
    OutputFolder,
    SessionFiles,
    columns_name,
    rows_of,
    session_files,
    short,
)
from vislam2tag.pipeline.run.workers import Job
from vislam2tag.sessions.prepared import SessionTask, mappable_session
from vislam2tag.sessions.registry import at_hand, format_module, hash_inputs
from vislam2tag.sessions.session_landmarks import ambiguous_landmarks
from vislam2tag.site.model import SessionRef
from vislam2tag.site.walkable.drawn_cells import drawing_mark
from vislam2tag.site.walkable.plan_costs import plan_fault, plan_mark

_Made = TypeVar("_Made")
_NOWHERE = OutputFolder(Path())
_JOINING = f"{__package__}.together"


@dataclass(frozen=True)
class Outcome:
    """Result of a worker; the rest is on disk."""

    slug: str
    error: str | None
    repeated: bool
    """False if an earlier run's result is still valid."""
    rows: int


@dataclass(frozen=True)
class SessionJob(Job[Outcome]):
    """All that a worker needs to process one session.

    Unchanged results of an earlier run are not computed again. A session that cannot be read or mapped becomes a
    result with an error. Raises OutputError or StoreError if a file cannot be read or written: then the session is not
    marked as done.
    """

    task: SessionTask
    settings: ProcessSettings
    out: OutputFolder
    code: str
    """Key of the source that processes it (:func:`code_of`)."""

    @property
    def slug(self) -> str:
        """File-name stem of the session's outputs."""
        return self.task.ref.slug

    @property
    def waits(self) -> bool:
        """Whether its files come from a store, or go to one."""
        return self.task.ref.stored is not None or self.out.in_store

    def code_here(self) -> str:
        """Key of the source that would process it in this process."""
        return _code_of(self.task.ref.format, json.dumps(self.settings.of_labels()))

    @contextmanager
    def opened(self) -> Iterator[Callable[[], Outcome]]:
        """Check whether its earlier result is valid; if not, fetch its files and write the results."""
        kept = self.out.kept(self.slug)
        whole = kept.result if self.out.is_whole(self.slug, kept) else None
        if whole is not None and self._unread(kept) and not _changes_by_listing(self, whole):
            yield partial(outcome_of, whole, repeated=False)
            return
        files = session_files(self.out, self.slug, kept, _inputs(self.task.ref))
        with at_hand(self.task.ref, TRUTH_FILE) as ref, files as made:
            job = self._of(ref)
            if whole is not None and still_holds(job, whole):
                yield partial(outcome_of, whole, repeated=False)
            else:
                yield partial(_processed, job, made)

    def given_up(self, error: str) -> Outcome:
        """Write the result of a session that could not be processed for an external cause."""
        kept = self.out.kept(self.slug)
        with session_files(self.out, self.slug, kept, _inputs(self.task.ref)) as files, files.begun():
            files.result = _failed(self, files, f"{self.task.ref.key}: {error}")
            return outcome_of(files.result, repeated=True)

    def reasons(self) -> tuple[Reason, ...]:
        """Why it would be processed; empty if it would not. Nothing is written."""
        kept = self.out.kept(self.slug)
        if kept.result is None:
            return (Reason.NEW,)
        if not kept.result.fingerprint:
            return (Reason.FAILED,)
        if not self.out.is_whole(self.slug, kept):
            return (Reason.LOST,)
        if self._unread(kept):
            return _changes_by_listing(self, kept.result)
        with at_hand(self.task.ref, TRUTH_FILE) as ref:
            return _changes(self._of(ref), kept.result)

    def _unread(self, kept: Kept) -> bool:
        """Whether a store's listing shows that the session's files are those of the result."""
        return kept.inputs == _inputs(self.task.ref) != ""

    def _of(self, ref: SessionRef) -> SessionJob:
        return replace(self, task=replace(self.task, ref=ref))


@dataclass(frozen=True)
class OfSession(Job[_Made]):
    """Other work on the session of a job, with the same source code."""

    job: SessionJob
    code: str

    @property
    def slug(self) -> str:
        """File-name stem of the session's outputs."""
        return self.job.slug

    @property
    def waits(self) -> bool:
        """Whether its files come from a store, or go to one."""
        return self.job.waits

    def code_here(self) -> str:
        """Key of the source that would work at it in this process."""
        return self.job.code_here()


def code_of(format_name: str, settings: ProcessSettings) -> str:
    """Key of the source that processes sessions of a format: this module, reader and strategy, and what they import.

    With constraints between walks, also the module that joins them.
    """
    joining = (_JOINING,) if settings.together else ()
    return code_key(
        __name__, format_module(format_name), *strategy_modules(settings.strategy, settings.mapping), *joining
    )


def jobs_of(tasks: Sequence[SessionTask], settings: ProcessSettings, out: OutputFolder = _NOWHERE) -> list[SessionJob]:
    """Jobs that process sessions into ``out``, each with the key of its source."""
    code = {name: code_of(name, settings) for name in sorted({task.ref.format for task in tasks})}
    return [SessionJob(task, settings, out, code[task.ref.format]) for task in tasks]


@cache
def _code_of(format_name: str, settings: str) -> str:
    """Key of the source as it is in this process, which reads it once."""
    return code_of(format_name, ProcessSettings.model_validate_json(settings))


def _inputs(ref: SessionRef) -> str:
    """A mark of a session's files in a store; empty for files on this machine, which are hashed."""
    if ref.stored is None:
        return ""
    return key_of(ref.stored.store.address, [[file.name, short(file.version)] for file in ref.stored.files])


def _processed(job: SessionJob, files: SessionFiles) -> Outcome:
    """Read, map, label and write a session with local files."""
    with files.begun():
        try:
            prepared = mappable_session(job.task, inertial=job.settings.inertial)
            session = prepared.session
            walk = LabelledWalk.of(prepared, job.settings)
            _write_tables(job, files, walk.tables(job.task.frames))
            if session.columns:
                job.out.put_text(columns_name(job.slug), session.columns)
            hashes = {record.name: record.sha256 for record in session.files}
            result = session_result(prepared, walk, job.settings)
            known = {"fingerprint": _fingerprint(job, hashes, result), "parts": _parts(job)}
            files.result = result.model_copy(update=known)
        except Exception as error:  # one bad session must not end the batch; its result names the fault
            files.result = _failed(job, files, reason(job.task.ref.key, error))
    return outcome_of(files.result, repeated=True)


def outcome_of(result: SessionResult, *, repeated: bool) -> Outcome:
    """The outcome of a session with this result."""
    return Outcome(result.slug, result.error, repeated, rows_of(result))


def _failed(job: SessionJob, files: SessionFiles, error: str) -> SessionResult:
    """Write tables with zero rows for a session that failed."""
    _write_tables(job, files, {name: pl.DataFrame(schema=SCHEMAS[name]) for name in SCHEMAS.keys() - OPTIONAL})
    return result_of(job.task, job.settings.strategy, fingerprint="", error=error)


def _write_tables(job: SessionJob, files: SessionFiles, tables: dict[str, pl.DataFrame]) -> None:
    for name, table in tables.items():
        files.write(name, partial(_fill, table, name, job.settings.strategy))


def _fill(table: pl.DataFrame, name: str, strategy: str, path: Path) -> None:
    write_table(table, name, strategy, Folder.at(path.parent), path.name)


class Reason(Enum):
    """Why a session is processed."""

    NEW = "new"
    FAILED = "failed before"
    LOST = "its tables are missing"
    CODE = "code changed"
    SETTINGS = "settings changed"
    INPUTS = "inputs changed"
    """Its own files, or its entries in the site or the corrections."""


def still_holds(job: SessionJob, done: SessionResult, hashes: dict[str, str] | None = None) -> bool:
    """Whether an earlier result equals what processing would produce now.

    ``hashes`` are the SHA-256 of the session's files by name, where they are known without reading the files.
    """
    try:
        known = hashes or hash_inputs(job.task.ref)
        return done.fingerprint == _fingerprint(job, known, done)
    except SessionError:
        return False


def _changes(job: SessionJob, done: SessionResult, hashes: dict[str, str] | None = None) -> tuple[Reason, ...]:
    """Why an earlier result of a local session is not valid (:func:`still_holds`); empty if it is."""
    if still_holds(job, done, hashes):
        return ()
    now = _parts(job)
    parts = {Reason.CODE: "code", Reason.SETTINGS: "settings"}
    changed = [reason for reason, name in parts.items() if done.parts.get(name) != now[name]]
    try:
        same_files = {file.name: file.sha256 for file in done.files} == (hashes or hash_inputs(job.task.ref))
    except SessionError:
        same_files = False
    return (*changed, *([] if same_files and changed else [Reason.INPUTS]))


def _changes_by_listing(job: SessionJob, done: SessionResult) -> tuple[Reason, ...]:
    """Why a result of these files in a store is not valid.

    Only the truth is fetched, because the result has no hash of it.
    """
    ref = job.task.ref
    assert ref.stored is not None
    with scratch_folder() as folder:
        for file in ref.stored.files:
            if file.name == f"{ref.stored.name}/{TRUTH_FILE}":
                ref.stored.store.fetch(file.name, folder, TRUTH_FILE)
        here = job._of(replace(ref, folder=folder.path))
        return _changes(here, done, {file.name: file.sha256 for file in done.files})


def _parts(job: SessionJob) -> dict[str, str]:
    return {"code": job.code, "settings": key_of(job.settings.of_labels())}


def _fingerprint(job: SessionJob, hashes: dict[str, str], done: SessionResult) -> str:
    """SHA-256 over all inputs of the session's outputs.

    Which landmarks and plans these are follows from what ``done`` says that the session logged and how it was mapped.
    """
    task, logged = job.task, done.landmarks_logged
    marks, _ = task.candidate_landmarks(logged, done.floors_told)
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
    if _depends_on_plans(job.settings.strategy, done):
        parts["plans"] = [[floor.number, plan_mark(floor)] for floor in task.site.floors]
    if any(finding.kind == "unusable_plan" for finding in done.findings):  # until its extra is installed
        parts["plan_fault"] = plan_fault(task.floor)
    if task.told is not None:
        parts["told"] = [task.told.ids, task.told.floor.tolist()]
    digest = hashlib.sha256(json.dumps(parts, sort_keys=True).encode())
    arrays = (marks.position_bcs, marks.covariance_bcs, marks.z_m, marks.heading_rad, marks.heading_sigma_rad)
    joint = () if marks.joint_covariance is None else (marks.joint_covariance,)
    for array in (*arrays, *joint, *_told_arrays(task)):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _depends_on_plans(strategy: str, done: SessionResult) -> bool:
    """Whether the floors' plans may change a result; not one of the smoother if landmarks determine the walk."""
    if strategy == ON_PLAN or done.placing is not None:
        return True
    return strategy == BY_LANDMARKS and not frames_placed(done.frames)


def _told_arrays(task: SessionTask) -> Iterator[AnyArray]:
    """Constraints from other sessions."""
    if (told := task.told) is not None:
        yield from (told.position_bcs, told.heading_rad, told.joint_covariance)
    if (ways := task.ways) is not None:
        yield from (ways.position_bcs, ways.course_rad, ways.walk.astype(np.float64))
    if (ties := task.ties) is not None:
        yield from (ties.time_ns, ties.position_bcs, ties.covariance_m2)
    if (hints := task.hints) is not None:
        yield np.array([np.nan if hints.north_rad is None else hints.north_rad])
        for place in hints.places:
            yield from (np.array((place.time_ns, place.sigma_m)), place.position_bcs, place.weight)
    if (tracker := task.tracker) is not None:
        yield np.array((tracker.times_usual, tracker.effective_observations))
