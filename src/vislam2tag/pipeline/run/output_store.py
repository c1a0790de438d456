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
from tempfile import TemporaryDirectory

from vislam2tag.common.errors import OutputError, StoreConflictError
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

REPORT_FILE = "report.html"
LOGS = "logs"
"""A file of JSON lines for each session: how, where and when it was processed."""
_TRIES = 5
"""For a mark that others write at the same time."""


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
        with TemporaryDirectory(prefix="vislam2tag-") as scratch:
            path = Path(scratch) / PurePosixPath(relative).name
            fill(path)
            self.store.put(relative, path)

    def write_text(self, relative: str, text: str) -> None:
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

    def keep_only(self, slugs: set[str]) -> int:
        """Remove what earlier runs left of sessions that this run does not cover; return how many there were."""
        kept = {None, *slugs}
        gone = [file.name for file in self.store.list() if _slug_of(file.name) not in kept]
        self.store.delete(gone)
        return sum(name.startswith(f"{RESULTS}/") for name in gone)


def table_name(table: str, slug: str) -> str:
    """Where a session's table stands."""
    return f"{table}/{slug}.parquet"


def short(version: Version) -> str:
    """A version as notes keep it."""
    return version.mark.strip('"')


@contextmanager
def claim_store(
    store: Store, run: dict[str, object], *, replace: bool = False, keep_summary: bool = False
) -> Iterator[OutputStore]:
    """Open an output folder in a store for one run: new, empty or written by ``process``; raises OutputError otherwise.

    Several programs may run at once as long as their ``run`` is the same. Raises StoreError where the store cannot be
    written or has no conditional writes, OutputError where a run of other settings took the folder meanwhile. With
    ``keep_summary`` the summary of an earlier run stays if that run's record was the same.
    """
    store.refuse_without_conditional_writes()
    folder = OutputStore(store)
    before = _run_of_ours(store) or _emptied(store, replace)
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
        store.delete([SUMMARY_FILE, REPORT_FILE, CONFLICTS_PAGE, CONFLICTS_FILE, LOG_FILE])
    with TemporaryDirectory(prefix="vislam2tag-") as scratch:
        log = Path(scratch) / LOG_FILE
        try:
            with logged_to(log):
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
    found = store.get(RUN_FILE)
    return found if found is not None and _program(found.data) == PROGRAM else None


def _emptied(store: Store, replace: bool) -> Stored | None:
    """Refuse a folder that holds what ``process`` did not write, or remove it; return the run that began meanwhile."""
    files = [file.name for file in store.list() if not file.name.startswith(PROBE)]  # others may just begin, too
    if not files:
        return None
    if (begun := _run_of_ours(store)) is not None:
        return begun
    if not replace or any(name.startswith("floor_") for name in files):
        raise OutputError(
            f"{store.address}: is not empty and was not made by `{PROGRAM} process` (it holds {files[0]}); "
            "choose an empty or new folder for --out"
        )
    store.delete(files)
    return None


def _slug_of(name: str) -> str | None:
    """The session that a file of an output folder is of; None where it is of none."""
    path = PurePosixPath(name)
    if len(path.parts) != 2:
        return None
    table = path.suffix == ".parquet" and path.name.startswith("floor_")
    return path.stem if table or path.parent.name in (RESULTS, LOGS) else None


def _mark_name(slug: str) -> str:
    return f"{RESULTS}/{slug}.json"
