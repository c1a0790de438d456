"""The Parquet tables of one session: columns, types and metadata as docs/formats.md specifies."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag import __version__
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import STATUS_LABELS, has_position
from vislam2tag.core.tracks import Trajectory
from vislam2tag.labeling.readings import label_readings, status_text
from vislam2tag.sessions.model import Session
from vislam2tag.settings import LabelSettings
from vislam2tag.survey.model import SessionKey

TRAJECTORY = "trajectory"
UNITS = {
    "x y z sigma": "m",
    "cov_xx cov_xy cov_yy": "m^2",
    "qx qy qz qw": "unit quaternion, camera to BCS",
    "time_ns": "ns since boot of the phone",
    "rssi_dbm": "dBm",
    "frequency_mhz": "MHz",
}
_KEY_SCHEMA: dict[str, pl.DataType] = {"floor": pl.Int32(), "device": pl.String(), "session": pl.String()}


def trajectory_table(key: SessionKey, trajectory: Trajectory) -> pl.DataFrame:
    """One row for each frame, in file order; null where a value is not known."""
    mapped = has_position(trajectory.status)[:, None]
    position = np.where(mapped, trajectory.position_bcs, np.nan)
    orientation = np.where(mapped, trajectory.orientation_bcs, np.nan)
    covariance = trajectory.covariance_bcs
    columns = {
        **dict(zip(("x", "y", "z"), position.T, strict=True)),
        **dict(zip(("qx", "qy", "qz", "qw"), orientation.T, strict=True)),
        "sigma": trajectory.sigma_m,
        "cov_xx": covariance[:, 0, 0],
        "cov_xy": covariance[:, 0, 1],
        "cov_yy": covariance[:, 1, 1],
    }
    frame = pl.DataFrame(
        [
            pl.Series("time_ns", trajectory.time_ns),
            *(pl.Series(name, values, nan_to_null=True, dtype=pl.Float64) for name, values in columns.items()),
            status_text(trajectory.status),
        ]
    )
    return _keyed(key, frame)


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
    )


def reading_tables(session: Session, trajectory: Trajectory, settings: LabelSettings) -> dict[str, pl.DataFrame]:
    """Label each time-stamped table of the session; one output row for each raw row that parsed, in file order."""
    return {
        name: _keyed(session.key, label_readings(table, trajectory, settings)) for name, table in session.tables.items()
    }


def write_table(table: pl.DataFrame, name: str, strategy: str, path: Path) -> None:
    """Write one Parquet file with metadata that names frame, units, stage and version."""
    metadata = {"frame": "BCS of the floor", "units": UNITS, "stage": f"{name}, labelled by {strategy}"}
    text = json.dumps(metadata | {"version": __version__}, sort_keys=True)
    table.write_parquet(path, compression="snappy", metadata={"vislam2tag": text})


def _keyed(key: SessionKey, frame: pl.DataFrame) -> pl.DataFrame:
    """Put floor, device and session in front of the columns."""
    values = {"floor": key.floor, "device": key.device, "session": key.session}
    literals = (pl.lit(values[name], dtype=dtype).alias(name) for name, dtype in _KEY_SCHEMA.items())
    return frame.select(*literals, pl.all())
