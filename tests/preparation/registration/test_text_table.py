from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.common.errors import SurveyError
from vislam2tag.preparation.registration.text_table import TextTable, read_text_table


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


@pytest.mark.parametrize(
    ("text", "decimal", "number"),
    [
        ("2'600'000.125", ".", 2600000.125),
        ("2\u2019600\u2019000,125 m", ",", 2600000.125),
        ("2.600.000,125", ",", 2600000.125),
        ("2,600,000", ".", 2600000),
        ("\u22121\u202f234.5", ".", -1234.5),
        ("12.5 cm", ".", 0.125),
        ("10ft", ".", 3.048),
    ],
)
def test_groups_and_units_are_parts_of_a_number(text: str, decimal: str, number: float) -> None:
    assert TextTable("a", (), ";", decimal).number(text) == pytest.approx(number)


@pytest.mark.parametrize("text", ["12.3 gon", "1'00", "1234'56", "1,234", "m", "1.5e"])
def test_other_units_and_ambiguous_groups_are_no_numbers(text: str) -> None:
    with pytest.raises(ValueError, match="is not a number"):
        TextTable("a", (), ";", ".").number(text)
