"""The output folder: claimed by one run at a time, every file written whole or not at all."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterable, Iterator, Set
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import polars as pl
from pydantic import ValidationError

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.folder import UNFINISHED, Folder
from vislam2tag.common.files.lock import only_one
from vislam2tag.common.files.own_files import OWN_FILES, OwnFiles, owned_files, without_record
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.files.whole_folder import files_below
from vislam2tag.datasets.folder import MANIFEST, refuse_unless_replaced, written_by
from vislam2tag.labeling.results import (
    CONFLICTS_FILE,
    CONFLICTS_PAGE,
    PROGRAM,
    RESULTS,
    RUN_FILE,
    SUMMARY_FILE,
    SessionResult,
)
from vislam2tag.labeling.schemas import OPTIONAL, SCHEMAS
from vislam2tag.pipeline.run.failures import LOG_FILE, logged_to

LOCK = ".lock"
SESSION_FOLDERS = (RESULTS, *SCHEMAS)
"""Folders with a file for each session."""


@dataclass(frozen=True)
class OutputFolder:
    """Paths and whole-file writes of one output folder; cheap to pass to worker processes."""

    root: Path

    @property
    def place(self) -> str:
        """Its path, for messages."""
        return str(self.root)

    @property
    def folder(self) -> Folder:
        """It, for writing."""
        return Folder.at(self.root)

    def write(self, relative: str, fill: Callable[[Path], None]) -> None:
        """Let ``fill`` write a temporary file, then move it to ``relative``.

        Raises OutputError, and leaves no half file, where either cannot be done.
        """
        with self._written(relative), self.folder.filling(relative) as path:
            fill(path)

    def put_text(self, relative: str, text: str) -> None:
        """Write a UTF-8 text file whole; raises as :meth:`write`."""
        with self._written(relative):
            self.folder.write(relative, text)

    @contextmanager
    def _written(self, relative: str) -> Iterator[None]:
        try:
            yield
        except (OSError, pl.exceptions.PolarsError, OutputError) as error:
            raise OutputError(
                f"{self.root / relative}: cannot be written ({_cause(error)}); free space or choose another --out, "
                "then run the same command again"
            ) from error

    def remove(self, relative: str) -> None:
        """Remove a file; none there is no fault."""
        try:
            self.folder.remove(relative)
        except OSError as error:
            raise OutputError(
                f"{self.root / relative}: cannot be removed ({error.strerror}); check its permissions or choose "
                "another --out"
            ) from error

    def has(self, relative: str) -> bool:
        """Whether a file is there."""
        return (self.root / relative).is_file()

    def result(self, slug: str) -> SessionResult | None:
        """Read the result (and so the done-mark) of a session; None where there is none that can be read."""
        try:
            return SessionResult.model_validate_json(read_bytes(self.root / RESULTS / f"{slug}.json"))
        except (OSError, ValidationError):
            return None

    def results(self, slugs: Iterable[str]) -> Iterator[SessionResult]:
        """Read the results of sessions, in this order, but for those that are not there or cannot be read."""
        yield from (result for slug in slugs if (result := self.result(slug)) is not None)

    def forget(self, slug: str) -> None:
        """Remove a session's done-mark, so that its tables are not trusted while they are rewritten.

        Tables that not every session has go, too: the session may have none now.
        """
        self.remove(f"{RESULTS}/{slug}.json")
        for relative in (*(f"{name}/{slug}.parquet" for name in OPTIONAL), *self._of_companions(slug)):
            self.remove(relative)

    def _of_companions(self, slug: str) -> list[str]:
        """Tables of a session's companions: of one named B in folders such as ``sensors_B``."""
        folders = (name for name in self.folder.names() if "_" in name and name.partition("_")[0] in SCHEMAS)
        return [relative for name in folders if (self.root / (relative := f"{name}/{slug}.parquet")).is_file()]

    def finished(self) -> set[str]:
        """Slugs of the sessions that have a result."""
        return {path.stem for path in self.root.glob(f"{RESULTS}/*.json")}

    def own(self) -> OwnFiles:
        """The record of the files that are ours; raises OutputError if it is damaged."""
        return OwnFiles.read(self.root) or OwnFiles()

    def add_own(self, *files: str) -> None:
        """Record further files as ours, before they are written; by the process that claimed the folder alone."""
        before = self.own()
        if not all(map(before.owns, files)):
            self.set_own(before.with_those_of(OwnFiles.of(files)))

    def set_own(self, own: OwnFiles) -> None:
        """Write the record of the files that are ours."""
        self.put_text(OWN_FILES, own.text())

    def drop(self, keep: Callable[[str], bool]) -> list[str]:
        """Remove the files of recorded sessions that are not to be kept; return the slugs of those that had a result.

        Other files stay, whatever they are called.
        """
        own = self.own()
        gone = {slug for slug in recorded_sessions(own) if not keep(slug)}
        had_result = sorted(gone & self.finished())
        for slug in sorted(gone):
            for relative in (*session_files(slug), *self._of_companions(slug)):
                if own.owns(relative):
                    self.remove(relative)
        if gone:
            self.set_own(without_sessions(own, gone))
        return had_result

    def discard(self, *names: str, folders: Iterable[str] = ()) -> None:
        """Remove those of these files that are ours, and the files of ours right in these folders."""
        own = self.own()
        inside = (f"{name}/{file}" for name in folders for file in self.folder.folder(name).names())
        for name in (*names, *inside):
            if own.owns(name):
                self.remove(name)


def recorded_sessions(own: OwnFiles) -> set[str]:
    """Slugs of the sessions of which a record names files."""
    paths = map(PurePosixPath, own.files)
    return {*own.stems, *(path.stem for path in paths if path.parent.as_posix() in SESSION_FOLDERS)}


def session_files(slug: str) -> tuple[str, ...]:
    """Relative paths of all files that a session may have in an output folder."""
    return (f"{RESULTS}/{slug}.json", *(f"{name}/{slug}.parquet" for name in SCHEMAS))


def without_sessions(own: OwnFiles, slugs: Set[str]) -> OwnFiles:
    """A record without the files of some sessions."""
    gone = {file for slug in slugs for file in session_files(slug)}
    return OwnFiles.of({*own.files} - gone, own.folders, {*own.stems} - slugs)


@contextmanager
def claim(
    root: Path,
    run: dict[str, object],
    program: str = PROGRAM,
    own: OwnFiles | None = None,
    *,
    replace: bool | None = None,
    keep_summary: bool = False,
) -> Iterator[OutputFolder]:
    """Open an output folder for one run: new, empty or of the same ``program``; raises OutputError otherwise.

    ``own`` names the files that the run may write besides those that every run writes; they are recorded as ours. With
    ``replace`` what another command of ours wrote is removed first, by its own record; None: it is never replaced.
    With ``keep_summary`` the summary of an earlier run stays if that run's record was the same.
    """
    folder = OutputFolder(root)
    try:
        folder.folder.make()
        _refuse_foreign(root, program, replace)
    except OSError as error:
        reason = "a file, not a folder" if root.is_file() else error.strerror
        raise OutputError(f"{root}: cannot be the output folder ({reason}); choose another --out") from error
    with only_one(folder.folder, LOCK, f"{root}: another run is writing there; wait for it or choose another --out"):
        if _refuse_foreign(root, program, replace):
            _empty(folder)
        _prepare(folder, {"program": program} | run, own or OwnFiles(), keep_summary)
        with logged_to(folder.folder):
            yield folder


def _refuse_foreign(root: Path, program: str, replace: bool | None) -> bool:
    """Refuse a non-empty folder that no command of ours wrote, or without a record of its files.

    Return whether another command of ours wrote it.
    """
    there = {path.name for path in root.iterdir() if not UNFINISHED.fullmatch(path.name)}
    if there <= {LOCK, OWN_FILES}:
        return False
    maker = written_by(root)
    if maker is None:
        # A record without a run is of a command that was killed before it wrote, or after it removed, all else.
        if OWN_FILES in there and not there & {RUN_FILE, MANIFEST} and OwnFiles.read(root) is not None:
            return False
        raise OutputError(
            f"{root}: is not empty and was not made by {program} (it holds no {RUN_FILE} of it); "
            "choose an empty or new folder for --out"
        )
    of_another = maker != (f"{PROGRAM} process" if program == PROGRAM else program)
    if of_another and replace is None:
        raise OutputError(f"{root}: holds what `{maker}` wrote; other commands never replace it: choose another --out")
    if of_another:
        refuse_unless_replaced(root, maker, bool(replace))
    if OwnFiles.read(root) is None:
        raise without_record(str(root))
    return of_another


def _empty(output: OutputFolder) -> None:
    """Remove the files that a folder's record names, but for the record; the record of the run goes last."""
    root = output.root
    owned = owned_files(files_below(root), lambda name: OwnFiles.read((root / name).parent))
    for name in sorted(owned - {OWN_FILES}, key=lambda name: (name in (RUN_FILE, MANIFEST), name)):
        output.remove(name)
        for folder in list(PurePosixPath(name).parents)[:-1]:
            output.folder.folder(folder.as_posix()).remove_if_empty()


def _prepare(folder: OutputFolder, run: dict[str, object], own: OwnFiles, keep_summary: bool) -> None:
    """Record what is ours, remove what an earlier run summed up, and write what this one follows from."""
    content = json.dumps(run, indent=2, sort_keys=True) + "\n"
    if not (keep_summary and _is_recorded(folder.root, content)):
        folder.discard(SUMMARY_FILE, "report.html", CONFLICTS_PAGE, CONFLICTS_FILE, LOG_FILE)
    before = folder.own() if (folder.root / RUN_FILE).is_file() else OwnFiles()  # else all that it names is gone
    own = own.with_those_of(OwnFiles.of([RUN_FILE, LOG_FILE])).with_those_of(before)
    if own != before:
        folder.set_own(own)
    folder.put_text(RUN_FILE, content)


def _is_recorded(root: Path, content: str) -> bool:
    """Whether this is the record of the run that wrote a folder."""
    try:
        return read_bytes(root / RUN_FILE) == content.encode()
    except FileNotFoundError:
        return False


def _cause(error: Exception) -> str:
    """Say in the system's words why a file could not be written, whichever library met it."""
    first = error.__cause__ or error
    number = re.search(r"\(os error (\d+)\)", str(first))
    if number:
        return os.strerror(int(number.group(1)))
    return (first.strerror if isinstance(first, OSError) else None) or str(first)
