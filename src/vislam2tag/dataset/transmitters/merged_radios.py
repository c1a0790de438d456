"""One reading for all networks that a radio sends: each has a beacon of its own, but none says more of the place."""

from __future__ import annotations

from dataclasses import replace

import polars as pl

from vislam2tag.dataset.by_session import readings_by_session
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, RTT, SCHEMAS
from vislam2tag.dataset.transmitters.access_points import access_point_table


def merged_radios(dataset: Dataset) -> Dataset:
    """Make one reading of all networks of a radio that a scan heard, and one access point of each radio.

    The radio's name takes the place of the address. RSSI (the mean of the values in dBm, which lowers fading and keeps
    the scale of a single beacon), time, position and sigma are means; frequency is the first. Identifiers without a
    known radio stay as they are. Ranges stay each for itself, under the radio's name. Tables stay lazy but that of the
    access points.
    """
    points = dataset.access_points.collect().with_columns(as_one=pl.coalesce("radio", "bssid"))
    names = points.select("bssid", "as_one").lazy()
    readings = readings_by_session(dataset.fingerprints, dataset.readings, lambda own: _merged(own, names))
    merged = {
        FINGERPRINTS: _counted_anew(dataset.fingerprints, readings),
        READINGS: readings,
        ACCESS_POINTS: _merged_points(dataset.fingerprints, readings, points).lazy(),
    }
    if RTT in dataset.tables:
        ranges = dataset.tables[RTT].join(names, on="bssid", how="left", maintain_order="left")
        merged[RTT] = ranges.with_columns(bssid=pl.coalesce("as_one", "bssid")).drop("as_one")
    return replace(dataset, tables={**dataset.tables, **merged})


def _merged(readings: pl.LazyFrame, names: pl.LazyFrame) -> pl.LazyFrame:
    schema = SCHEMAS[READINGS]
    return (
        readings.join(names, on="bssid", how="left", maintain_order="left")
        .group_by("scan_id", pl.coalesce("as_one", "bssid").alias("radio"), maintain_order=True)
        .agg(
            pl.col("rssi_dbm", "time_ns", "x", "y", "sigma").mean(),
            pl.col("frequency_mhz", "floor").drop_nulls().first(),
        )
        .rename({"radio": "bssid"})
        .select(pl.col(column).cast(kind) for column, kind in schema.items())
    )


def _counted_anew(fingerprints: pl.LazyFrame, readings: pl.LazyFrame) -> pl.LazyFrame:
    """Count what is left of each fingerprint's readings."""
    counts = readings.group_by("scan_id").agg(
        readings=pl.len().cast(pl.Int32), labelled=pl.col("x").count().cast(pl.Int32)
    )
    columns = fingerprints.collect_schema().names()
    return (
        fingerprints.drop("readings", "labelled")
        .join(counts, on="scan_id", how="left", maintain_order="left")
        .with_columns(pl.col("readings", "labelled").fill_null(0))
        .with_columns(labelled_share=pl.when(pl.col("readings") > 0).then(pl.col("labelled") / pl.col("readings")))
        .with_columns(pl.col("labelled_share").fill_null(0.0))
        .select(columns)
    )


def _merged_points(fingerprints: pl.LazyFrame, readings: pl.LazyFrame, points: pl.DataFrame) -> pl.DataFrame:
    """Count the radios, and carry what was known of their networks: a flag of one holds for its radio."""
    names = points.select("technology", "ssid", bssid="as_one", count=pl.col("readings").cast(pl.Int64))
    table = access_point_table(fingerprints, readings, names)
    flags = points.group_by(bssid="as_one").agg(pl.col("mobile", "nomap").any(ignore_nulls=False))
    return table.drop("mobile", "nomap").join(flags, on="bssid", how="left").select(table.columns).sort("bssid")
