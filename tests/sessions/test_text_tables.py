"""Text tables of recorders."""

from __future__ import annotations

import polars as pl
import pytest

from tests.sessions.raw import count_lines
from vislam2tag.sessions.readings import WIFI_LINES
from vislam2tag.sessions.text_tables import FieldTable, NamedTable, RawTable

SCHEMA = {"time_ns": pl.Int64, "name": pl.String, "value": pl.Float64}


def parse(text: str | bytes) -> RawTable:
    return FieldTable(SCHEMA).read(text if isinstance(text, bytes) else text.encode(), "file.csv")


def kinds(table: RawTable) -> dict[str, tuple[int, ...]]:
    return {finding.kind: finding.lines for finding in table.findings}


@pytest.mark.parametrize("separator", ["; ", ";"])
@pytest.mark.parametrize("mark", [",", "."])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_separators_marks_and_newlines_are_found_by_looking(separator: str, mark: str, newline: str) -> None:
    lines = [("5", "ACC", f"-1{mark}25"), ("6", "GYRO", "3")]
    table = parse("".join(separator.join(line) + newline for line in lines))
    assert table.rows.rows() == [(1, 5, "ACC", -1.25), (2, 6, "GYRO", 3.0)]
    assert not table.findings


def test_line_numbers_stay_exact_around_bad_and_blank_lines() -> None:
    table = parse("1; a; 1\n\n2; b; 2\nno table\n   \n3; c; 3\n\n\n4; d; 4\n")
    assert table.lines == 9
    assert table.rows["row"].to_list() == [1, 3, 6, 9]
    assert table.unreadable == (2, 4, 5, 7, 8)
    assert kinds(table) == {"malformed_lines": (2, 4, 5, 7, 8)}


@pytest.mark.parametrize(
    "line",
    [
        "1; a",
        "1; a; 2; 3",
        "1; a; ",
        "1; ; 2",
        "; a; 2",
        "1.5; a; 2",
        "1e3; a; 2",
        "-1; a; 2",
        "9223372036854775808; a; 2",
        "1; a; 1,234.5",
        "1; a; 1.234.567",
        "1; a; 0x1F",
        "1; a; 1_000",
        "1; a; two",
        "1, a, 2",
        "1\ta\t2",
        "1; a\x00; 2",
        "1; \ufffd; 2",
        "\x00",
        '"1; a; 2"',
    ],
)
def test_lines_that_are_no_row(line: str) -> None:
    table = parse(f"0; first; 0.5\n{line}\n7; last; 0.5\n")
    assert table.rows["name"].to_list() == ["first", "last"]
    assert table.unreadable == (2,)
    assert set(kinds(table)) == {"malformed_lines"}


@pytest.mark.parametrize(("time", "kind"), [("7,28313E+14", "rounded_times"), ("728313.25", "time_unit")])
def test_files_whose_times_have_another_notation(time: str, kind: str) -> None:
    table = parse(f"{time}; a; 2\n" * 20)
    assert [(one.kind, one.count) for one in table.findings if one.kind != "mixed_decimal_marks"] == [(kind, 20)]


def test_broken_utf8_makes_a_text_field_unreadable() -> None:
    table = parse(b"1; a; 1\n2; b\xff; 2\n3; c; 3\xfe\n")
    assert table.unreadable == (2, 3)


@pytest.mark.parametrize("text", ["NaN", "nan", "Infinity", "-Infinity", "inf", "1e999"])
def test_non_finite_numbers_parse(text: str) -> None:
    value = parse(f"1; a; {text}\n").rows["value"][0]
    assert value != value or abs(value) == float("inf")


def test_both_decimal_marks_in_one_file_are_understood_and_reported() -> None:
    table = parse("1; a; 1,5\n2; b; 2.5\n3; c; 3,5\n4; d; 4\n")
    assert table.rows["value"].to_list() == [1.5, 2.5, 3.5, 4.0]
    assert kinds(table) == {"mixed_decimal_marks": (2,)}


def test_an_unreadable_line_does_not_make_a_file_mixed() -> None:
    assert kinds(parse("1; a; 1,5\nv2.5\n")) == {"malformed_lines": (2,)}


def test_a_cut_off_last_line_is_told_from_malformed_ones() -> None:
    table = parse("bad\n1; a; 1.5\n2; b")
    assert kinds(table) == {"malformed_lines": (1,), "partial_last_line": (3,)}
    assert table.lines == 3


def test_a_last_line_without_newline_that_parses_is_a_row() -> None:
    table = parse("1; a; 1.5\n2; b; 2.5")
    assert table.rows.height == 2
    assert not table.findings


def test_an_empty_file_is_a_finding_of_its_own() -> None:
    table = parse(b"")
    assert (table.lines, table.rows.height, table.unreadable) == (0, 0, ())
    assert set(kinds(table)) == {"empty_file"}


def test_a_byte_order_mark_is_no_text() -> None:
    assert parse("\ufeff1; a; 1.5\n").rows.rows() == [(1, 1, "a", 1.5)]


@pytest.mark.parametrize(
    ("data", "lines"), [(b"", 0), (b"a", 1), (b"a\n", 1), (b"a\nb", 2), (b"\n", 1), (b"\n\n", 2), (b"a\r\nb\r\n", 2)]
)
def test_lines_are_counted_as_an_editor_counts_them(data: bytes, lines: int) -> None:
    assert count_lines(data) == lines
    assert parse(data).lines == lines


def test_cells_of_a_named_table_are_reported_by_column_and_blanks_are_no_part_of_them() -> None:
    read = NamedTable({"time": pl.Int64, "x": pl.Float64}, ("x",)).read
    assert read(b"time,x\n1, 2.5\n 2 , 3\n", "f.csv").rows.rows() == [(2, 1, 2.5), (3, 2, 3.0)]
    found = {each.kind: each for each in read(b"time,x\n1,N/A\n2,3\n3,near\n", "f.csv").findings}
    assert (found["unreadable_cells"].count, found["unreadable_cells"].lines) == (2, (2, 4))
    assert "column x: cells such as 'N/A' (line 2)" in found["unreadable_cells"].message


def test_times_that_a_spreadsheet_rounded_are_named() -> None:
    tables = (
        NamedTable({"time": pl.Int64, "x": pl.Float64}).read,
        FieldTable({"t": pl.Int64, "x": pl.Float64}, ",").read,
    )
    for read in tables:
        found = {each.kind: each for each in read(b"time,x\n1.70136E+18,2\n1.70136E+18,3\n", "f.csv").findings}
        assert "such as 1.70136E+18" in found["rounded_times"].message
        assert "malformed_lines" not in found


@pytest.mark.parametrize(("separator", "words"), [(", ", "commas"), (",", "commas"), ("\t", "tabs")])
def test_another_separator_is_named_with_a_line_of_the_right_form(separator: str, words: str) -> None:
    lines = [("5", "281", "WLAN", "Cafe; Bar", "02:ca:07:12:27:d2", "-60")] * 3
    (found,) = WIFI_LINES.read("".join(separator.join(line) + "\n" for line in lines).encode(), "wifi.csv").findings
    right = f";{separator[1:]}".join(lines[0])
    assert (found.kind, found.count) == ("malformed_lines", 3)
    assert f"fields are separated by {words}, not by semicolons as in '{right}'" in found.message
    (found,) = parse(separator.join(("5", "ACC", "1.5")) + "\nno table\n").findings
    assert f"fields are separated by {words}" not in found.message


@pytest.mark.parametrize(("separator", "words"), [(";", "semicolons"), ("\t", "tabs")])
def test_a_named_table_that_a_spreadsheet_saved_is_recognised_by_its_separator(separator: str, words: str) -> None:
    table = NamedTable({"time_ns": pl.Int64, "x": pl.Float64})
    (found,) = table.read(
        f"time_ns{separator}more{separator}x\r\n2,81838E+14{separator}{separator}2,5\r\n".encode(), "f"
    ).findings
    assert (found.kind, found.count) == ("malformed_header", 1)
    assert found.message.startswith(f"fields are separated by {words}, so a spreadsheet saved this file")
    (found,) = table.read(f"time_ns{separator}more\r\n1{separator}2\r\n".encode(), "f").findings
    assert found.message.startswith("the header must name time_ns, x")
