from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest

from tests.dataset.factory import SESSION_KEYS, small_dataset
from vislam2tag.common.errors import UsageError
from vislam2tag.dataset.comparing.comparison import compare
from vislam2tag.dataset.folder import write_dataset
from vislam2tag.dataset.model import Dataset, Fold, Split, SplitInfo
from vislam2tag.dataset.schema import FINGERPRINTS, READINGS

FIRST = SESSION_KEYS[0][2]


def changed(name: str, *changes: pl.Expr) -> Dataset:
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
    found = compare(base, other(base, changed(FINGERPRINTS, moved)), 0.01)
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
    with pytest.raises(UsageError, match=r"of the kind data set, .* of the kind annotated files"):
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
