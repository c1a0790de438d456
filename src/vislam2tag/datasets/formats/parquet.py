"""Plain Parquet tables for use without this program: pandas, Polars, DuckDB and R read them directly.

The tables of a data set, snappy-compressed, all splits as one table, and ``columns.csv`` with the meaning of each
column. The metadata of ``fingerprints.parquet`` contain the manifest, so reading the files back loses only plans.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from pathlib import Path

import polars as pl
from pydantic import ValidationError

from vislam2tag.common.errors import DatasetError, first_line
from vislam2tag.common.files.archives import folder_of, names_in
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import parquet_metadata, read_parquet, scan_parquet, write_csv, write_parquet
from vislam2tag.common.findings import Finding
from vislam2tag.datasets.folder import is_dataset
from vislam2tag.datasets.format_registry import ExportContext, ExportFormat, ImportContext, ImportFormat, register
from vislam2tag.datasets.model import Dataset, DatasetInfo, Split, SplitInfo
from vislam2tag.datasets.schema import FINGERPRINTS, REQUIRED, SCHEMAS, UNITS
from vislam2tag.datasets.writing import MANIFEST, ONE_SPLIT, SET, SPLITS

SPLITS_FILE, COLUMNS_FILE = "splits.parquet", "columns.csv"
SPLITS_COLUMNS = ("split", "id", "group")
_MANIFEST, _SPLITS = "vislam2tag_manifest", "vislam2tag_splits"
_ROWS_A_GROUP = 100_000
HOLDS = {**{name: tuple(schema) for name, schema in SCHEMAS.items()}, SET: (MANIFEST, SPLITS, ONE_SPLIT)}


def write(dataset: Dataset, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    """Write one file for each table, ``splits.parquet`` (split, id, group) and ``columns.csv``."""
    for name, table in dataset.tables.items():
        metadata = _metadata(dataset) if name == FINGERPRINTS else {}
        file = f"{name}.parquet"
        write_parquet(table, folder, file, compression="snappy", row_group_size=_ROWS_A_GROUP, metadata=metadata)
        context.progress(name, len(dataset.tables))
    if dataset.splits:
        write_parquet(splits_table(dataset.splits), folder, SPLITS_FILE, compression="snappy")
    write_csv(columns_table(dataset), folder, COLUMNS_FILE)
    return ()


def _metadata(dataset: Dataset) -> dict[str, str]:
    floors = tuple(floor.model_copy(update={"plan": None}) for floor in dataset.info.floors)
    info = dataset.info.model_copy(update={"floors": floors, "tables": {}, "splits": {}})
    splits = {name: split.info.model_dump(mode="json") for name, split in dataset.splits.items()}
    return {_MANIFEST: info.model_dump_json(), _SPLITS: json.dumps(splits)}


def splits_table(splits: Mapping[str, Split]) -> pl.DataFrame:
    """All splits as one table of text: ``split``, ``id``, ``group``."""
    tables = [split.groups.select(split=pl.lit(name), id="id", group="group") for name, split in splits.items()]
    return pl.concat(tables).cast(pl.String())


def columns_table(dataset: Dataset, held: Mapping[str, Collection[str]] = SCHEMAS) -> pl.DataFrame:
    """Type and unit of each column of a data set's tables: ``table``, ``column``, ``type``, ``unit``.

    ``held`` are the columns that a format writes, by table.
    """
    rows = [
        {"table": name, "column": column, "type": str(kind), "unit": UNITS.get(column)}
        for name in dataset.tables
        for column, kind in SCHEMAS[name].items()
        if column in held.get(name, ())
    ]
    rows += [
        {"table": "splits", "column": column, "type": "String", "unit": None}
        for column in SPLITS_COLUMNS
        if dataset.splits
    ]
    return pl.DataFrame(rows, schema={"table": pl.String, "column": pl.String, "type": pl.String, "unit": pl.String})


def recognises(path: Path) -> bool:
    """Whether the files exist, without a data set's manifest; one may be missing, which :func:`read` reports."""
    if path.is_file() and path.suffix == ".parquet":
        return False
    names = {name.name for name in names_in(path)}
    missing = {COLUMNS_FILE, *(f"{name}.parquet" for name in REQUIRED)} - names
    return not is_dataset(path) and len(missing) <= 1


def read(path: Path, context: ImportContext) -> Dataset:
    """Scan the tables; raises DatasetError if one is missing or has other columns."""
    found = folder_of(path, context.scratch, context.most_unpacked)
    folder = next((file.parent for file in sorted(found.rglob(f"{FINGERPRINTS}.parquet"))), found)
    tables = {name: _table(folder / f"{name}.parquet", name) for name in SCHEMAS if _wanted(folder, name)}
    info, splits = _manifest(folder / f"{FINGERPRINTS}.parquet")
    return Dataset(info, tables, _splits(folder / SPLITS_FILE, splits))


def _wanted(folder: Path, name: str) -> bool:
    return name in REQUIRED or (folder / f"{name}.parquet").is_file()


def _table(path: Path, name: str) -> pl.LazyFrame:
    try:
        table = scan_parquet(path)
        schema = table.collect_schema()
    except (OSError, pl.exceptions.PolarsError) as error:
        raise DatasetError(f"{path}: cannot be read ({first_line(error)}); export it again") from error
    wrong = [column for column, kind in SCHEMAS[name].items() if schema.get(column) != kind]
    if wrong:
        raise DatasetError(f"{path}: column {wrong[0]} is missing or not {SCHEMAS[name][wrong[0]]}; export it again")
    return table.select(*SCHEMAS[name])


def _manifest(path: Path) -> tuple[DatasetInfo, dict[str, SplitInfo]]:
    metadata = parquet_metadata(path)
    try:
        info = DatasetInfo.model_validate_json(metadata[_MANIFEST])
        splits = {name: SplitInfo.model_validate(each) for name, each in json.loads(metadata[_SPLITS]).items()}
    except (KeyError, ValueError, ValidationError) as error:
        raise DatasetError(
            f"{path}: the metadata does not contain the manifest that `export` writes; perhaps another program "
            "rewrote the file. Export again"
        ) from error
    return info, splits


def _splits(path: Path, infos: Mapping[str, SplitInfo]) -> dict[str, Split]:
    if not infos:
        return {}
    try:
        table = read_parquet(path).select(*SPLITS_COLUMNS).cast(pl.String())
    except (OSError, pl.exceptions.PolarsError) as error:
        raise DatasetError(f"{path}: cannot be read ({first_line(error)}); export it again") from error
    return {
        name: Split(info, table.filter(pl.col("split") == name).select("id", "group")) for name, info in infos.items()
    }


register(ImportFormat("parquet", read, recognises), ExportFormat("parquet", HOLDS, write=write))
