"""The Parquet tables of one session: made and written with their metadata."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag import __version__
from vislam2tag.common.table_files import write_parquet
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import Trajectory
from vislam2tag.labeling.readings import label_readings, status_text
from vislam2tag.labeling.schemas import KEY, SCHEMAS, TRAJECTORY, UNITS
from vislam2tag.sessions.model import Session
from vislam2tag.settings import LabelSettings
from vislam2tag.survey.model import SessionKey


def trajectory_table(key: SessionKey, trajectory: Trajectory) -> pl.DataFrame:
    """One row for each frame, in file order; null where a value is not known. Each row has its frame's floor."""
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
    floor = [pl.Series("floor", trajectory.floor)] if len(trajectory.floor) else []
    frame = pl.DataFrame(
        [
            *floor,
            pl.Series("time_ns", trajectory.time_ns),
            *(pl.Series(name, values, nan_to_null=True, dtype=pl.Float64) for name, values in columns.items()),
            status_text(trajectory.status),
        ]
    )
    return _keyed(key, TRAJECTORY, frame)


def reading_tables(session: Session, trajectory: Trajectory, settings: LabelSettings) -> dict[str, pl.DataFrame]:
    """Label each time-stamped table of the session; one output row for each raw row that parsed, in file order."""
    return {
        name: _keyed(session.key, name, label_readings(table, trajectory, settings, session.excluded_ns))
        for name, table in session.tables.items()
    }


def write_table(table: pl.DataFrame, name: str, strategy: str, path: Path) -> None:
    """Write one Parquet file with metadata that names frame, units, stage and version."""
    metadata = {
        "frame": "BCS of the floor",
        "units": {column: UNITS[column] for column in table.columns if column in UNITS},
        "stage": f"{name}, labelled by {strategy}",
        "version": __version__,
    }
    text = json.dumps(metadata, sort_keys=True)
    write_parquet(table, path, compression="snappy", metadata={"vislam2tag": text})


def _keyed(key: SessionKey, name: str, frame: pl.DataFrame) -> pl.DataFrame:
    """Put floor (the session's own where rows have none), device and session in front, and the columns into order."""
    values = {"floor": key.floor, "device": key.device, "session": key.session}
    firsts = [
        (pl.col(column) if column in frame.columns else pl.lit(values[column])).cast(kind).alias(column)
        for column, kind in KEY.items()
    ]
    others = [column for column in SCHEMAS.get(name, frame.schema) if column not in KEY]
    return frame.select(*firsts, *others)
