from __future__ import annotations

import polars as pl
import pytest
from polars.testing import assert_frame_equal

from tests.datasets.factory import SESSION_KEYS, small_dataset
from vislam2tag.datasets.model import RunningTotal, each_session, readings_by_session


def test_every_row_comes_once_with_its_session() -> None:
    dataset = small_dataset()
    found = list(each_session(dataset.fingerprints, dataset.readings))
    assert [tables.session for tables in found] == sorted(session for _, _, session in SESSION_KEYS)
    both = pl.concat([tables.readings for tables in found])
    assert_frame_equal(both, dataset.readings.collect(), check_row_order=False)
    assert all(tables.readings["scan_id"].is_in(tables.fingerprints["scan_id"].implode()).all() for tables in found)


def test_ids_need_not_begin_with_their_session() -> None:
    fingerprints = pl.LazyFrame({"scan_id": ["a", "b", "c"], "session": ["one", "two", "one"]})
    readings = pl.LazyFrame({"scan_id": ["a", "b", "b", "c"]})
    counts = {tables.session: tables.readings.height for tables in each_session(fingerprints, readings)}
    assert counts == {"one": 2, "two": 2}


def test_lazy_work_sees_one_session_at_a_time_and_keeps_the_order() -> None:
    dataset = small_dataset()
    counted = readings_by_session(
        dataset.fingerprints, dataset.readings, lambda own: own.with_columns(count=pl.len())
    ).collect()
    assert_frame_equal(counted.drop("count"), dataset.readings.collect())
    sessions = pl.col("scan_id").str.split("/").list.first()
    expected = dataset.readings.select(count=pl.len().over(sessions)).collect()["count"]
    assert counted["count"].to_list() == expected.to_list()


def test_no_session_is_no_rows() -> None:
    dataset = small_dataset()
    none = readings_by_session(dataset.fingerprints.head(0), dataset.readings.head(0), lambda own: own)
    assert none.collect().is_empty()


@pytest.mark.parametrize("parts", [1, 15, 16, 40])
def test_a_running_total_is_the_sum_over_all_parts(parts: int) -> None:
    table = pl.DataFrame({"key": [number % 3 for number in range(80)], "count": list(range(80))})
    total, keys = RunningTotal(("key",), (pl.col("count").sum(),)), RunningTotal(("key",))
    for number in range(parts):
        total.add(table[number::parts])
        keys.add(table[number::parts].select("key"))
    expected = table.group_by("key").agg(pl.col("count").sum()).sort("key")
    assert_frame_equal(total.table.sort("key"), expected)
    assert keys.table["key"].sort().to_list() == [0, 1, 2]


def test_the_running_total_of_nothing_has_its_columns() -> None:
    assert RunningTotal(("key",), schema={"key": pl.Int32()}).table.schema == {"key": pl.Int32}
