"""Reading a trajectory back from its written table (docs/formats.md)."""

from __future__ import annotations

import polars as pl

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import STATUS_LABELS
from vislam2tag.core.tracks import Trajectory


def trajectory_of(table: pl.DataFrame) -> Trajectory:
    """Turn a written trajectory table back into arrays (segments and visits are not in it)."""

    def columns(*names: str) -> FloatArray:
        return table.select(names).cast(pl.Float64).fill_null(float("nan")).to_numpy()

    return Trajectory(
        time_ns=table["time_ns"].to_numpy(),
        position_bcs=columns("x", "y", "z"),
        orientation_bcs=columns("qx", "qy", "qz", "qw"),
        covariance_bcs=columns("cov_xx", "cov_xy", "cov_yy")[:, (0, 1, 1, 2)].reshape(-1, 2, 2),
        status=table["status"].cast(pl.Enum(STATUS_LABELS)).to_physical().cast(pl.Int8).to_numpy(),
        floor=table["floor"].cast(pl.Int64).to_numpy(),
    )
