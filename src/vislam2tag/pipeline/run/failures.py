"""Unexpected errors: reported in one line and logged with traceback in ``OUT/log.txt`` if OUT is a folder.

Logs of workers are returned with their outcomes and logged again by the main process, in the order of the sessions.
"""

from __future__ import annotations

import io
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from logging.handlers import QueueHandler
from queue import SimpleQueue
from typing import TypeVar

from vislam2tag.common.errors import OutputError, SessionError, Vislam2tagError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.plugins import foreign_failure
from vislam2tag.common.visible_text import VisibleFormatter

LOG_FILE = "log.txt"
LOG = logging.getLogger("vislam2tag")
LOG.addHandler(logging.NullHandler())  # otherwise Python prints warnings to stderr

_Outcome = TypeVar("_Outcome")


def unexpected(what: object, error: Exception) -> str:
    """Log an exception that only ends the work on ``what``, and return a line about it."""
    name = type(error).__name__
    LOG.error("%s: unexpected %s", what, name, exc_info=error)
    where = f"OUT/{LOG_FILE}, or run `vislam2tag -v COMMAND`"
    return f"{what}: unexpected {name}: {error}; please report this with its traceback ({where})"


def reason(what: object, error: Exception) -> str:
    """Describe why the work on one session, ``what``, failed, so that the batch continues.

    OutputError is raised again, because an output that cannot be written ends the batch.
    """
    if isinstance(error, OutputError):
        raise error
    if isinstance(error, SessionError):
        return str(error)
    return foreign_failure(error) or unexpected(what, error)


def done_or_failed(what: object, work: Callable[[], _Outcome], failed: Callable[[str], _Outcome]) -> _Outcome:
    """Do the work on one session; if that fails, return ``failed`` of the :func:`reason`."""
    try:
        return work()
    except Exception as error:  # an error of the session, of this program or of a library
        return failed(reason(what, error))


class _FolderLog(logging.FileHandler):
    """Logs to a file of a folder, which is created on the first message."""

    def __init__(self, folder: Folder) -> None:
        self._folder = folder
        super().__init__(folder / LOG_FILE, encoding="utf-8", delay=True)

    def _open(self) -> io.TextIOWrapper:
        return io.TextIOWrapper(io.BufferedWriter(self._folder.appending(LOG_FILE)), encoding="utf-8")


@contextmanager
def logged_to(folder: Folder) -> Iterator[None]:
    """Log to a file, which is created on the first message. An unexpected exception is logged and names the file."""
    handler = _FolderLog(folder)
    handler.setFormatter(VisibleFormatter("%(levelname)s %(message)s"))
    LOG.addHandler(handler)
    try:
        yield
    except Vislam2tagError:
        raise
    except Exception as error:
        LOG.critical("ended by an unexpected %s", type(error).__name__, exc_info=error)
        error.add_note(f"{_KEPT}{folder / LOG_FILE}")
        raise
    finally:
        LOG.removeHandler(handler)
        handler.close()


_KEPT = "its traceback is kept in "


def log_of(error: BaseException) -> str | None:
    """The file in which :func:`logged_to` logged an exception; None if it did not."""
    notes = (note.removeprefix(_KEPT) for note in getattr(error, "__notes__", ()) if note.startswith(_KEPT))
    return next(notes, None)


def recorded(work: Callable[[], _Outcome]) -> tuple[_Outcome, list[logging.LogRecord]]:
    """Do the work; return its outcome and its log records, which are not logged yet."""
    records: SimpleQueue[logging.LogRecord] = SimpleQueue()
    handlers, propagate = LOG.handlers, LOG.propagate
    LOG.handlers, LOG.propagate = [QueueHandler(records)], False
    try:
        outcome = work()
    finally:
        LOG.handlers, LOG.propagate = handlers, propagate
    return outcome, [records.get() for _ in range(records.qsize())]


@dataclass
class LogInOrder:
    """Logs the returned records in the order of the jobs."""

    _waiting: dict[int, list[logging.LogRecord]] = field(default_factory=dict)
    _next: int = 0

    def add(self, number: int, records: list[logging.LogRecord]) -> None:
        """Take the records of job ``number``, and log those whose turn it is."""
        self._waiting[number] = records
        while self._next in self._waiting:
            log_again(self._waiting.pop(self._next))
            self._next += 1

    def close(self) -> None:
        """Log the remaining records of jobs after one that never ended."""
        for _, records in sorted(self._waiting.items()):
            log_again(records)
        self._waiting.clear()


def log_again(records: list[logging.LogRecord]) -> None:
    """Log what :func:`recorded` returned."""
    for record in records:
        LOG.handle(record)
