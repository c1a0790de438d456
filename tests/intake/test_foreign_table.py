"""Tables of other programs: their form is found by looking, and their cells equal those that were written."""

from __future__ import annotations

import string
from pathlib import Path
from typing import Any

import pandas as pd
import polars as pl
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from vislam2tag.common.errors import UsageError
from vislam2tag.intake import foreign_table
from vislam2tag.intake.foreign_table import ForeignTable, decoded, read_foreign_table, table_of_frame


def read(folder: Path, content: str | bytes, name: str = "table.csv") -> ForeignTable:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return read_foreign_table(path)


def cells(table: ForeignTable) -> list[tuple[object, ...]]:
    return table.rows.rows()


@pytest.mark.parametrize("mark", [",", ";", "\t", "|", " "])
def test_separators(tmp_path: Path, mark: str) -> None:
    table = read(tmp_path, mark.join("abc") + "\n" + mark.join("123") + "\n" + mark.join("456") + "\n")
    assert table.columns == ("a", "b", "c")
    assert cells(table) == [("1", "2", "3"), ("4", "5", "6")]
    assert table.lines.to_list() == [2, 3]


def test_blanks_before_and_between_fields(tmp_path: Path) -> None:
    table = read(tmp_path, "  x   y\n  1.0 2.0\n 10.0\t3.0 \n")
    assert (table.columns, cells(table)) == (("x", "y"), [("1.0", "2.0"), ("10.0", "3.0")])


def test_a_semicolon_wins_over_decimal_commas(tmp_path: Path) -> None:
    table = read(tmp_path, "x;y\n1,5;2,5\n2,5;3,5\n")
    assert cells(table) == [("1,5", "2,5"), ("2,5", "3,5")]
    assert table.notes == ("fields are separated by semicolons",)


@pytest.mark.parametrize("first", ["sep=;", '"sep=;"'])
def test_a_line_that_states_the_separator(tmp_path: Path, first: str) -> None:
    table = read(tmp_path, f"{first}\nname,and;b\n1,2;3\n")
    assert (table.columns, cells(table), table.header_line) == (("name,and", "b"), [("1,2", "3")], 2)


def test_preamble_and_comments_are_not_used(tmp_path: Path) -> None:
    table = read(tmp_path, "WigleWifi-1.6,appRelease=2.90\nMAC,RSSI,FirstSeen\nm,-60,1\nn,-61,2\n")
    assert (table.columns, table.height, table.lines.to_list()) == (("MAC", "RSSI", "FirstSeen"), 2, [3, 4])
    assert "the line above the table is not used" in table.notes
    table = read(tmp_path, "# one\n# two, three\n\nx,y\n1,2\n")
    assert (table.columns, cells(table), table.lines.to_list()) == (("x", "y"), [("1", "2")], [5])
    assert table.notes == ("2 lines above the table are not used",)


def test_a_header_in_a_comment(tmp_path: Path) -> None:
    table = read(tmp_path, "# a log\n# time x y\n1.0 2.0 3.0\n1.5 2.5 3.5\n")
    assert (table.columns, cells(table)) == (("time", "x", "y"), [("1.0", "2.0", "3.0"), ("1.5", "2.5", "3.5")])


def test_several_header_rows(tmp_path: Path) -> None:
    table = read(tmp_path, "pose,,wifi,\nx,y,x,rssi\n1,2,3,-60\n")
    assert table.columns == ("pose x", "pose y", "wifi x", "wifi rssi")
    assert cells(table) == [("1", "2", "3", "-60")]
    assert table.notes == ("2 header rows were read",)


def test_a_row_of_units(tmp_path: Path) -> None:
    table = read(tmp_path, "time,x,rssi\nms,ft,dBm\n1,2,-60\n")
    assert (table.columns, cells(table)) == (("time [ms]", "x [ft]", "rssi"), [("1", "2", "-60")])


def test_a_column_of_row_numbers_is_not_used(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    pd.DataFrame({"x": [1.5, 2.5], "y": [3, 4]}).to_csv(path)
    table = read_foreign_table(path)
    assert (table.columns, cells(table)) == (("x", "y"), [("1.5", "3"), ("2.5", "4")])
    assert table.notes == ("the column of row numbers is not used",)
    unnamed = read(tmp_path, ",x\n1700000000,1\n1700000001,2\n")
    assert unnamed.columns == ("column_1", "x")  # times, not row numbers


def test_no_header(tmp_path: Path) -> None:
    table = read(tmp_path, "1,2,-60\n3,4,-61\n")
    assert (table.columns, table.header_line, table.lines.to_list()) == (
        ("column_1", "column_2", "column_3"),
        0,
        [1, 2],
    )
    assert table.notes == ("the table has no header",)


def test_blanks_quotes_and_empty_cells(tmp_path: Path) -> None:
    table = read(tmp_path, 'name, x , y\n"a, b", 1 , \n"two\nlines",2,3\n')
    assert table.columns == ("name", "x", "y")
    assert cells(table) == [("a, b", "1", None), ("two\nlines", "2", "3")]
    assert table.lines.to_list() == [2, 3]


def test_a_lone_quote_is_part_of_its_line(tmp_path: Path) -> None:
    table = read(tmp_path, '# 5" screen\nx,y\n1,2\n3,4\n')
    assert cells(table) == [("1", "2"), ("3", "4")]


def test_line_ends_blank_lines_and_a_last_line_without_end(tmp_path: Path) -> None:
    table = read(tmp_path, "x,y\r\n\r\n1,2\r\n  \r\n3,4")
    assert (cells(table), table.lines.to_list()) == ([("1", "2"), ("3", "4")], [3, 5])


def test_equal_and_missing_names(tmp_path: Path) -> None:
    assert read(tmp_path, "x,x,y\n1,2,3\n").columns == ("x", "x (2)", "y")
    assert read(tmp_path, "x,,y,\n1,2,3,\n").columns == ("x", "column_2", "y")


def test_a_ragged_line_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"table\.csv: line 6 has 3 fields, the first line 2"):
        _ = read(tmp_path, "x,y\n\n1,2\n\n\n3,4,5\n").rows
    with pytest.raises(UsageError, match=r"line 2 has 4 fields.*perhaps decimal commas"):
        _ = read(tmp_path, "x,y\n1,5,2,5\n1,5,2,5\n").rows
    assert cells(read(tmp_path, "x,y,z\n1,2\n3,4,5\n")) == [("1", "2", None), ("3", "4", "5")]


def test_a_ragged_line_of_a_later_batch_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(foreign_table, "CELLS_AT_ONCE", 4)
    table = read(tmp_path, "x,y\n" + "1,2\n" * 60 + "1,2,3\n")
    with pytest.raises(UsageError, match="line 62 has 3 fields"):
        list(table.batches())


def test_batches_are_the_rows(tmp_path: Path) -> None:
    table = read(tmp_path, "# above\nx,y\n" + "".join(f"{number},{number}\n\n" for number in range(7)))
    parts = list(table.batches(3))
    assert [part.height for _, part in parts] == [3, 3, 1]
    assert pl.concat([part for _, part in parts]).equals(table.rows)
    assert pl.concat([lines for lines, _ in parts]).to_list() == table.lines.to_list() == list(range(3, 17, 2))
    assert table.head(2).equals(table.rows.head(2))


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_encodings(tmp_path: Path, encoding: str) -> None:
    table = read(tmp_path, "x,Gebäude\n1,Büro\n".encode(encoding))
    assert (table.columns, cells(table)) == (("x", "Gebäude"), [("1", "Büro")])
    assert table.notes == (("line 1 " + foreign_table.NOT_UTF8,) if encoding == "cp1252" else ())


def test_decoded_says_which_line_is_not_utf8() -> None:
    assert decoded(b"a\nb\xfc") == ("a\nbü", 2)
    assert decoded(b"\xef\xbb\xbfa") == ("a", None)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "the file is empty"),
        (b"\n \n", "the file is empty"),
        (b"PK\x03\x04", "a spreadsheet"),
        (b"\x00\x01\x02", "is not text"),
    ],
)
def test_what_is_no_table(tmp_path: Path, content: bytes, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        read(tmp_path, content)


def test_a_missing_file_and_a_damaged_parquet_file(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="No such file"):
        read_foreign_table(tmp_path / "none.csv")
    with pytest.raises(UsageError, match=r"t\.parquet: cannot be read"):
        read(tmp_path, b"PAR1 not", "t.parquet")
    with pytest.raises(UsageError, match="not a readable XLSX"):
        read(tmp_path, b"PK not", "t.xlsx")


def test_a_header_alone_has_no_rows(tmp_path: Path) -> None:
    table = read(tmp_path, "x,y\n")
    assert (table.height, table.rows.columns, table.head().height) == (0, ["x", "y"], 0)


def test_xlsx(tmp_path: Path) -> None:
    frame = pd.DataFrame(
        {"x": [1.5, 2.0], "name": ["a, b", 'c "d"'], "when": pd.to_datetime(["2024-05-01 09:14:01"] * 2)}
    )
    path = tmp_path / "t.xlsx"
    with pd.ExcelWriter(path) as book:
        frame.to_excel(book, sheet_name="first", index=False, startrow=2)
        frame.to_excel(book, sheet_name="second")
    table = read_foreign_table(path)
    assert table.columns == ("x", "name", "when")
    assert cells(table) == [("1.5", "a, b", "2024-05-01 09:14:01"), ("2", 'c "d"', "2024-05-01 09:14:01")]
    assert (table.header_line, table.lines.to_list()) == (3, [4, 5])
    assert "of 2 sheets the first, first, was read" in table.notes


def test_parquet_keeps_types_and_loses_the_index(tmp_path: Path) -> None:
    frame = pd.DataFrame({"x": [1.5, 2.5, 3.5], "name": ["a", None, "c"]}).drop(1)
    path = tmp_path / "t.parquet"
    frame.to_parquet(path, index=True)
    table = read_foreign_table(path)
    assert (table.columns, cells(table), table.lines.to_list()) == (("x", "name"), [(1.5, "a"), (3.5, "c")], [2, 3])
    assert table.notes == ("the column of row numbers is not used",)


def test_wide_parquet_in_batches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(foreign_table, "CELLS_AT_ONCE", 1000)
    frame = pl.DataFrame({f"AP{place}": [place, place + 1, place + 2] for place in range(600)})
    frame.write_parquet(tmp_path / "t.parquet")
    table = read_foreign_table(tmp_path / "t.parquet")
    parts = [part for _, part in table.batches()]
    assert [part.height for part in parts] == [1, 1, 1]
    assert pl.concat(parts).equals(frame)


def test_a_data_frame_is_a_table() -> None:
    frame = pl.DataFrame({"Unnamed: 0": [0, 1], "x": [1.5, 2.5]})
    table = table_of_frame(frame)
    assert (table.columns, table.lines.to_list()) == (("x",), [2, 3])


def test_only_the_head_of_a_large_file_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(foreign_table, "_HEAD_BYTES", 1000)
    path = tmp_path / "t.csv"
    path.write_text("x,y\n" + "10,20\n" * 5000)
    head = read_foreign_table(path, only_head=True)
    assert 100 < head.height < 200
    assert head.rows.equals(read_foreign_table(path).rows.head(head.height))


TEXTS = (
    st.text(string.ascii_letters + " ,;|\t'äß\"\n", min_size=1, max_size=8)
    .map(str.strip)
    .filter(lambda text: text.lower() not in ("", "na", "n/a", "none", "null", "nan") and text.count('"') % 2 == 0)
)
DIALECTS = st.fixed_dictionaries(
    {
        "sep": st.sampled_from([",", ";", "\t", "|"]),
        "quoting": st.sampled_from([0, 2]),
        "index": st.booleans(),
        "lineterminator": st.sampled_from(["\n", "\r\n"]),
        "encoding": st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]),
    }
)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    numbers=st.lists(st.tuples(st.floats(-1e6, 1e6), st.integers(-100, -1)), min_size=2, max_size=30),
    texts=st.data(),
    dialect=DIALECTS,
    preamble=st.sampled_from(["", "# a comment\n", "sep"]),
)
def test_what_pandas_writes_is_read_back(
    tmp_path: Path,
    numbers: list[tuple[float, int]],
    texts: st.DataObject,
    dialect: dict[str, Any],
    preamble: str,
) -> None:
    names = texts.draw(st.lists(TEXTS, min_size=len(numbers), max_size=len(numbers)))
    frame = pd.DataFrame({"x": [x for x, _ in numbers], "rssi": [level for _, level in numbers], "name": names})
    path = tmp_path / "random.csv"
    with path.open("w", encoding=str(dialect["encoding"]), newline="") as file:
        file.write(f"sep={dialect['sep']}\n" if preamble == "sep" else preamble)
        frame.to_csv(file, **{key: value for key, value in dialect.items() if key != "encoding"})
    table = read_foreign_table(path)
    assert table.columns == ("x", "rssi", "name")
    found = table.rows
    assert found["x"].cast(pl.Float64).to_list() == frame["x"].to_list()
    assert found["rssi"].cast(pl.Int64).to_list() == frame["rssi"].to_list()
    assert found["name"].to_list() == names
