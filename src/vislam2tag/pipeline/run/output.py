"""An output folder, on this machine or in an object store, with files that are written completely or not at all.

A session's tables are written first and its result, ``sessions/SLUG.json``, last, which marks the session as done. In a
store, notes of the result name the versions of its tables. So if another program writes at the same time, or a program
is killed, the result is at worst invalid, and the session is processed again.
"""

from __future__ import annotations

import json
import os
import platform
import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Set
from concurrent.futures import Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from logging import LogRecord
from logging.handlers import QueueHandler
from pathlib import Path, PurePosixPath
from queue import SimpleQueue

import polars as pl

from vislam2tag.common.errors import OutputError, StoreConflictError, StoreError
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.files.own_files import OWN_FILES, OwnFiles
from vislam2tag.common.files.store import Store, Version, asking, at_once
from vislam2tag.common.files.stored_folder import AnyStore, any_store_at
from vislam2tag.labeling.results import RESULTS, SessionResult
from vislam2tag.labeling.tables import OPTIONAL, SCHEMAS, TRAJECTORY
from vislam2tag.pipeline.run.failures import LOG

REPORT_FILE = "report.html"
LOGS = "logs"
"""In a store: a log for each session in JSON lines (how, where and when it was processed)."""
COLUMNS = "columns"
"""A ``columns.toml`` for each session whose tables have names of their own: how they were read."""
SESSION_FOLDERS = (RESULTS, *SCHEMAS)
"""Folders with a file for each session."""
_TRIES = 5
"""Attempts for a file that others write at the same time."""


@dataclass(frozen=True)
class Kept:
    """Contents of an output folder for a session."""

    result: SessionResult | None = None
    """None if there is none that can be read."""
    version: Version | None = None
    """Version of the existing file, readable or not."""
    inputs: str = ""
    """In a store: mark of the session's files at that time; empty if unknown."""
    tables: Mapping[str, str] = field(default_factory=dict)
    """In a store: versions of the tables of the result."""


@dataclass(frozen=True)
class OutputFolder:
    """Reads and atomic writes of one output folder; cheap to pass to worker processes."""

    root: Path
    """A path, or the address that it represents."""

    @property
    def at(self) -> AnyStore:
        """Where its files are."""
        return any_store_at(self.root)

    @property
    def in_store(self) -> bool:
        """Whether it is in an object store."""
        return isinstance(self.at, Store)

    @property
    def place(self) -> str:
        """Its path or address, for messages."""
        return self.at.address

    def write(self, relative: str, fill: Callable[[Path], None]) -> None:
        """Let ``fill`` write a temporary file, then move it to ``relative``.

        Raises OutputError or StoreError if that fails, and leaves no partial file.
        """
        with self._written(relative), self.at.filling(relative) as path:
            fill(path)

    def put_text(self, relative: str, text: str) -> None:
        """Write a UTF-8 text file atomically; raises as :meth:`write`."""
        with self._written(relative):
            self.at.put(relative, text.encode())

    @contextmanager
    def _written(self, relative: str) -> Iterator[None]:
        try:
            yield
        except (OSError, pl.exceptions.PolarsError, OutputError) as error:
            raise OutputError(
                f"{self.place}/{relative}: cannot be written ({_cause(error)}); free space or choose another --out, "
                "then run the same command again"
            ) from error

    def remove(self, *names: str) -> None:
        """Remove files; missing ones are ignored."""
        try:
            self.at.delete(names)
        except OutputError as error:
            raise OutputError(f"{error} or choose another --out") from error

    def has(self, relative: str) -> bool:
        """Whether a file is there."""
        return self.at.version(relative) is not None

    def kept(self, slug: str) -> Kept:
        """The contents for a session."""
        try:
            found = self.at.get(result_name(slug))
        except StoreError:
            if self.in_store:
                raise
            return Kept()  # a folder in its place, or a file that cannot be read
        if found is None:
            return Kept()
        try:
            result = SessionResult.model_validate_json(found.data)
            tables = json.loads(found.notes.get("tables", "{}"))
        except ValueError:
            return Kept(version=found.version)
        return Kept(result, found.version, found.notes.get("inputs", ""), tables)

    def result(self, slug: str) -> SessionResult | None:
        """Read the result of a session; None if there is none that can be read."""
        return self.kept(slug).result

    def results(self, slugs: Iterable[str]) -> Iterator[SessionResult]:
        """Read the results of sessions, in this order, except missing or unreadable ones."""
        found = at_once(self.result, slugs) if self.in_store else map(self.result, slugs)
        yield from (result for result in found if result is not None)

    def is_whole(self, slug: str, kept: Kept) -> bool:
        """Whether a session has a result, and its tables exist."""
        done = kept.result
        if done is None:
            return False
        if not self.in_store:
            tables = [TRAJECTORY, *done.readings] if done.frames or done.readings else []
            return all(self.has(table_name(name, slug)) for name in tables)
        versions = at_once(lambda name: self.at.version(table_name(name, slug)), kept.tables)
        found = [None if version is None else short(version) for version in versions]
        return found == list(kept.tables.values())

    def finished(self) -> set[str]:
        """Slugs of the sessions that have a result."""
        return {PurePosixPath(file.name).stem for file in self.at.list(RESULTS) if file.name.endswith(".json")}

    def forget(self, slug: str) -> None:
        """Remove a session's result, so that its tables are not trusted while they are rewritten.

        Optional tables and ``columns.toml`` are removed, too, because the session may have none now.
        """
        tables = (table_name(name, slug) for name in (*OPTIONAL, *self._of_companions(slug)))
        self.remove(result_name(slug), columns_name(slug), *tables)

    def _of_companions(self, slug: str) -> list[str]:
        """Tables of a session's companions: of one named B such as ``sensors_B``."""
        folders = (name for name in self.at.folders() if "_" in name and name.partition("_")[0] in SCHEMAS)
        return [name for name in folders if self.has(table_name(name, slug))]

    def own(self) -> OwnFiles:
        """The record of the files that are ours; raises OutputError if it is damaged."""
        return self.own_version()[0] or OwnFiles()

    def own_version(self) -> tuple[OwnFiles | None, Version | None]:
        """The record of our files, and its version."""
        found = self.at.get(OWN_FILES)
        if found is None:
            return None, None
        return OwnFiles.parsed(found.data, f"{self.place}/{OWN_FILES}"), found.version

    def change_own(self, change: Callable[[OwnFiles], OwnFiles]) -> None:
        """Change the record of the files that are ours; in a store others may change it at the same time."""
        for _ in range(_TRIES):
            before, version = self.own_version()
            after = change(before or OwnFiles())
            if after == before:
                return
            if not isinstance(self.at, Store):
                self.put_text(OWN_FILES, after.text())
                return
            try:
                self.at.put_over(OWN_FILES, after.text().encode(), version)
                return
            except StoreConflictError:
                continue
        raise StoreConflictError(
            f"{self.place}/{OWN_FILES}: other programs keep writing this file; run again when they have ended"
        )

    def add_own(self, *files: str) -> None:
        """Record further files as ours before they are written; only for the process that claimed the folder."""
        self.change_own(lambda own: own if all(map(own.owns, files)) else own.with_those_of(OwnFiles.of(files)))

    def drop(self, keep: Callable[[str], bool]) -> list[str]:
        """Remove the files of recorded sessions that are not kept; return the slugs of those with a result.

        Other files stay.
        """
        own = self.own()
        gone = {slug for slug in recorded_sessions(own) if not keep(slug)}
        if not gone:
            return []
        had_result = sorted(gone & self.finished())
        self.remove(*(file.name for file in self.at.list() if own.owns(file.name) and _session_of(file.name) in gone))
        self.change_own(lambda before: without_sessions(before, gone))
        return had_result

    def discard(self, *names: str, folders: Iterable[str] = ()) -> None:
        """Remove those of these files that are ours, and the files of ours right in these folders."""
        own = self.own()
        inside = (file.name for name in folders for file in self.at.list(name) if file.name.count("/") == 1)
        self.remove(*(name for name in (*names, *inside) if own.owns(name)))


def result_name(slug: str) -> str:
    """Where a session's result is."""
    return f"{RESULTS}/{slug}.json"


def table_name(table: str, slug: str) -> str:
    """Where a session's table is."""
    return f"{table}/{slug}.parquet"


def columns_name(slug: str) -> str:
    """Where the ``columns.toml`` of a session is."""
    return f"{COLUMNS}/{slug}.toml"


def short(version: Version) -> str:
    """A version as notes keep it."""
    return version.mark.strip('"')


def recorded_sessions(own: OwnFiles) -> set[str]:
    """Slugs of the sessions with files in a record."""
    paths = map(PurePosixPath, own.files)
    return {*own.stems, *(path.stem for path in paths if path.parent.as_posix() in SESSION_FOLDERS)}


def without_sessions(own: OwnFiles, slugs: Set[str]) -> OwnFiles:
    """A record without the files of some sessions."""
    gone = {file for slug in slugs for file in (result_name(slug), *(table_name(name, slug) for name in SCHEMAS))}
    gone |= {columns_name(slug) for slug in slugs}
    return OwnFiles.of({*own.files} - gone, own.folders, {*own.stems} - slugs)


def _session_of(name: str) -> str | None:
    """The slug of the session of a file, from its path; None for other files."""
    path = PurePosixPath(name)
    known = {RESULTS: ".json", LOGS: ".jsonl", COLUMNS: ".toml"} | dict.fromkeys(SCHEMAS, ".parquet")
    folder = path.parent.as_posix()
    suffix = known.get(folder, ".parquet" if folder.partition("_")[0] in SCHEMAS else None)
    return path.stem if path.suffix == suffix else None


def _cause(error: Exception) -> str:
    """The system's message why a file could not be written, for errors of any library."""
    first = error.__cause__ or error
    number = re.search(r"\(os error (\d+)\)", str(first))
    if number:
        return os.strerror(int(number.group(1)))
    return (first.strerror if isinstance(first, OSError) else None) or str(first)


@contextmanager
def session_files(folder: OutputFolder, slug: str, kept: Kept, inputs: str) -> Iterator[SessionFiles]:
    """Yield a writer of a session's files; its result, if set, is written when the block ends without error.

    ``inputs`` is the mark of the session's own files if they are in a store. Raises OutputError or StoreError if
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
        """Write the session again during the block; its earlier result is removed."""
        self.folder.forget(self.slug)
        yield

    def write(self, table: str, fill: Callable[[Path], None]) -> None:
        """Write a table atomically."""
        self.folder.write(table_name(table, self.slug), fill)


@dataclass
class _SentFiles(SessionFiles):
    """Uploads tables to a store as soon as they are written to scratch space."""

    store: Store = field(kw_only=True)
    sent: dict[str, Future[Version]] = field(default_factory=dict)
    """By table."""
    log: str = ""

    @contextmanager
    def begun(self) -> Iterator[None]:
        """Log how, where and when the session is processed: its start, messages and end, one event per line."""
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
        """Write a table and upload it; a repeated write waits for the first upload."""
        super().write(table, fill)
        name = table_name(table, self.slug)
        wait([self.sent[table]] if table in self.sent else [])
        self.sent[table] = asking().submit(self.store.put, name, self.folder.root / name)

    def finish(self, result: SessionResult, kept: Kept, inputs: str) -> None:
        """Mark the session as done once all its tables are uploaded; obsolete tables are removed."""
        others = {*OPTIONAL, *kept.tables} - self.sent.keys()
        gone = asking().submit(self.store.delete, [table_name(name, self.slug) for name in sorted(others)])
        tables = {name: short(future.result()) for name, future in sorted(self.sent.items())}
        gone.result()
        logged = asking().submit(self.store.put, f"{LOGS}/{self.slug}.jsonl", self.log.encode())
        self._put_result(_text(result).encode(), kept.version, {"inputs": inputs, "tables": json.dumps(tables)})
        logged.result()

    def _put_result(self, data: bytes, before: Version | None, notes: dict[str, str]) -> None:
        """Write the result; the version ``before`` is replaced.

        If others wrote it meanwhile, theirs is replaced: the present tables are ours, or otherwise the result is not
        valid. Raises StoreConflictError if that continues.
        """
        for _ in range(_TRIES):
            try:
                self.store.put_over(result_name(self.slug), data, before, notes)
                return
            except StoreConflictError:
                before = self.store.version(result_name(self.slug))
        place = self.store.address
        raise StoreConflictError(
            f"{place}: other programs keep writing session {self.slug}; run again when they have ended"
        )


def rows_of(result: SessionResult) -> int:
    """Number of readings of a session."""
    return sum(sum(counts.values()) for counts in result.readings.values())
