"""Between our data sets and other formats.

Importing: from files of another format to a data set with splits, statistics and card. Exporting: from a data set or an
output folder of ``process`` to a folder in another format.
"""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Literal

import polars as pl
from pydantic import ValidationError

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError, OutputError, UsageError, first_line
from vislam2tag.common.files.archives import MOST_UNPACKED
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.given_files import AnyPath, path_or_none, read_bytes
from vislam2tag.common.files.table_files import scan_parquet
from vislam2tag.common.files.whole_output import whole_folder
from vislam2tag.common.findings import Finding
from vislam2tag.common.folder_kinds import found_at, survey_around
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.tabular import Result
from vislam2tag.datasets.description import Description, with_description
from vislam2tag.datasets.folder import (
    dataset_folder,
    is_dataset,
    listed_files,
    open_dataset,
    open_dataset_to_share,
    sha256_of,
)
from vislam2tag.datasets.format_registry import (
    LAST,
    LEVEL_OPTIONS,
    ExportContext,
    ExportFormat,
    ImportContext,
    ImportFormat,
    export_named,
    import_format_of,
    import_named,
)
from vislam2tag.datasets.labelled import is_labelled
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.privacy import NOMAP_LEFT_OUT, Privacy, with_privacy
from vislam2tag.datasets.writing import left_out, left_out_of_dataset
from vislam2tag.intake.columns import COLUMNS_FILE, ColumnNames, columns_toml, read_columns_file
from vislam2tag.intake.extents import fingerprint_problem
from vislam2tag.intake.level_scales import LevelScale
from vislam2tag.labeling.tables import SCHEMAS
from vislam2tag.pipeline.datasets.finish import finish_dataset
from vislam2tag.pipeline.run.selection import refuse_among_sessions
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.links import CURE, is_from_outside

_OUR_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)


@dataclass(frozen=True)
class ImportOptions:
    """Options of an import."""

    format_name: str | None = None
    """None: detected from the files' names and first lines."""
    name: str | None = None
    """Name of the data set; None: as the format has it."""
    origin: tuple[float, float] | None = None
    """Origin of metres (latitude and longitude, degrees) for formats with geographic positions."""
    privacy: Privacy = field(default_factory=Privacy)
    description: Description | None = None
    """What people say of the data set."""
    replace: bool = False
    """Replace a data set of another command."""
    most_unpacked: int = MOST_UNPACKED
    """Maximum bytes of an unpacked archive."""
    follow_links: bool = False
    """Include files that links lead to outside the folder."""
    not_heard: float | None = None
    """The number for "not heard" in formats with a column for each access point; None: from the files."""
    levels: LevelScale | None = None
    """What the numbers in these formats mean, if they are not dBm."""
    columns: AnyPath | None = None
    """A ``columns.toml`` that names the columns of a table of the user's own."""


def import_format(
    path: AnyPath, out: AnyPath, options: ImportOptions | None = None, *, progress: Progress[str] = silent
) -> Dataset:
    """Read files of another format into the data set ``out``, which appears complete or not at all, and open it.

    Raises UsageError for an unsuitable format or option, DatasetError, with file and line, if the files are
    not of the format, OutputError if ``out`` cannot be written.
    """
    path, out = Path(path), Path(out)
    options = options or ImportOptions()
    chosen = _chosen(path, options)
    if not options.follow_links and is_from_outside(path, [path]):
        raise DatasetError(f"{path}: the folder contains links to files outside it; {CURE}")
    with dataset_folder(out, "import", options.replace) as folder:
        with scratch_folder(folder.out) as scratch:
            with _reading(path):
                columns = None if options.columns is None else read_columns_file(Path(options.columns))
                given = (options.origin, progress, options.most_unpacked, options.not_heard, options.levels, columns)
                dataset = chosen.read(path, ImportContext(scratch, *given))
                _refuse_other_units(path, dataset)
            dataset = with_privacy(dataset, options.privacy)
            folder.add(dataset)
        info = dataset.info if options.name is None else dataset.info.model_copy(update={"name": options.name})
        if (known := info.sources[0].settings.get("columns")) is not None:
            with folder.out.writing(COLUMNS_FILE) as file:
                file.write(columns_toml(ColumnNames.model_validate(known)).encode())
        finish_dataset(folder, with_description(info, options.description) if options.description else info)
    return open_dataset(out)


def _chosen(path: Path, options: ImportOptions) -> ImportFormat:
    if not path.exists():
        raise DatasetError(f"{path}: no such file or folder")
    named = options.format_name or (None if options.columns is None else LAST)
    chosen = import_named(named) if named else import_format_of(path)
    if options.columns is not None and "columns" not in chosen.takes:
        raise UsageError(f"--columns: the columns of {chosen.name} are known; remove this option")
    if options.origin is not None and "origin" not in chosen.takes:
        raise UsageError(f"--origin: positions of {chosen.name} are already in metres; remove this option")
    for name in LEVEL_OPTIONS:
        if getattr(options, name) is not None and name not in chosen.takes:
            option = name.replace("_", "-")
            raise UsageError(f"--{option}: {chosen.name} only lists received access points; remove this option")
    return chosen


def _refuse_other_units(path: Path, dataset: Dataset) -> None:
    """Raise DatasetError if the positions of a data set are not metres."""
    rows = dataset.fingerprints.select(pl.col("building").fill_null(""), pl.col("x", "y").cast(pl.Float64)).collect()
    if problem := fingerprint_problem(rows):
        raise DatasetError(f"{path}: {problem}")


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Convert errors to those of the input, except for a full disk."""
    try:
        yield
    except pl.exceptions.PolarsError as error:
        raise DatasetError(f"{path}: cannot be read ({first_line(error)})") from error
    except OSError as error:
        if error.errno in _OUR_DISK:
            raise
        raise DatasetError(f"{error.filename or path}: cannot be read ({error.strerror or error})") from error


RECORD_FILE = "export.json"


class ExportRecord(Result):
    """Contents of an export (``export.json``), written last."""

    main_table: ClassVar[str] = "files"

    program: Literal["vislam2tag export"] = "vislam2tag export"
    version: str = __version__
    format: str
    source: str
    """Name of the data set's or the labels' folder."""
    bssid_key: str | None = None
    """Name of the key that BSSIDs are hashed with; None: they are unchanged."""
    findings: tuple[Finding, ...]
    """What was left out."""
    files: dict[str, str]
    """SHA-256 of each file."""


@dataclass(frozen=True)
class ExportOptions:
    """Options of an export besides its format."""

    split: str | None = None
    fold: str | None = None
    survey: AnyPath | None = None
    privacy: Privacy = field(default_factory=Privacy)
    escape_formulas: bool = True
    follow_links: bool = False
    """Include files that links lead to outside the source and the survey."""


def is_export(folder: Path) -> bool:
    """Whether a folder was written by :func:`export`."""
    return _record_of(folder) is not None


def _record_of(folder: Path) -> ExportRecord | None:
    """The record of an export; None if the folder is none."""
    try:
        return ExportRecord.model_validate_json(read_bytes(folder / RECORD_FILE))
    except (OSError, ValidationError):
        return None


def export(
    source: AnyPath,
    out: AnyPath,
    format_name: str,
    options: ExportOptions | None = None,
    *,
    jobs: int = 1,
    progress: Progress[str] = silent,
    tell: Callable[[Sequence[Finding]], None] = lambda _: None,
) -> ExportRecord:
    """Write ``source`` in a format to the folder ``out``, which appears complete or not at all.

    Formats for data sets accept labels, too: the data set is built first. ``progress`` is called with the stage
    (``build``, ``write``) of each part and the number of parts. ``tell`` is called with the names of files that are
    skipped because links lead outside ``source`` and the survey.

    Raises UsageError for an unknown format, split, fold or survey and for options that do not apply, and DatasetError
    if ``source`` is neither, or contains nothing for the format. Raises OutputError if ``out`` contains an export in
    another format or cannot be written.
    """
    source, out = Path(source), Path(out)
    options = options or ExportOptions()
    chosen = export_named(format_name)
    _refuse(source, out, chosen, options)
    given = vars(options) | {"survey": path_or_none(options.survey)}
    context = ExportContext(**given, progress=lambda _part, total: progress("write", total), tell=tell)
    if chosen.write_labels:
        with whole_folder(out, is_export) as folder:
            lost = chosen.write_labels(source, folder, context)
            return _finish(folder, chosen, source, None, (*lost, *left_out(_labels(source), chosen.holds)))
    with whole_folder(out, is_export) as folder:
        with scratch_folder(folder) as scratch:
            opened = _dataset(source, scratch / "dataset", options.follow_links, jobs, progress, tell)
            dataset = with_privacy(opened, options.privacy)
            lost = _write(chosen, dataset, folder, context)
        return _finish(folder, chosen, source, dataset.info.bssid_key, (*_opted_out(opened, dataset), *lost))


def _refuse(source: Path, out: Path, chosen: ExportFormat, options: ExportOptions) -> None:
    """Raise for unsuitable sources and options before anything is written."""
    given = {"split": options.split, "fold": options.fold, "survey": options.survey}
    for option, value in given.items():
        if value is not None and ("split" if option == "fold" else option) not in chosen.takes:
            raise UsageError(f"--{option} does not apply to the format {chosen.name}; remove this option")
    if not source.exists():
        raise DatasetError(f"{source}: no such folder; expected a data set or an output folder of `vislam2tag process`")
    if chosen.source == "labels" and not is_labelled(source):
        raise UsageError(
            f"{source}: is not an output folder of `vislam2tag process`{found_at(source)}. The format {chosen.name} "
            "needs labels with every frame and reading; give an output folder of `vislam2tag process`"
        )
    if options.survey is not None:
        refuse_among_sessions(open_survey(options.survey), out)
    earlier = _record_of(out)
    if earlier is not None and earlier.format != chosen.name:
        raise OutputError(
            f"{out}: contains an export in the format {earlier.format}; choose another --out, or delete that folder "
            "first"
        )


def _dataset(
    source: Path,
    out: Path,
    follow_links: bool,
    jobs: int,
    progress: Progress[str],
    tell: Callable[[Sequence[Finding]], None],
) -> Dataset:
    """Open the data set, or build it of labels in the folder ``out``."""
    if is_dataset(source):
        return open_dataset_to_share(source, follow_links=follow_links)
    if not is_labelled(source):
        raise DatasetError(
            f"{source}: expected a data set or an output folder of `vislam2tag process`{found_at(source)}; "
            f"`vislam2tag dataset {survey_around(source) or source} --out fingerprints` makes a data set of a survey"
        )
    # imported only if needed, because statistics and figures take seconds to import
    from vislam2tag.pipeline.datasets.build import BuildOptions, build_dataset

    return build_dataset(
        source,
        out,
        # the export's own options decide what is removed
        options=BuildOptions(privacy=None, follow_links=follow_links),
        jobs=jobs,
        progress=lambda _session, total: progress("build", total),
        tell=tell,
    )


def _write(chosen: ExportFormat, dataset: Dataset, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    if chosen.write is None:
        raise UsageError(f"the format {chosen.name} cannot be created from a data set")
    return (*chosen.write(dataset, folder, context), *left_out_of_dataset(dataset, chosen.holds))


def _opted_out(before: Dataset, after: Dataset) -> tuple[Finding, ...]:
    """Findings that privacy options added to those of the data set."""
    new = after.info.findings[len(before.info.findings) :]
    return tuple(finding for finding in new if finding.kind == NOMAP_LEFT_OUT)


def _labels(source: Path) -> dict[str, pl.LazyFrame]:
    """All sessions' tables of each kind that exist."""
    found = {name: sorted((source / name).glob("*.parquet")) for name in SCHEMAS}
    return {name: scan_parquet(files) for name, files in found.items() if files}


def _finish(
    folder: Folder, chosen: ExportFormat, source: Path, bssid_key: str | None, findings: tuple[Finding, ...]
) -> ExportRecord:
    """Write the record, which marks the folder as an export and lists what was removed."""
    record = ExportRecord(
        format=chosen.name,
        source=source.resolve().name,
        bssid_key=bssid_key,
        findings=findings,
        files={name: sha256_of(folder / name) for name in listed_files(folder.path)},
    )
    folder.write(RECORD_FILE, record.model_dump_json(indent=1) + "\n")
    return record
