"""Clocks of a session: the unit of its times, the lag of its poses, tables on another clock, companions' offsets."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.clocks import (
    LAG_STEP_S,
    MAX_LAG_S,
    ClockAlignment,
    Heard,
    align_by_levels,
    align_by_motion,
    align_by_taps,
    correlation_of_rows,
    estimate_pose_lag,
)
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.core.transforms import angular_speed
from vislam2tag.intake.clock_ties import tie_fault
from vislam2tag.intake.readings import MASKED, measured, normal_addresses
from vislam2tag.intake.time_units import MAX_AFTER_S, READINGS, SCANS, Steps, recognised_ns
from vislam2tag.sessions.foreign_tables import MOST_NS
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.readings import readings_of

if TYPE_CHECKING:
    from vislam2tag.sessions.companions import OtherRecording


def clock_mismatch(times_ns: IntArray, file: str, camera: CameraTrack) -> list[Finding]:
    """Report a table whose times (any order, nanoseconds) do not overlap those of the usable frames at all."""
    frames_ns = camera.time_ns[camera.usable]
    if len(times_ns) == 0 or len(frames_ns) == 0:
        return []
    first, last = int(times_ns.min()), int(times_ns.max())
    before_s = (int(frames_ns[0]) - last) / 1e9
    after_s = (first - int(frames_ns[-1])) / 1e9
    if before_s <= 0 and after_s <= 0:
        return []
    where = f"end {before_s:.3f} s before the first" if before_s > 0 else f"begin {after_s:.3f} s after the last"
    message = (
        f"the times {where} camera frame: another clock; nothing of this file can be labelled unless "
        "corrections.toml shifts it ([[shift_clock]])"
    )
    return [Finding(kind="clock_mismatch", file=file, count=len(times_ns), message=message)]


def late_scans(times_ns: IntArray, file: str, camera: CameraTrack, sensors: pl.DataFrame) -> list[Finding]:
    """Report scans at times after the end of their recording, which is that of the last frame or sensor reading."""
    if not len(sensors) or not len(camera.time_ns):
        return []
    end_ns = max(int(camera.time_ns[-1]), int(sensors["time_ns"].to_numpy().max()))
    late = int(np.count_nonzero(times_ns > end_ns + MAX_AFTER_S * 1e9))
    if late in (0, len(times_ns)):
        return []  # if all are, they are on another clock: clock_mismatch
    message = (
        f"rows are up to {(int(times_ns.max()) - end_ns) / 1e9:.1f} s after the last frame and sensor reading, so the "
        "times of this file are from another clock. Correct them in corrections.toml ([[shift_clock]])"
    )
    return [Finding(kind="clock_mismatch", file=file, count=late, message=message)]


def unix_ahead_ns(start: Any) -> int | None:
    """How far Unix time is ahead of the boot clock, by ``start`` of a phone's record; None if that is unknown."""
    try:
        ahead_ns = int(start["wall_ms"]) * 1_000_000 - int(start["boot_ns"])
    except (ValueError, KeyError, TypeError, OverflowError):
        return None
    return ahead_ns if abs(ahead_ns) < MOST_NS else None


FASTEST_RAD_PER_S = 100.0
"""No gyroscope of a phone measures faster turns; greater values are faults."""


def pose_lag_of(camera: CameraTrack, sensors: pl.DataFrame) -> float | None:
    """Lag of the pose stamps in seconds (positive: stamped late), by a ``sensors`` table; None if unknown.

    It is 0 where the stamps are known to be those of the exposure.
    """
    if camera.exposure_known:
        return 0.0
    time_ns, turning = readings_of(sensors, "GYRO", ("v1", "v2", "v3"))
    possible = (np.abs(turning) < FASTEST_RAD_PER_S).all(axis=1)
    usable = camera.usable
    lag_s = estimate_pose_lag(
        camera.time_ns[usable],
        camera.orientation_acs[usable],
        time_ns[possible],
        turning[possible],
    )
    return None if lag_s is None else round(lag_s, 4)


def clock_of(camera: CameraTrack, sensors: pl.DataFrame | None = None) -> IntArray:
    """Times (k,), ns, that a session's other tables must meet: of usable frames, or without any, of sensor readings."""
    frames_ns = camera.time_ns[camera.usable]
    return frames_ns if len(frames_ns) or sensors is None else sensors["time_ns"].to_numpy()


def with_times(
    rows: pl.DataFrame, file: str, steps: Steps, clock_ns: IntArray | None = None, stated: str = "nanoseconds"
) -> tuple[pl.DataFrame, list[Finding]]:
    """Rows (``time_ns`` as read) with their times in ns, and a finding if they are not in the ``stated`` unit.

    ``steps`` limit how fast rows come; ``clock_ns`` are times that they must meet.
    """
    rate = _rate(rows, steps).to_numpy()
    time_ns, findings = recognised_ns(rows["time_ns"].to_numpy(), rate, steps, file, stated, clock_ns)
    return (rows.with_columns(time_ns=time_ns) if findings else rows), findings


def _rate(rows: pl.DataFrame, steps: Steps) -> pl.Series:
    """The times whose distances ``steps`` limit: of the sensor with most rows, of the starts of scans, or all."""
    if steps is READINGS:
        most = rows["sensor"].value_counts().sort("count", "sensor", descending=True)["sensor"].head(1)
        return rows.filter(pl.col("sensor").is_in(most.to_list()))["time_ns"]
    if steps is SCANS:
        return rows.group_by("scan").agg(pl.col("time_ns").min())["time_ns"]
    return rows["time_ns"]


MOTION, LEVELS, TAPS = "motion", "levels", "taps"
WAYS = (MOTION, LEVELS, TAPS)
ACCELERATION_SIGMA_S = 0.01
"""Two places of one body are not accelerated at once: measured with devices half a metre apart."""
_FEWEST = 20
"""Readings; fewer are not series."""


def possible_alignments(
    session: Session, other: OtherRecording, wanted: str | None = None
) -> dict[str, Callable[[], ClockAlignment]]:
    """What can show the offset, by name, the most exact first; ``wanted`` of :data:`WAYS`: only by that."""
    found: dict[str, Callable[[], ClockAlignment]] = {}
    if wanted in (None, MOTION):
        turns, force = (_norm(other.tables.get("sensors"), sensor) for sensor in ("GYRO", "ACC"))
        ours = _turns_of(session)
        if turns is not None and ours is not None:
            found["turns that both measured"] = lambda: align_by_motion(*turns, *ours)
        felt = _norm(session.tables.get("sensors"), "ACC")
        if force is not None and felt is not None:
            found["accelerations that both measured"] = lambda: by_acceleration(align_by_motion(*force, *felt))
    if wanted in (None, LEVELS):
        theirs, heard = (heard_in(tables.get("wifi")) for tables in (other.tables, session.tables))
        if theirs and heard:
            found["access points that both received"] = lambda: align_by_levels(theirs, heard)
    if wanted in (None, TAPS) and len(other.taps_ns) and len(session.presses_ns):
        found["taps on both"] = lambda: align_by_taps(other.taps_ns, session.presses_ns)
    return found


def by_acceleration(found: ClockAlignment) -> ClockAlignment:
    """The same with the sigma that remains however well accelerations agree (:data:`ACCELERATION_SIGMA_S`)."""
    return replace(found, sigma_s=float(np.hypot(found.sigma_s, ACCELERATION_SIGMA_S)))


def first_clear(
    possible: Mapping[str, Callable[[], ClockAlignment]], matched: Callable[[ClockAlignment], float]
) -> tuple[str, ClockAlignment | None, list[str]]:
    """The first alignment that shows the offset, by which name, and what those before it said.

    ``matched`` is the share of the recording that an alignment puts into the walk.
    """
    refused: list[str] = []
    for name, align in possible.items():
        tried = align()
        fault = None if tried.offset_ns is None else tie_fault(tried.sigma_s, matched(tried))
        if tried.offset_ns is not None and fault is None:
            return name, tried, refused
        refused.append(f"{name}: {tried.figures}" + ("" if fault is None else f"; {fault}"))
    return "", None, refused


def _turns_of(session: Session) -> tuple[IntArray, FloatArray] | None:
    """Times (n,), ns, and turn rates (n,), rad/s, of a session: its gyroscope's, else those of its poses."""
    measured = _norm(session.tables.get("sensors"), "GYRO")
    if measured is not None:
        return measured
    camera = session.camera
    usable = camera.usable
    if usable.sum() < _FEWEST:
        return None
    middle_s, speed = angular_speed(camera.time_ns[usable], camera.orientation_acs[usable])
    return int(camera.time_ns[usable][0]) + np.round(middle_s * 1e9).astype(np.int64), speed


def _norm(sensors: pl.DataFrame | None, sensor: str) -> tuple[IntArray, FloatArray] | None:
    """Times (n,), ns, and norms (n,) of a sensor's readings; None where there are hardly any."""
    if sensors is None:
        return None
    rows = sensors.filter((pl.col("sensor") == sensor) & ~pl.col("repeated"))
    norm = np.linalg.norm(rows.select("v1", "v2", "v3").to_numpy(), axis=1)
    sound = np.isfinite(norm) & ((norm < FASTEST_RAD_PER_S) | (sensor != "GYRO"))
    return (rows["time_ns"].to_numpy()[sound], norm[sound]) if sound.sum() >= _FEWEST else None


def heard_in(wifi: pl.DataFrame | None) -> Heard:
    """Times and levels of each access point in a table ``wifi``."""
    if wifi is None:
        return {}
    kept = wifi.with_columns(normal_addresses(wifi["bssid"])).filter(~pl.col("bssid").is_in(list(MASKED)))
    rows = kept.select("bssid", ns="time_ns", dbm=measured().cast(pl.Float64))
    parts = rows.drop_nulls().sort("ns").partition_by("bssid", as_dict=True)
    return {str(key[0]): (part["ns"].to_numpy(), part["dbm"].to_numpy()) for key, part in parts.items()}


_LEAST_COMPARED_S, _LONGEST_STEP_S = 15.0, 0.25
"""Motion is compared at its own times from this duration on, of rows that are this close."""
_MOST_COMPARED = 5000
_STILL = 1e-9


def agreement_by_motion(
    their_ns: IntArray, theirs: FloatArray, our_ns: IntArray, ours: FloatArray, least_spread: float
) -> float | None:
    """Correlate one norm of motion of two recordings on one clock: ``theirs`` (n,) and ``ours`` (m,), at any times, ns.

    Times may differ by up to :data:`MAX_LAG_S`. Returns None if there is too little at the same time, or if our motion
    has less than ``least_spread`` (standard deviation), as when standing still.
    """
    their_ns, first = np.unique(their_ns[np.isfinite(theirs)], return_index=True)
    theirs = theirs[np.isfinite(theirs)][first]
    our_ns, first = np.unique(our_ns[np.isfinite(ours)], return_index=True)
    ours = ours[np.isfinite(ours)][first]
    steps_s = np.diff(their_ns) * 1e-9
    if steps_s[steps_s <= _LONGEST_STEP_S].sum() < _LEAST_COMPARED_S or not len(our_ns) or theirs.std() <= _STILL:
        return None
    every = len(theirs) // _MOST_COMPARED + 1
    lags = np.arange(-MAX_LAG_S, MAX_LAG_S + LAG_STEP_S / 2, LAG_STEP_S)
    at_s = (their_ns[::every] - our_ns[0]) * 1e-9 + lags[:, None]
    own = np.interp(at_s, (our_ns - our_ns[0]) * 1e-9, ours)
    return None if own.std() < least_spread else float(correlation_of_rows(own, theirs[::every]).max())
