"""The phone app's own format: its record, tables with headers, exposure times, its tracker's word on itself, anchors.

docs/reference/phone-format.md is its specification.
"""

from __future__ import annotations

import codecs
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import polars as pl
from pydantic import Field, ValidationError

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.given_files import plain
from vislam2tag.common.findings import Finding, Severity, at_lines_if
from vislam2tag.common.records import Record
from vislam2tag.core.arrays import BoolArray, IntArray, runs_of
from vislam2tag.core.context import AnchorLog, ToldFloors, TrackerState
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.intake.readings import admitted
from vislam2tag.intake.time_units import ANY, FRAMES, SCANS
from vislam2tag.sessions.clocks import clock_of, pose_lag_of, unix_ahead_ns
from vislam2tag.sessions.model import Recording, Session
from vislam2tag.sessions.readings import SENSOR_VALUES, mark_repeated, pressure_log
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.session_files import FileFormat, SessionFiles, existing_files
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.text_tables import Columns, NamedTable, RawTable
from vislam2tag.sessions.tracker_tables import (
    POSE_COLUMNS,
    camera_track,
    frames_of,
    landmark_log,
    poses_of,
    sorted_once,
)
from vislam2tag.sessions.without_poses import FIXES_FILE, with_fixes, with_taps
from vislam2tag.site.model import SessionKey
from vislam2tag.site.site_table import is_file

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
    start: Any = None
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


_HEADERS = tuple(mark + b"time_ns" + separator for mark in (b"", codecs.BOM_UTF8) for separator in (b",", b";", b"\t"))
"""How the header of every table begins, also if a spreadsheet saved it."""
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
    message = "the clock of the images is unknown: these frames have the time at which they were logged"
    findings += at_lines_if("unknown_exposure", file, unknown, message)
    findings += _tracking_lost(camera, state, file)
    first = np.flatnonzero(np.diff(state.section) != 0) + 1
    message = (
        "the tracker restarted at these frames; each part of the walk is mapped separately and needs two landmarks"
    )
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
    message = (
        f"tracking was lost {len(spans)} time{'s' if len(spans) > 1 else ''}{why}; the program continues at the next "
        "landmark"
    )
    return at_lines_if("tracking_lost", file, camera.row[lost].tolist(), message)


FILE_NAMES = {
    "record": (RECORD_FILE,),
    "poses": ("CameraPose.csv",),
    "landmarks": ("LandmarkPose.csv",),
    "anchors": ("AnchorPose.csv",),
    "wifi": ("WiFi.csv",),
    "sensors": ("Sensors.csv",),
    "presses": ("ControlPoint.csv",),
    "ble": ("Ble.csv",),
    "rtt": ("Rtt.csv",),
    "events": ("Events.csv",),
    "fixes": (FIXES_FILE,),
}
"""The name of each role's file."""
_RADIOS = {"wifi": "Wi-Fi", "ble": "Bluetooth"}
"""How events name what a phone hears with."""


def _recognises(folder: Path) -> bool:
    """A session has ``session.json``, or a table of a known name that begins with our header."""
    return is_file(folder / RECORD_FILE) or any(_has_header(path) for path in existing_files(folder, FILE_NAMES))


def _session(reading: SessionFiles, key: SessionKey, settings: FindingSettings) -> Session:
    record = _record(reading, key)
    poses = reading.rows("poses", CAMERA.read, FRAMES)
    camera = reading.noted(phone_camera(poses, reading.name_of("poses"), settings))
    landmarks = _landmarks(reading, camera)
    anchors = _anchors(reading, camera)
    sensors = reading.readings(SENSORS.read, camera)
    clock_ns = clock_of(camera, sensors)
    wifi = reading.wifi(reading.rows("wifi", WIFI.read, SCANS, clock_ns), settings)
    tables = {"wifi": reading.on_clock("wifi", wifi, camera, sensors), "sensors": sensors}
    ble = reading.on_clock("ble", reading.ble(reading.rows("ble", BLE.read, ANY, clock_ns)), camera)
    tables |= {name: table for name, table in (("ble", ble), ("rtt", _rtt(reading, camera, clock_ns))) if table.height}
    presses_ns, taps = _presses(reading, camera, clock_ns)
    recording, told_floors = _recording(reading, record, clock_ns)
    pressure, pose_lag_s = pressure_log(sensors), pose_lag_of(camera, sensors)
    camera = replace(camera, anchors=anchors, told_floors=told_floors, pressure=pressure, pose_lag_s=pose_lag_s)
    session = reading.session(key, camera, landmarks, tables, presses_ns=presses_ns, recording=recording)
    return with_taps(with_fixes(session, reading), reading, taps, reading.name_of("presses"))


def _has_header(path: Path) -> bool:
    try:
        with plain(path).open("rb") as file:
            return file.read(max(map(len, _HEADERS))).startswith(_HEADERS)
    except OSError:
        return False


def _record(reading: SessionFiles, key: SessionKey) -> PhoneRecord | None:
    """The session's record; where it says another floor or device than the folders do, these count."""
    file, data = reading.load("record")
    if not reading.has("record"):
        message = "floor and device are taken from the folders; how the recording ended is unknown"
        reading.note("missing_file", file, message)
        return None
    try:
        record = parse_record(data, str(reading.folder / file))
    except ValueError as error:
        message = f"{error}; floor and device are taken from the folders; how the recording ended is unknown"
        reading.note("unreadable_record", file, message)
        return None
    reading.account("record", data, RawTable(file, 1, pl.DataFrame({"row": [1]}), (), ()))
    if record.floor != key.floor:
        message = (
            f"the collector chose floor {record.floor}, but the session is in the folder of floor {key.floor}, which "
            "is used; move the session if that is wrong"
        )
        reading.note("other_floor", file, message)
    if record.ended != STOPPED:
        detail = f" ({record.end.detail})" if record.end and record.end.detail else ""
        message = (
            f"the recording was not stopped by hand: it ended as '{record.ended}'{detail}; all recorded data is used"
        )
        reading.note("recording_ended", file, message, Severity.INFO)
    return record


def _landmarks(reading: SessionFiles, camera: CameraTrack) -> LandmarkLog:
    """Rows that the tracker stands for; one that it does not track, or in a lost frame, counts as lost."""
    file = reading.name_of("landmarks")
    rows = unit_poses(reading.rows("landmarks", LANDMARKS.read, FRAMES, clock_of(camera)))
    # A row that is not tracked may have no pose: it says no more than that.
    logged = rows.filter((pl.col("state") == TRACKING) | pl.col("tx").is_not_null())
    log, findings = landmark_log(logged, file, camera)
    by_row = rows.select("row", tracked=pl.col("state") == TRACKING, seen=pl.col("method") == SIGHTING)
    state = pl.DataFrame({"row": log.row}).join(by_row, on="row", how="left", maintain_order="left")
    lost = ~state["tracked"].to_numpy()
    if camera.state is not None:
        lost |= ~camera.state.tracking[log.frame]
    reading.findings += [finding for finding in findings if finding.kind != "tracking_lost"]
    return replace(log, lost=lost, seen=state["seen"].to_numpy() & ~lost)


def _anchors(reading: SessionFiles, camera: CameraTrack) -> AnchorLog | None:
    """Rows of anchors that are tracked, at usable frames with tracking; None where there are none."""
    rows = unit_poses(reading.rows("anchors", ANCHORS.read, FRAMES, clock_of(camera)))
    rows = rows.filter(pl.col("state") == TRACKING)
    position, orientation, sound, odd = poses_of(rows, reading.name_of("anchors"))
    reading.findings += odd
    frame, _ = frames_of(rows["time_ns"].to_numpy(), camera)
    used = sound & (frame >= 0)
    if camera.state is not None and len(camera.time_ns):
        used &= camera.state.tracking[frame]
    if not used.any():
        return None
    anchor = rows["anchor"].to_numpy()
    order, _ = sorted_once(anchor, frame, np.flatnonzero(used))
    return AnchorLog(anchor[order], frame[order], position[order], orientation[order])


def _rtt(reading: SessionFiles, camera: CameraTrack, clock_ns: IntArray) -> pl.DataFrame:
    """Ranges to access points; older apps have no such file."""
    rows = reading.noted(admitted(reading.rows("rtt", RTT.read, ANY, clock_ns), "bssid", reading.name_of("rtt")))
    rows = mark_repeated(rows.with_columns(responder=pl.col("responder") != 0), "bssid")
    return reading.on_clock("rtt", rows, camera)


def _presses(reading: SessionFiles, camera: CameraTrack, clock_ns: IntArray) -> tuple[IntArray, pl.DataFrame]:
    """Times (k,) of presses of the button, ns, and the taps on the plan. What was taken back is left out."""
    rows = reading.rows("presses", _parse_presses, ANY, clock_ns)
    undone = rows.filter(pl.col("action") == "undo")["n"]
    kept = rows.filter(~pl.col("n").is_in(undone.to_list()))
    presses = reading.on_clock("presses", kept.filter(action="press"), camera)
    presses_ns = presses["time_ns"].to_numpy().astype(np.int64)
    if "x_m" not in kept.columns:
        return presses_ns, kept.clear()
    x, y = (pl.col(name).fill_null(np.nan).alias(name[0]) for name in ("x_m", "y_m"))
    return presses_ns, kept.filter(action="tap").select("row", "time_ns", x, y, "sigma_m")


def _parse_presses(data: bytes, file: str) -> RawTable:
    has_places = b"x_m" in data.partition(b"\n")[0].split(b",")
    return (TAPS if has_places else PRESSES).read(data, file)


def _recording(
    reading: SessionFiles, record: PhoneRecord | None, clock_ns: IntArray
) -> tuple[Recording, ToldFloors | None]:
    """What the recorder says of itself, and where the walker said to have come to another floor."""
    file = reading.name_of("events")
    rows = reading.rows("events", EVENTS.read, ANY, clock_ns)
    counts = dict(rows["event"].value_counts().sort("event").iter_rows())
    known = ("", counts) if record is None else (record.ended, counts, record.note, unix_ahead_ns(record.start))
    recording = Recording(*known)
    if recording.scans_refused:
        message = (
            "scans were refused or failed, probably because the phone throttles them; disable 'Wi-Fi scan "
            "throttling' in its developer options"
        )
        reading.note("scans_refused", file, message, count=recording.scans_refused)
    stopped = rows.filter(pl.col("event") == "scans_stopped")
    radios = " and ".join(_RADIOS.get(word, word) for word in stopped["detail"].fill_null("").unique().sort())
    message = (
        f"with the screen off, the phone returned no {radios} for at least 90 s; walk with the screen on, or exempt "
        "the app from battery saving in the phone's settings (Apps, vislam2tag, Battery: unrestricted)"
    )
    reading.findings += at_lines_if("scans_stopped", file, stopped["row"].to_list(), message)
    dropped = counts.get("rows_dropped", 0)
    if dropped:
        message = (
            "rows came faster than the phone could write them and are missing; choose a lower sensor rate in the app"
        )
        reading.note("rows_dropped", file, message, count=dropped)
    return recording, _told_floors(rows)


def _told_floors(events: pl.DataFrame) -> ToldFloors | None:
    told = events.filter(event="floor").select(
        "time_ns", floor=pl.col("detail").cast(pl.Int32, strict=False).cast(pl.Int64)
    )
    told = told.drop_nulls().sort("time_ns", maintain_order=True)
    return ToldFloors(told["time_ns"].to_numpy(), told["floor"].to_numpy()) if told.height else None


register(FileFormat("phone", FILE_NAMES, _recognises, _session))
