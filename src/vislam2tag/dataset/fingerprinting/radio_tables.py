"""The labelled radio tables, each a technology, in one form, and the mean position of a group of their readings."""

from __future__ import annotations

import polars as pl

WIFI = "wifi"
"""The technology whose table ``process`` always writes."""
TECHNOLOGIES = ("ble", WIFI)
"""Tables of an output folder of ``process`` that become fingerprints."""
LEAST_SIGMA_M = 1e-3
"""No position is surer than this; keeps weights finite."""


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


def mean_position(placed: pl.Expr) -> dict[str, pl.Expr]:
    """Aggregate ``x``, ``y``, ``z``, ``sigma`` and ``floor`` over the readings of a group where ``placed`` holds.

    Positions weigh by 1 / sigma^2; an unknown sigma counts as the greatest of the group, and where none is known all
    weigh the same. The sigma of the mean is the weighted mean of theirs: readings of one moment share the error of the
    trajectory, which no number of them averages out. It is null where none is known; ``z`` is null unless all have
    one. The floor is that of most readings, of equally many the lowest. All are null where nothing is placed.
    """
    sigma = pl.col("sigma").filter(placed).clip(lower_bound=LEAST_SIGMA_M)
    known = sigma.fill_null(sigma.max()).fill_null(1.0)
    weight = known**-2
    z = pl.col("z").filter(placed)

    def mean(values: pl.Expr) -> pl.Expr:
        return pl.when(placed.any()).then((weight * values).sum() / weight.sum())

    return {
        "x": mean(pl.col("x").filter(placed)),
        "y": mean(pl.col("y").filter(placed)),
        "z": pl.when(z.null_count() == 0).then(mean(z)),
        "sigma": pl.when(sigma.count() > 0).then(mean(known)),
        "floor": pl.col("floor").filter(placed).mode().min(),
    }
