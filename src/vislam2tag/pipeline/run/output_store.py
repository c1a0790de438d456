"""The output folder in an object store: no lock, as no program there can hold one, but a mark for each session.

A session is done when its result, ``sessions/SLUG.json``, stands there; it is written last, by a conditional write, and
its notes say which versions of the session's tables it speaks of. So whoever writes at the same time, or dies while
writing, leaves at worst a mark that does not hold, and the session is done again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from vislam2tag.common.errors import OutputError, StoreConflictError
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.files.own_files import OWN_FILES, OwnFiles, without_record
from vislam2tag.common.files.store import PROBE, Store, Stored, Version, at_once
from vislam2tag.labeling.results import (
    CONFLICTS_FILE,
    CONFLICTS_PAGE,
    PROGRAM,
    RESULTS,
    RUN_FILE,
    SUMMARY_FILE,
    SessionResult,
)
from vislam2tag.pipeline.run.failures import LOG_FILE, logged_to
from vislam2tag.pipeline.run.store import recorded_sessions, session_files, without_sessions

REPORT_FILE = "report.html"
LOGS = "logs"
"""A file of JSON lines for each session: how, where and when it was processed."""
_TRIES = 5
"""For a mark or record that others write at the same time."""
_OF_RUN = (SUMMARY_FILE, REPORT_FILE, CONFLICTS_PAGE, CONFLICTS_FILE, LOG_FILE)
"""What a run sums up last."""


@dataclass(frozen=True)
class Mark:
    """A session's result as it stands in the store."""

    result: SessionResult
    version: Version
    inputs: str
    """Of the session's files, what tells them from any others; empty where that is not known."""
    tables: Mapping[str, str]
    """Of each table, the version that the result speaks of."""


@dataclass(frozen=True)
class OutputStore:
    """Reads and writes of one output folder in a store; cheap to pass to workers."""

    store: Store

    @property
    def place(self) -> str:
        """Its address."""
        return self.store.address

    def write(self, relative: str, fill: Callable[[Path], None]) -> None:
        """Let ``fill`` write a temporary file, then put it whole."""
        with scratch_folder() as scratch:
            path = scratch / PurePosixPath(relative).name
            fill(path)
            self.store.put(relative, path)

    def put_text(self, relative: str, text: str) -> None:
        """Put a UTF-8 text file."""
        self.store.put(relative, text.encode())

    def remove(self, relative: str) -> None:
        """Remove a file; none there is no fault."""
        self.store.delete([relative])

    def has(self, relative: str) -> bool:
        """Whether a file is there."""
        return self.store.version(relative) is not None

    def results(self, slugs: Iterable[str]) -> Iterator[SessionResult]:
        """Read the results of sessions, in this order, but for those that are not there or cannot be read."""
        yield from (mark.result for mark, _ in at_once(self.mark, slugs) if mark is not None)

    def mark(self, slug: str) -> tuple[Mark | None, Version | None]:
        """A session's mark, and the version that stands there, be it readable or not."""
        found = self.store.get(_mark_name(slug))
        if found is None:
            return None, None
        try:
            result = SessionResult.model_validate_json(found.data)
            tables = json.loads(found.notes.get("tables", "{}"))
        except ValueError:
            return None, found.version
        return Mark(result, found.version, found.notes.get("inputs", ""), tables), found.version

    def holds(self, slug: str, mark: Mark) -> bool:
        """Whether the tables that a mark speaks of stand there, in the versions it speaks of."""
        versions = at_once(lambda name: self.store.version(table_name(name, slug)), mark.tables)
        found = [None if version is None else short(version) for version in versions]
        return found == list(mark.tables.values())

    def put_mark(
        self, slug: str, data: bytes, before: Version | None, inputs: str, tables: Mapping[str, Version]
    ) -> None:
        """Write a session's mark, of tables that were written just now; the version ``before`` is replaced.

        Where others wrote it meanwhile, theirs is replaced: the tables that stand there now are ours, or, if they are
        not, the mark does not hold. Raises StoreConflictError where that goes on.
        """
        notes = {"inputs": inputs, "tables": json.dumps({name: short(tables[name]) for name in sorted(tables)})}
        for _ in range(_TRIES):
            try:
                self.store.put_over(_mark_name(slug), data, before, notes)
                return
            except StoreConflictError:
                before = self.store.version(_mark_name(slug))
        raise StoreConflictError(f"{self.place}: other programs keep writing session {slug}; run again when they ended")

    def finished(self) -> set[str]:
        """Slugs of the sessions that have a result."""
        return {PurePosixPath(file.name).stem for file in self.store.list(RESULTS) if file.name.endswith(".json")}

    def own(self) -> OwnFiles:
        """The record of the files that are ours; raises OutputError if it is damaged."""
        return _own(self.store)[0] or OwnFiles()

    def discard(self, name: str) -> None:
        """Remove a file, named by its path, if it is ours."""
        if self.own().owns(name):
            self.remove(name)

    def drop(self, keep: Callable[[str], bool]) -> list[str]:
        """Remove the files of recorded sessions that are not to be kept; return the slugs of those that had a result.

        Other files stay, whatever they are called.
        """
        own = self.own()
        gone = {slug for slug in recorded_sessions(own) if not keep(slug)}
        if not gone:
            return []
        had_result = sorted(gone & self.finished())
        there = {file.name for file in self.store.list()}
        files = {file for slug in gone for file in (*session_files(slug), f"{LOGS}/{slug}.jsonl")}
        self.store.delete(sorted(file for file in files & there if own.owns(file)))
        _record(self.store, lambda before: without_sessions(before, gone))
        return had_result


def table_name(table: str, slug: str) -> str:
    """Where a session's table stands."""
    return f"{table}/{slug}.parquet"


def short(version: Version) -> str:
    """A version as notes keep it."""
    return version.mark.strip('"')


@contextmanager
def claim_store(
    store: Store,
    run: dict[str, object],
    own: OwnFiles | None = None,
    *,
    replace: bool = False,
    keep_summary: bool = False,
) -> Iterator[OutputStore]:
    """Open an output folder in a store for one run: new, empty or written by ``process``; raises OutputError otherwise.

    ``own`` names the files that the run may write besides those that every run writes; they are recorded as ours.
    Several programs may run at once as long as their ``run`` is the same. Raises StoreError where the store cannot be
    written or has no conditional writes, OutputError where a run of other settings took the folder meanwhile. With
    ``keep_summary`` the summary of an earlier run stays if that run's record was the same.
    """
    store.refuse_without_conditional_writes()
    folder = OutputStore(store)
    before = _run_of_ours(store) or _emptied(store, replace)
    stale = [name for name in _OF_RUN if folder.own().owns(name)]
    mine = (own or OwnFiles()).with_those_of(OwnFiles.of([RUN_FILE, LOG_FILE]))
    _record(store, mine.with_those_of)
    content = (json.dumps({"program": PROGRAM} | run, indent=2, sort_keys=True) + "\n").encode()
    taken = OutputError(
        f"{store.address}: a run of other settings is writing there; wait for it or choose another --out"
    )
    is_recorded = before is not None and before.data == content
    if not is_recorded:
        try:
            store.put_over(RUN_FILE, content, None if before is None else before.version)
        except StoreConflictError:
            if _content(store) != content:
                raise taken from None
    if not (keep_summary and is_recorded):
        store.delete(stale)
    with scratch_folder() as scratch:
        log = scratch / LOG_FILE
        try:
            with logged_to(scratch):
                yield folder
        finally:
            if log.exists():
                store.put(LOG_FILE, log)
    if _content(store) != content:
        raise taken


def _content(store: Store) -> bytes | None:
    found = store.get(RUN_FILE)
    return None if found is None else found.data


def _program(data: bytes) -> str | None:
    try:
        return str(json.loads(data)["program"])
    except (ValueError, KeyError, TypeError):
        return None


def _run_of_ours(store: Store) -> Stored | None:
    """The run that wrote this folder; raises OutputError for one without a record of its files."""
    found = store.get(RUN_FILE)
    if found is None or _program(found.data) != PROGRAM:
        return None
    if _own(store)[0] is None:
        raise without_record(store.address)
    return found


def _emptied(store: Store, replace: bool) -> Stored | None:
    """Refuse a folder that `process` did not write, or remove what its record names; return a run that began since."""
    files = [file.name for file in store.list() if not file.name.startswith(PROBE)]  # others may just begin, too
    if not {*files} - {OWN_FILES}:
        return None
    if (begun := _run_of_ours(store)) is not None:
        return begun
    own, _ = _own(store)
    if RUN_FILE not in files and own is not None:  # it was killed before it wrote, or after it removed, all else
        return None
    if own is None or not replace or any(name.startswith("floor_") for name in files):
        raise OutputError(
            f"{store.address}: is not empty and was not made by `{PROGRAM} process` (it holds {files[0]}); "
            "choose an empty or new folder for --out"
        )
    owned = [name for name in files if own.owns(name)]
    store.delete(name for name in owned if name not in (OWN_FILES, RUN_FILE))
    store.delete([RUN_FILE])
    _record(store, lambda _: OwnFiles())
    return None


def _own(store: Store) -> tuple[OwnFiles | None, Version | None]:
    """The record of the files that are ours, and the version that is there."""
    found = store.get(OWN_FILES)
    if found is None:
        return None, None
    return OwnFiles.parsed(found.data, f"{store.address}/{OWN_FILES}"), found.version


def _record(store: Store, change: Callable[[OwnFiles], OwnFiles]) -> None:
    """Change the record of the files that are ours, which others may change at the same time."""
    for _ in range(_TRIES):
        before, version = _own(store)
        after = change(before or OwnFiles())
        if after == before:
            return
        try:
            store.put_over(OWN_FILES, after.text().encode(), version)
            return
        except StoreConflictError:
            continue
    raise StoreConflictError(f"{store.address}/{OWN_FILES}: other programs keep writing it; run again when they ended")


def _mark_name(slug: str) -> str:
    return f"{RESULTS}/{slug}.json"
