from __future__ import annotations

import math

import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.dataset.comparing.table_comparison import ROWS_NAMED, TableDifferences, compare_tables

TABLE = pl.DataFrame(
    {
        "id": ["a", "b", "c"],
        "x": [0.0, 1.0, None],
        "y": [0.0, 1.0, None],
        "rssi_dbm": pl.Series([-60.0, -61.0, -62.0], dtype=pl.Float32),
        "heading_deg": [0.0, 359.999, 20.0],
        "status": ["ok", "ok", None],
        "values": [[1.0, 2.0], [3.0], []],
        "floors": [[0], [0, 1], None],
    }
)


def compared(one: pl.DataFrame, other: pl.DataFrame, tolerance: float = 0.01) -> TableDifferences:
    return compare_tables("walk", "table", one, other, ("id",), tolerance)


def changed(row: int, **values: object) -> pl.DataFrame:
    rows = TABLE.rows(named=True)
    rows[row] |= values
    return pl.DataFrame(rows, schema=TABLE.schema)


def test_a_table_is_the_same_as_itself() -> None:
    found = compared(TABLE, TABLE, 0.0)
    assert found.same
    assert found.matched == 3


def test_a_positions_difference_is_a_distance() -> None:
    (difference,) = compared(TABLE, changed(1, x=4.0, y=5.0)).columns
    assert (difference.column, difference.rows, difference.greatest, difference.where) == ("x, y", 1, 5.0, "b")


def test_the_tolerance_is_of_the_distance() -> None:
    other = changed(0, x=0.006, y=0.0079)
    assert compared(TABLE, other, 0.01).same
    assert not compared(TABLE, other, 0.009).same


@pytest.mark.parametrize(
    ("values", "column", "greatest"),
    [
        ({"rssi_dbm": -63.0}, "rssi_dbm", 3.0),
        ({"rssi_dbm": None}, "rssi_dbm", None),
        ({"rssi_dbm": math.nan}, "rssi_dbm", None),
        ({"x": None, "y": None}, "x, y", None),
        ({"status": "lost"}, "status", None),
        ({"status": None}, "status", None),
        ({"heading_deg": 190.0}, "heading_deg", 170.0),
        ({"values": [1.0, 2.5]}, "values", 0.5),
        ({"values": [1.0]}, "values", None),
        ({"floors": [1]}, "floors", None),
    ],
)
def test_each_kind_of_column(values: dict[str, object], column: str, greatest: float | None) -> None:
    for one, other in ((TABLE, changed(0, **values)), (changed(0, **values), TABLE)):
        (difference,) = compared(one, other).columns
        assert (difference.column, difference.rows, difference.where) == (column, 1, "a")
        assert difference.greatest == (None if greatest is None else pytest.approx(greatest, abs=0.01))


def test_headings_are_compared_around_the_circle() -> None:
    assert compared(TABLE, changed(0, heading_deg=359.995)).same


def test_a_value_too_many_does_not_hide_the_greatest_difference() -> None:
    other = pl.concat([changed(0, rssi_dbm=None).head(1), changed(1, rssi_dbm=-60.0).tail(2)])
    (difference,) = compared(TABLE, other).columns
    assert (difference.rows, difference.greatest, difference.where) == (2, 1.0, "b")


def test_rows_of_one_side_are_counted_and_the_first_named() -> None:
    many = pl.DataFrame({"id": [f"row {number}" for number in range(10)]})
    found = compared(many, many.tail(2))
    assert (found.matched, found.missing, found.extra) == (2, 8, 0)
    assert found.missing_rows == tuple(f"row {number}" for number in range(ROWS_NAMED))


def test_rows_with_one_key_are_matched_in_their_order() -> None:
    twice = pl.DataFrame({"id": ["a", "a"], "rssi_dbm": [1.0, 2.0]})
    assert compared(twice, twice).same
    assert compared(twice, twice.head(1)).missing == 1
    assert compared(twice, twice.reverse()).columns[0].rows == 2


def test_the_order_of_rows_makes_no_difference() -> None:
    assert compared(TABLE, TABLE.reverse()).same


def test_columns_of_one_side_and_of_another_type_are_told() -> None:
    found = compared(TABLE.drop("status"), TABLE.with_columns(rssi_dbm=pl.lit("loud")))
    assert found.missing_columns == ("rssi_dbm",)
    assert found.extra_columns == ("rssi_dbm", "status")


def test_the_width_of_a_number_is_no_difference() -> None:
    assert compared(TABLE, TABLE.with_columns(pl.col("rssi_dbm").cast(pl.Float64))).same


VALUES = st.one_of(st.none(), st.floats(-100, 100, width=32))
ROWS = st.lists(st.tuples(st.sampled_from("abcde"), VALUES, VALUES, st.sampled_from([None, "ok"])), max_size=6)


def as_table(rows: list[tuple[str, float | None, float | None, str | None]]) -> pl.DataFrame:
    schema = {"id": pl.String, "x": pl.Float64, "y": pl.Float64, "status": pl.String}
    return pl.DataFrame(rows, schema=schema, orient="row")


@given(ROWS)
def test_comparison_is_reflexive(rows: list[tuple[str, float | None, float | None, str | None]]) -> None:
    assert compared(as_table(rows), as_table(rows), 0.0).same


@given(ROWS, ROWS, st.floats(0, 10))
def test_comparison_is_symmetric(
    one: list[tuple[str, float | None, float | None, str | None]],
    other: list[tuple[str, float | None, float | None, str | None]],
    tolerance: float,
) -> None:
    there = compared(as_table(one), as_table(other), tolerance)
    back = compared(as_table(other), as_table(one), tolerance)
    assert (there.missing, there.extra, there.matched) == (back.extra, back.missing, back.matched)
    assert (there.missing_rows, there.extra_rows) == (back.extra_rows, back.missing_rows)
    differences = [[(c.column, c.rows, c.greatest) for c in found.columns] for found in (there, back)]
    assert differences[0] == differences[1]
