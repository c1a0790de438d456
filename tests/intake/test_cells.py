"""Numbers in cells are read in any notation that is unambiguous, and all others are counted by column."""

from __future__ import annotations

import polars as pl
import pytest

from vislam2tag.intake.cells import separator_of, surplus_fields, with_numbers, without_unit


def read(*cells: str | None) -> tuple[list[float | None], list[tuple[str, int, tuple[int, ...]]]]:
    rows = pl.DataFrame({"row": range(2, len(cells) + 2), "a": cells}, schema_overrides={"row": pl.Int64})
    numbers, odd = with_numbers(rows, ["a"], "t.csv")
    return numbers["a"].to_list(), [(each.kind, each.count, each.lines) for each in odd]


@pytest.mark.parametrize(
    ("cell", "number"),
    [
        (" 0.0441", 0.0441),
        ("-60dBm", -60.0),
        ("-60 dBm ", -60.0),
        ("1 013,2", 1013.2),
        ("1\u202f013", 1013.0),
        ("1'013.25", 1013.25),
        ("1,013.25", 1013.25),
        ("1.013,25", 1013.25),
        ("1.013.250,5", 1013250.5),
        ("\u221271", -71.0),
        ("-60,5", -60.5),
        ("0,125", 0.125),
        ("1,7E+3", 1700.0),
    ],
)
def test_a_number_is_read_in_every_clear_notation(cell: str, number: float) -> None:
    assert read(cell) == ([number], [])


def test_text_that_is_no_number_is_counted_with_its_line_and_empty_cells_are_not() -> None:
    numbers = [1.0, None, None, None, None, None]
    assert read("1", "N/A", "", None, "near", " ") == (numbers, [("unreadable_cells", 2, (3, 6))])
    rows = pl.DataFrame({"row": [2], "a": ["N/A"]})
    assert "column a: cells such as 'N/A' (line 2) cannot be read" in with_numbers(rows, ["a"], "")[1][0].message


def test_a_comma_before_three_digits_is_read_only_if_other_cells_show_its_meaning() -> None:
    assert read("1,013", "998") == ([None, 998], [("unreadable_cells", 1, (2,))])
    assert read("1,013", "0,998") == ([1.013, 0.998], [])


def test_columns_of_numbers_stay() -> None:
    rows = pl.DataFrame({"row": [2, 3], "a": [1, None], "b": [0.5, float("inf")]})
    numbers, odd = with_numbers(rows, ["a", "b"], "")
    assert numbers.rows() == [(2, 1.0, 0.5), (3, None, float("inf"))]
    assert odd == []


@pytest.mark.parametrize("separator", [";", "\t", "|", ","])
def test_the_separator_is_the_most_frequent_mark(separator: str) -> None:
    assert separator_of(separator.join(("time", "x", "y"))) == separator


@pytest.mark.parametrize(
    ("lines", "separator", "said"),
    [
        ("1,1,5,-0,25\n2,2,5,-0,5", ",", "line 4 has 5 fields, the first line 3: perhaps decimal commas"),
        ("1,2,3\n2,3,Cafe, Bar", ",", "line 5 has 4 fields, the first line 3: quote texts that contain ','"),
        ('1,"2,0",3\n2,4', ",", None),
        ("1;2;3;4", ";", "line 4 has 4 fields, the first line 3: quote texts that contain ';'"),
    ],
)
def test_a_line_with_more_fields_than_the_header_is_named_with_its_cause(
    lines: str, separator: str, said: str | None
) -> None:
    found = surplus_fields(f"t{separator}x{separator}y\n{lines}\n", separator, 2)
    assert found is None if said is None else found is not None and found.startswith(said)


@pytest.mark.parametrize(
    ("header", "name", "metres"),
    [
        ("E [m]", "E", 1.0),
        ("Ost in mm", "Ost", 0.001),
        ("H (in cm)", "H", 0.01),
        ("pos_x_ft", "pos x", 0.3048),
        ("Easting US survey feet", "Easting", 1200 / 3937),
        ("Ost (LV95)", "Ost (LV95)", None),
        ("m", "m", None),
    ],
)
def test_a_header_is_parted_into_name_and_unit(header: str, name: str, metres: float | None) -> None:
    assert without_unit(header) == (name, metres)
