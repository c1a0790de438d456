"""What every data set's folder gets once its tables are there: splits, statistics and the card."""

from __future__ import annotations

from dataclasses import replace

from vislam2tag.dataset.card.write import write_card
from vislam2tag.dataset.folder import FolderWriter
from vislam2tag.dataset.model import Dataset, DatasetInfo
from vislam2tag.dataset.splits import split_findings, standard_splits
from vislam2tag.dataset.statistics import dataset_statistics
from vislam2tag.dataset.statistics_record import FieldWork

STATISTICS_FILE = "statistics.json"


def finish_dataset(folder: FolderWriter, info: DatasetInfo, field_work: FieldWork | None = None) -> Dataset:
    """Add the standard splits, ``statistics.json`` and the card to a folder that holds all tables, and open it."""
    dataset = folder.opened(info)
    splits = standard_splits(dataset)
    folder.add_splits(splits)
    info = info.model_copy(update={"findings": (*info.findings, *split_findings(dataset))})
    dataset = replace(dataset, info=folder.finish(info), splits=splits)
    statistics = dataset_statistics(dataset, field_work)
    (folder.root / STATISTICS_FILE).write_text(statistics.model_dump_json(indent=1) + "\n", encoding="utf-8")
    write_card(dataset, statistics, folder.root)
    return dataset
