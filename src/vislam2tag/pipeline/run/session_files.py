"""A session's files on their way into an output folder: its tables as they are made, its result last."""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from logging import LogRecord
from logging.handlers import QueueHandler
from pathlib import Path
from queue import SimpleQueue

from vislam2tag.common.errors import StoreConflictError
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.files.store import Store, Version, asking
from vislam2tag.labeling.results import SessionResult
from vislam2tag.labeling.schemas import OPTIONAL
from vislam2tag.pipeline.run.failures import LOG
from vislam2tag.pipeline.run.output import LOGS, Kept, OutputFolder, result_name, short, table_name

_TRIES = 5
"""For a result that others write at the same time."""


@contextmanager
def session_files(folder: OutputFolder, slug: str, kept: Kept, inputs: str) -> Iterator[SessionFiles]:
    """Yield what writes a session's files; if it was given a result, that is written when the block ends well.

    ``inputs`` tells the session's own files from any others if they are in a store. Raises OutputError or StoreError if
    a file cannot be written: then the session is not marked as done.
    """
    store = folder.at
    if not isinstance(store, Store):
        files = SessionFiles(folder, slug)
        yield files
        if files.result is not None:
            folder.put_text(result_name(slug), _text(files.result))
        return
    with scratch_folder() as scratch:
        sent = _SentFiles(OutputFolder(scratch.path), slug, store=store)
        yield sent
        if sent.result is not None:
            sent.finish(sent.result, kept, inputs)


def _text(result: SessionResult) -> str:
    return result.model_dump_json(indent=1) + "\n"


@dataclass
class SessionFiles:
    """Writes the files of one session into a folder of this machine."""

    folder: OutputFolder
    slug: str
    result: SessionResult | None = None
    """Once all tables are written."""

    @contextmanager
    def begun(self) -> Iterator[None]:
        """Make the session anew while the block lasts: its result of before is removed."""
        self.folder.forget(self.slug)
        yield

    def write(self, table: str, fill: Callable[[Path], None]) -> None:
        """Write a table whole."""
        self.folder.write(table_name(table, self.slug), fill)


@dataclass
class _SentFiles(SessionFiles):
    """Puts tables into a store as soon as they are written in scratch space, while more is made."""

    store: Store = field(kw_only=True)
    sent: dict[str, Future[Version]] = field(default_factory=dict)
    """By table."""
    log: str = ""

    @contextmanager
    def begun(self) -> Iterator[None]:
        """Note how, where and when the session is made: its start, each message, its end, an event a line."""
        started, since = datetime.now(UTC), time.monotonic()
        messages: SimpleQueue[LogRecord] = SimpleQueue()
        handler = QueueHandler(messages)
        LOG.addHandler(handler)
        try:
            yield
        finally:
            LOG.removeHandler(handler)
        lines = [self._event("started", started, host=platform.node(), process=os.getpid())]
        for record in (messages.get() for _ in range(messages.qsize())):
            at = datetime.fromtimestamp(record.created, UTC)
            lines.append(self._event("message", at, level=record.levelname.lower(), text=record.getMessage()))
        ended: dict[str, object] = {"seconds": round(time.monotonic() - since, 3)}
        if self.result is not None:
            ended |= {"rows": rows_of(self.result), "error": self.result.error}
        self.log = "".join([*lines, self._event("ended", datetime.now(UTC), **ended)])

    def _event(self, name: str, at: datetime, **details: object) -> str:
        event = {"time": at.isoformat(timespec="milliseconds"), "session": self.slug, "event": name} | details
        return f"{json.dumps(event)}\n"

    def write(self, table: str, fill: Callable[[Path], None]) -> None:
        """Write a table and put it; one that is written again, after the first is there."""
        super().write(table, fill)
        name = table_name(table, self.slug)
        wait([self.sent[table]] if table in self.sent else [])
        self.sent[table] = asking().submit(self.store.put, name, self.folder.root / name)

    def finish(self, result: SessionResult, kept: Kept, inputs: str) -> None:
        """Mark the session as done once all its tables are there; tables of before that it has no more go."""
        others = {*OPTIONAL, *kept.tables} - self.sent.keys()
        gone = asking().submit(self.store.delete, [table_name(name, self.slug) for name in sorted(others)])
        tables = {name: short(future.result()) for name, future in sorted(self.sent.items())}
        gone.result()
        logged = asking().submit(self.store.put, f"{LOGS}/{self.slug}.jsonl", self.log.encode())
        self._put_result(_text(result).encode(), kept.version, {"inputs": inputs, "tables": json.dumps(tables)})
        logged.result()

    def _put_result(self, data: bytes, before: Version | None, notes: dict[str, str]) -> None:
        """Write the result; the version ``before`` is replaced.

        If others wrote it meanwhile, theirs is replaced: the tables that are there now are ours, or, if they are not,
        the result does not hold. Raises StoreConflictError if that goes on.
        """
        for _ in range(_TRIES):
            try:
                self.store.put_over(result_name(self.slug), data, before, notes)
                return
            except StoreConflictError:
                before = self.store.version(result_name(self.slug))
        place = self.store.address
        raise StoreConflictError(f"{place}: other programs keep writing session {self.slug}; run again when they ended")


def rows_of(result: SessionResult) -> int:
    """How many readings a session has."""
    return sum(sum(counts.values()) for counts in result.readings.values())
