"""The output folder: claimed by one run at a time, every file written whole or not at all."""

from __future__ import annotations

import json
import os
import platform
import re
import shutil
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import polars as pl
from pydantic import ValidationError

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.lock import only_one
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.dataset.folder import MANIFEST, refuse_unless_replaced, written_by
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

PARTIAL, LOCK = ".partial", ".lock"


@dataclass(frozen=True)
class OutputFolder:
    """Paths and whole-file writes of one output folder; cheap to pass to worker processes."""

    root: Path

    @property
    def place(self) -> str:
        """Its path, for messages."""
        return str(self.root)

    def write(self, relative: str, fill: Callable[[Path], None]) -> None:
        """Let ``fill`` write a temporary file, then move it to ``relative``.

        Raises OutputError, and leaves no half file, where either cannot be done.
        """
        target = self.root / relative
        # Where several machines share the folder, two may be at one session: each has a file of its own.
        partial = self.root / PARTIAL / f"{platform.node()}.{os.getpid()}.{relative.replace('/', '.')}"
        try:
            target.parent.mkdir(exist_ok=True)
            fill(partial)
            os.replace(partial, target)  # noqa: PTH105 - Path.replace would hide that this must be atomic
        except (OSError, pl.exceptions.PolarsError, OutputError) as error:
            partial.unlink(missing_ok=True)
            raise OutputError(
                f"{target}: cannot be written ({_cause(error)}); free space or choose another --out, then run the same "
                "command again: what is done is kept"
            ) from error

    def write_text(self, relative: str, text: str) -> None:
        """Write a UTF-8 text file whole."""
        self.write(relative, lambda path: _write_bytes(path, text.encode()))

    def remove(self, relative: str) -> None:
        """Remove a file; none there is no fault."""
        self._remove(self.root / relative)

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
        self._remove(self.root / RESULTS / f"{slug}.json")
        for name, path in self.tables(slug).items():
            if name not in SCHEMAS.keys() - OPTIONAL:
                self._remove(path)

    def tables(self, slug: str) -> dict[str, Path]:
        """Files of a session's tables by name, sorted."""
        found = (folder / f"{slug}.parquet" for folder in sorted(self.root.iterdir()))
        return {path.parent.name: path for path in found if path.is_file()}

    def keep_only(self, slugs: set[str]) -> int:
        """Remove what earlier runs left of sessions that this run does not cover; return how many there were."""
        results = list(self.root.glob(f"{RESULTS}/*.json"))
        for path in [*results, *self.root.glob("*/floor_*.parquet")]:
            if path.stem not in slugs:
                self._remove(path)
        return len({path.stem for path in results} - slugs)

    def _remove(self, path: Path) -> None:
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise OutputError(
                f"{path}: cannot be removed ({error.strerror}); check its permissions or choose another --out"
            ) from error


@contextmanager
def claim(
    root: Path,
    run: dict[str, object],
    program: str = PROGRAM,
    *,
    replace: bool | None = None,
    keep_summary: bool = False,
) -> Iterator[OutputFolder]:
    """Open an output folder for one run: new, empty or of the same ``program``; raises OutputError otherwise.

    With ``replace`` what another command of ours wrote is removed first, the whole folder; None: it is never replaced.
    With ``keep_summary`` the summary of an earlier run stays if that run's record was the same.
    """
    folder = OutputFolder(root)
    try:
        root.mkdir(parents=True, exist_ok=True)
        _refuse_foreign(root, program, replace)
    except OSError as error:
        reason = "a file, not a folder" if root.is_file() else error.strerror
        raise OutputError(f"{root}: cannot be the output folder ({reason}); choose another --out") from error
    with only_one(root / LOCK, f"{root}: another run is writing there; wait for it or choose another --out"):
        if _refuse_foreign(root, program, replace):
            _empty(root)
        try:
            _prepare(folder, {"program": program} | run, keep_summary)
            with logged_to(root / LOG_FILE):
                yield folder
        finally:
            shutil.rmtree(root / PARTIAL, ignore_errors=True)


def _refuse_foreign(root: Path, program: str, replace: bool | None) -> bool:
    """Refuse a non-empty folder that none of our commands wrote; tell whether another command did."""
    if {path.name for path in root.iterdir()} <= {PARTIAL, LOCK}:
        return False
    maker = written_by(root)
    if maker is None:
        raise OutputError(
            f"{root}: is not empty and was not made by {program} (it holds no {RUN_FILE} of it); "
            "choose an empty or new folder for --out"
        )
    if maker == (f"{PROGRAM} process" if program == PROGRAM else program):
        return False
    if replace is None:
        raise OutputError(f"{root}: holds what `{maker}` wrote; other commands never replace it: choose another --out")
    refuse_unless_replaced(root, maker, replace)
    return True


def _empty(root: Path) -> None:
    """Remove all but the lock; the record last, so that what a killed command left is still known to be ours."""
    for path in sorted(root.iterdir(), key=lambda path: path.name in (RUN_FILE, MANIFEST)):
        if path.name == LOCK:
            continue
        try:
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                path.unlink()
        except OSError as error:
            raise OutputError(f"{path}: cannot be removed ({error.strerror}); choose another --out") from error


def _prepare(folder: OutputFolder, run: dict[str, object], keep_summary: bool) -> None:
    content = json.dumps(run, indent=2, sort_keys=True) + "\n"
    try:
        shutil.rmtree(folder.root / PARTIAL, ignore_errors=True)
        (folder.root / PARTIAL).mkdir()
        if not (keep_summary and _is_recorded(folder.root, content)):
            for name in (SUMMARY_FILE, "report.html", CONFLICTS_PAGE, CONFLICTS_FILE, LOG_FILE):
                (folder.root / name).unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{folder.root}: cannot be written ({error.strerror}); choose another --out") from error
    folder.write_text(RUN_FILE, content)


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


def _write_bytes(path: Path, data: bytes) -> None:
    path.write_bytes(data)
