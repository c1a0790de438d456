"""Folders that may lie in an object store or on this machine, so that commands need not ask where.

:class:`FolderStore` reads and writes a folder of this machine as :class:`~vislam2tag.common.files.store.Store` does one
in a store. The other way round, a folder in a store is one of this machine for as long as a command needs it. What is
read as a whole is fetched (:func:`folder_at_hand`). What is made as a whole is put back when it is done
(:func:`folder_to_fill`). Of what is read one session at a time, only the names are there (:func:`outline_at_hand`).
"""

from __future__ import annotations

import hashlib
import json
import secrets
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, TypeAlias

from vislam2tag.common.errors import OutputError, StoreConflictError, StoreError, UsageError, Vislam2tagError
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.files.store import Listed, Store, Stored, Version, store_at

if TYPE_CHECKING:  # loads pydantic, which `vislam2tag --help` does without
    from vislam2tag.common.files.own_files import OwnFiles


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
                    raise StoreConflictError(
                        f"{self.root / name}: another program wrote it during this run; run the same command again"
                    )
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


MARK = ".vislam2tag.json"
"""In a folder that was put into a store as a whole: the SHA-256 of each of its files, once all of them stand there."""
_STOOD_FOR: dict[str, str] = {}
"""By folder of this machine, the address that it stands for, or did: of the last :data:`_REMEMBERED`."""
_REMEMBERED = 1000


def with_addresses(text: str) -> str:
    """Text for people: in place of folders that stand for others by address, those addresses."""
    for here, address in _STOOD_FOR.items():
        text = text.replace(here, address)
    return text


@contextmanager
def folder_at_hand(folder: Path) -> Iterator[Path]:
    """Yield a folder for one by address, fetched whole, which lasts as long as the block; one of this machine as it is.

    A single file can be had so, too. Raises UsageError where nothing is stored there, StoreError where the store cannot
    be read, and where a folder that was put there as a whole is not whole.
    """
    store = store_at(folder)
    if store is None:
        yield folder
        return
    with place_for(store) as here:
        sums = _fetch(store, here)
        if not here.exists() and not _fetch_file(store.address, here):
            raise UsageError(f"{store.address}: nothing is stored there")
        mark = store.get(MARK)
        wanted = {} if mark is None else _files_and_changes(mark.data)[0]
        if wanted is None or not wanted.items() <= sums.items():
            raise StoreError(
                f"{store.address}: is incomplete: another program is writing it, writing was interrupted, or a file "
                "was changed; run the command that makes it again"
            )
        yield here


@contextmanager
def folder_to_fill(folder: Path, *, unfinished: bool = False) -> Iterator[Path]:
    """Yield a folder for one by address, with what is stored there; what the block makes of it is stored when it ends.

    After an exception nothing is, unless what is ``unfinished`` is of use, too: the same command goes on with it.
    A folder of this machine is yielded as it is. One that another program was still writing, or died over, is yielded
    empty. Raises StoreError where the store cannot be read or written or has no conditional writes, StoreConflictError
    where another program writes there at the same time.
    """
    store = store_at(folder)
    if store is None:
        yield folder
        return
    store.refuse_without_conditional_writes()
    mark = store.get(MARK)
    with place_for(store) as here:
        torn = None if mark is None else _files_and_changes(mark.data)[1]
        stale = set[str]() if torn is None else torn | _owned(store)
        before = _fetch(store, here) if torn is None else {}
        whole = False
        try:
            yield here
            whole = True
        finally:
            after = _sums(here) if whole or unfinished else before
            if after != before:
                _put_whole(store, here, before, after, stale, None if mark is None else mark.version)


@contextmanager
def folder_to_add_to(folder: Path, *, at_hand: Sequence[str] = ()) -> Iterator[Path]:
    """Yield an empty folder for one by address; the files that the block makes in it are stored when it ends.

    Only the files ``at_hand`` of what is stored are in it. After an exception none is stored. What else is stored there
    stays. Raises StoreError where it cannot be written.
    """
    store = store_at(folder)
    if store is None:
        yield folder
        return
    with place_for(store) as here:
        for name in at_hand:
            store.fetch(name, Folder(here), name)
        yield here
        for path in sorted(path for path in here.rglob("*") if path.is_file()):
            store.put(path.relative_to(here).as_posix(), path)


@dataclass(frozen=True)
class Outline:
    """What is stored in a folder, by name."""

    store: Store
    files: Mapping[str, list[Listed]]
    """By path of a folder, all that is listed below it or, for a file's own path, itself."""


_OUTLINES: dict[Path, Outline] = {}
"""By folder of this machine, what it stands for with its names alone."""


def outline_of(root: Path) -> Outline | None:
    """What a folder that :func:`outline_at_hand` made stands for; None for any other."""
    return _OUTLINES.get(root)


@contextmanager
def outline_at_hand(store: Store, fetched: Callable[[Path], Iterable[Path]]) -> Iterator[Path]:
    """Yield a folder with the names of all that is stored, empty files, as long as the block lasts.

    Of the files that ``fetched`` names, given the folder, the content is there, too; of those before, when it names
    the next. Without any file there is no folder. Raises StoreError where the store cannot be read.
    """
    with place_for(store) as root:
        here = Folder(root)
        listed = _without_folders(sorted(file for file in store.list() if is_safe_name(file.name)))
        for file in listed:
            here.create(file.name)
        for path in fetched(root):
            name = path.relative_to(root).as_posix()
            store.fetch(name, here, name)
        _OUTLINES[root] = Outline(store, _by_folder(listed))
        try:
            yield root
        finally:
            del _OUTLINES[root]


@contextmanager
def place_for(store: Store) -> Iterator[Path]:
    """Yield where a folder of this machine can stand for one in a store, by its name; it goes with the block.

    Errors of ours that the block raises name the address.
    """
    with scratch_folder() as scratch:
        here = scratch / PurePosixPath(store.address).name
        _STOOD_FOR[str(here)] = store.address
        for old in list(islice(_STOOD_FOR, max(len(_STOOD_FOR) - _REMEMBERED, 0))):
            _STOOD_FOR.pop(old, None)
        try:
            yield here
        except Vislam2tagError as error:
            error.args = tuple(with_addresses(each) if isinstance(each, str) else each for each in error.args)
            raise


def is_safe_name(name: str) -> bool:
    """Whether an object's name can be that of a file below a folder, without leaving it or being hidden.

    Only the record of own files is hidden and goes with its folder.
    """
    from vislam2tag.common.files.own_files import OWN_FILES

    path = PurePosixPath(name)
    parts = path.parent.parts if path.name == OWN_FILES else path.parts
    return bool(name) and not any(part == "/" or part.startswith(".") for part in parts)


def _fetch(store: Store, here: Path) -> dict[str, str]:
    """Fetch a folder whole; return the SHA-256 of each file."""
    sums = {}
    for file in _without_folders([file for file in store.list() if is_safe_name(file.name)]):
        if store.fetch(file.name, Folder(here), file.name) is not None:
            sums[file.name] = _sha256(here / file.name)
    return sums


def _fetch_file(address: str, here: Path) -> bool:
    """Fetch the one object that has this address; return whether there is one."""
    folder, _, name = address.rpartition("/")
    return not folder.endswith("/") and Store(folder).fetch(name, Folder(here.parent), here.name) is not None


def _owned(store: Store) -> set[str]:
    """Names of what is stored and owned by the record there (:mod:`vislam2tag.common.files.own_files`)."""
    from vislam2tag.common.files.own_files import OwnFiles, owned_files

    def record_at(name: str) -> OwnFiles | None:
        found = store.get(name)
        return None if found is None else OwnFiles.parsed(found.data, f"{store.address}/{name}")

    return owned_files([file.name for file in store.list()], record_at)


def _put_whole(
    store: Store,
    here: Path,
    before: Mapping[str, str],
    after: Mapping[str, str],
    stale: Set[str],
    mark: Version | None,
) -> None:
    """Make the stored folder equal to this one; a reader during the update, or after a crash, sees that it is
    incomplete.

    Of what is stored and not here, only files of ``before`` and ``stale`` ones go: others may be the user's. Records of
    own files come first, so that a crash leaves none that no record names.
    """
    from vislam2tag.common.files.own_files import OWN_FILES

    try:
        new = [name for name, sha256 in after.items() if before.get(name) != sha256]
        gone = (before.keys() | stale) - after.keys()
        mine = {"files": None, "writer": secrets.token_hex(8), "changes": sorted({*new, *gone})}
        begun = store.put_over(MARK, json.dumps(mine).encode(), mark)
        for name in sorted(new, key=lambda name: (PurePosixPath(name).name != OWN_FILES, name)):
            store.put(name, here / name)
        store.delete(sorted(gone))
        store.put_over(MARK, json.dumps({"files": after}, sort_keys=True).encode(), begun)
    except StoreConflictError as error:
        raise StoreConflictError(
            f"{store.address}: another program is writing there; run the same command again when it has finished"
        ) from error


def _files_and_changes(mark: bytes) -> tuple[dict[str, str] | None, set[str] | None]:
    """The SHA-256 of a whole folder's files, or names of what a write that did not end was to change; or neither."""
    try:
        values = json.loads(mark)
        if values["files"] is None:
            return None, {str(name) for name in values.get("changes", ())}
        return dict(values["files"]), None
    except (ValueError, KeyError, TypeError, AttributeError):
        return None, None


def _sums(here: Path) -> dict[str, str]:
    """The SHA-256 of each file of a folder except for hidden ones, which are not stored."""
    files = ((path.relative_to(here).as_posix(), path) for path in here.rglob("*") if path.is_file())
    return {name: _sha256(path) for name, path in files if is_safe_name(name)}


def _sha256(path: Path) -> str:
    return hashlib.sha256(read_bytes(path)).hexdigest()


def _without_folders(files: list[Listed]) -> list[Listed]:
    """Leave out objects that only stand for a folder."""
    folders = {parent.as_posix() for file in files for parent in PurePosixPath(file.name).parents}
    return [file for file in files if file.name not in folders]


def _by_folder(files: list[Listed]) -> dict[str, list[Listed]]:
    by_folder: dict[str, list[Listed]] = {}
    for file in files:
        path = PurePosixPath(file.name)
        for place in (path, *path.parents[:-1]):
            by_folder.setdefault(place.as_posix(), []).append(file)
    return by_folder
