"""A Parquet file whose footer lies is refused before Polars' reader panics over it."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from vislam2tag.common.files.parquet_footer import check_footer
from vislam2tag.common.files.table_files import read_parquet, scan_parquet


@pytest.fixture
def table(tmp_path: Path) -> Path:
    numbers = pl.int_range(1000, eager=True)
    path = tmp_path / "t.parquet"
    columns = {"a": numbers, "b": numbers.cast(pl.String), "c": [[1.0, None]] * 1000, "d": numbers % 2 == 0}
    pl.DataFrame(columns).write_parquet(path, row_group_size=100, metadata={"x": "y"})
    return path


def test_whole_files_pass(table: Path, tmp_path: Path) -> None:
    check_footer(table)
    empty = tmp_path / "empty.parquet"
    pl.DataFrame({"a": []}).write_parquet(empty)
    check_footer(empty)


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
    with pytest.raises(OSError, match="is no whole Parquet file"):
        check_footer(table)


@pytest.mark.parametrize("fill", [b"\x00", b"\xff", b"\x19", b"\x1c"])
def test_a_footer_of_one_byte_is_refused(table: Path, fill: bytes) -> None:
    data = table.read_bytes()
    length = int.from_bytes(data[-8:-4], "little")
    table.write_bytes(data[: -8 - length] + fill * length + data[-8:])
    with pytest.raises(OSError, match="its footer is damaged"):
        check_footer(table)
