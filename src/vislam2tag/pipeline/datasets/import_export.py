"""Between our data sets and other formats.

Importing: files of another format go in; a data set with splits, statistics and card comes out. Exporting: a data set,
or what ``process`` wrote, goes in; a folder in a format of the field comes out.
"""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import polars as pl
from pydantic import ValidationError

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError, UsageError, first_line
from vislam2tag.common.files.archives import MOST_UNPACKED
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.given_files import AnyPath, path_or_none, read_bytes
from vislam2tag.common.files.table_files import scan_parquet
from vislam2tag.common.files.whole_output import whole_folder
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.records import Record
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
from vislam2tag.labeling.tables import SCHEMAS
from vislam2tag.pipeline.datasets.finish import finish_dataset
from vislam2tag.pipeline.run.selection import refuse_among_sessions
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.links import CURE, is_from_outside

_OUR_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)


@dataclass(frozen=True)
class ImportOptions:
    """Options of an import besides where the files are."""

    format_name: str | None = None
    """None: found by the files' names and first lines."""
    name: str | None = None
    """Name of the data set; None: as the format has it."""
    origin: tuple[float, float] | None = None
    """Latitude and longitude, degrees, where metres count from, for formats with geographic positions."""
    privacy: Privacy = field(default_factory=Privacy)
    description: Description | None = None
    """What people say of the data set."""
    replace: bool = False
    """Replace a data set of another command."""
    most_unpacked: int = MOST_UNPACKED
    """Bytes that an archive may unpack to."""
    follow_links: bool = False
    """Take files, too, that links lead to outside the folder."""
    not_heard: float | None = None
    """The level that stands for "not heard", for formats with a column for each access point; None: as they state."""


def import_format(
    path: AnyPath, out: AnyPath, options: ImportOptions | None = None, *, progress: Progress[str] = silent
) -> Dataset:
    """Read files of another format into the data set ``out``, whole or not at all, and open it.

    Raises UsageError for a format or option that cannot work, DatasetError, naming file and line, where the files are
    not of the format, OutputError where ``out`` cannot be written.
    """
    path, out = Path(path), Path(out)
    options = options or ImportOptions()
    chosen = _chosen(path, options)
    if not options.follow_links and is_from_outside(path, [path]):
        raise DatasetError(f"{path}: contains links to files outside it; {CURE}")
    with dataset_folder(out, "import", options.replace) as folder:
        with scratch_folder(folder.out) as scratch:
            with _reading(path):
                context = ImportContext(scratch, options.origin, progress, options.most_unpacked, options.not_heard)
                dataset = chosen.read(path, context)
            dataset = with_privacy(dataset, options.privacy)
            folder.add(dataset)
        info = dataset.info if options.name is None else dataset.info.model_copy(update={"name": options.name})
        finish_dataset(folder, with_description(info, options.description) if options.description else info)
    return open_dataset(out)


def _chosen(path: Path, options: ImportOptions) -> ImportFormat:
    if not path.exists():
        raise DatasetError(f"{path}: no such file or folder")
    chosen = import_named(options.format_name) if options.format_name else import_format_of(path)
    if options.origin is not None and "origin" not in chosen.takes:
        raise UsageError(f"--origin: positions of {chosen.name} are metres already; leave it out")
    if options.not_heard is not None and "not_heard" not in chosen.takes:
        raise UsageError(f"--not-heard: {chosen.name} lists only what was heard; leave the option out")
    return chosen


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Tell what goes wrong as the input's fault, but for a disk that is full."""
    try:
        yield
    except pl.exceptions.PolarsError as error:
        raise DatasetError(f"{path}: cannot be read ({first_line(error)})") from error
    except OSError as error:
        if error.errno in _OUR_DISK:
            raise
        raise DatasetError(f"{error.filename or path}: cannot be read ({error.strerror or error})") from error


RECORD_FILE = "export.json"


class ExportRecord(Record):
    """What an export holds (``export.json``), written last."""

    program: Literal["vislam2tag export"] = "vislam2tag export"
    version: str = __version__
    format: str
    source: str
    """Name of the data set's or the labels' folder."""
    bssid_key: str | None = None
    """Name of the key that BSSIDs are hashed with; None: they are as heard."""
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
    """Share files, too, that links lead to outside the source and the survey."""


def is_export(folder: Path) -> bool:
    """Whether a folder was written by :func:`export`."""
    try:
        ExportRecord.model_validate_json(read_bytes(folder / RECORD_FILE))
    except (OSError, ValidationError):
        return False
    return True


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
    """Write ``source`` in a format into the folder ``out``, whole or not at all.

    Formats that are made of a data set take labels, too: the data set is built on the way. ``progress`` hears the stage
    (``build``, ``write``) of each part and how many parts that stage has; ``tell`` the names of what links lead to
    outside ``source`` and the survey, which is left out. Raises UsageError for a
    format, split, fold or survey that is not there and for options that mean nothing to the format, DatasetError where
    ``source`` is neither, or holds nothing that the format can, OutputError where ``out`` cannot be written.
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
    """Raise for what cannot work before anything is written."""
    given = {"split": options.split or options.fold, "survey": options.survey}
    for option, value in given.items():
        if value is not None and option not in chosen.takes:
            raise UsageError(f"--{option}: means nothing to the format {chosen.name}; leave it out")
    if not source.exists():
        raise DatasetError(f"{source}: no such folder; give a data set or what `vislam2tag process` wrote")
    if chosen.source == "labels" and not is_labelled(source):
        what = "is a data set" if is_dataset(source) else "is no output folder of `vislam2tag process`"
        raise UsageError(
            f"{source}: {what}; {chosen.name} is made of labels, with every frame and reading: give the output folder "
            "of `vislam2tag process`"
        )
    if options.survey is not None:
        refuse_among_sessions(open_survey(options.survey), out)


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
            f"{source}: is neither a data set nor an output folder of `vislam2tag process`; make one of them first"
        )
    # Building brings statistics and figures, which take seconds to import: only where they are needed.
    from vislam2tag.pipeline.datasets.build import BuildOptions, build_dataset

    return build_dataset(
        source,
        out,
        # the export's own wishes say what goes
        options=BuildOptions(privacy=None, follow_links=follow_links),
        jobs=jobs,
        progress=lambda _session, total: progress("build", total),
        tell=tell,
    )


def _write(chosen: ExportFormat, dataset: Dataset, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    if chosen.write is None:
        raise UsageError(f"{chosen.name} cannot be made of a data set")
    return (*chosen.write(dataset, folder, context), *left_out_of_dataset(dataset, chosen.holds))


def _opted_out(before: Dataset, after: Dataset) -> tuple[Finding, ...]:
    """What privacy added to the findings of the data set itself."""
    new = after.info.findings[len(before.info.findings) :]
    return tuple(finding for finding in new if finding.kind == NOMAP_LEFT_OUT)


def _labels(source: Path) -> dict[str, pl.LazyFrame]:
    """All sessions' tables of each kind; what is not there is not left out either."""
    found = {name: sorted((source / name).glob("*.parquet")) for name in SCHEMAS}
    return {name: scan_parquet(files) for name, files in found.items() if files}


def _finish(
    folder: Folder, chosen: ExportFormat, source: Path, bssid_key: str | None, findings: tuple[Finding, ...]
) -> ExportRecord:
    """Write the record, which marks the folder as an export and tells what was left out."""
    record = ExportRecord(
        format=chosen.name,
        source=source.resolve().name,
        bssid_key=bssid_key,
        findings=findings,
        files={name: sha256_of(folder / name) for name in listed_files(folder.path)},
    )
    folder.write(RECORD_FILE, record.model_dump_json(indent=1) + "\n")
    return record
