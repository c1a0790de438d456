"""Completes a data set on disk with splits, statistics, report and card, and adds splits later.

An added split is written in this order: the record of own files, the split's files, the manifest, the card.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from pydantic import ValidationError

from vislam2tag.common.errors import DatasetError, OutputError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath, read_bytes
from vislam2tag.common.files.own_files import OWN_FILES, OwnFiles
from vislam2tag.common.files.whole_output import exclusive_writer
from vislam2tag.datasets.card import SUMS, write_card
from vislam2tag.datasets.folder import FolderWriter, dataset_in, open_dataset, split_files
from vislam2tag.datasets.model import Dataset, DatasetInfo, Split, Storey
from vislam2tag.datasets.splits import split_findings, standard_splits
from vislam2tag.datasets.statistics import dataset_statistics
from vislam2tag.datasets.statistics_record import DatasetStatistics, FieldWork
from vislam2tag.site.walkable.walked import WalkedFloor
from vislam2tag.views.dataset_page import dataset_page

STATISTICS_FILE = "statistics.json"
PAGE_FILE = "report.html"
_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*")


def finish_dataset(
    folder: FolderWriter,
    info: DatasetInfo,
    field_work: FieldWork | None = None,
    walked: Mapping[Storey, WalkedFloor] = MappingProxyType({}),
    *,
    keep_splits: bool = False,
) -> Dataset:
    """Add standard splits, ``statistics.json``, ``report.html`` and the card to a folder with all tables.

    ``walked`` is the coverage of the plans, for floors where it is known. ``keep_splits``: keep the existing splits and
    add none. Returns the completed data set.
    """
    dataset = folder.opened(info)
    splits = dataset.splits
    if not keep_splits:
        splits = {**splits, **standard_splits(dataset)}
        folder.add_splits(splits)
        info = info.model_copy(update={"findings": (*info.findings, *split_findings(dataset))})
    dataset = replace(dataset, info=folder.finish(info), splits=splits)
    statistics = dataset_statistics(dataset, field_work)
    folder.out.write(STATISTICS_FILE, statistics.model_dump_json(indent=1) + "\n")
    folder.out.write(PAGE_FILE, dataset_page(dataset, statistics, walked))
    write_card(dataset, statistics, folder.out)
    return dataset


def add_split(folder: AnyPath, split: Split) -> Dataset:
    """Save a split with the data set in ``folder``, and return the changed data set.

    If the program is killed, the data set is complete with or without the split; the same call then completes it.
    Raises DatasetError if the folder does not contain a data set, UsageError if it has another split of that name,
    OutputError if nothing can be written or another command is writing.
    """
    folder = dataset_in(Path(folder))
    if not _NAME.fullmatch(split.info.name):
        raise UsageError(f"--name {split.info.name}: use letters, digits, '.', '_' and '-' only")
    open_dataset(folder)  # refuses other folders before anything is written
    with exclusive_writer(folder):  # opened again, because another command may have changed it
        return _added(folder, open_dataset(folder), split)


def _added(folder: Path, dataset: Dataset, split: Split) -> Dataset:
    name = split.info.name
    there = dataset.splits.get(name)
    if there is not None and not (there.info == split.info and there.groups.equals(split.groups)):
        raise UsageError(f"--name {name}: the data set has another split of this name; choose another --name")
    statistics = read_statistics(folder)
    try:
        if there is None:
            _save(Folder.at(folder), dataset, split)
        return _described(folder, statistics)
    except OSError as error:
        raise OutputError(
            f"{folder}: the split cannot be written ({error.strerror}); free space or check permissions"
        ) from error


def _save(folder: Folder, dataset: Dataset, split: Split) -> None:
    _record_as_own(folder, split_files(split.info.name))
    writer = FolderWriter(folder)
    writer.add_splits({split.info.name: split})
    writer.list_split(dataset.info, split.info.name)


def _record_as_own(folder: Folder, files: Sequence[str]) -> None:
    """Add files to the folder's record before they are written; raises OutputError if the user has one of the name.

    A data set without a record (downloaded, or from an earlier version) gets none.
    """
    own = OwnFiles.read(folder.path)
    if own is None:
        return
    for name in files:
        if (folder / name).exists() and not own.owns(name):
            raise OutputError(
                f"{folder / name}: this file is not from this program; move it away, or choose another --name"
            )
    folder.write(OWN_FILES, own.with_those_of(OwnFiles.of(files)).text())


def read_statistics(folder: Path) -> DatasetStatistics | None:
    """Read a data set's ``statistics.json``, if it has one; raises DatasetError if it cannot be read."""
    path = folder / STATISTICS_FILE
    try:
        return DatasetStatistics.model_validate_json(read_bytes(path))
    except FileNotFoundError:
        return None
    except (OSError, ValidationError) as error:
        raise DatasetError(f"{path}: the file cannot be read; build the data set again") from error


def _described(folder: Path, statistics: DatasetStatistics | None) -> Dataset:
    """Write the card again if there is one, because it lists the splits and the checksums of all files."""
    dataset = open_dataset(folder)
    if statistics is not None and (folder / SUMS).is_file():
        write_card(dataset, statistics, Folder.at(folder))
    return dataset
