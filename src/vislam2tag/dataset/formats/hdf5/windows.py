"""Windows of inertial and magnetic readings as HDF5 groups, session by session."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from vislam2tag.dataset.formats.hdf5.columns import (
    Hdf5Column,
    Hdf5Table,
    float_columns,
    side_by_side,
    text_column,
    vocabulary_column,
    whole_numbers,
    write_splits,
)
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.schema import IMU_WINDOWS, MAGNETIC, UNITS

if TYPE_CHECKING:
    import h5py

_NAMES = ("building", "device", "session")


def write_imu_windows(file: h5py.File, dataset: Dataset) -> None:
    """Write ``imu/N_samples_at_R_hz`` for each length and rate that there is: windows side by side are of one shape."""
    if IMU_WINDOWS not in dataset.tables:
        return
    table = dataset.tables[IMU_WINDOWS].with_columns(samples=pl.col("accelerometer").list.len() // 3)
    shapes = table.select("samples", "rate_hz").unique().sort("samples", "rate_hz").collect(engine="streaming")
    for samples, rate_hz in shapes.iter_rows():
        own = table.filter((pl.col("samples") == samples) & (pl.col("rate_hz") == rate_hz))
        group = file.create_group(f"imu/{samples}_samples_at_{rate_hz:g}_hz", track_order=True)
        group.attrs["rate_hz"] = rate_hz
        _write(
            group,
            dataset,
            own,
            [
                _samples("accelerometer", samples),
                _samples("gyroscope", samples),
                side_by_side("displacement", ("displacement_x", "displacement_y"), UNITS["displacement_x"]),
                *float_columns("heading_change_rad", "heading_rad"),
                side_by_side("start", ("x_start", "y_start"), "m, BCS"),
                side_by_side("end", ("x_end", "y_end"), "m, BCS"),
                *float_columns("sigma_start", "sigma_end"),
                whole_numbers("start_ns", np.int64),
            ],
        )


def write_magnetic(file: h5py.File, dataset: Dataset) -> None:
    """Write ``magnetic``: the windows that have a position."""
    if MAGNETIC not in dataset.tables:
        return
    known = dataset.tables[MAGNETIC].filter(pl.all_horizontal(pl.col("x", "y", "floor").is_not_null()))
    _write(
        file.create_group("magnetic", track_order=True),
        dataset,
        known,
        [
            side_by_side("X", ("norm_ut", "norm_deviation_ut", "vertical_ut", "horizontal_ut"), "microtesla"),
            side_by_side("y", ("x", "y"), "m, BCS"),
            *float_columns("z", "sigma"),
            whole_numbers("readings", np.int32),
            whole_numbers("start_ns", np.int64),
            whole_numbers("end_ns", np.int64),
        ],
    )


def _write(group: h5py.Group, dataset: Dataset, table: pl.LazyFrame, columns: list[Hdf5Column]) -> None:
    """Write these columns and those that all windows have."""
    ids = table.select("window_id").collect(engine="streaming")["window_id"]
    names = {name: vocabulary_column(table, name) for name in _NAMES}
    common = [whole_numbers("floor", np.int32), *(column for column, _ in names.values()), text_column("window_id")]
    filling = Hdf5Table(group, len(ids), [*columns, *common], {name: words for name, (_, words) in names.items()})
    for rows in _each_session(table, names["session"][1]):
        filling.add(rows)
    write_splits(group, dataset.splits, ids)


def _each_session(table: pl.LazyFrame, sessions: pl.Series) -> Iterator[pl.DataFrame]:
    for session in sessions:
        yield table.filter(pl.col("session") == session).collect()


def _samples(name: str, samples: int) -> Hdf5Column:
    def values(rows: pl.DataFrame) -> Any:
        return rows[name].explode().to_numpy().reshape(rows.height, samples, 3)

    return Hdf5Column(name, np.float32, values, (samples, 3), UNITS[name].partition(",")[0], "samples x axes")
