"""The tables of a labelled session: made of its trajectory and readings, written with their metadata, read back."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import polars as pl

from vislam2tag import __version__
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import write_parquet
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import Trajectory
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.labeling.readings import label_readings, mark_uncertain
from vislam2tag.labeling.schemas import KEY, SCHEMAS, TRAJECTORY, UNITS
from vislam2tag.labeling.settings import LabelSettings, ProcessSettings
from vislam2tag.labeling.status_column import status_codes, status_text
from vislam2tag.labeling.tables_in_new_frame import changed_table
from vislam2tag.sessions.prepared import PreparedSession
from vislam2tag.site.frame_change import FrameChange
from vislam2tag.site.model import SessionKey


@dataclass(frozen=True)
class LabelledWalk:
    """A mapped session whose readings have labels; make it by :meth:`of`.

    ``mapped`` is what the strategy made of it, and ``trajectory`` marks its uncertain frames; ``readings`` has each
    time-stamped table with one row for each raw row that parsed, in file order. All are in the frame that the session
    was mapped in. ``settings`` are those that hold for it.
    """

    key: SessionKey
    mapped: Trajectory
    trajectory: Trajectory
    readings: dict[str, pl.DataFrame]
    settings: LabelSettings
    needs: str
    """What the strategy says that a walk must have had to be mapped."""

    @classmethod
    def of(cls, prepared: PreparedSession, settings: ProcessSettings) -> LabelledWalk:
        """Map a session that was prepared, and label its readings by its trajectory."""
        session = prepared.session
        strategy = strategy_named(settings.strategy, settings.mapping)
        mapped = strategy.map(session.camera, session.landmarks, prepared.landmarks)
        labels = settings.labels.for_session(without_poses=session.camera.without_poses)
        # Readings come first: between a sure and an uncertain frame each one's own sigma decides.
        readings = {
            name: _keyed(
                session.key,
                name,
                label_readings(table, mapped, labels, session.excluded_ns, session.attached.get(name)),
            )
            for name, table in session.tables.items()
        }
        return cls(session.key, mapped, mark_uncertain(mapped, labels.max_sigma_m), readings, labels, strategy.needs)

    def tables(self, frames: Mapping[int, FrameChange]) -> dict[str, pl.DataFrame]:
        """All tables by name, each row in the frame of its own floor; ``frames`` is empty where all share one."""
        tables = {TRAJECTORY: trajectory_table(self.key, self.trajectory), **self.readings}
        if not frames:
            return tables
        return {name: changed_table(table.lazy(), frames).collect() for name, table in tables.items()}


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


def trajectory_of(table: pl.DataFrame) -> Trajectory:
    """Turn a written trajectory table back into arrays (segments and visits are not in it)."""

    def columns(*names: str) -> FloatArray:
        return table.select(names).cast(pl.Float64).fill_null(float("nan")).to_numpy()

    return Trajectory(
        time_ns=table["time_ns"].to_numpy(),
        position_bcs=columns("x", "y", "z"),
        orientation_bcs=columns("qx", "qy", "qz", "qw"),
        covariance_bcs=columns("cov_xx", "cov_xy", "cov_yy")[:, (0, 1, 1, 2)].reshape(-1, 2, 2),
        status=status_codes(table),
        floor=table["floor"].cast(pl.Int64).to_numpy(),
    )


def write_table(table: pl.DataFrame, name: str, strategy: str, folder: Folder, file: str) -> None:
    """Write one Parquet file with metadata that names frame, units, stage and version."""
    metadata = {
        "frame": "BCS of the floor",
        "units": {column: UNITS[column] for column in table.columns if column in UNITS},
        "stage": f"{name}, labelled by {strategy}",
        "version": __version__,
    }
    text = json.dumps(metadata, sort_keys=True)
    write_parquet(table, folder, file, compression="snappy", metadata={"vislam2tag": text})


def _keyed(key: SessionKey, name: str, frame: pl.DataFrame) -> pl.DataFrame:
    """Put floor (the session's own where rows have none), device and session in front, and the columns into order."""
    values = {"floor": key.floor, "device": key.device, "session": key.session}
    firsts = [
        (pl.col(column) if column in frame.columns else pl.lit(values[column])).cast(kind).alias(column)
        for column, kind in KEY.items()
    ]
    others = [column for column in SCHEMAS.get(name, frame.schema) if column not in KEY]
    return frame.select(*firsts, *others)
