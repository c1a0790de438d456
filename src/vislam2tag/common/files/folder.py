"""A folder of this machine: the one module through which files are written, renamed and deleted.

Folders may come from others, with links planted in them. The path that the user gives may lead through links and is
resolved once. Below it, nothing is written, renamed or deleted through a link. Each step of the path is opened as a
directory, relative to the one before (POSIX *openat* with ``O_NOFOLLOW``). A file gets a random name, made exclusively,
until it is whole; :data:`UNFINISHED` matches these names. What a killed program left under such a name is removed by
the next one that writes to the same folder: its lock is free then.

Libraries that want a path get one in a private folder (:meth:`Folder.filling`, :func:`scratch_folder`).
"""

from __future__ import annotations

import errno
import io
import os
import re
import secrets
import shutil
import stat
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import BinaryIO

from vislam2tag.common.files.atomic import exchange
from vislam2tag.common.files.given_files import plain

try:
    import fcntl
except ImportError:  # on Windows
    fcntl = None  # type: ignore[assignment]

_HAS_HANDLES = os.open in os.supports_dir_fd
"""Whether the system opens files relative to a directory; on Windows each step of a path is looked at instead."""
_DIRECTORY = os.O_RDONLY | getattr(os, "O_DIRECTORY", 0) | getattr(os, "O_NOFOLLOW", 0)
_READ = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
_NEW = os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
_MORE = os.O_CREAT | os.O_APPEND | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
UNFINISHED = re.compile(r"\.vislam2tag-[0-9a-f]{16}\.part")
"""Names of files and folders that are not whole yet."""
_AT_ONCE = 1 << 20
_swept: set[tuple[Path, int, int]] = set()
"""Directories that this process has looked through for what killed programs left, by path, device and inode.

The path is there because file systems give the inode of a deleted directory to a new one.
"""


@dataclass(frozen=True)
class Folder:
    """A folder, which need not exist yet. All names are relative to it, with ``/`` between their parts.

    Every method raises OSError if the system refuses, or if a link is in the way. Cheap to pass to other processes.
    """

    root: Path
    """Absolute, without links: see :meth:`at`."""
    below: PurePosixPath = field(default_factory=PurePosixPath)
    """Which folder below ``root`` it is."""

    @classmethod
    def at(cls, path: Path) -> Folder:
        """The folder at a path that the user gave; links on the way to it are followed here, and only here."""
        return cls(path.resolve())

    @property
    def path(self) -> Path:
        """Where it is, for reading and for messages."""
        return self.root / self.below

    def __truediv__(self, name: str) -> Path:
        """Path of an entry, for reading."""
        return self.path / name

    def folder(self, name: str) -> Folder:
        """A folder below this one."""
        return Folder(self.root, self.below.joinpath(*_parts(name)))

    def make(self) -> Folder:
        """Make the folder and those above it, as far as they are not there, and return it."""
        with self._opened((), make=True):
            return self

    def make_new(self) -> Folder:
        """Make the folder and those above it, and return it; FileExistsError if it is there."""
        outer, name = self._place_of_itself()
        with outer._opened((), make=True) as at:
            os.mkdir(at.spelled(name), dir_fd=at.handle)
        return self

    def names(self) -> list[str]:
        """Names of all entries, sorted; none if the folder is not there."""
        try:
            with self._opened(()) as at:
                return sorted(at.names())
        except FileNotFoundError:
            return []

    def write(self, name: str, content: bytes | str) -> None:
        """Write a file whole or not at all; text becomes UTF-8, its lines end as they are."""
        with self.writing(name) as file:
            file.write(content.encode() if isinstance(content, str) else content)

    @contextmanager
    def writing(self, name: str) -> Iterator[BinaryIO]:
        """Yield a new file, which takes its place when the block ends without an exception."""
        with self._place(name) as (at, last), _unfinished(at) as (unfinished, handle):
            with os.fdopen(handle, "w+b") as file:
                yield file
            at.rename(unfinished, at, last)

    @contextmanager
    def filling(self, name: str) -> Iterator[Path]:
        """Yield where a library may write a file or a folder, which takes its place when the block ends well.

        It is in a private folder, where it has its last name already.
        """
        with self._place(name) as (at, last), _unfinished(at, folder=True) as (private, _):
            yield at.path / private / last
            at.rename(f"{private}/{last}", at, last)

    def appending(self, name: str) -> io.FileIO:
        """Open a file to go on writing it at its end, unbuffered; what is written stays."""
        with self._place(name) as (at, last):
            return io.FileIO(os.open(at.spelled(last), os.O_WRONLY | _MORE, 0o666, dir_fd=at.handle), "ab")

    def create(self, name: str, content: bytes = b"") -> None:
        """Write a file of a folder that no one else reads yet; FileExistsError if it is there."""
        *before, last = _parts(name)
        with self._opened(before, make=True) as at:
            handle = os.open(at.spelled(last), os.O_WRONLY | _NEW, 0o666, dir_fd=at.handle)
            with os.fdopen(handle, "wb") as file:
                file.write(content)

    def copy(self, source: Path, name: str) -> None:
        """Copy the content of a plain file, whole or not at all; links to ``source`` are followed."""
        with plain(source).open("rb") as content, self.writing(name) as file:
            shutil.copyfileobj(content, file, _AT_ONCE)

    def link(self, source: Path, name: str) -> None:
        """Give a plain file, or a link itself, a second name here, or copy it if the file system has no hard links.

        FileExistsError if something is there.
        """
        *before, last = _parts(name)
        with self._opened(before, make=True) as at:
            try:
                os.link(source, at.spelled(last), dst_dir_fd=at.handle, follow_symlinks=False)
            except (FileExistsError, FileNotFoundError):
                raise
            except OSError:
                self.copy(source, name)

    def without_links(self, name: str) -> Path:
        """Path of an entry for a library that writes it in place; OSError if a link is on the way or at its end."""
        with self._place(name) as (at, last):
            return at.path / last

    def move(self, name: str, to: Folder, new_name: str, *, replace: bool = False) -> None:
        """Rename a file or folder; FileExistsError if something is there, unless it may be replaced."""
        with self._place(name) as (at, last), to._place(new_name) as (there, new_last):
            if not replace and there.status(new_last) is not None:
                raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(there.path / new_last))
            at.rename(last, there, new_last)

    def exchange(self, name: str, to: Folder, other_name: str) -> bool:
        """Exchange two folders at once; False if the system or the file system cannot."""
        with self._place(name) as (at, last), to._place(other_name) as (there, other):
            return exchange(at.handle, last, there.handle, other, there.path)

    def remove(self, name: str) -> None:
        """Remove a file; none there is no fault."""
        self._discard(name, folder=False)

    def remove_tree(self, name: str) -> None:
        """Remove a folder with all that is in it: links themselves, not what they lead to; none there is no fault."""
        self._discard(name, folder=True)

    def _discard(self, name: str, *, folder: bool) -> None:
        *before, last = _parts(name)
        with suppress(FileNotFoundError), self._opened(before) as at:
            at.refuse_special(last)
            at.discard(last, folder=folder)

    def remove_if_empty(self) -> None:
        """Remove the folder itself if nothing is in it."""
        outer, name = self._place_of_itself()
        with suppress(OSError), outer._opened(()) as at:
            os.rmdir(at.spelled(name), dir_fd=at.handle)

    def sync(self, name: str = "") -> None:
        """Have the system put a file, or the folder's list of names, on the disk now."""
        if not _HAS_HANDLES:
            return  # Windows opens no folder, and writes its entries itself
        *before, last = _parts(name) if name else (".",)
        with self._opened(before) as at:
            handle = os.open(last, _READ, dir_fd=at.handle)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)

    def _place_of_itself(self) -> tuple[Folder, str]:
        """The folder around this one, and its name there."""
        if self.below.parts:
            return Folder(self.root, self.below.parent), self.below.name
        return Folder(self.root.parent), self.root.name

    @contextmanager
    def _place(self, name: str) -> Iterator[tuple[_Directory, str]]:
        """Open the directory that an entry is to be in, made if it is not there; refuses a link or device there."""
        *before, last = _parts(name)
        with self._opened(before, make=True) as at:
            at.refuse_special(last)
            at.sweep()
            yield at, last

    @contextmanager
    def _opened(self, inside: Sequence[str], *, make: bool = False) -> Iterator[_Directory]:
        """Open a directory in this folder, step by step."""
        if make:
            self.root.mkdir(parents=True, exist_ok=True)
        at = _Directory.of_root(self.root)
        try:
            for part in (*self.below.parts, *inside):
                at = at.step(part, make=make)
            yield at
        finally:
            at.close()


@dataclass(frozen=True)
class _Directory:
    """An open directory; without a handle, where the system has none for it, the path that was looked at."""

    path: Path
    handle: int | None

    @classmethod
    def of_root(cls, root: Path) -> _Directory:
        return cls(root, os.open(root, _DIRECTORY) if _HAS_HANDLES else None)

    def step(self, name: str, *, make: bool) -> _Directory:
        """Go on to a directory in this one, which is closed then."""
        if make:
            with suppress(FileExistsError):
                os.mkdir(self.spelled(name), dir_fd=self.handle)
        self.refuse_special(name)
        if self.handle is None:
            return _Directory(self.path / name, None)
        inner = os.open(name, _DIRECTORY, dir_fd=self.handle)
        self.close()
        return _Directory(self.path / name, inner)

    def close(self) -> None:
        if self.handle is not None:
            os.close(self.handle)

    def names(self) -> list[str]:
        """Names of all entries."""
        return os.listdir(self.path if self.handle is None else self.handle)  # noqa: PTH208 - pathlib knows no handles

    def spelled(self, name: str) -> str:
        """An entry's name as the functions of the system want it, together with the handle."""
        return str(self.path / name) if self.handle is None else name

    def status(self, name: str) -> os.stat_result | None:
        """The system's status of an entry, of a link itself; None if it is not there."""
        try:
            return os.stat(self.spelled(name), dir_fd=self.handle, follow_symlinks=False)
        except FileNotFoundError:
            return None

    def refuse_special(self, name: str) -> None:
        """Raise OSError for a link, device, pipe or socket, which a new file would replace."""
        found = self.status(name)
        if found is None or stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode):
            return
        if stat.S_ISLNK(found.st_mode):
            reason = "it is a link, and the program does not write or remove files through links; replace it by a copy"
            raise OSError(errno.ELOOP, reason, str(self.path / name))
        raise OSError(errno.EINVAL, "it is a device, pipe or socket, not a regular file", str(self.path / name))

    def rename(self, name: str, to: _Directory, new_name: str) -> None:
        os.replace(self.spelled(name), to.spelled(new_name), src_dir_fd=self.handle, dst_dir_fd=to.handle)

    def discard(self, name: str, *, folder: bool) -> None:
        """Remove a file, or a folder with all that is in it."""
        if folder:
            shutil.rmtree(self.spelled(name), dir_fd=self.handle)
        else:
            os.unlink(self.spelled(name), dir_fd=self.handle)

    def sweep(self) -> None:
        """Remove what killed programs left unfinished, once for each directory."""
        if self.handle is None:
            return
        found = os.fstat(self.handle)
        here = (self.path, found.st_dev, found.st_ino)
        if here in _swept:
            return
        _swept.add(here)
        try:
            names = self.names()
        except PermissionError:  # it may be written, but not listed
            return
        for name in filter(UNFINISHED.fullmatch, names):
            with suppress(OSError, _SweptError), _locked(self, name, wait=False) as handle:
                self.discard(name, folder=stat.S_ISDIR(os.fstat(handle).st_mode))


@contextmanager
def scratch_folder(within: Folder | None = None) -> Iterator[Folder]:
    """Yield a private folder, which goes with all that is in it when the block ends.

    It is among the system's temporary files, or ``within`` a folder, so that things can be moved to their places.
    """
    if within is not None:
        with within._opened((), make=True) as at:
            at.sweep()
            with _unfinished(at, folder=True) as (name, _):
                yield within.folder(name)
        return
    with tempfile.TemporaryDirectory(prefix="vislam2tag-", ignore_cleanup_errors=True) as scratch:
        yield Folder.at(Path(scratch))


def _parts(name: str) -> tuple[str, ...]:
    """The parts of a name; OSError if it leads outside or is none."""
    parts = PurePosixPath(name).parts
    if not parts or PurePosixPath(name).is_absolute() or ".." in parts or "\0" in name:
        raise OSError(errno.EINVAL, "its name leads out of the folder", name)
    return parts


@contextmanager
def _unfinished(at: _Directory, *, folder: bool = False) -> Iterator[tuple[str, int]]:
    """Yield the name of a new file, and its handle, which the block closes, or of a new private folder.

    What is not renamed by then is removed.
    """
    while True:
        name, handle = f".vislam2tag-{secrets.token_hex(8)}.part", -1
        if folder:
            os.mkdir(at.spelled(name), 0o700, dir_fd=at.handle)
        else:
            handle = os.open(at.spelled(name), os.O_RDWR | _NEW, 0o666, dir_fd=at.handle)
        try:
            with _locked(at, name, wait=True):
                try:
                    yield name, handle
                finally:
                    with suppress(OSError):
                        at.discard(name, folder=folder)
                return
        except _SweptError:  # before it was locked
            if not folder:
                os.close(handle)


class _SweptError(Exception):
    """Another program took for unfinished what has just been made here."""


@contextmanager
def _locked(at: _Directory, name: str, *, wait: bool) -> Iterator[int]:
    """Hold the lock of what is unfinished, so that no sweep removes it; yields a handle of its own."""
    if at.handle is None or fcntl is None:
        yield -1
        return
    try:
        handle = os.open(name, _READ, dir_fd=at.handle)
    except FileNotFoundError:
        raise _SweptError from None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
        there = at.status(name)
        if there is None or there.st_ino != os.fstat(handle).st_ino:
            raise _SweptError
        yield handle
    finally:
        os.close(handle)
