"""The record of an output folder's own files: all that a later command may replace or remove there.

Every output folder of ours contains it as a hidden file. Files that it does not name belong to the user. This module
reads and serialises the record; the commands that own a folder write it, before they write the files that it names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Annotated, Self, TypeAlias

from pydantic import AfterValidator, ValidationError

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.records import Record

OWN_FILES = ".vislam2tag-files"
"""The record's name."""


def _relative(text: str) -> str:
    """Refuse a path that leads out of its folder: the folder may come from others."""
    parts = PurePosixPath(text).parts
    if not parts or ".." in parts or PureWindowsPath(text).anchor or "\\" in text or "\0" in text:
        raise ValueError(f"{text!r} is not a path below the folder")
    return PurePosixPath(text).as_posix()


def _name(text: str) -> str:
    """Refuse what is not the name of one file or folder."""
    if len(PurePosixPath(_relative(text)).parts) != 1:
        raise ValueError(f"{text!r} is not a single name")
    return text


_Path: TypeAlias = Annotated[str, AfterValidator(_relative)]
_Name: TypeAlias = Annotated[str, AfterValidator(_name)]


class OwnFiles(Record):
    """Which files of a folder are ours."""

    files: tuple[_Path, ...] = ()
    """Paths relative to the folder, with ``/`` between their parts; sorted."""
    folders: tuple[_Name, ...] = ()
    """Folders right below it that contain files of sessions."""
    stems: tuple[_Name, ...] = ()
    """Sessions' slugs: a file of one of the ``folders`` is ours if its name is a slug, a dot and anything."""

    @classmethod
    def of(cls, files: Iterable[str] = (), folders: Iterable[str] = (), stems: Iterable[str] = ()) -> Self:
        """Make a record from names in any order."""
        return cls(files=_sorted(files), folders=_sorted(folders), stems=_sorted(stems))

    @classmethod
    def read(cls, folder: Path) -> Self | None:
        """Read a folder's record; None if there is none. Raises OutputError if it cannot be read or is damaged."""
        path = folder / OWN_FILES
        try:
            return cls.parsed(read_bytes(path), str(path))
        except FileNotFoundError:
            return None
        except OSError as error:
            raise OutputError(f"{path}: cannot be read ({error.strerror}); {_CURE}") from error

    @classmethod
    def parsed(cls, data: bytes, name: str) -> Self:
        """Parse a record's content; raises OutputError with its ``name`` if it is damaged."""
        try:
            return cls.model_validate_json(data)
        except ValidationError as error:
            fault = error.errors()[0]["msg"]
            raise OutputError(f"{name}: is damaged or was written by a later version ({fault}); {_CURE}") from error

    def text(self) -> str:
        """The record's content."""
        return self.model_dump_json(indent=1) + "\n"

    def owns(self, relative: str) -> bool:
        """Whether a file, named by its path relative to the folder, is ours."""
        folder, _, name = relative.partition("/")
        # The tables of a companion named B are in folders such as sensors_B.
        is_ours = folder in self.folders or (name.endswith(".parquet") and folder.partition("_")[0] in self.folders)
        of_session = is_ours and any(stem in self._stems for stem in _stems_of(name))
        return of_session or relative in self._files or relative == OWN_FILES

    @cached_property
    def _files(self) -> frozenset[str]:
        return frozenset(self.files)

    @cached_property
    def _stems(self) -> frozenset[str]:
        return frozenset(self.stems)

    def with_those_of(self, other: OwnFiles) -> OwnFiles:
        """Both records in one."""
        return OwnFiles.of(self.files + other.files, self.folders + other.folders, self.stems + other.stems)


def owned_files(names: Iterable[str], record_at: Callable[[str], OwnFiles | None]) -> set[str]:
    """Those files of a folder, named by their paths relative to it, that its record owns.

    A subfolder with a record counts with all that this one owns, if the folder's own record owns the record there: it
    was written by the same command. ``record_at`` reads a record, named by its path; None if there is none.
    """
    names = set(names)
    own = record_at(OWN_FILES)
    if own is None:
        return set()
    owned = {name for name in names if own.owns(name)}
    for record in sorted(name for name in owned if name.endswith(f"/{OWN_FILES}")):
        below = record.removesuffix(OWN_FILES)
        inside = {name.removeprefix(below) for name in names if name.startswith(below)}
        owned |= {below + name for name in owned_files(inside, lambda name, below=below: record_at(below + name))}  # type: ignore[misc]
    return owned


_CURE = "move files that you want to keep, then remove the folder, or choose another --out"


def without_record(place: str) -> OutputError:
    """The error of an output of ours without a record, which version 0.2 and earlier wrote."""
    return OutputError(f"{place}: was written by an earlier version, which did not store a list of its files; {_CURE}")


def _sorted(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(sorted(set(names)))


def _stems_of(name: str) -> Iterator[str]:
    """The part before each dot of a file's name; nothing for a path of several parts."""
    if "/" not in name:
        yield from (name[:at] for at, letter in enumerate(name) if letter == "." and at)
