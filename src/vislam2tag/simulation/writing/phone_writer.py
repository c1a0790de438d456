"""Simulated sessions as the phone app's files (docs/phone-format.md)."""

from __future__ import annotations

import io
import json
from datetime import UTC, datetime

import polars as pl

from vislam2tag import __version__
from vislam2tag.simulation.sensors.imu import SENSOR_TYPES
from vislam2tag.simulation.writing.phone_log import SLEPT_NS, PhoneLog
from vislam2tag.survey.model import SessionKey


def session_name(key: SessionKey) -> str:
    """Name of a session's folder: its start without colons."""
    return key.session.replace(":", "")


def phone_text(log: PhoneLog, key: SessionKey, boot_unix_ns: int) -> dict[str, bytes]:
    """Content of each file of a session by name; ``boot_unix_ns`` is wall clock (Unix ns) minus boot clock."""
    files = {f"{name}.csv": _text(table) for name, table in log.tables.items()}
    return {"session.json": _record(log, key, boot_unix_ns), **files}


def _text(table: pl.DataFrame) -> bytes:
    buffer = io.BytesIO()
    table.write_csv(buffer)
    return buffer.getvalue()


def _record(log: PhoneLog, key: SessionKey, boot_unix_ns: int) -> bytes:
    used = set(log.tables["Sensors"]["sensor"].unique().to_list())
    content = {
        "format": "vislam2tag-phone",
        "version": 1,
        "session": session_name(key),
        "site": "simulated",
        "floor": key.floor,
        "device": key.device,
        "note": "",
        "app": {"version": f"simulated {__version__}"},
        "phone": {"manufacturer": "", "model": key.device, "android": "11", "api": 30, "arcore": "1.43.0"},
        "start": _clocks(log.start_ns, boot_unix_ns),
        "end": {"state": "stopped", "detail": "", **_clocks(log.end_ns, boot_unix_ns)},
        "sensors": [_sensor(name) for name in SENSOR_TYPES if name in used],
        "landmarks": {"loaded": log.tables["LandmarkPose"]["id"].n_unique(), "refused": []},
    }
    return (json.dumps(content, indent=2) + "\n").encode()


def _sensor(name: str) -> dict[str, object]:
    return {"sensor": name, "name": name, "vendor": "simulated", "rate_hz": None}


def _clocks(boot_ns: int, boot_unix_ns: int) -> dict[str, object]:
    wall_ms = (boot_ns + boot_unix_ns) // 1_000_000
    wall = datetime.fromtimestamp(wall_ms / 1000, UTC).isoformat(timespec="milliseconds")
    return {"wall": wall, "wall_ms": wall_ms, "boot_ns": boot_ns, "nano_ns": boot_ns - SLEPT_NS}
