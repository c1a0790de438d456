"""A folder of this machine, read and written as one in an object store, for what may lie in either."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from vislam2tag.common.errors import OutputError, StoreConflictError, StoreError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.files.store import Listed, Store, Stored, Version, store_at

_LOCK = ".lock"
_WAIT_S = 60


@dataclass(frozen=True)
class FolderStore:
    """What :class:`~vislam2tag.common.files.store.Store` is for a folder in a store; names are paths below it."""

    root: Path

    @property
    def address(self) -> str:
        """Its path, for messages."""
        return str(self.root)

    def get(self, name: str) -> Stored | None:
        """Read a file whole; None where there is none. Raises StoreError where it cannot be read."""
        try:
            data = read_bytes(self.root / name)
        except FileNotFoundError:
            return None
        except OSError as error:
            raise StoreError(f"{self.root / name}: cannot be read ({error.strerror}); check its permissions") from error
        return Stored(data, Version(hashlib.sha256(data).hexdigest()), {})

    def version(self, name: str) -> Version | None:
        """Version of a file as :meth:`list` shows it; None where there is none."""
        path = self.root / name
        return _listed_version(path) if path.is_file() else None

    @property
    def _folder(self) -> Folder:
        return Folder.at(self.root)

    def fetch(self, name: str, folder: Folder, new_name: str) -> None:
        """Copy a file to a folder; raises StoreError if it cannot be done."""
        try:
            folder.copy(self.root / name, new_name)
        except OSError as error:
            raise StoreError(f"{self.root / name}: cannot be copied ({error.strerror})") from error

    def put(self, name: str, content: bytes | Path) -> None:
        """Write a file whole; raises OutputError where it cannot be written."""
        try:
            if isinstance(content, Path):
                self._folder.copy(content, name)
            else:
                self._folder.write(name, content)
        except OSError as error:
            raise OutputError(f"{self.root / name}: cannot be written ({error.strerror})") from error

    def filling(self, name: str) -> AbstractContextManager[Path]:
        """Yield where a library may write a file, which takes its place when the block ends well."""
        return self._folder.filling(name)

    def put_over(self, name: str, content: bytes, before: Version | None) -> None:
        """Replace the version ``before`` of a file, or create it where that is None.

        Raises StoreConflictError where another version is there, StoreError where another program holds the folder for
        a minute.
        """
        from filelock import FileLock, Timeout

        try:
            with FileLock(self._folder.without_links(_LOCK), timeout=_WAIT_S):
                found = self.get(name)
                if (None if found is None else found.version) != before:
                    raise StoreConflictError(f"{self.root / name}: another program has written it meanwhile")
                self.put(name, content)
        except Timeout as error:
            raise StoreError(f"{self.root}: another program is writing there; wait for it") from error

    def list(self, folder: str = "") -> Iterator[Listed]:
        """List all files below a folder; their versions here are of size and time, no hashes."""
        for path in sorted((self.root / folder).rglob("*")):
            if path.is_file():
                name, version = path.relative_to(self.root).as_posix(), _listed_version(path)
                yield Listed(name, path.stat().st_size, version)

    def folders(self) -> tuple[str, ...]:
        """Names of the folders right below, sorted; hidden ones are left out."""
        there = self.root.iterdir() if self.root.is_dir() else ()
        return tuple(sorted(path.name for path in there if path.is_dir() and not path.name.startswith(".")))

    def delete(self, names: Iterable[str]) -> None:
        """Remove files; one that is not there is no fault. Raises OutputError for one that cannot be removed."""
        for name in names:
            try:
                self._folder.remove(name)
            except OSError as error:
                reason = f"cannot be removed ({error.strerror}); check its permissions"
                raise OutputError(f"{self.root / name}: {reason}") from error


def _listed_version(path: Path) -> Version:
    found = path.stat()
    return Version(f"{found.st_size}-{found.st_mtime_ns}")


AnyStore: TypeAlias = Store | FolderStore


def any_store_at(path: Path) -> AnyStore:
    """The folder that a path stands for, in a store or on this machine."""
    return store_at(path) or FolderStore(path)
