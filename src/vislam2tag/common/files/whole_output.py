"""Files and folders that appear whole or not at all.

A folder is filled in a hidden work folder beside its place, then exchanged with it. ``.NAME.vislam2tag`` beside
``NAME`` is the work folder, and contains

- ``lock``: who holds it may write; the next command on ``NAME`` is refused as long,
- ``new``: what is being written,
- ``old``: what was at ``NAME``, while ``new`` is renamed to it: only if the system cannot exchange two folders at
  once. A command killed meanwhile leaves nothing at ``NAME``; :func:`restore` moves ``old`` back.

The next command on ``NAME`` removes what a killed one left there. In the folder, ``.vislam2tag-files`` lists the files
that the command wrote. When it is written again these are replaced; all others are the user's and are kept.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

import polars as pl

from vislam2tag.common.errors import OutputError, first_line
from vislam2tag.common.files.atomic import only_one
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.own_files import OWN_FILES, OwnFiles, without_record


def write_file(target: Path, content: bytes | str) -> None:
    """Write a file, text as UTF-8; raises OutputError if it cannot be written."""
    with file_to_write(target) as file:
        file.write(content.encode() if isinstance(content, str) else content)


@contextmanager
def file_to_write(target: Path) -> Iterator[BinaryIO]:
    """Yield an open file, which becomes ``target`` when the block ends without an exception.

    Links on the way to it, and the file itself if it is one, are followed. Raises OutputError if it cannot be written.
    """
    real = target.resolve()
    with output_errors(target):
        if not real.parent.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, f"{target.parent} is not a folder")
        with Folder(real.parent).writing(real.name) as file:
            yield file


@contextmanager
def output_errors(target: Path) -> Iterator[None]:
    """Raise OutputError, which names ``target``, for what the system refuses in the block."""
    try:
        yield
    except OSError as error:
        raise OutputError(
            f"{target}: cannot be written ({error.strerror}); free space or choose another place"
        ) from error


_LOCK, _NEW, _OLD, _REPLACED = "lock", "new", "old", "replaced"


@contextmanager
def whole_folder(target: Path, replaceable: Callable[[Path], bool], option: str = "--out") -> Iterator[Folder]:
    """Yield an empty folder that becomes ``target``, named by an ``option``, when the block ends without an exception.

    What was at ``target`` stays until then; it must not exist, be empty, or be ``replaceable`` (made by the same
    command). Files in it that the command did not write are kept. Raises OutputError otherwise, if another command
    writes there, and if nothing can be written.
    """
    with exclusive_writer(target, option) as work:
        _refuse_foreign(target, replaceable, option)
        try:
            new = work.folder(_NEW).make_new()
            yield new
            _refuse_foreign(target, replaceable, option)  # another command may have put its own there meanwhile
            new.write(OWN_FILES, OwnFiles.of(files_below(new.path)).text())
            _put_in_place(work, target)
        except (OSError, pl.exceptions.PolarsError) as error:
            cause = (error.strerror if isinstance(error, OSError) else None) or first_line(error)
            advice = f"free space or choose another {option}"
            if isinstance(error, pl.exceptions.PolarsError):
                advice += ", or check whether its input is damaged"
            raise OutputError(f"{target}: cannot be written ({cause}); {advice}") from error


def restore(target: Path) -> None:
    """Move back what was at ``target`` if the command that replaced it was killed before anything else did.

    Raises OutputError if that cannot be done, or another command is at it.
    """
    if not target.exists() and (work_folder_of(target) / _OLD).exists():
        with exclusive_writer(target):
            pass


def work_folder_of(target: Path) -> Path:
    """The work folder of a target; it is there while a command writes, or if one was killed."""
    place = target.resolve()
    return place.with_name(f".{place.name}.vislam2tag")


@contextmanager
def exclusive_writer(target: Path, option: str = "--out") -> Iterator[Folder]:
    """Hold the work folder of ``target``, tidied before and after, and remove it in the end.

    Raises OutputError if another command writes there, and if the parent of ``target`` cannot be written.
    """
    path = work_folder_of(target)
    work = Folder(path.parent).folder(path.name)
    try:
        work.make()
    except OSError as error:
        raise OutputError(f"{target}: cannot be created ({error.strerror}); choose another {option}") from error
    refusal = f"{target}: another command is writing there; wait for it or choose another {option}"
    try:
        with only_one(work, _LOCK, refusal):
            _tidy(work, target.resolve())
            try:
                yield work
            finally:
                _tidy(work, target.resolve())
    finally:
        work.remove_if_empty()


def files_below(folder: Path) -> Iterator[str]:
    """Yield the files below a folder, and links whatever they lead to, by their paths in it, sorted in each folder."""
    for parent, folders, files in os.walk(folder):
        links = [name for name in folders if (Path(parent) / name).is_symlink()]
        folders.sort()
        yield from ((Path(parent) / name).relative_to(folder).as_posix() for name in sorted([*files, *links]))


def _tidy(work: Folder, place: Path) -> None:
    """Restore ``old`` if nothing has its place, and remove what else a command left."""
    _clear(work, (_NEW, _REPLACED))
    try:
        if _OLD in work.names():  # renamed before it is removed: half of it must never be restored
            if place.exists():
                work.move(_OLD, work, _REPLACED)
            else:
                work.move(_OLD, Folder(place.parent), place.name)
    except OSError as error:
        old = work / _OLD
        raise OutputError(
            f"{place}: cannot be restored ({error.strerror}); its files are in {old}: move them back"
        ) from error
    _clear(work, (_REPLACED,))


def _clear(work: Folder, names: tuple[str, ...]) -> None:
    for name in names:
        with suppress(OSError):
            work.remove_tree(name)


def _refuse_foreign(target: Path, replaceable: Callable[[Path], bool], option: str) -> None:
    if target.is_file():
        raise OutputError(f"{target}: is a file, not a folder; choose another {option}")
    if not target.is_dir():
        return
    if target.resolve() in (Path.cwd(), *Path.cwd().parents):
        raise OutputError(f"{target}: is the current folder, which cannot be replaced; choose another {option}")
    if any(target.iterdir()):
        if not replaceable(target):
            raise OutputError(
                f"{target}: is not empty and was not made by this command; choose an empty or new folder for {option}"
            )
        if OwnFiles.read(target) is None:
            raise without_record(str(target))


def _put_in_place(work: Folder, target: Path) -> None:
    """Let the new folder take its place; what was there ends at ``new`` or at ``old``."""
    place = target.resolve()
    around = Folder(place.parent)
    if not place.exists():
        work.move(_NEW, around, place.name)
        return
    own = OwnFiles.read(place) or OwnFiles()
    _keep_others(place, own, work.folder(_NEW), target)
    if work.exchange(_NEW, around, place.name):
        _keep_others(work / _NEW, own, around.folder(place.name), target)  # what came while they were exchanged
        return
    around.move(place.name, work, _OLD)
    work.move(_NEW, around, place.name)
    _keep_others(work / _OLD, own, around.folder(place.name), target)


def _keep_others(old: Path, own: OwnFiles, new: Folder, target: Path) -> None:
    """Give files of the old folder that the command did not write a second name in the new one."""
    for name in files_below(old):
        if own.owns(name):
            continue
        try:
            new.link(old / name, name)
        except FileExistsError:
            there = (new / name).lstat()
            if (there.st_dev, there.st_ino) != ((old / name).lstat().st_dev, (old / name).lstat().st_ino):
                raise OutputError(
                    f"{target / name}: was not written by this command, which needs to write a file of this name; "
                    "move yours elsewhere and run the command again"
                ) from None
