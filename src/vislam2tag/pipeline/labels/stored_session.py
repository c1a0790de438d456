"""One session whose outputs go to an object store: processed as any other, in scratch space that lasts as long.

What is computed, and how, is :mod:`vislam2tag.pipeline.labels.session`'s alone; here files come and go.
"""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Callable, Iterator, Set
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from functools import cache, partial
from logging import LogRecord
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeAlias

from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.files.store import Version
from vislam2tag.labeling.results import RESULTS
from vislam2tag.labeling.schemas import OPTIONAL
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.accuracy import TRUTH_FILE
from vislam2tag.pipeline.labels.landmark_survey import ReducedSession
from vislam2tag.pipeline.labels.session import (
    Job,
    Outcome,
    Reason,
    code_of,
    fail_session,
    outcome_of,
    process_session,
    reasons_against,
)
from vislam2tag.pipeline.labels.together import ReduceJob
from vislam2tag.pipeline.run.dask_executor import DaskExecutor
from vislam2tag.pipeline.run.failures import LOG, recorded
from vislam2tag.pipeline.run.keys import key_of
from vislam2tag.pipeline.run.output_store import LOGS, Mark, OutputStore, short, table_name
from vislam2tag.pipeline.run.store import PARTIAL, OutputFolder
from vislam2tag.pipeline.run.workers import Executor
from vislam2tag.sessions.prepared import SessionTask
from vislam2tag.sessions.registry import at_hand
from vislam2tag.survey.model import SessionRef


@dataclass(frozen=True)
class StoredJob:
    """All that a worker needs to process one session into a store."""

    task: SessionTask
    settings: ProcessSettings
    out: OutputStore
    code: str

    @property
    def slug(self) -> str:
        """File-name stem of the session's outputs."""
        return self.task.ref.slug


AnyJob: TypeAlias = Job | StoredJob
"""What processes a session; the executors also run :class:`.ReduceJob` (``process --together``)."""
Output: TypeAlias = OutputFolder | OutputStore


def job_for(task: SessionTask, settings: ProcessSettings, out: Output, code: str) -> AnyJob:
    """Make the job that processes a session into ``out``."""
    return StoredJob(task, settings, out, code) if isinstance(out, OutputStore) else Job(task, settings, out, code)


def run_session(job: AnyJob) -> Outcome:
    """Process a session, wherever its outputs go: what every executor runs. One whose mark holds is not repeated.

    Into a store go its tables, its log and, last, its mark. Raises OutputError or StoreError where what it needs cannot
    be read or written: then nothing is marked as done.
    """
    return _into_store(job, process_session) if isinstance(job, StoredJob) else process_session(job)


def give_up(job: AnyJob | ReduceJob, error: str) -> Outcome | ReducedSession:
    """End a job for a cause that is not its own to tell; a session that could not be reduced is mapped alone."""
    return ReducedSession(job.task.ref.key, error=error) if isinstance(job, ReduceJob) else give_up_session(job, error)


def give_up_session(job: AnyJob, error: str) -> Outcome:
    """Write the result of a session that could not be processed, for a cause that is not its own to tell."""
    work = partial(fail_session, error=error)
    return _into_store(job, work) if isinstance(job, StoredJob) else work(job)


def code_here(job: AnyJob | ReduceJob) -> str:
    """Key of the source that would process a job in this process."""
    return _code_of(job.task.ref.format, json.dumps(job.settings.of_labels()))


@cache
def _code_of(format_name: str, settings: str) -> str:
    return code_of(format_name, ProcessSettings.model_validate_json(settings))


def _into_store(stored: StoredJob, work: Callable[[Job], Outcome]) -> Outcome:
    started, since = datetime.now(UTC), time.monotonic()
    mark, version = stored.out.mark(stored.slug)
    before = set() if mark is None else set(mark.tables)
    if mark is not None and not stored.out.holds(stored.slug, mark):
        mark = None
    inputs = _inputs(stored.task.ref)
    with _scratch_job(stored) as job:
        if mark is not None and mark.inputs == inputs != "" and not _reasons_by_listing(job, mark):
            return outcome_of(mark.result, repeated=False)
        if mark is not None:
            _lay_out(job, mark)
        outcome, records = recorded(work, job)
        if outcome.repeated:
            _put(stored, job, version, inputs, before)
            log = "".join(f"{json.dumps(line)}\n" for line in _log(outcome, records, started, time.monotonic() - since))
            stored.out.write_text(f"{LOGS}/{job.slug}.jsonl", log)
    for record in records:
        LOG.handle(record)
    return outcome


@contextmanager
def _scratch_job(stored: StoredJob) -> Iterator[Job]:
    with TemporaryDirectory(prefix="vislam2tag-") as scratch:
        folder = OutputFolder(Path(scratch))
        (folder.root / PARTIAL).mkdir()
        yield Job(stored.task, stored.settings, folder, stored.code)


def _inputs(ref: SessionRef) -> str:
    """What tells a session's files in a store from any others; empty for those of this machine, which are hashed."""
    if ref.stored is None:
        return ""
    return key_of(ref.stored.store.address, [[file.name, short(file.version)] for file in ref.stored.files])


def reasons_to_run(job: AnyJob) -> tuple[Reason, ...]:
    """Why :func:`run_session` would process a session, as it decides that itself; nothing is written."""
    if isinstance(job, Job):
        with at_hand(job.task.ref, TRUTH_FILE) as ref:
            return reasons_against(replace(job, task=replace(job.task, ref=ref)), job.out.result(job.slug))
    mark, _ = job.out.mark(job.slug)
    if mark is None:
        return (Reason.NEW,)
    if not job.out.holds(job.slug, mark):
        return (Reason.LOST,)
    with _scratch_job(job) as here:
        if mark.inputs == _inputs(job.task.ref) != "":
            return _reasons_by_listing(here, mark)
        _lay_out(here, mark)
        return reasons_to_run(here)


def _reasons_by_listing(job: Job, mark: Mark) -> tuple[Reason, ...]:
    """Why a mark of just these files does not hold; only the truth is fetched, which the mark keeps no hash of."""
    ref = job.task.ref
    assert ref.stored is not None
    folder = job.out.root / "session"
    folder.mkdir()
    for file in ref.stored.files:
        if file.name == f"{ref.stored.name}/{TRUTH_FILE}":
            ref.stored.store.fetch(file.name, folder / TRUTH_FILE)
    here = replace(job, task=replace(job.task, ref=replace(ref, folder=folder)))
    return reasons_against(here, mark.result, {file.name: file.sha256 for file in mark.result.files})


def _lay_out(job: Job, mark: Mark) -> None:
    """Let scratch space look as a folder in which the session was done: its tables are there, by name."""
    for name in mark.tables:
        (job.out.root / name).mkdir()
        (job.out.root / table_name(name, job.slug)).touch()
    job.out.write_text(f"{RESULTS}/{job.slug}.json", mark.result.model_dump_json())


def _put(stored: StoredJob, job: Job, before: Version | None, inputs: str, tables_before: Set[str]) -> None:
    store = stored.out.store
    made = job.out.tables(job.slug)
    tables = {name: store.put(table_name(name, job.slug), path) for name, path in made.items()}
    store.delete(table_name(name, job.slug) for name in (tables_before | set(OPTIONAL)) - tables.keys())
    result = read_bytes(job.out.root / RESULTS / f"{job.slug}.json")
    stored.out.put_mark(job.slug, result, before, inputs, tables)


def _log(outcome: Outcome, records: list[LogRecord], started: datetime, seconds: float) -> Iterator[dict[str, object]]:
    """What is kept of how a session was processed, an event a line: its start, each message, its end."""

    def event(name: str, at: datetime, **details: object) -> dict[str, object]:
        return {"time": at.isoformat(timespec="milliseconds"), "session": outcome.slug, "event": name} | details

    yield event("started", started, host=platform.node(), process=os.getpid())
    for record in records:
        at = datetime.fromtimestamp(record.created, UTC)
        yield event("message", at, level=record.levelname.lower(), text=record.getMessage())
    end = started + timedelta(seconds=seconds)
    yield event("ended", end, seconds=round(seconds, 3), rows=outcome.rows, error=outcome.error)


def on_dask(client: Any, tell: Callable[[str], None]) -> Executor:
    """What processes sessions on the workers of a ``distributed.Client``; ``tell`` is told which are refused."""
    return DaskExecutor(client, code_here, give_up, tell)
