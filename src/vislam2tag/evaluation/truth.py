"""Labels against a known truth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import SessionError
from vislam2tag.common.table_files import read_csv
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.interpolation import label_by_interpolation
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import Trajectory

MAX_GAP_S = 1.0


@dataclass(frozen=True)
class Truth:
    """True positions (t, 2) in the BCS, metres, at strictly increasing boot-clock times (t,), ns."""

    time_ns: IntArray
    position_bcs: FloatArray


def read_truth(path: Path) -> Truth:
    """Read ``truth.csv`` (header ``time_ns,x,y``, further columns are ignored); raises SessionError if it is none."""
    schema = {"time_ns": pl.Int64, "x": pl.Float64, "y": pl.Float64}
    try:
        table = read_csv(path, columns=list(schema), schema_overrides=schema).unique("time_ns").sort("time_ns")
    except (OSError, pl.exceptions.PolarsError) as error:
        raise SessionError(f"{path}: expected a table with the columns time_ns, x and y ({error})") from error
    return Truth(table["time_ns"].to_numpy(), table.select("x", "y").to_numpy())


def errors_at_truth(trajectory: Trajectory, truth: Truth) -> FloatArray:
    """Distance (t,) in the plane between each true point and the label at its time, metres; NaN without a label."""
    labels = label_by_interpolation(truth.time_ns, trajectory, MAX_GAP_S)
    return np.asarray(np.linalg.norm(labels.position_bcs[:, :2] - truth.position_bcs, axis=1))


def errors_at_frames(trajectory: Trajectory, truth: Truth) -> FloatArray:
    """Distance (n,) in the plane between each mapped frame and the truth interpolated at its time, metres.

    NaN where a frame has no position or lies outside the truth.
    """
    known = has_position(trajectory.status)
    known &= (trajectory.time_ns >= truth.time_ns[0]) & (trajectory.time_ns <= truth.time_ns[-1])
    since = (trajectory.time_ns - truth.time_ns[0]).astype(np.float64)
    knots = (truth.time_ns - truth.time_ns[0]).astype(np.float64)
    true = np.column_stack([np.interp(since, knots, truth.position_bcs[:, axis]) for axis in (0, 1)])
    return np.where(known, np.linalg.norm(trajectory.position_bcs[:, :2] - true, axis=1), np.nan)
