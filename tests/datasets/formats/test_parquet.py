"""Plain Parquet tables: DuckDB reads them as they are, our importer loses nothing but plans."""

from __future__ import annotations

from pathlib import Path

import duckdb
import polars as pl
import pytest
from polars.testing import assert_frame_equal

from tests.datasets.factory import SCANS, small_dataset
from tests.datasets.formats.round_trip import exported, imported, odd_dataset, through, with_split
from vislam2tag.common.errors import DatasetError
from vislam2tag.datasets.folder import write_dataset
from vislam2tag.datasets.format_registry import import_format_of


def test_everything_comes_back(tmp_path: Path) -> None:
    dataset = with_split(odd_dataset(), folds=2)
    back = through(dataset, "parquet", tmp_path)
    assert import_format_of(tmp_path / "out").name == "parquet"
    assert back.info == dataset.info
    assert set(back.tables) == set(dataset.tables)
    for name, table in dataset.tables.items():
        assert_frame_equal(back.tables[name].collect(), table.collect())
    split = back.splits["by_walk"]
    assert split.info == dataset.splits["by_walk"].info
    assert_frame_equal(split.groups, dataset.splits["by_walk"].groups)


def test_duckdb_reads_it(tmp_path: Path) -> None:
    exported(with_split(small_dataset()), "parquet", tmp_path / "out")
    query = f"""
        select count(distinct f.scan_id), min(r.rssi_dbm) from '{tmp_path}/out/fingerprints.parquet' f
        join '{tmp_path}/out/readings.parquet' r using (scan_id)
        join '{tmp_path}/out/splits.parquet' s on s.id = scan_id
        where s.split = 'by_walk' and s."group" = f.session and f.x is not null
    """
    count, weakest = duckdb.connect().execute(query).fetchall()[0]
    assert count == 4 * (SCANS - 2)
    assert weakest < -90


def test_each_column_is_explained(tmp_path: Path) -> None:
    exported(small_dataset(), "parquet", tmp_path / "out")
    columns = pl.read_csv(tmp_path / "out" / "columns.csv")
    row = columns.row(by_predicate=(pl.col("table") == "readings") & (pl.col("column") == "rssi_dbm"), named=True)
    assert row == {"table": "readings", "column": "rssi_dbm", "type": "Float32", "unit": "dBm"}
    assert "splits" not in columns["table"]


def test_a_data_set_itself_is_no_export(tmp_path: Path) -> None:
    write_dataset(small_dataset(), tmp_path / "set")
    (tmp_path / "set" / "columns.csv").touch()
    with pytest.raises(DatasetError, match="is already a data set of this program"):
        import_format_of(tmp_path / "set")


def test_tables_that_another_program_rewrote(tmp_path: Path) -> None:
    exported(small_dataset(), "parquet", tmp_path / "out")
    file = tmp_path / "out" / "fingerprints.parquet"
    pl.read_parquet(file).write_parquet(file)
    with pytest.raises(DatasetError, match="does not contain the manifest that `export` writes"):
        imported("parquet", tmp_path / "out", tmp_path / "a")
    (tmp_path / "out" / "readings.parquet").unlink()
    assert import_format_of(tmp_path / "out").name == "parquet"
    with pytest.raises(DatasetError, match=r"readings.parquet: cannot be read"):
        imported("parquet", tmp_path / "out", tmp_path / "b")


def test_a_column_of_another_type(tmp_path: Path) -> None:
    exported(small_dataset(), "parquet", tmp_path / "out")
    file = tmp_path / "out" / "readings.parquet"
    pl.read_parquet(file).with_columns(pl.col("x").cast(pl.String)).write_parquet(file)
    with pytest.raises(DatasetError, match="column x is missing or not Float64"):
        imported("parquet", tmp_path / "out", tmp_path / "scratch")
