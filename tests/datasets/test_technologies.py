"""Fingerprints of one technology, or of both in one."""

from __future__ import annotations

from dataclasses import replace

import polars as pl

from tests.datasets.factory import small_dataset
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS
from vislam2tag.datasets.technologies import BOTH, instead_of, main_technology, of_technology, parts_of

SMALL = small_dataset()
WIFI_ONLY = replace(
    SMALL,
    tables={
        **SMALL.tables,
        FINGERPRINTS: SMALL.fingerprints.filter(pl.col("technology") == "wifi"),
    },
)
FIRST = WIFI_ONLY.access_points.select("bssid").collect()["bssid"].sort()[0]
JOINED = replace(
    WIFI_ONLY,
    tables={
        **WIFI_ONLY.tables,
        FINGERPRINTS: WIFI_ONLY.fingerprints.with_columns(technology=pl.lit(BOTH)),
        ACCESS_POINTS: WIFI_ONLY.access_points.with_columns(
            technology=pl.when(pl.col("bssid") == FIRST).then(pl.lit("ble")).otherwise(pl.lit("wifi"))
        ),
    },
)


def test_the_technology_to_use_is_the_first_that_there_is() -> None:
    assert main_technology(WIFI_ONLY) == "wifi"
    assert main_technology(JOINED) == BOTH
    assert parts_of(BOTH) == ("wifi", "ble")


def test_fingerprints_of_both_give_those_of_each() -> None:
    fingerprints, readings = of_technology(JOINED, "ble")
    of_first = JOINED.readings.filter(pl.col("bssid") == FIRST).collect()
    ours = JOINED.fingerprints.select("scan_id").collect()["scan_id"]
    assert readings.collect()["bssid"].unique().to_list() == [FIRST]
    assert set(fingerprints.collect()["scan_id"]) == set(of_first["scan_id"]) & set(ours)
    assert of_technology(JOINED, BOTH)[1].collect().height == JOINED.readings.collect().height


def test_what_there_is_instead_is_named() -> None:
    ble = replace(
        WIFI_ONLY,
        tables={**WIFI_ONLY.tables, FINGERPRINTS: WIFI_ONLY.fingerprints.with_columns(technology=pl.lit("ble"))},
    )
    assert instead_of(ble, BOTH).endswith("fingerprints of ble. Build it with `vislam2tag dataset --ble-with-wifi`")
    assert instead_of(WIFI_ONLY, "ble") == "; it contains fingerprints of wifi"
