"""Joins a later survey to a data set, and describes the changes between the two."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import polars as pl

from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.files.table_files import write_csv
from vislam2tag.common.text_tables import spreadsheet_escaped
from vislam2tag.datasets.changes import (
    CHANGED,
    CHANGED_POINTS,
    OUTDATED,
    RECORD,
    Changes,
    SurveyChanges,
    survey_changes,
    survey_record,
)
from vislam2tag.datasets.folder import dataset_folder, open_dataset_to_share
from vislam2tag.datasets.joining import join_datasets
from vislam2tag.datasets.model import Dataset, DatasetInfo, Storey
from vislam2tag.datasets.settings import CHANGE_CELL_M
from vislam2tag.pipeline.datasets.finish import finish_dataset
from vislam2tag.views.coverage_figures import ChangedFloor, change_map, storey_title
from vislam2tag.views.panels import rendered

CHANGES = "changes"
"""Folder of the data set with the changes."""
_KINDS = ("svg", "pdf")
_SPLIT_FINDINGS = frozenset({"no_split", "not_in_split"})
"""Findings about splits, which are created again."""


def join(
    base: AnyPath,
    later: AnyPath,
    out: AnyPath,
    cell_m: float = CHANGE_CELL_M,
    *,
    replace: bool = False,
    follow_links: bool = False,
) -> SurveyChanges:
    """Write the joined data set to ``out``, with the changes in ``changes/``, and return them.

    ``replace`` allows ``out`` to contain a data set of another command. Raises DatasetError if one is not a data set,
    has links to files outside it without ``follow_links``, or they cannot be joined, OutputError if ``out`` cannot
    be written.
    """
    base, later, out = Path(base), Path(later), Path(out)
    first, second = (open_dataset_to_share(folder, follow_links=follow_links) for folder in (base, later))
    joined, news = join_datasets(first, second)
    both = sorted(_technologies(first) & _technologies(news))
    changes = [survey_changes(first, news, technology, cell_m) for technology in both]
    record = survey_record(first.info.name, second.info.name, changes)
    with dataset_folder(out, "join", replace) as folder:
        folder.add(joined)
        write_changes(folder.out.folder(CHANGES), record, changes)
        _draw(joined, changes, folder.out.folder(CHANGES))
        finish_dataset(folder, _info(joined.info, record))
    return record


def _info(info: DatasetInfo, record: SurveyChanges) -> DatasetInfo:
    kept = (finding for finding in info.findings if finding.kind not in _SPLIT_FINDINGS)
    return info.model_copy(update={"findings": (*kept, *record.findings)})


def _technologies(dataset: Dataset) -> set[str]:
    return set(dataset.fingerprints.select("technology").unique().collect(engine="streaming")["technology"])


def _draw(dataset: Dataset, changes: Sequence[Changes], folder: Folder) -> None:
    """Draw the floors of each technology with labelled fingerprints in both surveys."""
    for one in changes:
        keys = one.places.select(pl.col("building").fill_null(""), "floor").unique().sort("building", "floor").rows()
        shown = [(Storey(*key), dataset.site_floor(Storey(*key))) for key in keys]
        floors = [ChangedFloor(storey_title(key, floor.name), key.building, floor) for key, floor in shown]
        if floors:
            figure = change_map(floors, one)
            for kind in _KINDS:
                folder.write(f"{one.technology}.{kind}", rendered(figure, kind))


def write_changes(folder: Folder, record: SurveyChanges, changes: Sequence[Changes]) -> None:
    """Write ``changes.json``, ``access_points.csv`` and ``places.csv``; the largest changes come first."""
    folder.write(RECORD, record.model_dump_json(indent=1) + "\n")
    for name in ("access_points", "places"):
        tables = [getattr(one, name).with_columns(technology=pl.lit(one.technology)) for one in changes]
        if tables:
            write_csv(spreadsheet_escaped(_listed(pl.concat(tables))), folder, f"{name}.csv")


def _listed(table: pl.DataFrame) -> pl.DataFrame:
    """Sort a table by relevance, and write lists as words."""
    first = ~pl.col("change").is_in([*CHANGED_POINTS, CHANGED, OUTDATED])
    size = "size_db" if "size_db" in table.columns else "score"
    words = (pl.col(name).list.join(" ") for name, kind in table.schema.items() if isinstance(kind, pl.List))
    order = (first, "technology", "change", size)
    ordered = table.sort(*order, descending=[False, False, False, True], nulls_last=True, maintain_order=True)
    return ordered.select("technology", pl.exclude("technology")).with_columns(*words)
