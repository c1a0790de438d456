"""What every data set's folder gets once its tables are there: splits, statistics, page and card."""

from __future__ import annotations

from dataclasses import replace

from vislam2tag.dataset.card.write import write_card
from vislam2tag.dataset.folder import FolderWriter
from vislam2tag.dataset.measures.statistics import dataset_statistics
from vislam2tag.dataset.measures.statistics_record import FieldWork
from vislam2tag.dataset.model import Dataset, DatasetInfo
from vislam2tag.dataset.splitting.splits import split_findings, standard_splits
from vislam2tag.report.dataset_page import dataset_page

STATISTICS_FILE = "statistics.json"
PAGE_FILE = "report.html"


def finish_dataset(
    folder: FolderWriter, info: DatasetInfo, field_work: FieldWork | None = None, *, keep_splits: bool = False
) -> Dataset:
    """Add standard splits, ``statistics.json``, ``report.html`` and the card to a folder that holds all tables.

    ``keep_splits``: those that are there are all. Returns the data set as it is then.
    """
    dataset = folder.opened(info)
    splits = dataset.splits
    if not keep_splits:
        splits = {**splits, **standard_splits(dataset)}
        folder.add_splits(splits)
        info = info.model_copy(update={"findings": (*info.findings, *split_findings(dataset))})
    dataset = replace(dataset, info=folder.finish(info), splits=splits)
    statistics = dataset_statistics(dataset, field_work)
    (folder.root / STATISTICS_FILE).write_text(statistics.model_dump_json(indent=1) + "\n", encoding="utf-8")
    (folder.root / PAGE_FILE).write_text(dataset_page(dataset, statistics), encoding="utf-8")
    write_card(dataset, statistics, folder.root)
    return dataset
