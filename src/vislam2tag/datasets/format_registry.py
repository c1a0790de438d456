"""Interface and registry of data formats. A new format needs one new module in this package.

The module ends with ``register(ImportFormat(...), ExportFormat(...))``, or with one of them: ``register(reads=...)``.
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
from vislam2tag.common.folder_kinds import MODEL_SUFFIX, PROCESS, RUN, SURVEY, kind_of, survey_around, written_by
from vislam2tag.common.plugins import Registry
from vislam2tag.common.progress import Progress, silent
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.privacy import Privacy
from vislam2tag.intake.columns import ColumnNames
from vislam2tag.intake.level_scales import LevelScale

_NAMED = 3
_Format = TypeVar("_Format", "ImportFormat", "ExportFormat")


@dataclass(frozen=True)
class ImportContext:
    """Arguments of a reader besides the path."""

    scratch: Folder
    """An empty folder for intermediate tables that the data set scans; it exists longer than the data set."""
    origin: tuple[float, float] | None = None
    """Latitude and longitude of the metric origin, degrees, for formats with geographic positions."""
    progress: Progress[str] = silent
    """Called after each file (or walk) with its name."""
    most_unpacked: int = MOST_UNPACKED
    """Largest size to which an archive may unpack, bytes."""
    not_heard: float | None = None
    """The number that means "not heard" according to the user, for formats with a column for each access point."""
    levels: LevelScale | None = None
    """What the numbers in these formats mean according to the user, if they are not dBm."""
    columns: ColumnNames | None = None
    """Which columns of a table of the user's own have which meaning; None: by their names."""


LEVEL_OPTIONS = ("not_heard", "levels")
"""Options of formats with a column for each access point."""


@dataclass(frozen=True)
class ExportContext:
    """Arguments of a writer besides source and folder."""

    split: str | None = None
    """Name of the split to export; None: the official one, if there is one."""
    fold: str | None = None
    """Name of the split's fold; None if it has only one."""
    survey: Path | None = None
    """The raw survey of the labels, for formats that include its files."""
    privacy: Privacy = field(default_factory=Privacy)
    """What formats made from labels skip or hide; data sets are already filtered."""
    progress: Progress[str] = silent
    """Called after each part (table, walk) with its name."""
    escape_formulas: bool = True
    """Put an apostrophe before texts that a spreadsheet would read as formulas, if the format allows it."""
    follow_links: bool = False
    """Also share files that are links out of the labels and the survey."""
    tell: Callable[[Sequence[Finding]], None] = lambda _: None
    """Called with what is skipped, by name."""


@dataclass(frozen=True)
class ImportFormat:
    """A format that can be read."""

    name: str
    read: Callable[[Path, ImportContext], Dataset]
    """Reads a file or folder into a data set with lazy tables; odd but usable data become findings.

    Raises DatasetError with file, line and what was expected, if the files are not in this format.
    """
    recognises: Callable[[Path], bool]
    """Whether a file or folder is in this format, from names and first lines only; never raises DatasetError."""
    takes: Collection[str] = ()
    """The options of :class:`ImportContext` that this format uses: ``origin``, ``not_heard``, ``levels``."""


@dataclass(frozen=True)
class ExportFormat:
    """A format that can be written: from a data set (``write``) or from labels (``write_labels``)."""

    name: str
    holds: Mapping[str, Collection[str]]
    """The columns that survive, by table; for labels the tables are those of ``process``."""
    takes: Collection[str] = ()
    """The options of :class:`ExportContext` that this format uses: ``split``, ``survey``."""
    write: Callable[[Dataset, Folder, ExportContext], tuple[Finding, ...]] | None = None
    """Writes a data set into an empty folder and returns findings about skipped data.

    Raises DatasetError if the data set contains nothing that this format supports.
    """
    write_labels: Callable[[Path, Folder, ExportContext], tuple[Finding, ...]] | None = None
    """The same for the output folder of ``process``."""

    @property
    def source(self) -> Literal["dataset", "labels"]:
        """Kind of its source."""
        return "dataset" if self.write else "labels"


FORMATS: Registry[tuple[ImportFormat | None, ExportFormat | None]] = Registry(plugins.DATASET_FORMATS)
"""Reader, writer, or both, of each format, by name."""


def register(reads: ImportFormat | None = None, writes: ExportFormat | None = None) -> None:
    """Register a format; called once at the end of the format's module."""
    (name,) = {way.name for way in (reads, writes) if way}
    FORMATS.add(name, (reads, writes))


def import_formats() -> dict[str, ImportFormat]:
    """All formats that can be read, sorted by name."""
    return {name: reads for name, (reads, _) in FORMATS.all().items() if reads}


def export_formats() -> dict[str, ExportFormat]:
    """All formats that can be written, sorted by name."""
    return {name: writes for name, (_, writes) in FORMATS.all().items() if writes}


def import_named(name: str) -> ImportFormat:
    """Return the format of this name; raises UsageError if it cannot be read."""
    return _named(import_formats(), name, "read")


def export_named(name: str) -> ExportFormat:
    """Return the format of this name; raises UsageError if it cannot be written."""
    return _named(export_formats(), name, "written")


def _named(formats: Mapping[str, _Format], name: str, done: str) -> _Format:
    if name not in formats:
        raise UsageError(f"no format '{name}' can be {done}; formats are: {', '.join(formats)}")
    return formats[name]


LAST = "table"
"""The format that is recognised only if no other is."""


def import_format_of(path: Path) -> ImportFormat:
    """Return the one format that recognises a file or folder.

    Raises DatasetError if the path does not exist or is a damaged archive, and if no format or several recognise it.
    """
    if not path.exists():
        raise DatasetError(f"{path}: no such file or folder")
    check_archive(path)
    formats = import_formats()
    found = [name for name, each in formats.items() if name != LAST and each.recognises(path)]
    if not found and formats[LAST].recognises(path):
        found = [LAST]
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
    """Explain a folder of this program that needs no import."""
    if (path / "dataset.json").is_file():
        return "it is already a data set of this program and needs no import"
    kind = kind_of(path)
    if kind == SURVEY or written_by(path) in (PROCESS, RUN):
        return f"it is {kind}; `vislam2tag dataset {path} --out fingerprints` makes a data set from it"
    if survey := survey_around(path):
        return f"it is {kind}; `vislam2tag dataset {survey} --out fingerprints` makes a data set from it"
    if written_by(path) or path.suffix == MODEL_SUFFIX:
        return f"it is {kind}; expected data of another program"
    return ""
