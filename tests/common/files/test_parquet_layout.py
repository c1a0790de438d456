"""A Parquet file whose footer or pages lie is refused before Polars' reader panics or ends the process over it."""

from __future__ import annotations

from pathlib import Path

import duckdb
import numpy as np
import polars as pl
import pytest

from vislam2tag.common.files.parquet_layout import check_parquet
from vislam2tag.common.files.table_files import read_parquet, scan_parquet


@pytest.fixture
def table(tmp_path: Path) -> Path:
    numbers = pl.int_range(1000, eager=True)
    path = tmp_path / "t.parquet"
    columns = {"a": numbers, "b": numbers.cast(pl.String), "c": [[1.0, None]] * 1000, "d": numbers % 2 == 0}
    pl.DataFrame(columns).write_parquet(path, row_group_size=100, metadata={"x": "y"})
    return path


def test_whole_files_pass(table: Path, tmp_path: Path) -> None:
    check_parquet(table)
    empty = tmp_path / "empty.parquet"
    pl.DataFrame({"a": []}).write_parquet(empty)
    check_parquet(empty)


def test_a_column_that_lies_beyond_the_file_is_refused(table: Path) -> None:
    """Bytes are taken out of the data, so that the footer is whole and points too far."""
    data = table.read_bytes()
    length = int.from_bytes(data[-8:-4], "little")
    table.write_bytes(data[:4] + data[-8 - length :])
    for read in (read_parquet, lambda path: scan_parquet(path).collect()):
        with pytest.raises(OSError, match=r"it ends before its last column: .*t\.parquet"):
            read(table)


@pytest.mark.parametrize("size", [0, 3, 8, 11, 500])
def test_a_file_that_is_cut_off_is_refused(table: Path, size: int) -> None:
    table.write_bytes(table.read_bytes()[:size])
    with pytest.raises(OSError, match="is not a complete Parquet file"):
        check_parquet(table)


@pytest.mark.parametrize("fill", [b"\x00", b"\xff", b"\x19", b"\x1c"])
def test_a_footer_of_one_byte_is_refused(table: Path, fill: bytes) -> None:
    data = table.read_bytes()
    length = int.from_bytes(data[-8:-4], "little")
    table.write_bytes(data[: -8 - length] + fill * length + data[-8:])
    with pytest.raises(OSError, match="its footer is damaged"):
        check_parquet(table)


def test_pages_of_all_compressions_and_writers_pass(tmp_path: Path) -> None:
    values = ["a", "b", None] * 3000
    columns = {"s": values, "l": [[x, x] for x in values], "n": range(9000), "c": [1] * 9000}
    for compression in ("uncompressed", "zstd", "snappy"):
        path = tmp_path / f"{compression}.parquet"
        pl.DataFrame(columns).write_parquet(path, compression=compression, data_page_size=500)
        check_parquet(path)
    duckdb.sql(f"COPY (SELECT range AS n, range % 3 AS c FROM range(300000)) TO '{tmp_path}/d.parquet'")
    check_parquet(tmp_path / "d.parquet")


def test_a_page_that_says_it_holds_more_values_is_refused(tmp_path: Path) -> None:
    """Polars ends the process over this one: it asks for 2 EB of memory."""
    path = tmp_path / "t.parquet"
    pl.DataFrame({"a": [1.5, 2.5, None] * 100}).write_parquet(path, compression="uncompressed")
    data = bytearray(path.read_bytes())
    assert data[12:16] == b",\x15\xd8\x04", "the data page's count of values, 300"
    path.write_bytes(data[:14] + b"\xff" + data[15:])
    with pytest.raises(OSError, match="one of its pages is damaged"):
        read_parquet(path)


def test_a_small_file_that_says_it_holds_a_great_table_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "t.parquet"
    rows = 9_000_000
    pl.DataFrame({name: pl.repeat(1.0, rows, eager=True) for name in "abcd"}).write_parquet(path)
    assert path.stat().st_size < 200_000
    with pytest.raises(OSError, match=r"bytes that claim to contain a table of 0\.3 GB"):
        check_parquet(path)
    rng = np.random.default_rng(1)
    pl.DataFrame({"a": rng.normal(size=rows // 3), "b": 1.0}).write_parquet(path)
    check_parquet(path)
