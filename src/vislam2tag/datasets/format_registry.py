"""What a format of the field must offer, and their registry; adding one touches one module of this package.

A module ends with ``register(ImportFormat(...), ExportFormat(...))``, or names one of them: ``register(reads=...)``.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, TypeVar

from vislam2tag.common import plugins
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.files.archives import MOST_UNPACKED, archives_in, check_archive
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.findings import Finding
from vislam2tag.common.plugins import Registry
from vislam2tag.common.progress import Progress, silent
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.privacy import Privacy

_NAMED = 3
_Format = TypeVar("_Format", "ImportFormat", "ExportFormat")


@dataclass(frozen=True)
class ImportContext:
    """What a reader is given besides the path."""

    scratch: Folder
    """An empty folder for intermediate tables that the data set scans; it outlives the data set's use."""
    origin: tuple[float, float] | None = None
    """Latitude and longitude, degrees, where metres count from, for formats whose positions are geographic."""
    progress: Progress[str] = silent
    """Called after each file (or walk) with its name."""
    most_unpacked: int = MOST_UNPACKED
    """Bytes that an archive may unpack to."""
    not_heard: float | None = None
    """The level that the user says stands for "not heard", for formats with a column for each access point."""


@dataclass(frozen=True)
class ExportContext:
    """What a writer is given besides its source and its folder."""

    split: str | None = None
    """Name of the split whose parts become the format's own; None: the official one if there is one."""
    fold: str | None = None
    """Name of the split's fold; None if it has one only."""
    survey: Path | None = None
    """The raw survey that labels were made of, for formats that put its files beside."""
    privacy: Privacy = field(default_factory=Privacy)
    """What formats made of labels leave out or hide; a data set comes without it already."""
    progress: Progress[str] = silent
    """Called after each part (table, walk) with its name."""
    escape_formulas: bool = True
    """Put an apostrophe before texts that a spreadsheet would take for formulas, where the format allows it."""
    follow_links: bool = False
    """Share files, too, that links lead to outside the labels and the survey."""
    tell: Callable[[Sequence[Finding]], None] = lambda _: None
    """Called with what is left out, by name."""


@dataclass(frozen=True)
class ImportFormat:
    """A format that can be read."""

    name: str
    read: Callable[[Path, ImportContext], Dataset]
    """Reads a file or folder into a data set with lazy tables; what is odd but usable becomes findings.

    Raises DatasetError, naming file, line and what was expected, if the files are not of this format.
    """
    recognises: Callable[[Path], bool]
    """Whether a file or folder is of this format, from names and first lines alone; never raises DatasetError."""
    takes: Collection[str] = ()
    """The options of :class:`ImportContext` that mean something here: ``origin``, ``not_heard``."""


@dataclass(frozen=True)
class ExportFormat:
    """A format that can be written: from a data set (``write``) or from labels (``write_labels``)."""

    name: str
    holds: Mapping[str, Collection[str]]
    """By table, the columns that survive; of labels the tables are those that ``process`` wrote."""
    takes: Collection[str] = ()
    """The options of :class:`ExportContext` that mean something here: ``split``, ``survey``."""
    write: Callable[[Dataset, Folder, ExportContext], tuple[Finding, ...]] | None = None
    """Writes a data set into an empty folder and returns what could not be written, counted.

    Raises DatasetError if the set has nothing that this format can hold.
    """
    write_labels: Callable[[Path, Folder, ExportContext], tuple[Finding, ...]] | None = None
    """The same of the folder that ``process`` wrote."""

    @property
    def source(self) -> Literal["dataset", "labels"]:
        """What it is written from."""
        return "dataset" if self.write else "labels"


FORMATS: Registry[tuple[ImportFormat | None, ExportFormat | None]] = Registry(plugins.DATASET_FORMATS)
"""How each format of the field is read, written, or both, by its name."""


def register(reads: ImportFormat | None = None, writes: ExportFormat | None = None) -> None:
    """Make a format known by its name; called once at the end of the format's own module."""
    (name,) = {way.name for way in (reads, writes) if way}
    FORMATS.add(name, (reads, writes))


def import_formats() -> dict[str, ImportFormat]:
    """All formats that can be read, by name in order."""
    return {name: reads for name, (reads, _) in FORMATS.all().items() if reads}


def export_formats() -> dict[str, ExportFormat]:
    """All formats that can be written, by name in order."""
    return {name: writes for name, (_, writes) in FORMATS.all().items() if writes}


def import_named(name: str) -> ImportFormat:
    """Return the format of this name; raises UsageError if none can be read."""
    return _named(import_formats(), name, "read")


def export_named(name: str) -> ExportFormat:
    """Return the format of this name; raises UsageError if none can be written."""
    return _named(export_formats(), name, "written")


def _named(formats: Mapping[str, _Format], name: str, done: str) -> _Format:
    if name not in formats:
        raise UsageError(f"no format '{name}' can be {done}; formats are: {', '.join(formats)}")
    return formats[name]


def import_format_of(path: Path) -> ImportFormat:
    """Return the one format that recognises a file or folder.

    Raises DatasetError if the path is not there or a damaged archive, and if no format or several recognise it.
    """
    if not path.exists():
        raise DatasetError(f"{path}: no such file or folder")
    check_archive(path)
    formats = import_formats()
    found = [name for name, each in formats.items() if each.recognises(path)]
    if len(found) == 1:
        return formats[found[0]]
    archives = archives_in(path)
    if not found and len(archives) > 1:
        names = ", ".join((*archives[:_NAMED], "...") if len(archives) > _NAMED else archives)
        raise DatasetError(
            f"{path}: the folder contains {len(archives)} archives ({names}); pass one of them, or unpack those that "
            "belong together into one folder and pass that"
        )
    said = f"the format may be {' or '.join(found)}" if found else f"not in a known format ({', '.join(formats)})"
    raise DatasetError(f"{path}: {said}; {_instead(path) or 'name the format with --format'}")


def _instead(path: Path) -> str:
    """What a folder of ours is that needs no import."""
    if (path / "dataset.json").is_file():
        return "it is already a data set of this program and needs no import"
    if any(path.glob("floor_*/*/*/")):
        return "it is a survey; `vislam2tag dataset` makes a data set from it"
    return ""
