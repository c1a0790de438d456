"""Tables whose times are brought to nanoseconds, whatever unit they were written in."""

from __future__ import annotations

import polars as pl

from vislam2tag.common.findings import Finding
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.intake.time_units import ANY, FRAMES, READINGS, SCANS, Steps, recognised_ns


def with_frame_times(rows: pl.DataFrame, file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """Rows of poses (``time_ns`` as read) with their times in ns, and a finding if they were in another unit."""
    return _recognised(rows, rows["time_ns"], FRAMES, file, "nanoseconds", None)


def with_landmark_times(rows: pl.DataFrame, file: str, camera: CameraTrack) -> tuple[pl.DataFrame, list[Finding]]:
    """The same for rows of landmarks, which have the times of frames."""
    return _recognised(rows, rows["time_ns"], FRAMES, file, "nanoseconds", camera)


def with_reading_times(rows: pl.DataFrame, file: str, camera: CameraTrack) -> tuple[pl.DataFrame, list[Finding]]:
    """The same for sensor readings: those of the sensor with most rows say how fast they come."""
    most = rows["sensor"].value_counts().sort("count", "sensor", descending=True)["sensor"].head(1)
    rate = rows.filter(pl.col("sensor").is_in(most.to_list()))["time_ns"]
    return _recognised(rows, rate, READINGS, file, "nanoseconds", camera)


def with_scan_times(
    rows: pl.DataFrame, file: str, camera: CameraTrack, stated: str = "nanoseconds"
) -> tuple[pl.DataFrame, list[Finding]]:
    """The same for Wi-Fi scans; the published layout ``stated`` microseconds."""
    starts = rows.group_by("scan").agg(pl.col("time_ns").min())["time_ns"]
    return _recognised(rows, starts, SCANS, file, stated, camera)


def with_times_of(rows: pl.DataFrame, file: str, camera: CameraTrack) -> tuple[pl.DataFrame, list[Finding]]:
    """The same for rows whose rate says nothing, such as presses and advertisements."""
    return _recognised(rows, rows["time_ns"], ANY, file, "nanoseconds", camera)


def _recognised(
    rows: pl.DataFrame, rate: pl.Series, steps: Steps, file: str, stated: str, camera: CameraTrack | None
) -> tuple[pl.DataFrame, list[Finding]]:
    frames_ns = None if camera is None else camera.time_ns[camera.usable]
    time_ns, findings = recognised_ns(rows["time_ns"].to_numpy(), rate.to_numpy(), steps, file, stated, frames_ns)
    return (rows.with_columns(time_ns=time_ns) if findings else rows), findings
