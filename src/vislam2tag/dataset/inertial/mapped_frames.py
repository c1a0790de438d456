"""A session's frames as the phone's sensors see them: on the gyroscope's clock, between the faults of the mapping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.pose_lag import estimate_pose_lag
from vislam2tag.core.status import Status, has_position
from vislam2tag.dataset.inertial.sensor_series import (
    FINE,
    JUMP,
    RotationSeries,
    SensorSeries,
    first_fault,
    in_time_order,
)
from vislam2tag.labeling.settings import LabelSettings
from vislam2tag.labeling.status_column import status_codes

JUMP_M, FASTEST_M_S = 0.1, 4.0
"""A step between frames longer than both allow, metres and metres a second, was not walked."""


@dataclass(frozen=True)
class MappedFrames:
    """Usable frames in time order; ``positioned`` (n,): those with position and orientation."""

    series: SensorSeries
    positioned: BoolArray
    orientation: Rotation
    """``bcs_R_camera`` of the positioned frames."""

    @property
    def positioned_ns(self) -> IntArray:
        """(k,) times of the positioned frames."""
        positioned_ns: IntArray = self.series.time_ns[self.positioned]
        return positioned_ns

    def first_fault(self, start_ns: IntArray, end_ns: IntArray) -> IntArray:
        """Tell for each window (w,) why the mapping does not hold all through it, or FINE."""
        series = self.series
        faults = series.faults(LabelSettings().max_gap_s)
        step_m = np.hypot(*np.diff(series.values[:, :2], axis=0).T)
        jumped = step_m > JUMP_M + FASTEST_M_S * np.diff(series.time_ns) * 1e-9
        faults[(faults == FINE) & jumped] = JUMP
        return first_fault(series.time_ns, faults, start_ns, end_ns)

    def place_at(self, time_ns: IntArray) -> FloatArray:
        """Interpolate x, y and sigma at times (w,) without fault: (w, 3)."""
        since, at = ((times - self.series.time_ns[0]) * 1e-9 for times in (self.positioned_ns, time_ns))
        return np.column_stack([np.interp(at, since, column) for column in self.series.values[self.positioned].T])

    def turned(self, axis: FloatArray, start_ns: IntArray, end_ns: IntArray) -> FloatArray:
        """Angle (w,) by which an axis (3,) of the camera turned about the vertical, rad, counter-clockwise."""
        between = RotationSeries(self.positioned_ns, self.orientation)
        start, end = (between.at(times).apply(axis) for times in (start_ns, end_ns))
        turned: FloatArray = np.angle((end[:, 0] + 1j * end[:, 1]) * (start[:, 0] - 1j * start[:, 1]))
        return turned


def mapped_frames(trajectory: pl.DataFrame, gyroscope: SensorSeries) -> MappedFrames:
    """Take a session's frames from its ``trajectory`` table; stamps that the gyroscope says are late are set back."""
    unusable = (Status.DUPLICATE.label, Status.INVALID.label)
    rows = in_time_order(trajectory.filter(~pl.col("status").is_in(unusable)))
    positioned = rows.select(pl.all_horizontal(pl.col("x", "y", "qx", "qy", "qz", "qw").is_not_null())).to_series()
    quaternion = rows.filter(positioned).select("qx", "qy", "qz", "qw").to_numpy(writable=True).reshape(-1, 4)
    status = status_codes(rows)
    status[has_position(status) & ~positioned.to_numpy()] = Status.NO_MAPPING
    time_ns = rows["time_ns"].to_numpy()
    lag_s = estimate_pose_lag(time_ns[positioned.to_numpy()], quaternion, gyroscope.time_ns, gyroscope.values) or 0.0
    series = SensorSeries(
        time_ns - round(lag_s * 1e9),
        rows.select("x", "y", "sigma").cast(pl.Float64).fill_null(float("nan")).to_numpy().reshape(-1, 3),
        status,
        rows["floor"].cast(pl.Int64).to_numpy(),
    )
    return MappedFrames(series, positioned.to_numpy(), Rotation.from_quat(quaternion))
