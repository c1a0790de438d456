from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.datasets.factory import SESSION_KEYS, small_dataset
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets.comparison import ANNOTATED, ROWS_NAMED, TableDifferences, comparable, compare, compare_tables
from vislam2tag.datasets.folder import write_dataset
from vislam2tag.datasets.model import Dataset, Fold, Split, SplitInfo
from vislam2tag.datasets.schema import FINGERPRINTS, READINGS

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


WIFI_HEAD = "id,time,type,ssid,mac,rss,x_coord,y_coord\n"


def annotated(folder: Path, text: str, name: str = "wifi_annotated.csv") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_sessions_of_the_labelled_layout_are_its_folders(tmp_path: Path) -> None:
    annotated(tmp_path / "floor_0" / "LG" / "walk", WIFI_HEAD)
    found = comparable(tmp_path)
    assert (found.kind, found.sessions) == (ANNOTATED, {"floor_0/LG/walk"})


def test_a_folder_with_nothing_to_compare_is_refused(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text('{"program": "something else"}')
    with pytest.raises(UsageError, match="contains nothing to compare; pass data sets"):
        comparable(tmp_path)


FIRST = SESSION_KEYS[0][2]


def changed_set(name: str, *changes: pl.Expr) -> Dataset:
    dataset = small_dataset()
    return replace(dataset, tables={**dataset.tables, name: dataset.tables[name].with_columns(*changes)})


def kept(rows: pl.Expr) -> Dataset:
    """The small data set with some readings only."""
    dataset = small_dataset()
    return replace(dataset, tables={**dataset.tables, READINGS: dataset.readings.filter(rows)})


@pytest.fixture
def base(tmp_path: Path) -> Path:
    write_dataset(small_dataset(), tmp_path / "base")
    return tmp_path / "base"


def other(base: Path, dataset: Dataset) -> Path:
    write_dataset(dataset, base.parent / "other")
    return base.parent / "other"


def test_a_set_is_the_same_as_its_copy(base: Path) -> None:
    found = compare(base, other(base, small_dataset()), 0.0)
    assert found.same
    assert found.rows == sum(table.collect().height for table in small_dataset().tables.values())


def test_a_moved_label_is_found_where_it_is(base: Path) -> None:
    moved = pl.when(pl.col("session") == FIRST).then(pl.col("x") + 0.02).otherwise("x").alias("x")
    found = compare(base, other(base, changed_set(FINGERPRINTS, moved)), 0.01)
    (table,) = found.differences
    assert (table.session, table.table) == (FIRST, FINGERPRINTS)
    assert table.columns[0].column == "x, y"
    assert table.columns[0].greatest == pytest.approx(0.02)
    assert compare(base, base.parent / "other", 0.03).same


def test_readings_that_are_gone_are_counted(base: Path) -> None:
    found = compare(base, other(base, kept(pl.col("bssid") != "00:11:22:33:00:00")), 0.01)
    lost = sum(table.missing for table in found.differences)
    assert lost == small_dataset().readings.filter(pl.col("bssid") == "00:11:22:33:00:00").collect().height
    assert {table.table for table in found.differences} == {READINGS}


def test_sessions_of_one_side_are_named_and_not_compared(base: Path) -> None:
    dataset = small_dataset()
    tables = {
        name: table.filter(pl.col("session") != FIRST) if "session" in table.collect_schema() else table
        for name, table in dataset.tables.items()
    }
    found = compare(base, other(base, replace(dataset, tables=tables)), 0.01)
    assert (found.missing_sessions, found.extra_sessions) == ((FIRST,), ())
    assert compare(base.parent / "other", base, 0.01).extra_sessions == (FIRST,)
    assert FIRST not in {table.session for table in found.differences}


def test_splits_are_compared_and_one_that_is_missing_is_all_missing(base: Path) -> None:
    dataset = small_dataset()
    groups = dataset.fingerprints.select(id="scan_id", group=pl.lit("train")).collect()
    split = Split(SplitInfo(name="half", kind="random", folds=(Fold(name="test", test=("test",)),)), groups)
    found = compare(base, other(base, replace(dataset, splits={"half": split})), 0.01)
    (table,) = found.differences
    assert (table.table, table.extra, table.missing) == ("split half", groups.height, 0)


def test_manifests_must_agree_in_what_positions_mean(base: Path) -> None:
    dataset = small_dataset()
    info = dataset.info.model_copy(update={"floors": dataset.info.floors[:1], "title": "another title"})
    assert compare(base, other(base, replace(dataset, info=info)), 0.01).facts == ("floors",)
    drawn = tuple(floor.model_copy(update={"plan": "plans/other.png"}) for floor in dataset.info.floors)
    info = dataset.info.model_copy(update={"floors": drawn})
    assert compare(base, other(base, replace(dataset, info=info)), 0.01).same


def test_different_kinds_are_not_compared(base: Path, tmp_path: Path) -> None:
    walk = tmp_path / "labelled" / "walk"
    walk.mkdir(parents=True)
    (walk / "wifi_annotated.csv").write_text("id,time,type,ssid,mac,rss,x_coord,y_coord\n")
    with pytest.raises(UsageError, match=r"contains data set, .* contains annotated files"):
        compare(base, tmp_path / "labelled", 0.01)


def test_progress_is_told_to_the_end(base: Path) -> None:
    told: list[tuple[int, int]] = []
    compare(base, base, 0.01, lambda done, total: told.append((done, total)))
    assert [done for done, _ in told] == list(range(1, told[-1][1] + 1))


def test_the_published_programs_files_are_the_same_in_our_form(agreement: Path, tmp_path: Path) -> None:
    published = agreement / "published-output" / "floor_0" / "LG"
    for path in published.rglob("wifi_annotated.csv"):
        ours = tmp_path / path.relative_to(published)
        ours.parent.mkdir(parents=True)
        ours.write_text(path.read_text(encoding="utf-8").replace(", ", ","), encoding="utf-8")
    found = compare(published, tmp_path, 0.0)
    assert {(table.table, table.matched) for table in found.differences} <= {("sensors_annotated.csv", 0)}
    assert found.rows > 1000
    assert not found.missing_sessions
