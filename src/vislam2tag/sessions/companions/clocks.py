"""How far a companion's clock is ahead of the session's: by turns, acceleration, access points or taps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import polars as pl

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.clock_alignment import ClockAlignment, align_by_motion
from vislam2tag.core.clock_by_levels import Heard, align_by_levels
from vislam2tag.core.clock_by_taps import align_by_taps
from vislam2tag.core.pose_lag import angular_speed
from vislam2tag.intake.addresses import MASKED, normal_addresses
from vislam2tag.intake.signal_strength import measured
from vislam2tag.sessions.clock import FASTEST_RAD_PER_S
from vislam2tag.sessions.companions.recording import OtherRecording
from vislam2tag.sessions.model import Session

MOTION, LEVELS, TAPS = "motion", "levels", "taps"
WAYS = (MOTION, LEVELS, TAPS)
ACCELERATION_SIGMA_S = 0.01
"""Two places of one body are not accelerated at once: measured with devices half a metre apart."""
_FEWEST = 20
"""Readings; fewer are no series."""


def possible_alignments(
    session: Session, other: OtherRecording, wanted: str | None = None
) -> dict[str, Callable[[], ClockAlignment]]:
    """What can tell the offset, by name, the most exact first; ``wanted`` of :data:`WAYS`: only by that."""
    found: dict[str, Callable[[], ClockAlignment]] = {}
    if wanted in (None, MOTION):
        turns, force = (_norm(other.tables.get("sensors"), sensor) for sensor in ("GYRO", "ACC"))
        ours = _turns_of(session)
        if turns is not None and ours is not None:
            found["the turns that both felt"] = lambda: align_by_motion(*turns, *ours)
        felt = _norm(session.tables.get("sensors"), "ACC")
        if force is not None and felt is not None:
            found["the acceleration that both felt"] = lambda: by_acceleration(align_by_motion(*force, *felt))
    if wanted in (None, LEVELS):
        theirs, heard = (heard_in(tables.get("wifi")) for tables in (other.tables, session.tables))
        if theirs and heard:
            found["access points that both heard"] = lambda: align_by_levels(theirs, heard)
    if wanted in (None, TAPS) and len(other.taps_ns) and len(session.presses_ns):
        found["taps on both"] = lambda: align_by_taps(other.taps_ns, session.presses_ns)
    return found


def by_acceleration(found: ClockAlignment) -> ClockAlignment:
    """The same with the sigma that remains however well accelerations agree (:data:`ACCELERATION_SIGMA_S`)."""
    return replace(found, sigma_s=float(np.hypot(found.sigma_s, ACCELERATION_SIGMA_S)))


def first_clear(
    possible: Mapping[str, Callable[[], ClockAlignment]],
) -> tuple[str, ClockAlignment | None, list[str]]:
    """The first alignment that tells the offset, by which name, and what those before it said."""
    refused: list[str] = []
    for name, align in possible.items():
        tried = align()
        if tried.offset_ns is not None:
            return name, tried, refused
        refused.append(f"{name}: {tried.figures}")
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
