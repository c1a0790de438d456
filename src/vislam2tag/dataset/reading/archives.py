"""Published data come as a folder, a file or an archive of either: all are looked at as a folder."""

from __future__ import annotations

import lzma
import shutil
import tarfile
import zipfile
import zlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path, PurePosixPath
from typing import IO

from vislam2tag.common.errors import DatasetError, first_line
from vislam2tag.common.plain_files import plain

_TAR_NAMES = (".tar", ".tar.gz", ".tgz", ".tar.xz", ".tar.bz2")
_DAMAGED = (OSError, EOFError, tarfile.TarError, zipfile.BadZipFile, lzma.LZMAError, zlib.error)


def is_archive(path: Path) -> bool:
    """Whether a file is a zip or tar archive, by its name."""
    return path.is_file() and (_is_tar(path) or path.suffix.lower() == ".zip")


def _meant(path: Path) -> Path:
    """The archive in a folder that holds nothing else to look into (but a licence, a readme), else the path."""
    if not path.is_dir():
        return path
    inside = sorted(path.iterdir())
    archives = [each for each in inside if is_archive(each)]
    return archives[0] if len(archives) == 1 and not any(each.is_dir() for each in inside) else path


def names_in(path: Path) -> Iterator[PurePosixPath]:
    """Yield the files below a folder or in an archive, relative to it; the name of a plain file.

    Ends early where an archive is damaged: recognising must not fail.
    """
    path = _meant(path)
    if path.is_dir():
        yield from (PurePosixPath(file.relative_to(path).as_posix()) for file in path.rglob("*") if file.is_file())
    elif is_archive(path):
        yield from _names_in_archive(path, path.stat().st_mtime_ns)
    else:
        yield PurePosixPath(path.name)


@cache
def _names_in_archive(path: Path, changed_ns: int) -> tuple[PurePosixPath, ...]:
    """List an archive; kept, as every format looks at it and a tar must be unpacked for it."""
    del changed_ns
    names = []
    try:
        for name, _ in _members(path):
            names.append(name)
    except _DAMAGED:
        pass
    return tuple(names)


def heads_in(path: Path, suffix: str, size: int) -> Iterator[bytes]:
    """Yield the first bytes of each file of a suffix below a folder or in an archive; of a plain file of any suffix.

    Ends early where one cannot be read.
    """
    path = _meant(path)
    try:
        if is_archive(path):
            yield from (content.read(size) for name, content in _members(path) if content and name.suffix == suffix)
            return
        inside = (file for file in path.rglob("*") if file.suffix == suffix and file.is_file())
        files = inside if path.is_dir() else (path,)
        for each in files:
            with plain(each).open("rb") as file:
                yield file.read(size)
    except _DAMAGED:
        return


def folder_of(path: Path, scratch: Path) -> Path:
    """Return the folder itself, a file's folder, or where the archive was unpacked to (below ``scratch``).

    Raises DatasetError where the path is not there or the archive is damaged.
    """
    if not path.exists():
        raise DatasetError(f"{path}: no such file or folder")
    path = _meant(path)
    if path.is_dir():
        return path
    return _unpacked(path, scratch) if is_archive(path) else path.parent


def _unpacked(path: Path, scratch: Path) -> Path:
    """Unpack the files of an archive; links, devices and names that lead outside are left out."""
    target = scratch / "unpacked"
    try:
        for name, content in _members(path):
            if content is None or name.is_absolute() or ".." in name.parts:
                continue
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            with (target / name).open("wb") as file:
                shutil.copyfileobj(content, file)
    except _DAMAGED as error:
        raise DatasetError(f"{path}: cannot be unpacked ({first_line(error)}); download it again") from error
    target.mkdir(exist_ok=True)
    return target


def _is_tar(path: Path) -> bool:
    return path.name.lower().endswith(_TAR_NAMES)


def _members(path: Path) -> Iterator[tuple[PurePosixPath, IO[bytes] | None]]:
    """Yield each file of an archive with its open content."""
    if _is_tar(path):
        with tarfile.open(path) as archive:
            for member in archive:
                if member.isfile():
                    yield PurePosixPath(member.name), archive.extractfile(member)
        return
    with zipfile.ZipFile(path) as zipped:
        for entry in zipped.infolist():
            if not entry.is_dir():
                with zipped.open(entry) as content:
                    yield PurePosixPath(entry.filename), content
