"""Importing: files of another format go in; a data set with splits, statistics and card comes out."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import polars as pl

from vislam2tag.common.errors import DatasetError, UsageError, first_line
from vislam2tag.common.files.archives import MOST_UNPACKED
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.progress import Progress, silent
from vislam2tag.datasets.description import Description, with_description
from vislam2tag.datasets.folder import dataset_folder, open_dataset
from vislam2tag.datasets.format_registry import ImportContext, ImportFormat, import_format_of, import_named
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.privacy import Privacy, with_privacy
from vislam2tag.pipeline.datasets.finish import finish_dataset
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
