"""One session whose outputs go to an object store: processed as any other, in scratch space that lasts as long.

What is computed, and how, is :mod:`vislam2tag.pipeline.labels.session`'s alone; here files come and go.
"""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from functools import cache, partial
from logging import LogRecord
from pathlib import Path
from typing import Any, TypeAlias

from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.files.store import Version, asking
from vislam2tag.labeling.results import RESULTS
from vislam2tag.labeling.schemas import OPTIONAL
from vislam2tag.labeling.settings import ProcessSettings
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
from vislam2tag.pipeline.labels.session_result import TRUTH_FILE
from vislam2tag.pipeline.labels.together import HeardWalk, HearJob, JoiningJob, ReduceJob
from vislam2tag.pipeline.run.dask import DaskExecutor
from vislam2tag.pipeline.run.failures import LOG, recorded
from vislam2tag.pipeline.run.keys import key_of
from vislam2tag.pipeline.run.output_store import LOGS, Mark, OutputStore, short, table_name
from vislam2tag.pipeline.run.steps import InSteps, Steps
from vislam2tag.pipeline.run.store import OutputFolder
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
"""What processes a session; the executors also run a :class:`.JoiningJob` (``process --together``)."""
Output: TypeAlias = OutputFolder | OutputStore


def job_for(task: SessionTask, settings: ProcessSettings, out: Output, code: str) -> AnyJob:
    """Make the job that processes a session into ``out``."""
    return StoredJob(task, settings, out, code) if isinstance(out, OutputStore) else Job(task, settings, out, code)


def session_steps(job: AnyJob) -> Steps[Outcome]:
    """Process a session, wherever its outputs go: fetch it, compute, put. One whose mark holds is not repeated.

    Into a store go its tables, its log and, last, its mark. Raises OutputError or StoreError where what it needs cannot
    be read or written: then nothing is marked as done.
    """
    if isinstance(job, StoredJob):
        return (yield from _into_store(job, process_session, at_hand(job.task.ref, TRUTH_FILE)))
    with at_hand(job.task.ref, TRUTH_FILE) as ref:
        yield
        return process_session(replace(job, task=replace(job.task, ref=ref)))


run_session = InSteps(session_steps)
"""What every executor runs."""


def give_up(job: AnyJob | ReduceJob | HearJob, error: str) -> Outcome | ReducedSession | HeardWalk:
    """End a job for a cause that is not its own to tell."""
    return job.given_up(error) if isinstance(job, ReduceJob | HearJob) else give_up_session(job, error)


def give_up_session(job: AnyJob, error: str) -> Outcome:
    """Write the result of a session that could not be processed, for a cause that is not its own to tell."""
    work = partial(fail_session, error=error)
    if not isinstance(job, StoredJob):
        return work(job)
    steps = InSteps[StoredJob, Outcome](lambda stored: _into_store(stored, work, nullcontext(stored.task.ref)))
    return steps(job)


def code_here(job: AnyJob | JoiningJob) -> str:
    """Key of the source that would process a job in this process."""
    return _code_of(job.task.ref.format, json.dumps(job.settings.of_labels()))


@cache
def _code_of(format_name: str, settings: str) -> str:
    return code_of(format_name, ProcessSettings.model_validate_json(settings))


def _into_store(
    stored: StoredJob, work: Callable[[Job], Outcome], fetched: AbstractContextManager[SessionRef]
) -> Steps[Outcome]:
    before, version = stored.out.mark(stored.slug)
    mark = before if before is not None and stored.out.holds(stored.slug, before) else None
    inputs = _inputs(stored.task.ref)
    with _scratch_job(stored) as job:
        if mark is not None and mark.inputs == inputs != "" and not _reasons_by_listing(job, mark):
            return outcome_of(mark.result, repeated=False)
        if mark is not None:
            _lay_out(job, mark)
        tables = _SentTables(job.out.root, stored.out)
        with fetched as ref:
            yield
            started, since = datetime.now(UTC), time.monotonic()
            outcome, records = recorded(work, replace(job, task=replace(job.task, ref=ref), out=tables))
            log = _log(outcome, records, started, time.monotonic() - since)
            for record in records:
                LOG.handle(record)
            yield
        if outcome.repeated:
            tables.finish(job.slug, before, version, inputs, "".join(f"{json.dumps(line)}\n" for line in log))
    return outcome


@dataclass(frozen=True)
class _SentTables(OutputFolder):
    """Scratch space of one session whose tables go to a store as soon as they are written, while more is made."""

    to: OutputStore
    sent: dict[str, Future[Version]] = field(default_factory=dict)
    """By table."""

    def write(self, relative: str, fill: Callable[[Path], None]) -> None:
        """Write as any folder does, and put what is a table; one that is written again, after that is there."""
        super().write(relative, fill)
        table, _, file = relative.partition("/")
        if file.endswith(".parquet"):
            wait([self.sent[table]] if table in self.sent else [])
            self.sent[table] = asking().submit(self.to.store.put, relative, self.root / relative)

    def finish(self, slug: str, before: Mark | None, version: Version | None, inputs: str, log: str) -> None:
        """Mark the session as done once all its tables stand there; tables of before that it has no more go.

        Raises StoreError where that cannot be.
        """
        others = {*OPTIONAL, *(before.tables if before else ())} - self.sent.keys()
        gone = asking().submit(self.to.store.delete, [table_name(name, slug) for name in sorted(others)])
        versions = {name: future.result() for name, future in self.sent.items()}
        gone.result()
        logged = asking().submit(self.to.put_text, f"{LOGS}/{slug}.jsonl", log)
        self.to.put_mark(slug, read_bytes(self.root / RESULTS / f"{slug}.json"), version, inputs, versions)
        logged.result()


@contextmanager
def _scratch_job(stored: StoredJob) -> Iterator[Job]:
    with scratch_folder() as scratch:
        yield Job(stored.task, stored.settings, OutputFolder(scratch.path), stored.code)


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
    folder = Folder.at(job.out.root).folder("session").make()
    for file in ref.stored.files:
        if file.name == f"{ref.stored.name}/{TRUTH_FILE}":
            ref.stored.store.fetch(file.name, folder, TRUTH_FILE)
    here = replace(job, task=replace(job.task, ref=replace(ref, folder=folder.path)))
    return reasons_against(here, mark.result, {file.name: file.sha256 for file in mark.result.files})


def _lay_out(job: Job, mark: Mark) -> None:
    """Let scratch space look as a folder in which the session was done: its tables are there, by name."""
    for name in mark.tables:
        Folder.at(job.out.root).create(table_name(name, job.slug))
    job.out.put_text(f"{RESULTS}/{job.slug}.json", mark.result.model_dump_json())


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
