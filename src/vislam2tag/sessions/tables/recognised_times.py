"""Tables whose times are brought to nanoseconds, whatever unit they were written in."""

from __future__ import annotations

import polars as pl

from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import IntArray
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.intake.time_units import ANY, FRAMES, READINGS, SCANS, Steps, recognised_ns


def clock_of(camera: CameraTrack, sensors: pl.DataFrame | None = None) -> IntArray:
    """Times (k,), ns, that a session's other tables must meet: of usable frames, or without any, of sensor readings."""
    frames_ns = camera.time_ns[camera.usable]
    return frames_ns if len(frames_ns) or sensors is None else sensors["time_ns"].to_numpy()


def with_frame_times(rows: pl.DataFrame, file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """Rows of poses (``time_ns`` as read) with their times in ns, and a finding if they were in another unit."""
    return _recognised(rows, rows["time_ns"], FRAMES, file, "nanoseconds", None)


def with_landmark_times(rows: pl.DataFrame, file: str, clock_ns: IntArray) -> tuple[pl.DataFrame, list[Finding]]:
    """The same for rows of landmarks, which have the times of frames."""
    return _recognised(rows, rows["time_ns"], FRAMES, file, "nanoseconds", clock_ns)


def with_reading_times(rows: pl.DataFrame, file: str, clock_ns: IntArray) -> tuple[pl.DataFrame, list[Finding]]:
    """The same for sensor readings: those of the sensor with most rows say how fast they come."""
    most = rows["sensor"].value_counts().sort("count", "sensor", descending=True)["sensor"].head(1)
    rate = rows.filter(pl.col("sensor").is_in(most.to_list()))["time_ns"]
    return _recognised(rows, rate, READINGS, file, "nanoseconds", clock_ns)


def with_scan_times(
    rows: pl.DataFrame, file: str, clock_ns: IntArray, stated: str = "nanoseconds"
) -> tuple[pl.DataFrame, list[Finding]]:
    """The same for Wi-Fi scans; the published layout ``stated`` microseconds."""
    starts = rows.group_by("scan").agg(pl.col("time_ns").min())["time_ns"]
    return _recognised(rows, starts, SCANS, file, stated, clock_ns)


def with_times_of(rows: pl.DataFrame, file: str, clock_ns: IntArray) -> tuple[pl.DataFrame, list[Finding]]:
    """The same for rows whose rate says nothing, such as presses and advertisements."""
    return _recognised(rows, rows["time_ns"], ANY, file, "nanoseconds", clock_ns)


def _recognised(
    rows: pl.DataFrame, rate: pl.Series, steps: Steps, file: str, stated: str, clock_ns: IntArray | None
) -> tuple[pl.DataFrame, list[Finding]]:
    time_ns, findings = recognised_ns(rows["time_ns"].to_numpy(), rate.to_numpy(), steps, file, stated, clock_ns)
    return (rows.with_columns(time_ns=time_ns) if findings else rows), findings
