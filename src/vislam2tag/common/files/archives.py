"""Archives that others gave: what is in them is unpacked within bounds, whatever they say of themselves."""

from __future__ import annotations

import bz2
import errno
import gzip
import io
import lzma
import struct
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Container, Iterator
from dataclasses import dataclass
from functools import cache, partial
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import IO, Any

from vislam2tag.common.errors import DatasetError, first_line
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import plain


class BoundedFile(io.RawIOBase):
    """A file opened for reading that raises ``refusal`` where more than ``most`` bytes are asked for, or come, at once.

    Libraries of archives read directories and headers as large as the archive says, in one of several places.
    """

    def __init__(self, file: IO[bytes], most: int, refusal: Exception) -> None:
        self._file, self.most, self._refusal = file, most, refusal

    def read(self, size: int = -1) -> bytes:
        """As any file's, or raise the refusal."""
        if size > self.most:
            raise self._refusal
        data = bytes(self._file.read(self.most + 1 if size < 0 else size))  # a store's come as a buffer
        if len(data) > self.most:
            raise self._refusal
        return data

    def seek(self, offset: int, whence: int = 0) -> int:
        """As any file's."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """As any file's."""
        return self._file.tell()

    def seekable(self) -> bool:
        """True."""
        return True


_TAR_NAMES = (".tar", ".tar.gz", ".tgz", ".tar.xz", ".tar.bz2")
_DECOMPRESSORS: dict[bytes, Callable[[IO[bytes]], Any]] = {
    b"\x1f\x8b": gzip.open,
    b"\xfd7zXZ": lzma.open,
    b"BZh": bz2.open,
}
"""Of a TAR, by the first bytes of the file."""
MOST_UNPACKED = 20_000_000_000
"""Bytes that an archive may unpack to, where no one says more."""
_MOST_LOOKED_THROUGH = 5_000_000_000
"""Bytes of a packed TAR that are passed to find the names in it: some seconds."""
_MOST_MEMBERS = 200_000
_MOST_AT_ONCE = 32_000_000
"""Bytes of a directory of members, or of one member's header."""
_MOST_DICTIONARY = 500_000_000
"""Bytes of memory that unpacking an .xz may take."""
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2)
_ENCRYPTED = 0x1
_BLOCK = 1 << 20
_OUR_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)
_DAMAGED = (
    *(OSError, EOFError, ValueError, OverflowError, NotImplementedError, struct.error, zlib.error, lzma.LZMAError),
    *(tarfile.TarError, zipfile.BadZipFile),
)
"""What the libraries raise over an archive that is damaged or is."""


def is_archive(path: Path) -> bool:
    """Whether a file is a zip or tar archive, by its name."""
    return path.is_file() and (_is_tar(path) or path.suffix.lower() == ".zip")


def _meant(path: Path) -> Path:
    """The archive in a folder that contains nothing else to look into (but a licence, a readme), else the path."""
    if not path.is_dir():
        return path
    archives = archives_in(path)
    return path / archives[0] if len(archives) == 1 and not any(each.is_dir() for each in path.iterdir()) else path


def archives_in(path: Path) -> list[str]:
    """Return the names of the archives that lie in a folder, in order; none in anything else."""
    return sorted(each.name for each in path.iterdir() if is_archive(each)) if path.is_dir() else []


def names_in(path: Path) -> Iterator[PurePosixPath]:
    """Yield the files below a folder or in an archive, relative to it; the name of a plain file.

    Ends early where an archive is damaged: recognising must not fail.
    """
    path = _meant(path)
    if path.is_dir():
        yield from (PurePosixPath(file.relative_to(path).as_posix()) for file in path.rglob("*") if file.is_file())
    elif is_archive(path):
        yield from _listed(path, path.stat().st_mtime_ns)[0]
    else:
        yield PurePosixPath(path.name)


def check_archive(path: Path) -> None:
    """Raise DatasetError where the path is an archive, or a folder of one, whose files cannot be listed."""
    path = _meant(path)
    if is_archive(path) and (cause := _listed(path, path.stat().st_mtime_ns)[1]):
        raise _cannot_unpack(path, cause)


@cache
def _listed(path: Path, changed_ns: int) -> tuple[tuple[PurePosixPath, ...], str]:
    """List an archive, and what ended it early; kept, as every format looks and a tar is unpacked for it."""
    del changed_ns
    names = []
    size = 0
    try:
        for member in _members(path):
            names.append(member.name)
            size += member.size
            if _is_tar(path) and size > _MOST_LOOKED_THROUGH:
                break
    except _DAMAGED as error:
        return tuple(names), first_line(error)
    return tuple(names), ""


def first_bytes_of_files(path: Path, suffix: str, size: int) -> Iterator[bytes]:
    """Yield the first bytes of each file of a suffix below a folder or in an archive; of a plain file of any suffix.

    Ends early where one cannot be read.
    """
    path = _meant(path)
    try:
        if is_archive(path):
            for member in _members(path):
                if member.name.suffix == suffix:
                    with member.open() as content:
                        yield content.read(size)
            return
        inside = (file for file in path.rglob("*") if file.suffix == suffix and file.is_file())
        files = inside if path.is_dir() else (path,)
        for each in files:
            with plain(each).open("rb") as file:
                yield file.read(size)
    except _DAMAGED:
        return


def zip_names(file: IO[bytes]) -> list[PurePosixPath]:
    """List the files of a zip, but those whose names lead outside.

    Raises DatasetError where it is damaged, encrypted or packed in a way that is not read.
    """
    try:
        return [member.name for member in islice(_of_zip(file), _MOST_MEMBERS) if not _leads_outside(member.name)]
    except _DAMAGED as error:
        raise DatasetError(first_line(error)) from error


def zip_heads(file: IO[bytes], suffixes: Container[str], size: int, most: int) -> dict[PurePosixPath, bytes]:
    """The first bytes of the first files (``most``) of a zip with these suffixes, by name; none of damaged files.

    Raises DatasetError as :func:`zip_names`.
    """
    try:
        members = (each for each in islice(_of_zip(file), _MOST_MEMBERS) if each.name.suffix.lower() in suffixes)
        return {each.name: _head(each, size) for each in islice(members, most) if not _leads_outside(each.name)}
    except _DAMAGED as error:
        raise DatasetError(first_line(error)) from error


def _head(member: _Member, size: int) -> bytes:
    try:
        with member.open() as content:
            return content.read(size)
    except _DAMAGED:
        return b""


def folder_of(
    path: Path, scratch: Folder, most_bytes: int = MOST_UNPACKED, wanted: Container[PurePosixPath] | None = None
) -> Path:
    """Return the folder itself, a file's folder, or where the archive was unpacked to (below ``scratch``).

    Of an archive only the files ``wanted``, by name, are unpacked; None: all. Raises DatasetError where the path is not
    there, the archive is damaged, encrypted or packed in a way that is not read, or where it unpacks to more than
    ``most_bytes``.
    """
    if not path.exists():
        raise DatasetError(f"{path}: no such file or folder")
    path = _meant(path)
    if path.is_dir():
        return path
    return _unpacked(path, scratch, most_bytes, wanted) if is_archive(path) else path.parent


_DEEPEST = 100
"""Folders within folders: thousands could neither be looked through nor removed."""


def _unpacked(path: Path, scratch: Folder, most_bytes: int, wanted: Container[PurePosixPath] | None) -> Path:
    """Unpack the files of an archive that are wanted; links, devices and names that lead outside are left out."""
    target = scratch.folder("unpacked")
    left = most_bytes
    try:
        for member in _members(path):
            if _leads_outside(member.name) or (wanted is not None and member.name not in wanted):
                continue
            if len(member.name.parts) > _DEEPEST:
                raise _cannot_unpack(path, f"it contains a file more than {_DEEPEST} folders deep")
            with member.open() as content, target.writing(member.name.as_posix()) as file:
                while left >= 0 and (block := content.read(_BLOCK)):
                    left -= len(block)
                    file.write(block)
            if left < 0:
                most = f"{most_bytes / 1e9:g} GB"
                raise DatasetError(f"{path}: unpacks to more than {most}; raise --max-unpacked-gb if that is right")
    except _DAMAGED as error:
        if isinstance(error, OSError) and error.errno in _OUR_DISK:
            raise
        raise _cannot_unpack(path, first_line(error)) from error
    return target.make().path


def _leads_outside(name: PurePosixPath) -> bool:
    return name.is_absolute() or ".." in name.parts


def _cannot_unpack(path: Path, cause: str) -> DatasetError:
    return DatasetError(
        f"{path}: cannot be unpacked ({cause}); download it again, or unpack it yourself and pass the folder"
    )


def _is_tar(path: Path) -> bool:
    return path.name.lower().endswith(_TAR_NAMES)


@dataclass(frozen=True)
class _Member:
    """A file in an archive."""

    name: PurePosixPath
    size: int
    """Bytes, as the archive says."""
    open: Callable[[], IO[bytes]]


def _members(path: Path) -> Iterator[_Member]:
    """Yield the files of an archive; raises one of ``_DAMAGED``."""
    with plain(path).open("rb") as file:
        for number, member in enumerate(_of_tar(file) if _is_tar(path) else _of_zip(file)):
            if number >= _MOST_MEMBERS:
                raise ValueError(f"it contains more than {_MOST_MEMBERS:,} files")
            yield member


def _of_tar(file: IO[bytes]) -> Iterator[_Member]:
    with tarfile.open(fileobj=BoundedFile(_decompressed(file), _MOST_AT_ONCE, _too_long()), mode="r:") as archive:
        for member in archive:
            if member.isfile():
                if any("\ud800" <= letter <= "\udfff" for letter in member.name):
                    raise ValueError(f"the name {member.name!a:.80} is not UTF-8")
                yield _Member(PurePosixPath(member.name), member.size, partial(_open_in_tar, archive, member))


def _open_in_tar(archive: tarfile.TarFile, member: tarfile.TarInfo) -> IO[bytes]:
    content = archive.extractfile(member)
    assert content is not None  # it is a file
    return content


def _decompressed(file: IO[bytes]) -> IO[bytes]:
    """The TAR in a file, whichever way it is compressed."""
    head = file.read(_BLOCK)
    file.seek(0)
    known = next((open_it for magic, open_it in _DECOMPRESSORS.items() if head.startswith(magic)), None)
    if known is lzma.open:
        lzma.LZMADecompressor(memlimit=_MOST_DICTIONARY).decompress(head, max_length=1)
    return known(file) if known else file


def _of_zip(file: IO[bytes]) -> Iterator[_Member]:
    with zipfile.ZipFile(BoundedFile(file, _MOST_AT_ONCE, _too_long())) as archive:
        for entry in archive.infolist():
            if not entry.is_dir():
                if entry.flag_bits & _ENCRYPTED:
                    raise ValueError("it is encrypted")
                if entry.compress_type not in _METHODS:
                    raise ValueError(
                        f"it is packed by method {entry.compress_type}; only deflate and bzip2 can be read"
                    )
                yield _Member(PurePosixPath(entry.filename), entry.file_size, partial(archive.open, entry))


def _too_long() -> ValueError:
    return ValueError("its list of files is damaged or too long")
