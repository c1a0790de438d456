"""Wide tables: what is heard, what is not, and what is said of cells that cannot be."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vislam2tag.common.errors import DatasetError
from vislam2tag.datasets.wide_tables import WideTable, is_wide, read_columns, read_matrix, read_wide

COLUMNS = {"x": pl.Float64(), "phone": pl.String()}
HEADER = "WAP001,WAP002,x,phone\n"


def wide(tmp_path: Path, text: str | bytes) -> WideTable:
    path = tmp_path / "wide.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_wide(path, COLUMNS, lambda name: name.startswith("WAP"))


def test_only_what_was_heard_becomes_a_row(tmp_path: Path) -> None:
    table = wide(tmp_path, HEADER + "-50,100,1.5,LG\n100,100,2.5,LG\n-70.5,-1,3.5,\n")
    assert table.heard.rows() == [(0, "WAP001", -50.0), (2, "WAP001", -70.5), (2, "WAP002", -1.0)]
    assert table.rows.rows() == [(0, 1.5, "LG"), (1, 2.5, "LG"), (2, 3.5, None)]
    assert table.access_points == ("WAP001", "WAP002")
    assert not table.findings


@pytest.mark.parametrize(
    "text", ["\ufeff" + HEADER + "-50,100,1,LG\n", HEADER.replace("\n", "\r\n") + "-50,100,1,LG\r\n"]
)
def test_byte_order_mark_and_windows_lines(tmp_path: Path, text: str) -> None:
    assert wide(tmp_path, text).heard.rows() == [(0, "WAP001", -50.0)]


@pytest.mark.parametrize(
    "text",
    [
        "WAP001;WAP002;x;phone\n-50;100;1,5;LG\n",
        "wap001,Wap002,X,Phone\n-50.0,100.0,1.5,LG\n",
        "WAP001, WAP002, x, phone\n -50, 100, 1.5,LG\n",
        "WAP001\tWAP002\tx\tphone\n-50dBm\t100\t1.5\tLG\n",
    ],
)
def test_tables_of_spreadsheets_and_of_pandas_are_read(tmp_path: Path, text: str) -> None:
    table = wide(tmp_path, text)
    assert table.heard.rows() == [(0, "WAP001", -50.0)]
    assert table.rows.rows() == [(0, 1.5, "LG")]


def test_a_cell_in_another_notation_late_in_a_table_is_read(tmp_path: Path) -> None:
    text = "WAP001,floor\n" + "-50,1\n-61,1\n-72,1\n-83,1\n" * 12_500 + "-51,2.0\n"
    (tmp_path / "wide.csv").write_text(text, encoding="utf-8")
    table = read_wide(tmp_path / "wide.csv", {"floor": pl.Int64()}, lambda name: name.startswith("WAP"))
    assert table.rows.height == 50_001
    assert table.rows.row(-1) == (50_000, 2)
    for cell, said in (("2.5", "line 50002, column floor: 2.5 is not a whole"), ("1.38E+09", "are rounded to 1e+07")):
        (tmp_path / "wide.csv").write_text(text.replace("2.0", cell), encoding="utf-8")
        with pytest.raises(DatasetError, match=re.escape(said)):
            read_wide(tmp_path / "wide.csv", {"floor": pl.Int64()}, lambda name: name.startswith("WAP"))


def test_odd_levels_and_columns_are_told_by_line(tmp_path: Path) -> None:
    table = wide(tmp_path, "WAP001,WAP002,x,phone,humidity\n-50,,1,LG,3\n-50,-999,1,LG,3\n55,100,1,LG,3\n")
    found = {finding.kind: finding for finding in table.findings}
    assert (found["empty_levels"].count, found["empty_levels"].lines) == (1, (2,))
    assert (found["absurd_levels"].count, found["absurd_levels"].lines) == (2, (3, 4))
    assert "humidity" in found["unknown_columns"].message
    assert table.heard.rows() == [(0, "WAP001", -50.0), (1, "WAP001", -50.0)]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HEADER + "-50,100,1,LG\n-50,near,1,LG\n", "line 3, column WAP002: 'near' is not a number"),
        (HEADER + "-50,100,here,LG\n", "line 2, column x: 'here' is not a number"),
        (HEADER + "-50,100\n", "line 2 has 2 values, expected 4"),
        (HEADER + "-50,100,1,LG,more\n", "line 2 has 5 values, expected 4"),
        ("x,phone\n1,LG\n", "line 1 names no access point"),
        ("WAP001,WAP001,x\n1,2,3\n", "the column WAP001 is twice in line 1"),
        (HEADER, "contains no fingerprint"),
        ("", "is empty"),
        (b"PK\x03\x04\xff\xfe", "cannot be read as a table"),
    ],
)
def test_wrong_files_are_told(tmp_path: Path, text: str | bytes, said: str) -> None:
    with pytest.raises(DatasetError, match=said):
        wide(tmp_path, text)


def test_a_column_that_may_lack_is_null(tmp_path: Path) -> None:
    assert wide(tmp_path, "WAP001,x\n-50,1\n").rows["phone"].to_list() == [None]


@settings(max_examples=50)
@given(arrays(np.int16, st.tuples(st.integers(1, 5), st.integers(1, 6)), elements=st.sampled_from([100, -30, -95, -1])))
def test_a_matrix_comes_back(tmp_path_factory: pytest.TempPathFactory, levels: np.ndarray) -> None:
    path = tmp_path_factory.mktemp("m") / "rss.csv"
    assume((levels == 100).sum() > levels.size // 2)
    np.savetxt(path, levels, fmt="%d", delimiter=",")
    table = read_matrix(path)
    found = np.full(levels.shape, 100)
    column = [int(name[3:]) - 1 for name in table.heard["bssid"]]
    found[table.heard["row"].to_numpy(), column] = table.heard["rssi_dbm"].to_numpy()
    assert np.array_equal(found, levels)
    assert table.rows.height == len(levels)


def test_more_rows_than_are_read_at_once(tmp_path: Path) -> None:
    (tmp_path / "rss.csv").write_text("".join(f"100,{-(row % 90) - 1}\n" for row in range(5000)))
    table = read_matrix(tmp_path / "rss.csv")
    assert table.heard["row"].to_list() == list(range(5000))
    assert table.heard["rssi_dbm"].to_list() == [-(row % 90) - 1 for row in range(5000)]


def test_columns_without_a_header(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    path.write_text("1,2\n3,4.5\n")
    assert read_columns(path, {"x": pl.Float64(), "y": pl.Float64()}).rows() == [(1, 2), (3, 4.5)]
    with pytest.raises(DatasetError, match=r"line 1 has 2 values, expected 1 \(x\)"):
        read_columns(path, {"x": pl.Float64()})
    path.write_text("1,2\n3\n")
    with pytest.raises(DatasetError, match="line 2 has 1 values, expected 2"):
        read_columns(path, {"x": pl.Float64(), "y": pl.Float64()})


def test_recognised_by_the_header(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text('"WAP001","LONGITUDE"\n')
    assert is_wide(tmp_path / "a.csv", frozenset({"WAP001", "LONGITUDE"}))
    assert not is_wide(tmp_path / "a.csv", frozenset({"FLOOR"}))
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00")
    assert not is_wide(tmp_path / "b.csv", frozenset({"WAP001"}))
