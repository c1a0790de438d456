"""Windows of inertial readings with their displacement, and of the magnetic field.

Inertial windows are gravity-aligned, for learned odometry; see docs/reference/datasets.md. Magnetic fingerprints are
the field over short windows, as strength and as vertical and horizontal part. These do not depend on the phone's
orientation, because gravity alone defines the vertical.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import polars as pl

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.core.status import Status
from vislam2tag.datasets.fingerprints import mean_position
from vislam2tag.datasets.schema import IMU_WINDOWS, MAGNETIC, empty_table, in_schema
from vislam2tag.datasets.sensor_series import (
    FINE,
    FLOOR_CHANGE,
    JUMP,
    SENSOR_GAP,
    LevelOrientation,
    MappedFrames,
    SensorSeries,
    filtered_orientation,
    first_fault,
    in_time_order,
    level_heading,
    logged_orientation,
    mapped_frames,
    period_means,
    sensor_series,
)
from vislam2tag.datasets.settings import ImuWindowSettings

USUAL_RATES_HZ = (25.0, 50.0, 100.0, 200.0, 400.0)
MAX_SENSOR_GAP_S = 0.1
"""A window with a longer gap in a sensor's readings is dropped, seconds."""
MIN_AGREEMENT = 0.97
"""Below this the phone's heading and tilt differ from the tracker's by about 14 degrees, so one of them is wrong."""
NO_ACCELEROMETER, NO_GYROSCOPE, OTHER_CLOCK, NO_HEADING, ORIENTATIONS_DISAGREE, NO_TRACKER = range(103, 109)
CAUSES: Mapping[int, str] = {
    **{int(status): status.label for status in Status if status is not Status.OK},
    SENSOR_GAP: "sensor_gap",
    FLOOR_CHANGE: "floor_change",
    JUMP: "jump",
    NO_ACCELEROMETER: "no_accelerometer",
    NO_GYROSCOPE: "no_gyroscope",
    OTHER_CLOCK: "other_clock",
    NO_HEADING: "no_heading",
    ORIENTATIONS_DISAGREE: "orientations_disagree",
    NO_TRACKER: "no_tracker",
}
"""Reasons for dropping a window (docs/reference/datasets.md)."""
_AHEAD = np.array([0.0, 1.0, -1.0])
"""Between the directions of the phone's top and its back camera: forward whether it is held flat or upright."""


@dataclass(frozen=True)
class ImuWindows:
    """The windows of a session (schema ``IMU_WINDOWS``), and the number of dropped ones by cause (:data:`CAUSES`)."""

    table: pl.DataFrame
    dropped: Mapping[str, int]


@dataclass(frozen=True)
class _LevelSensors:
    """The sensors of a session in their common level frame."""

    accelerometer: SensorSeries
    gyroscope: SensorSeries
    rotation: SensorSeries
    level: LevelOrientation


def imu_windows(
    sensors: pl.DataFrame, trajectory: pl.DataFrame, session: str, settings: ImuWindowSettings
) -> ImuWindows:
    """Cut a session's windows from its ``sensors`` and ``trajectory`` tables, as ``process`` wrote them.

    A window starts every ``step_s``. It is dropped if a reading in it has no position, a sensor has a long gap, the
    floor changes, or the position jumps. It is also dropped if the phone's orientation does not match the tracker's.
    """
    start_ns = _starts(trajectory, settings)
    if len(start_ns) == 0:
        return ImuWindows(empty_table(IMU_WINDOWS), {})
    if trajectory["x"].count() and not trajectory["qw"].count():
        return ImuWindows(empty_table(IMU_WINDOWS), {CAUSES[NO_TRACKER]: len(start_ns)})
    motion = _motion(sensors, start_ns)
    if isinstance(motion, int):
        return ImuWindows(empty_table(IMU_WINDOWS), {CAUSES[motion]: len(start_ns)})
    frames = mapped_frames(trajectory, motion.gyroscope)
    cause = _causes(motion, frames, start_ns, settings)
    heading = level_heading(frames.positioned_ns, frames.orientation, motion.level) if frames.positioned.any() else None
    if heading is None:
        cause[cause == FINE] = NO_HEADING
        return ImuWindows(empty_table(IMU_WINDOWS), _counted(cause))
    turn = heading.at(start_ns + _length_ns(settings) // 2)
    cause[(cause == FINE) & (np.abs(turn) < MIN_AGREEMENT)] = ORIENTATIONS_DISAGREE
    kept = np.flatnonzero(cause == FINE)
    if len(kept) == 0:
        return ImuWindows(empty_table(IMU_WINDOWS), _counted(cause))
    turned = frames.turned(heading.camera_axes.apply(_AHEAD), start_ns[kept], start_ns[kept] + _length_ns(settings))
    columns = _columns(motion, frames, start_ns[kept], turn[kept], settings)
    table = pl.DataFrame(columns).with_columns(
        heading_change_rad=pl.Series(turned),
        window_id=pl.Series([f"{session}/imu/{number:06d}" for number in kept]),
        building=pl.lit(""),
        device=pl.lit(trajectory["device"][0]),
        session=pl.lit(session),
    )
    return ImuWindows(in_schema(IMU_WINDOWS, table), _counted(cause))


def _starts(trajectory: pl.DataFrame, settings: ImuWindowSettings) -> IntArray:
    """Return the starts of windows (w,), ns, one for each step with frames.

    The first start and the last end are far enough inside the frames that the sensors' readings cover them.
    """
    unusable = (Status.DUPLICATE.label, Status.INVALID.label)
    time_ns = trajectory.filter(~pl.col("status").is_in(unusable))["time_ns"].to_numpy()
    if len(time_ns) == 0:
        return np.empty(0, dtype=np.int64)
    margin_ns, step_ns = round(MAX_SENSOR_GAP_S * 1e9), round(settings.step_s * 1e9)
    start_ns = time_ns[0] + margin_ns + np.unique((time_ns - time_ns[0] - margin_ns) // step_ns) * step_ns
    first_ns, last_ns = time_ns[0] + margin_ns, time_ns[-1] - margin_ns - _length_ns(settings)
    starts: IntArray = start_ns[(start_ns >= first_ns) & (start_ns <= last_ns)]
    return starts


def _length_ns(settings: ImuWindowSettings) -> int:
    """Length of a window, nanoseconds."""
    return round(settings.length_s * 1e9)


def _counted(cause: IntArray) -> dict[str, int]:
    """Count causes (w,) other than FINE, by name."""
    codes, counts = np.unique(cause[cause != FINE], return_counts=True)
    return {CAUSES[int(code)]: int(count) for code, count in zip(codes, counts, strict=True)}


def _motion(sensors: pl.DataFrame, start_ns: IntArray) -> _LevelSensors | int:
    """Return the sensors in their level frame, for windows that start at (w,), ns, or the reason why not."""
    accelerometer = sensor_series(sensors, "ACC", ("v1", "v2", "v3"))
    gyroscope = _gyroscope(sensors)
    rotation = sensor_series(sensors, "GAME_ROT", ("v1", "v2", "v3", "v4"))
    for series, code in ((accelerometer, NO_ACCELEROMETER), (gyroscope, NO_GYROSCOPE)):
        if len(series) < 2:
            return code
    logged = len(rotation) > 1
    used = (accelerometer, gyroscope, rotation) if logged else (accelerometer, gyroscope)
    if any(series.time_ns[-1] < start_ns[0] or series.time_ns[0] > start_ns[-1] for series in used):
        return OTHER_CLOCK
    level = logged_orientation(rotation) if logged else filtered_orientation(accelerometer, gyroscope)
    return _LevelSensors(accelerometer, gyroscope, rotation if logged else gyroscope, level)


def _gyroscope(sensors: pl.DataFrame) -> SensorSeries:
    """Read the calibrated gyroscope, or the uncalibrated one minus its logged drift (``v4`` to ``v6``)."""
    calibrated = sensor_series(sensors, "GYRO", ("v1", "v2", "v3"))
    if len(calibrated):
        return calibrated
    raw = sensor_series(sensors, "GYRO_UN", ("v1", "v2", "v3", "v4", "v5", "v6"))
    return SensorSeries(raw.time_ns, raw.values[:, :3] - raw.values[:, 3:], raw.status, raw.floor)


def _causes(motion: _LevelSensors, frames: MappedFrames, start_ns: IntArray, settings: ImuWindowSettings) -> IntArray:
    """Return for each window (w,) why it is dropped, or FINE."""
    end_ns = start_ns + _length_ns(settings)
    cause = np.full(len(start_ns), FINE, dtype=np.int64)
    for series in (motion.accelerometer, motion.gyroscope, motion.rotation):
        fault = first_fault(series.time_ns, series.faults(MAX_SENSOR_GAP_S), start_ns, end_ns)
        cause = np.where(cause == FINE, fault, cause)
    return np.where(cause == FINE, frames.first_fault(start_ns, end_ns), cause)


def _columns(
    motion: _LevelSensors, frames: MappedFrames, start_ns: IntArray, turn: ComplexArray, settings: ImuWindowSettings
) -> dict[str, pl.Series]:
    """Return the columns of the windows that start at these times (w,); ``turn`` (w,) is the level frame's heading."""
    end_ns = start_ns + _length_ns(settings)
    ahead = motion.level.at(start_ns).apply(_AHEAD)
    own_heading = np.arctan2(ahead[:, 1], ahead[:, 0])
    heading = np.angle(turn * np.exp(1j * own_heading))
    start, end = frames.place_at(start_ns), frames.place_at(end_ns)
    way = ((end[:, 0] - start[:, 0]) + 1j * (end[:, 1] - start[:, 1])) * np.exp(-1j * heading)
    rate_hz = settings.rate_hz or _usual_rate_hz(motion.accelerometer)
    columns = {
        "floor": pl.Series(motion.accelerometer.floor[np.searchsorted(motion.accelerometer.time_ns, start_ns)]),
        "start_ns": pl.Series(start_ns),
        "rate_hz": pl.Series(np.full(len(start_ns), rate_hz)),
        "displacement_x": pl.Series(way.real),
        "displacement_y": pl.Series(way.imag),
        "heading_rad": pl.Series(heading),
    }
    for moment, values in (("start", start), ("end", end)):
        for name, column in zip(("x", "y", "sigma"), values.T, strict=True):
            columns[f"{name}_{moment}"] = pl.Series(column, nan_to_null=True)
    for name, series in (("accelerometer", motion.accelerometer), ("gyroscope", motion.gyroscope)):
        level = motion.level.at(series.time_ns).apply(series.values)
        means = period_means(series.time_ns, level, start_ns, round(settings.length_s * rate_hz), rate_hz)
        columns[name] = _flat(means, own_heading)
    return columns


def _flat(level: FloatArray, own_heading: FloatArray) -> pl.Series:
    """Turn samples (w, n, 3) from the level frame into each window's own: a list of 3 n numbers for each window."""
    plane = (level[..., 0] + 1j * level[..., 1]) * np.exp(-1j * own_heading)[:, None]
    own = np.stack((plane.real, plane.imag, level[..., 2]), axis=-1).astype(np.float32)
    return pl.Series(own.reshape(len(own), -1)).arr.to_list()


def _usual_rate_hz(series: SensorSeries) -> float:
    """Return the usual rate with the ratio closest to one to the series' own rate."""
    own_hz = 1e9 / float(np.median(np.diff(series.time_ns)))
    return min(USUAL_RATES_HZ, key=lambda rate_hz: abs(np.log(rate_hz / own_hz)))


LONGEST_GAP_NS = 200_000_000
"""A reading at a larger distance in time from any orientation has no vertical and horizontal part."""
_ROTATIONS = ("GAME_ROT", "ROT")


def magnetic_windows(sensors: pl.DataFrame, session: str, building: str, window_s: float) -> pl.DataFrame:
    """Average a session's magnetic readings (``MAG``, else ``MAG_UN`` minus its own estimate of the phone's field).

    ``sensors`` is the labelled table of ``process``. Windows are of the clock, counted from the window of the first
    reading; those without a labelled reading have no position. ``norm_deviation_ut`` is the standard deviation of the
    strength within the window; ``vertical_ut`` counts upwards. Both parts are null if the phone's tilt is unknown.
    """
    rows = _readings(sensors)
    vertical = _vertical(sensors, rows["time_ns"].to_numpy(), rows.select("fx", "fy", "fz").to_numpy(writable=True))
    norm = (pl.col("fx") ** 2 + pl.col("fy") ** 2 + pl.col("fz") ** 2).sqrt()
    window = pl.col("time_ns") // round(window_s * 1e9)
    measured = rows.with_columns(
        pl.Series("vertical", vertical, nan_to_null=True), norm=norm, number=window - window.min()
    ).with_columns(horizontal=(pl.col("norm") ** 2 - pl.col("vertical") ** 2).clip(lower_bound=0.0).sqrt())
    table = measured.group_by("number", maintain_order=True).agg(
        **mean_position(pl.col("x").is_not_null()),
        readings=pl.len(),
        norm_ut=pl.col("norm").mean(),
        norm_deviation_ut=pl.col("norm").std(ddof=0),
        vertical_ut=pl.col("vertical").mean(),
        horizontal_ut=pl.col("horizontal").mean(),
        device=pl.col("device").first(),
        start_ns=pl.col("time_ns").min(),
        end_ns=pl.col("time_ns").max(),
    )
    name = pl.concat_str(pl.lit(f"{session}/magnetic/"), pl.col("number").cast(pl.String).str.zfill(6))
    return in_schema(
        MAGNETIC,
        table.with_columns(window_id=name, building=pl.lit(building), session=pl.lit(session)).drop("number"),
    )


def _readings(sensors: pl.DataFrame) -> pl.DataFrame:
    """Select the magnetometer's readings in order, each once; ``fx``, ``fy``, ``fz`` are the field in the phone's
    axes."""
    columns = ("time_ns", "status", "floor", "device", "x", "y", "z", "sigma")
    rows = sensors.filter(pl.col("sensor") == "MAG").select(*columns, fx="v1", fy="v2", fz="v3")
    if not len(rows):
        rows = sensors.filter(pl.col("sensor") == "MAG_UN").select(
            *columns, fx=pl.col("v1") - pl.col("v4"), fy=pl.col("v2") - pl.col("v5"), fz=pl.col("v3") - pl.col("v6")
        )
    finite = pl.all_horizontal(pl.col("fx", "fy", "fz").is_finite())
    return in_time_order(rows.filter(finite, pl.col("status") != "duplicate"))


def _vertical(sensors: pl.DataFrame, time_ns: IntArray, field: FloatArray) -> FloatArray:
    """Vertical part (n,) of a field (n, 3) in the phone's axes; NaN if its tilt is not known."""
    found = _tilt(sensors)
    if found is None or not len(time_ns):
        return np.full(len(time_ns), np.nan)
    level, known_ns = found
    after = np.searchsorted(known_ns, time_ns)
    near = np.minimum(
        np.abs(known_ns[np.minimum(after, len(known_ns) - 1)] - time_ns),
        np.abs(known_ns[np.maximum(after - 1, 0)] - time_ns),
    )
    vertical: FloatArray = np.where(near <= LONGEST_GAP_NS, level.at(time_ns).apply(field)[:, 2], np.nan)
    return vertical


def _tilt(sensors: pl.DataFrame) -> tuple[LevelOrientation, IntArray] | None:
    """Find the phone's level orientation, and the times (n,) of its readings; None if no sensor shows it."""
    for name in _ROTATIONS:
        rotation = sensor_series(sensors, name, ("v1", "v2", "v3", "v4"))
        if len(rotation) > 1:
            return logged_orientation(rotation), rotation.time_ns
    accelerometer, gyroscope = (sensor_series(sensors, name, ("v1", "v2", "v3")) for name in ("ACC", "GYRO"))
    if len(accelerometer) > 1 and len(gyroscope) > 1:
        return filtered_orientation(accelerometer, gyroscope), gyroscope.time_ns
    return None
