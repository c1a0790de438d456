from __future__ import annotations

from dataclasses import replace

import polars as pl
import pytest
from polars.testing import assert_frame_equal

from tests.dataset.factory import small_dataset
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.schema import ACCESS_POINTS, SCHEMAS
from vislam2tag.dataset.transmitters.merged_radios import merged_radios

LEAD = "00:11:22:33:00:00"
TWIN = "00:11:22:33:00:01"


def with_twins() -> Dataset:
    """The small data set, in which two addresses are one radio and one of them opted out."""
    dataset = small_dataset()
    points = dataset.access_points.with_columns(
        radio=pl.when(pl.col("bssid") == TWIN).then(pl.lit(LEAD)).otherwise(pl.col("radio")),
        nomap=pl.col("bssid") == TWIN,
    )
    return replace(dataset, tables={**dataset.tables, ACCESS_POINTS: points})


def test_a_scan_has_one_reading_of_a_radio() -> None:
    before, after = with_twins(), merged_radios(with_twins())
    twins = before.readings.filter(pl.col("bssid").is_in([LEAD, TWIN])).collect()
    both = after.readings.filter(pl.col("bssid") == LEAD).collect()
    assert both.height == twins["scan_id"].n_unique()
    assert TWIN not in after.readings.collect()["bssid"]
    scan = both.row(0, named=True)
    heard = twins.filter(pl.col("scan_id") == scan["scan_id"])
    assert heard.height == 2
    assert scan["rssi_dbm"] == pytest.approx(heard["rssi_dbm"].mean())


def test_all_else_stays() -> None:
    before, after = with_twins(), merged_radios(with_twins())
    others = ~pl.col("bssid").is_in([LEAD, TWIN])
    assert_frame_equal(before.readings.filter(others), after.readings.filter(others))
    assert after.readings.collect_schema() == SCHEMAS["readings"]
    columns = pl.exclude("readings", "labelled")
    assert_frame_equal(before.fingerprints.select(columns), after.fingerprints.select(columns))


def test_counts_follow() -> None:
    after = merged_radios(with_twins())
    counts = after.readings.group_by("scan_id").agg(readings=pl.len().cast(pl.Int32))
    told = after.fingerprints.filter(pl.col("readings") > 0).select("scan_id", "readings")
    assert_frame_equal(told, counts, check_row_order=False)


def test_a_radio_is_one_access_point_with_what_was_known_of_its_networks() -> None:
    before = with_twins().access_points.collect()
    after = merged_radios(with_twins()).access_points.collect()
    assert after["bssid"].to_list() == [bssid for bssid in before["bssid"] if bssid != TWIN]
    lead = after.row(by_predicate=pl.col("bssid") == LEAD, named=True)
    assert (lead["nomap"], lead["mobile"], lead["ssid"]) == (True, False, "eduroam")
    assert not after.filter(pl.col("bssid") != LEAD)["nomap"].any()


def test_without_twins_nothing_changes() -> None:
    dataset = small_dataset()
    for name, table in merged_radios(dataset).tables.items():
        assert_frame_equal(table, dataset.tables[name])
