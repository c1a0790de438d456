from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.preparation.registration.network import Measurement
from vislam2tag.preparation.registration.point_columns import parse_columns
from vislam2tag.preparation.registration.point_file import read_points
from vislam2tag.preparation.registration.text_table import TextTable, read_text_table


def rows_of(tmp_path: Path, text: str, columns: str | None = None) -> tuple[list[Measurement], list[str]]:
    path = tmp_path / "S1.csv"
    path.write_text(text)
    rows, findings = read_points(path, None if columns is None else parse_columns(columns))
    return rows, [finding.kind for finding in findings]


def coordinates(row: Measurement) -> tuple[str, float, float]:
    return row.point, row.place.real, row.place.imag


@pytest.mark.parametrize(
    "header",
    [
        "Point,East,North,Height",
        "PtID,E [m],N [m],H [m]",
        "Punktnummer,Rechtswert,Hochwert,Höhe",
        "Pkt-Nr.,Ostwert (m),Nordwert (m),Z",
        "name,easting,northing,elevation",
    ],
)
def test_headers_in_both_languages(tmp_path: Path, header: str) -> None:
    rows, findings = rows_of(tmp_path, f"{header}\n7,1.5,2.5,3.5\n")
    assert [coordinates(row) for row in rows] == [("7", 1.5, 2.5)]
    assert rows[0].height_m == 3.5
    assert findings == []


def test_columns_in_any_order_with_code_and_station(tmp_path: Path) -> None:
    (row,), _ = rows_of(tmp_path, "Standpunkt;Hochwert;Code;Punkt;Rechtswert\nA;2,5;LM;007;1,50\n")
    assert (coordinates(row), row.code, row.station) == (("7", 1.5, 2.5), "LM", "A")
    assert (row.source, row.decimals) == ("S1.csv:2", 2)


def test_surveyors_y_before_x_is_east_and_told(tmp_path: Path) -> None:
    (row,), findings = rows_of(tmp_path, "Punkt;Y;X\n7;1;2\n")
    assert coordinates(row) == ("7", 1, 2)
    (other,), _ = rows_of(tmp_path, "name;X;Y\n7;1;2\n")
    assert coordinates(other) == ("7", 1, 2)
    (late,), _ = rows_of(tmp_path, "name;H;Y;X\n7;9;1;2\n")
    assert (coordinates(late), late.height_m) == (("7", 1, 2), 9)
    assert findings == ["assumed_columns"]


def test_without_a_header_custom_counts_and_is_told(tmp_path: Path) -> None:
    (row,), findings = rows_of(tmp_path, "7 1.5 2.5 3.5 LM\n")
    assert (coordinates(row), row.height_m, row.code) == (("7", 1.5, 2.5), 3.5, "LM")
    assert findings == ["assumed_columns"]


def test_given_columns_outdo_header_and_custom(tmp_path: Path) -> None:
    (row,), findings = rows_of(tmp_path, "7,1,2,3\n", "point,N,E,H")
    assert (coordinates(row), findings) == (("7", 2, 1), [])
    (row,), _ = rows_of(tmp_path, "a,b,c,d\nx,7,1,2\n", "-,point,N,E")
    assert coordinates(row) == ("7", 2, 1)


def test_lines_before_the_header_are_passed_over(tmp_path: Path) -> None:
    rows, _ = rows_of(tmp_path, "Job;Mall;floor 3\nDate;2026-01-01\nPunkt;Y;X;H\n7;1;2;3\n")
    assert [coordinates(row) for row in rows] == [("7", 1, 2)]


def test_bad_lines_are_counted_by_number(tmp_path: Path) -> None:
    path = tmp_path / "S1.csv"
    path.write_text("Point,E,N\n7,1,2\n8,one,2\n,1,2\n9,1\n10,1e12,0\n11,3,4\n")
    rows, findings = read_points(path)
    assert [row.point for row in rows] == ["7", "11"]
    assert {finding.kind: finding.lines for finding in findings} == {
        "malformed_lines": (3, 4, 5),
        "non_finite_values": (6,),
    }


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Point,E,H\n7,1,2\n", r"S1\.csv:1: the header has no column for N .* --columns"),
        ("Point,E,N\n", r"S1\.csv: no line is a point"),
        ("only words here\nand here too\n", r"S1\.csv:1: the header has no column for point and E and N"),
    ],
)
def test_files_that_are_no_table_of_points(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SurveyError, match=message):
        rows_of(tmp_path, text)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ("point,E", "required columns are missing: N"),
        ("point,E,N,N", "appears twice"),
        ("point,E,N,colour", "'colour' is not a column"),
    ],
)
def test_wrong_columns_are_told(columns: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        parse_columns(columns)


def table_of(tmp_path: Path, raw: bytes) -> TextTable:
    path = tmp_path / "points.txt"
    path.write_bytes(raw)
    return read_text_table(path)


@pytest.mark.parametrize(
    ("text", "separator", "decimal"),
    [
        ("7,1.5,2.5\n8,3.5,4.5\n", ",", "."),
        ("7;1,5;2,5\n8;3,5;4,5\n", ";", ","),
        ("7;1.5;2.5\n", ";", "."),
        ("7\t1,5\t2,5\n", "\t", ","),
        ("7   1.5  2.5\n", " ", "."),
        ("7 1,5 2,5\n", " ", ","),
        ("Pkt;Y;X\n7;1;2\n", ";", "."),
    ],
)
def test_separator_and_decimal_mark_are_found(tmp_path: Path, text: str, separator: str, decimal: str) -> None:
    table = table_of(tmp_path, text.encode())
    assert (table.separator, table.decimal) == (separator, decimal)
    assert len(table.rows[-1][1]) == 3


@given(st.integers(-(10**6), 10**6), st.sampled_from(",."))
def test_numbers_are_read_with_either_mark(thousandths: int, mark: str) -> None:
    table = TextTable("a", (), ";", mark)
    assert table.number(f"{thousandths / 1000:.3f}".replace(".", mark)) == thousandths / 1000


@pytest.mark.parametrize("text", ["1.234,5", "1,5", "abc", "0x1F", "1_0", "nan", "inf", "1 2"])
def test_what_is_no_number_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is not a number"):
        TextTable("a", (), ";", ".").number(text)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_encodings_are_told_apart(tmp_path: Path, encoding: str) -> None:
    table = table_of(tmp_path, "Höhe;1,0;2,0\n".encode(encoding))
    assert table.rows == ((1, ("Höhe", "1,0", "2,0")),)
    assert table.findings == ()


def test_windows_encoding_is_read_and_told(tmp_path: Path) -> None:
    table = table_of(tmp_path, "a;1;2\nHöhe;1;2\n".encode("cp1252"))
    assert table.rows[1][1][0] == "Höhe"
    assert [(finding.kind, finding.lines) for finding in table.findings] == [("encoding", (2,))]


def test_lines_keep_their_numbers_beside_blanks_and_comments(tmp_path: Path) -> None:
    table = table_of(tmp_path, b"# job\r\n\r\n7,1,2\r\n// end\r\n8,3,4")
    assert table.rows == ((3, ("7", "1", "2")), (5, ("8", "3", "4")))


def test_nothing_to_read_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"points\.txt: contains no rows"):
        table_of(tmp_path, b"\xef\xbb\xbf\n# nothing\n")
    with pytest.raises(SurveyError, match=r"gone\.csv: cannot be opened \(No such file"):
        read_text_table(tmp_path / "gone.csv")


def test_points_with_decimal_commas_between_commas_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "control.csv"
    path.write_text("point,E,N\nK1,0,5,1,5\n")
    with pytest.raises(SurveyError, match=r"control\.csv:2: 5 values under 3 columns"):
        read_points(path)
