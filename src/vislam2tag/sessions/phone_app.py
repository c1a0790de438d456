"""What the phone app writes: its record, the columns of its tables, and what its tracker says of itself."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from typing import Literal

import numpy as np
import polars as pl
from pydantic import Field, ValidationError

from vislam2tag.common.errors import SessionError
from vislam2tag.common.findings import Finding, Severity, at_lines_if
from vislam2tag.common.records import Record
from vislam2tag.core.arrays import BoolArray, runs_of
from vislam2tag.core.context import TrackerState
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.sessions.readings import SENSOR_VALUES
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.text_tables import Columns, NamedTable
from vislam2tag.sessions.tracker_tables import POSE_COLUMNS, camera_track

RECORD_FILE = "session.json"
VERSION = 1
SESSION_NAME = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{6}(-[0-9]{1,6})?")
DEVICE_NAME = re.compile(r"[A-Za-z0-9]([A-Za-z0-9._ -]{0,62}[A-Za-z0-9_-])?")
STOPPED, KILLED = "stopped", "killed"


class _Model(Record, extra="ignore"):
    """Newer apps may say more."""


class RecordingEnd(_Model):
    """How and when a recording ended; times are None where they are not known."""

    state: str = Field(pattern=r"^[a-z_]{1,40}$")
    detail: str = ""
    wall_ms: int | None = None
    boot_ns: int | None = None


class Phone(_Model):
    """What the phone is."""

    manufacturer: str = ""
    model: str = ""
    android: str = ""
    arcore: str | None = None


class PhoneRecord(_Model):
    """What readers use of ``session.json``; other keys are ignored."""

    format: Literal["vislam2tag-phone"]
    version: Literal[1]
    session: str = Field(pattern=f"^{SESSION_NAME.pattern}$")
    floor: int = Field(ge=-999999, le=999999)
    device: str = Field(pattern=f"^{DEVICE_NAME.pattern}$")
    site: str = ""
    note: str = ""
    phone: Phone = Phone()
    end: RecordingEnd | None = None

    @property
    def ended(self) -> str:
        """How the recording ended; one that never said so was killed."""
        return self.end.state if self.end else KILLED


def parse_record(data: bytes, file: str) -> PhoneRecord:
    """Read ``session.json``; raises ValueError, one sentence, where it is none, SessionError for an unknown version."""
    try:
        return PhoneRecord.model_validate_json(data)
    except ValidationError as error:
        wrong = error.errors()[0]
        where = ".".join(map(str, wrong["loc"])) or "the file"
        if where == "version" and isinstance(wrong["input"], int):
            raise SessionError(
                f"{file}: version {wrong['input']!s:.20} of the phone's format; this program reads {VERSION}: update it"
            ) from error
        raise ValueError(f"{where}: {wrong['msg']}") from error


FIRST_COLUMN = b"time_ns,"
"""How the header of every table begins."""
TRACKING = "TRACKING"
SIGHTING = "FULL_TRACKING"
"""The tracker's word for a landmark that it sees in this frame."""
_POSE: Columns = dict.fromkeys(("tx_m", "ty_m", "tz_m", "qx", "qy", "qz", "qw"), pl.Float64)

_WORDS: Columns = dict.fromkeys(("state", "failure"), pl.String)
_BEACON: Columns = {"uuid": pl.String, "major": pl.Int32, "minor": pl.Int32, "rssi_dbm": pl.Float32}
_RANGE: Columns = dict.fromkeys(("range_m", "range_sigma_m", "rssi_dbm"), pl.Float32)
_COUNTS: Columns = dict.fromkeys(("attempted", "successful"), pl.Int32)

CAMERA = NamedTable(
    {"time_ns": pl.Int64, "frame_clock": pl.String, "part": pl.Int64, **_WORDS, **_POSE},
    required=("part",),
    words=("frame_clock", *_WORDS),
    severity=Severity.ERROR,
)
LANDMARKS = NamedTable(
    {"time_ns": pl.Int64, "id": pl.String, "state": pl.String, "method": pl.String, **_POSE},
    required=("id",),
    words=("state", "method"),
    quoted=True,
    severity=Severity.ERROR,
)
ANCHORS = NamedTable({"time_ns": pl.Int64, "anchor": pl.Int64, "state": pl.String, **_POSE}, ("anchor",), ("state",))
SENSORS = NamedTable(
    {"time_ns": pl.Int64, "sensor": pl.String, **dict.fromkeys(SENSOR_VALUES, pl.Float64)}, words=("sensor",)
)
WIFI = NamedTable(
    {"time_ns": pl.Int64, "scan": pl.Int32, "bssid": pl.String, "ssid": pl.String}
    | dict.fromkeys(("rssi_dbm", "frequency_mhz"), pl.Float32),
    required=("scan", "rssi_dbm", "frequency_mhz"),
    quoted=True,
)
BLE = NamedTable({"time_ns": pl.Int64, "address": pl.String, "name": pl.String, **_BEACON}, ("rssi_dbm",), quoted=True)
RTT = NamedTable(
    {"time_ns": pl.Int64, "bssid": pl.String, "responder": pl.Int32, **_RANGE, **_COUNTS}, ("responder", "range_m")
)
PRESSES = NamedTable({"time_ns": pl.Int64, "n": pl.Int64, "action": pl.String}, ("n",), ("action",))
_PLACE: Columns = dict.fromkeys(("x_m", "y_m", "sigma_m"), pl.Float64)
TAPS = NamedTable({**PRESSES.columns, **_PLACE}, PRESSES.required, PRESSES.words)
"""Presses as apps write them that take taps on the plan, too."""
EVENTS = NamedTable({"time_ns": pl.Int64, "event": pl.String, "detail": pl.String}, words=("event",), quoted=True)


def unit_poses(rows: pl.DataFrame) -> pl.DataFrame:
    """Name the pose columns as other formats do."""
    return rows.rename(dict(zip(_POSE, POSE_COLUMNS, strict=True)))


_UNKNOWN = "unknown"


def phone_camera(rows: pl.DataFrame, file: str, settings: FindingSettings) -> tuple[CameraTrack, list[Finding]]:
    """Make the camera track of the parsed rows of a camera table.

    Frames without tracking are kept as lost ones, at the pose last tracked where they have none of their own.
    """
    tracking = rows["state"].to_numpy() == TRACKING
    camera, findings = camera_track(_held(rows), file, settings)
    failures = rows["failure"].unique().sort().to_list()
    failure = rows["failure"].cast(pl.Enum(failures)).to_physical().to_numpy().astype(np.int64)
    state = TrackerState(np.asarray(tracking, dtype=bool), rows["part"].to_numpy(), tuple(failures), failure)
    unknown = rows.filter(pl.col("frame_clock") == _UNKNOWN)["row"].to_list()
    message = "the clock of the images is not known: these frames have the time at which they were logged"
    findings += at_lines_if("unknown_exposure", file, unknown, message)
    findings += _tracking_lost(camera, state, file)
    first = np.flatnonzero(np.diff(state.section) != 0) + 1
    message = "the tracker began anew at these frames; each part of the walk is mapped on its own and needs landmarks"
    findings += at_lines_if("tracking_restarted", file, camera.row[first].tolist(), message)
    return replace(camera, state=state, exposure_known=bool(len(rows)) and not unknown), findings


def _held(rows: pl.DataFrame) -> pl.DataFrame:
    """Name the pose columns as usual; a frame without tracking gets the pose last tracked in its part, or next."""
    rows = unit_poses(rows)
    own = pl.when(pl.col("state") == TRACKING).then(pl.col(list(POSE_COLUMNS)))
    held = own.forward_fill().backward_fill().over("part")
    at_rest = [pl.lit(1.0 if name == "qw" else 0.0).alias(name) for name in POSE_COLUMNS]
    filled = rows.with_columns(own.otherwise(held))
    return filled.with_columns(
        pl.when(pl.col("state") == TRACKING).then(pl.col(name)).otherwise(pl.coalesce(name, rest)).alias(name)
        for name, rest in zip(POSE_COLUMNS, at_rest, strict=True)
    )


def _tracking_lost(camera: CameraTrack, state: TrackerState, file: str) -> list[Finding]:
    """Report the usable frames without tracking, with the tracker's reasons."""
    lost: BoolArray = camera.usable & ~state.tracking
    spans = runs_of(lost)
    reasons = Counter(filter(None, (state.reason(first, after) for first, after in spans)))
    by_count = sorted(reasons.items(), key=lambda each: (-each[1], each[0]))
    counted = [f"{word.lower().replace('_', ' ')} ({count}x)" for word, count in by_count]
    why = f" for {', '.join(counted)}" if counted else ""
    message = f"tracking was lost {len(spans)} time{'s' if len(spans) > 1 else ''}{why}; it splits the walk"
    return at_lines_if("tracking_lost", file, camera.row[lost].tolist(), message)
