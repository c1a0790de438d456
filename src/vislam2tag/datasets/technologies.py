"""Radio technologies of fingerprints: Wi-Fi scans, windows of BLE readings, and both in one fingerprint."""

from __future__ import annotations

import polars as pl

from vislam2tag.datasets.model import Dataset

WIFI, BLE = "wifi", "ble"
BOTH = f"{WIFI}+{BLE}"
"""Fingerprints with a Wi-Fi scan and the BLE readings around it. Each access point has its own technology."""


def parts_of(technology: str) -> tuple[str, ...]:
    """Technologies of the access points in fingerprints of one technology."""
    return tuple(technology.split("+"))


def technologies_of(dataset: Dataset) -> list[str]:
    """Technologies of a data set's fingerprints, sorted."""
    return (
        dataset.fingerprints.select(pl.col("technology").unique()).collect()["technology"].drop_nulls().sort().to_list()
    )


def main_technology(dataset: Dataset) -> str:
    """The technology to use if none is given: the first of Wi-Fi, Wi-Fi with BLE, and others."""
    there = technologies_of(dataset)
    return next((name for name in (WIFI, BOTH, *there) if name in there), WIFI)


def of_technology(dataset: Dataset, technology: str) -> tuple[pl.LazyFrame, pl.LazyFrame]:
    """Fingerprints of one technology, and readings of the data set without those of other technologies.

    Fingerprints with both technologies count for each of them if they contain a reading of it.
    """
    own = pl.col("technology") == technology
    if technology not in parts_of(BOTH):
        return dataset.fingerprints.filter(own), dataset.readings
    points = dataset.access_points.filter(own).select("bssid")
    readings = dataset.readings.join(points, on="bssid", how="semi", maintain_order="left")
    joined = dataset.fingerprints.filter(pl.col("technology") == BOTH).select("scan_id")
    heard = readings.select("scan_id").join(joined, on="scan_id", how="semi").unique()
    wanted = own | pl.col("heard").is_not_null()
    fingerprints = (
        dataset.fingerprints.join(heard.with_columns(heard=True), on="scan_id", how="left", maintain_order="left")
        .filter(wanted)
        .drop("heard")
    )
    return fingerprints, readings


def instead_of(dataset: Dataset, technology: str) -> str:
    """Rest of a message about fingerprints that a data set does not contain: what there is, and what to do."""
    there = technologies_of(dataset)
    found = f"; it contains fingerprints of {', '.join(there)}" if there else ""
    if technology == BOTH and BLE in there:
        return f"{found}. Build it with `vislam2tag dataset --ble-with-wifi`"
    joined = technology in parts_of(BOTH) and BOTH in there
    return f"{found}. Build it without `--ble-with-wifi`" if joined else found
