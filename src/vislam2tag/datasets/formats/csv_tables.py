"""Plain CSV tables (UTF-8, commas, decimal points) for spreadsheets and programs that do not read Parquet.

The tables of a data set without columns of lists, all splits as one table, and ``columns.csv`` with the type and unit
of each column.
"""

from __future__ import annotations

import polars as pl

from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import write_csv
from vislam2tag.common.findings import Finding
from vislam2tag.common.text_tables import spreadsheet_escaped
from vislam2tag.datasets.format_registry import ExportContext, ExportFormat, register
from vislam2tag.datasets.formats.parquet import COLUMNS_FILE, columns_table, splits_table
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, MAGNETIC, READINGS, RTT, SCHEMAS, SESSIONS
from vislam2tag.datasets.writing import ONE_SPLIT, SET, SPLITS

HOLDS = {
    **{
        name: tuple(column for column, kind in SCHEMAS[name].items() if not isinstance(kind, pl.List))
        for name in (FINGERPRINTS, READINGS, ACCESS_POINTS, SESSIONS, MAGNETIC, RTT)
    },
    SET: (SPLITS, ONE_SPLIT),
}
SPLITS_FILE = "splits.csv"


def write(dataset: Dataset, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    """Write one file for each table, ``splits.csv`` (split, id, group) and ``columns.csv``."""
    tables = {name: table for name, table in dataset.tables.items() if name in HOLDS}
    for name, table in tables.items():
        shown = spreadsheet_escaped(table.select(HOLDS[name]), formulas=context.escape_formulas)
        write_csv(shown, folder, f"{name}.csv")
        context.progress(name, len(tables))
    if dataset.splits:
        write_csv(splits_table(dataset.splits), folder, SPLITS_FILE)
    write_csv(columns_table(dataset, HOLDS), folder, COLUMNS_FILE)
    return ()


register(writes=ExportFormat("csv", HOLDS, write=write))
