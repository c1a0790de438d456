"""Wi-Fi scans that are old results delivered again: every access point and level as in the scan before.

Access points that are heard twice in a row hardly ever come with the same levels throughout; a few may.
"""

from __future__ import annotations

import polars as pl

FEWEST_READINGS = 4
"""Scans of fewer readings may be alike by chance."""


def repeated_scans(wifi: pl.DataFrame) -> list[int]:
    """Numbers of the scans whose readings are those of the scan before, in order; ``wifi`` as in a session."""
    scans = (
        wifi.filter(~pl.col("repeated") & pl.col("rssi_dbm").is_not_null())
        .group_by("scan", maintain_order=True)
        .agg(
            pl.col("time_ns").min().alias("first_ns"),
            pl.struct("bssid", "rssi_dbm").hash(seed=0).sort().alias("readings"),
            pl.len().alias("count"),
        )
        .sort("first_ns")
    )
    alike = (pl.col("readings") == pl.col("readings").shift(1)) & (pl.col("count") >= FEWEST_READINGS)
    return scans.filter(alike.fill_null(value=False))["scan"].to_list()
