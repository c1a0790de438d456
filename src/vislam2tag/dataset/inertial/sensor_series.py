"""Readings of one sensor, or frames, as arrays: where no window may lie, rotations between them, means over periods."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import AnyArray, FloatArray, IntArray
from vislam2tag.core.status import Status, has_position
from vislam2tag.labeling.status_column import status_codes

FINE, SENSOR_GAP, FLOOR_CHANGE, JUMP = 0, 100, 101, 102
"""Faults; others are codes of :class:`~vislam2tag.core.status.Status`."""


@dataclass(frozen=True)
class SensorSeries:
    """Readings in time order, each time once, all values finite.

    ``time_ns`` (n,), ``values`` (n, k), ``status`` (n,) codes of Status, ``floor`` (n,).
    """

    time_ns: IntArray
    values: FloatArray
    status: AnyArray
    floor: IntArray

    def __len__(self) -> int:
        """Return how many readings there are."""
        return len(self.time_ns)

    def faults(self, max_gap_s: float) -> IntArray:
        """Tell for each pair of neighbouring readings (n - 1,) why no window may hold both, or FINE."""
        first, second = self.status[:-1], self.status[1:]
        cause = np.where(has_position(first), second, first).astype(np.int64)
        cause[has_position(first) & has_position(second)] = FINE
        changed = (cause == FINE) & (np.diff(self.floor) != 0)
        cause[changed] = FLOOR_CHANGE
        silent = (cause == FINE) & (np.diff(self.time_ns) > max_gap_s * 1e9)
        cause[silent] = SENSOR_GAP
        return cause


def sensor_series(sensors: pl.DataFrame, name: str, columns: tuple[str, ...]) -> SensorSeries:
    """Take one sensor from a session's ``sensors`` table; repeated and non-finite readings are left out."""
    finite = pl.all_horizontal(pl.col(columns).is_finite().fill_null(False))
    not_repeated = pl.col("status") != Status.DUPLICATE.label
    rows = sensors.select("sensor", "time_ns", "status", "floor", *columns)
    rows = in_time_order(rows.filter(pl.col("sensor") == name, not_repeated, finite))
    return SensorSeries(
        rows["time_ns"].to_numpy(),
        rows.select(columns).to_numpy(writable=True).reshape(-1, len(columns)),
        status_codes(rows),
        rows["floor"].cast(pl.Int64).to_numpy(),
    )


def in_time_order(rows: pl.DataFrame) -> pl.DataFrame:
    """Sort rows by ``time_ns``; of those with one time the first stays. Logs are in order nearly always."""
    step_ns = rows["time_ns"].diff().min()
    if step_ns is None or step_ns > 0:  # type: ignore[operator]
        return rows
    return rows.unique("time_ns", keep="first", maintain_order=True).sort("time_ns")


def first_fault(time_ns: IntArray, faults: IntArray, start_ns: IntArray, end_ns: IntArray) -> IntArray:
    """Tell for each window (w,) its first fault, from the reading at or before its start to that at or after its end.

    ``faults`` (n - 1,) of the pairs of readings at ``time_ns`` (n,). A window that the readings do not reach over is a
    SENSOR_GAP.
    """
    first = np.searchsorted(time_ns, start_ns, side="right") - 1
    last = np.searchsorted(time_ns, end_ns, side="left")
    found = np.where((first < 0) | (last >= len(time_ns)), SENSOR_GAP, FINE)
    places = np.append(np.flatnonzero(faults != FINE), len(time_ns))
    next_one = places[np.searchsorted(places, first)]
    met = next_one < np.minimum(last, len(faults))
    found[met] = faults[next_one[met]]
    return found


class RotationSeries:
    """Rotations at times (n,), strictly increasing, boot-clock ns."""

    def __init__(self, time_ns: IntArray, rotation: Rotation) -> None:
        quaternion = rotation.as_quat()
        # Neighbours on one side of the sphere, so that what lies between them is between them.
        flips = np.cumprod(np.where(np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0, -1.0, 1.0))
        self._quaternion = quaternion * np.concatenate(([1.0], flips))[:, None]
        self._time_ns = time_ns

    def at(self, time_ns: IntArray) -> Rotation:
        """Interpolate at times (k,); held before the first and after the last.

        Quaternions are blended and normalised: for the few degrees between neighbouring readings as good as Slerp (a
        tenth of a radian: a few millionths).
        """
        since, at = ((times - self._time_ns[0]) * 1e-9 for times in (self._time_ns, time_ns))
        return Rotation.from_quat(np.column_stack([np.interp(at, since, part) for part in self._quaternion.T]))


def period_means(time_ns: IntArray, values: FloatArray, start_ns: IntArray, samples: int, rate_hz: float) -> FloatArray:
    """Mean of a signal over each of ``samples`` periods from each start: (w, samples, k).

    The signal ``values`` (n, k) is linear between its times (n,), strictly increasing; starts (w,).
    """
    edges_s = (start_ns - time_ns[0])[:, None] * 1e-9 + np.arange(samples + 1) / rate_hz
    return np.diff(_integral(((time_ns - time_ns[0]) * 1e-9), values, edges_s), axis=1) * rate_hz


def _integral(time_s: FloatArray, values: FloatArray, at_s: FloatArray) -> FloatArray:
    """Integral of the piecewise linear signal from its first time to each time (...,): (..., k)."""
    step_s = np.diff(time_s)
    whole = np.cumsum((values[1:] + values[:-1]) / 2 * step_s[:, None], axis=0)
    whole = np.concatenate((np.zeros((1, values.shape[1])), whole))
    before = np.clip(np.searchsorted(time_s, at_s, side="right") - 1, 0, len(step_s) - 1)
    beyond_s = (at_s - time_s[before])[..., None]
    slope = (values[before + 1] - values[before]) / step_s[before][..., None]
    integral: FloatArray = whole[before] + beyond_s * (values[before] + slope * beyond_s / 2)
    return integral
