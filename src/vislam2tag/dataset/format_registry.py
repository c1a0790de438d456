"""What a format of the field must offer, and their registry; adding one touches one module of this package.

A module ends with ``register_import(name, read, help, recognises)``, ``register_export(name, write, help)`` or both.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Literal, Protocol, TypeVar

from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.findings import Finding
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.transmitters.privacy import Privacy

_Format = TypeVar("_Format", "ImportFormat", "ExportFormat")


def _no_progress(total: int) -> None:
    del total


@dataclass(frozen=True)
class ImportContext:
    """What a reader is given besides the path."""

    scratch: Path
    """An empty folder for intermediate tables that the data set scans; it outlives the data set's use."""
    origin: tuple[float, float] | None = None
    """Latitude and longitude, degrees, where metres count from, for formats whose positions are geographic."""
    advance: Callable[[int], None] = _no_progress
    """Called after each file (or walk) with how many there are."""


class Reader(Protocol):
    """Reads files of one format."""

    def __call__(self, path: Path, context: ImportContext) -> Dataset:
        """Read a file or folder into a data set with lazy tables; what is odd but usable becomes findings.

        Raises DatasetError, naming file, line and what was expected, where the files are not of this format.
        """
        ...


@dataclass(frozen=True)
class ExportContext:
    """What a writer is given besides its source and its folder."""

    split: str | None = None
    """Name of the split whose parts become the format's own; None: the official one where there is one."""
    fold: str | None = None
    """Name of the split's fold; None where it has one only."""
    survey: Path | None = None
    """The raw survey that labels were made of, for formats that put its files beside."""
    privacy: Privacy = field(default_factory=Privacy)
    """What formats made of labels leave out or hide; a data set comes without it already."""
    advance: Callable[[int], None] = _no_progress
    """Called after each part (chunk, table, walk) with how many there are."""


class Writer(Protocol):
    """Writes one format from a data set."""

    def __call__(self, dataset: Dataset, folder: Path, context: ExportContext) -> tuple[Finding, ...]:
        """Write into an empty folder; return what could not be written, counted.

        Raises DatasetError where the set has nothing that this format can hold.
        """
        ...


class LabelsWriter(Protocol):
    """Writes one format from the folder that ``process`` wrote."""

    def __call__(self, labels: Path, folder: Path, context: ExportContext) -> tuple[Finding, ...]:
        """Write into an empty folder; return what could not be written, counted."""
        ...


@dataclass(frozen=True)
class ImportFormat:
    """A format that can be read."""

    name: str
    read: Reader
    help: str
    """One line for ``import --help``: what the path is, and what of it is taken."""
    recognises: Callable[[Path], bool]
    """Whether a file or folder is of this format, from names and first lines alone; never raises DatasetError."""
    takes: frozenset[str] = frozenset()
    """The options of :class:`ImportContext` that mean something here: ``origin``."""


@dataclass(frozen=True)
class ExportFormat:
    """A format that can be written: from a data set (``write``) or from labels (``write_labels``)."""

    name: str
    help: str
    """One line for ``export --help``: what is written."""
    holds: Mapping[str, frozenset[str]]
    """By table, the columns that survive; of labels the tables are those that ``process`` wrote."""
    takes: frozenset[str] = frozenset()
    """The options of :class:`ExportContext` that mean something here: ``split``, ``survey``."""
    write: Writer | None = None
    write_labels: LabelsWriter | None = None

    @property
    def source(self) -> Literal["dataset", "labels"]:
        """What it is written from."""
        return "dataset" if self.write else "labels"


_IMPORTS: dict[str, ImportFormat] = {}
_EXPORTS: dict[str, ExportFormat] = {}


def register_import(
    name: str, read: Reader, help: str, recognises: Callable[[Path], bool], takes: Iterable[str] = ()
) -> None:
    """Make a format readable; called once at the end of the format's own module."""
    _IMPORTS[name] = ImportFormat(name, read, help, recognises, frozenset(takes))


def register_export(
    name: str,
    write: Writer,
    help: str,
    holds: Mapping[str, Iterable[str]],
    takes: Iterable[str] = (),
) -> None:
    """Make a format writable from a data set; called once at the end of the format's own module."""
    _EXPORTS[name] = ExportFormat(name, help, _frozen(holds), frozenset(takes), write=write)


def register_labels_export(
    name: str,
    write: LabelsWriter,
    help: str,
    holds: Mapping[str, Iterable[str]],
    takes: Iterable[str] = (),
) -> None:
    """Make a format writable from the output of ``process``; called once at the end of the format's own module."""
    _EXPORTS[name] = ExportFormat(name, help, _frozen(holds), frozenset(takes), write_labels=write)


def _frozen(holds: Mapping[str, Iterable[str]]) -> Mapping[str, frozenset[str]]:
    return MappingProxyType({table: frozenset(columns) for table, columns in holds.items()})


@cache
def _load_all() -> None:
    for module in pkgutil.iter_modules([str(Path(__file__).parent / "formats")]):
        importlib.import_module(f"{__package__}.formats.{module.name}")


def import_formats() -> Mapping[str, ImportFormat]:
    """All formats that can be read, by name in order."""
    _load_all()
    return MappingProxyType(dict(sorted(_IMPORTS.items())))


def export_formats() -> Mapping[str, ExportFormat]:
    """All formats that can be written, by name in order."""
    _load_all()
    return MappingProxyType(dict(sorted(_EXPORTS.items())))


def import_named(name: str) -> ImportFormat:
    """Return the format of this name; raises UsageError where none can be read."""
    return _named(import_formats(), name, "read")


def export_named(name: str) -> ExportFormat:
    """Return the format of this name; raises UsageError where none can be written."""
    return _named(export_formats(), name, "written")


def _named(formats: Mapping[str, _Format], name: str, done: str) -> _Format:
    if name not in formats:
        raise UsageError(f"no format called '{name}' can be {done}; there are: {', '.join(formats)}")
    return formats[name]


def import_format_of(path: Path) -> ImportFormat:
    """Return the one format that recognises a file or folder.

    Raises DatasetError where the path is not there, and where no format or several recognise it.
    """
    if not path.exists():
        raise DatasetError(f"{path}: no such file or folder")
    formats = import_formats()
    found = [name for name, each in formats.items() if each.recognises(path)]
    if len(found) == 1:
        return formats[found[0]]
    said = f"may be {' or '.join(found)}" if found else f"is none of the formats known ({', '.join(formats)})"
    raise DatasetError(f"{path}: {said}; say which by --format")
