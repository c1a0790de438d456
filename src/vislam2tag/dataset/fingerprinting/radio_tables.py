"""The labelled radio tables, each a technology, in one form: transmitter, name, level and position of a reading."""

from __future__ import annotations

import polars as pl

WIFI = "wifi"
"""The technology whose table ``process`` always writes."""
TECHNOLOGIES = ("ble", WIFI)
"""Tables of an output folder of ``process`` that become fingerprints."""


def radio_rows(table: pl.DataFrame, technology: str) -> pl.DataFrame:
    """Give a labelled table the columns of ``wifi``, whatever its technology.

    A BLE beacon is identified by ``UUID-MAJOR-MINOR`` where it tells them, as its address may change at any time, and
    by its address where it does not. BLE has no scans (null) and does not tell its frequency.
    """
    if technology == WIFI:
        return table
    beacon = pl.format("{}-{}-{}", "uuid", "major", "minor")
    return table.with_columns(
        bssid=pl.when(pl.col("uuid").is_not_null()).then(beacon).otherwise("address"),
        ssid="name",
        frequency_mhz=pl.lit(None, dtype=pl.Float32),
        scan=pl.lit(None, dtype=pl.Int32),
    ).drop("address", "name", "uuid", "major", "minor")
