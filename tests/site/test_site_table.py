"""Rows of a survey's site files, as people save them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from vislam2tag.site.site_table import LineCounts, finite_or_none, is_file, number_or_none, read_site_table


def test_rows_keep_their_lines_and_fields_lose_their_blanks(tmp_path: Path) -> None:
    (tmp_path / "floor_1").mkdir()
    path = tmp_path / "floor_1" / "landmarks.csv"
    path.write_bytes('\ufeffID, X ,Y\r\n\r\na, 1.5,"2,5"\r\nb\r\n'.encode())
    table = read_site_table(tmp_path, path)
    assert table.header == ("id", "x", "y")
    assert table.rows == ((3, ("a", "1.5", "2,5")), (4, ("b",)))
    assert [table.cell(fields, "y") for _, fields in table.rows] == ["2,5", ""]
    assert table.cell(table.rows[0][1], "z") == ""
    assert table.place(3) == "floor_1/landmarks.csv:3"


def test_without_a_header_the_first_line_is_a_row(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("1,2\n3,4\n")
    table = read_site_table(tmp_path, tmp_path / "a.csv", has_header=False)
    assert (table.header, table.rows) == ((), ((1, ("1", "2")), (2, ("3", "4"))))


@pytest.mark.parametrize(("text", "number"), [("", None), ("-1.5", -1.5), ("1e3", 1000.0)])
def test_optional_numbers(text: str, number: float | None) -> None:
    assert (number_or_none(text), finite_or_none(text)) == (number, number)


@pytest.mark.parametrize("text", ["1_000", "one", "1,5", "nan", "inf"])
def test_what_is_no_finite_number(text: str) -> None:
    with pytest.raises(ValueError, match=r"number|finite|float"):
        finite_or_none(text)


def test_lines_of_a_kind_are_one_finding_in_the_order_of_the_messages() -> None:
    counts = LineCounts.of("a.csv")
    counts.add("malformed_lines", 2)
    counts.add("duplicate_floor", 5)
    counts.add("malformed_lines", 7)
    found = counts.findings({"duplicate_floor": "is twice", "malformed_lines": "is odd", "empty_file": "is not"})
    assert [(one.kind, one.lines, one.count, one.message) for one in found] == [
        ("duplicate_floor", (5,), 1, "is twice"),
        ("malformed_lines", (2, 7), 2, "is odd"),
    ]


def test_a_file_is_there_or_not_or_cannot_be_known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    assert is_file(tmp_path / "file")
    assert not is_file(tmp_path)
    assert not is_file(tmp_path / "absent")
    assert not is_file(tmp_path / "file" / "below")

    def refused(*_: object, **__: object) -> os.stat_result:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "stat", refused)
    with pytest.raises(PermissionError):
        is_file(tmp_path / "file")
