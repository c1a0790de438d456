"""A folder that appears whole or not at all: filled in a hidden work folder beside its place, then exchanged with it.

``.NAME.vislam2tag`` beside ``NAME`` is the work folder, and holds

- ``lock``: who holds it may write; the next command on ``NAME`` is refused as long,
- ``new``: what is being written,
- ``old``: what stood at ``NAME``, while ``new`` is renamed to it: only where the system cannot exchange two folders at
  once. Whoever is killed meanwhile leaves nothing at ``NAME``; :func:`restore` moves ``old`` back.

What a killed command left there is removed by the next one.
"""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import polars as pl

from vislam2tag.common.errors import OutputError, first_line
from vislam2tag.common.files.lock import only_one

_EXCHANGES = {"linux": "renameat2", "darwin": "renameatx_np"}
"""By platform: the function of the C library that can exchange two names at once."""
_EXCHANGE = 2
"""The flag that asks for it (``RENAME_EXCHANGE``, ``RENAME_SWAP``)."""
_CANNOT_EXCHANGE = {errno.ENOSYS, errno.EINVAL, errno.ENOTSUP}
"""What systems and file systems answer that cannot."""


@contextmanager
def whole_folder(target: Path, replaceable: Callable[[Path], bool], option: str = "--out") -> Iterator[Path]:
    """Yield an empty folder that becomes ``target``, named by an ``option``, when the block ends without an exception.

    What was at ``target`` stays until then; it must not exist, be empty, or be ``replaceable`` (made by the same
    command). What is written beside the yielded folder goes when the block ends. Raises OutputError otherwise, where
    another command writes there, and where nothing can be written.
    """
    with exclusive_writer(target, option) as work:
        _refuse_foreign(target, replaceable, option)
        try:
            new = work / "new"
            new.mkdir()
            yield new
            _refuse_foreign(target, replaceable, option)  # another command may have put its own there meanwhile
            _put_in_place(new, target.resolve(), work / "old")
        except (OSError, pl.exceptions.PolarsError) as error:
            cause = (error.strerror if isinstance(error, OSError) else None) or first_line(error)
            advice = f"free space or choose another {option}"
            if isinstance(error, pl.exceptions.PolarsError):
                advice += ", or look whether what it is made of is damaged"
            raise OutputError(f"{target}: cannot be written ({cause}); {advice}") from error


def restore(target: Path) -> None:
    """Move back what stood at ``target`` if the command that replaced it was killed before anything else did.

    Raises OutputError where that cannot be done, or another command is at it.
    """
    if not target.exists() and (work_folder_of(target) / "old").exists():
        with exclusive_writer(target):
            pass


def work_folder_of(target: Path) -> Path:
    """The work folder of a target; it is there while a command writes, or where one was killed."""
    place = target.resolve()
    return place.with_name(f".{place.name}.vislam2tag")


@contextmanager
def exclusive_writer(target: Path, option: str = "--out") -> Iterator[Path]:
    """Hold the work folder of ``target``, tidied before and after, and remove it in the end.

    Raises OutputError where another command writes there, and where the parent of ``target`` cannot be written.
    """
    work = work_folder_of(target)
    try:
        work.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{target}: cannot be made ({error.strerror}); choose another {option}") from error
    refusal = f"{target}: another command is writing there; wait for it or choose another {option}"
    try:
        with only_one(work / "lock", refusal):
            _tidy(work, target.resolve())
            try:
                yield work
            finally:
                _tidy(work, target.resolve())
    finally:
        with suppress(OSError):
            work.rmdir()


def _tidy(work: Path, place: Path) -> None:
    """Restore ``old`` where nothing has its place, and remove all but the lock."""
    _clear(work, {"lock", "old"})
    old = work / "old"
    try:
        if old.exists():  # renamed before it is removed: half of it must never be restored
            old.rename(work / "replaced" if place.exists() else place)
    except OSError as error:
        raise OutputError(f"{place}: cannot be restored ({error.strerror}); it lies in {old}, move it back") from error
    _clear(work, {"lock"})


def _clear(work: Path, kept: set[str]) -> None:
    for path in work.iterdir():
        if path.name not in kept:
            shutil.rmtree(path, ignore_errors=True)


def _refuse_foreign(target: Path, replaceable: Callable[[Path], bool], option: str) -> None:
    if target.is_file():
        raise OutputError(f"{target}: is a file, not a folder; choose another {option}")
    if target.exists() and target.resolve() in (Path.cwd(), *Path.cwd().parents):
        raise OutputError(f"{target}: is the folder you are in, which cannot be replaced; choose another {option}")
    if target.is_dir() and any(target.iterdir()) and not replaceable(target):
        raise OutputError(
            f"{target}: is not empty and was not made by this command; choose an empty or new folder for {option}"
        )


def _put_in_place(new: Path, place: Path, old: Path) -> None:
    """Let the new folder take its place; what was there ends at ``new`` or at ``old``."""
    if not place.exists():
        new.rename(place)
    elif not _exchange(new, place):
        place.rename(old)
        new.rename(place)


def _exchange(one: Path, other: Path) -> bool:
    """Exchange two folders given by absolute paths, at once; False where the system or the file system cannot."""
    if sys.platform not in _EXCHANGES:
        return False
    function = getattr(ctypes.CDLL(None, use_errno=True), _EXCHANGES[sys.platform], None)
    if function is None:
        return False
    if function(0, os.fsencode(one), 0, os.fsencode(other), ctypes.c_uint(_EXCHANGE)) == 0:
        return True
    number = ctypes.get_errno()
    if number in _CANNOT_EXCHANGE:
        return False
    raise OSError(number, os.strerror(number), str(other))
