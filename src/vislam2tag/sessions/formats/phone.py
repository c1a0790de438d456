"""The phone app's own format: tables with headers, exposure times, what the tracker says of itself, anchors.

docs/reference/phone-format.md is its specification.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.files.plain_files import plain
from vislam2tag.common.findings import Severity, at_lines_if
from vislam2tag.core.arrays import IntArray
from vislam2tag.core.context import AnchorLog, ToldFloors
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.intake.readings import admitted
from vislam2tag.intake.time_units import ANY, FRAMES, SCANS
from vislam2tag.sessions.clocks import clock_of, pose_lag_of
from vislam2tag.sessions.model import Recording, Session
from vislam2tag.sessions.phone_app import (
    ANCHORS,
    BLE,
    CAMERA,
    EVENTS,
    FIRST_COLUMN,
    LANDMARKS,
    PRESSES,
    RECORD_FILE,
    RTT,
    SENSORS,
    SIGHTING,
    STOPPED,
    TAPS,
    TRACKING,
    WIFI,
    PhoneRecord,
    parse_record,
    phone_camera,
    unit_poses,
)
from vislam2tag.sessions.readings import mark_repeated, pressure_log
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.session_files import FileFormat, SessionFiles, existing_files
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.text_tables import RawTable
from vislam2tag.sessions.tracker_tables import frames_of, landmark_log, poses_of, sorted_once
from vislam2tag.sessions.without_poses import FIXES_FILE, with_fixes, with_taps
from vislam2tag.site.model import SessionKey
from vislam2tag.site.site_table import is_file

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
    tables = {"wifi": reading.on_clock("wifi", wifi, camera), "sensors": sensors}
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
            return file.read(len(FIRST_COLUMN)) == FIRST_COLUMN
    except OSError:
        return False


def _record(reading: SessionFiles, key: SessionKey) -> PhoneRecord | None:
    """The session's record; where it says another floor or device than the folders do, these count."""
    file, data = reading.load("record")
    if not reading.has("record"):
        message = "floor and device are the folders'; how the recording ended is not known"
        reading.note("missing_file", file, message)
        return None
    try:
        record = parse_record(data, str(reading.folder / file))
    except ValueError as error:
        message = f"{error}; the folders tell floor and device, how the recording ended is not known"
        reading.note("unreadable_record", file, message)
        return None
    reading.account("record", data, RawTable(file, 1, pl.DataFrame({"row": [1]}), (), ()))
    if record.floor != key.floor:
        message = (
            f"the collector chose floor {record.floor}, and the session lies under floor {key.floor}, which counts; "
            "move its folder if that is wrong"
        )
        reading.note("other_floor", file, message)
    if record.ended != STOPPED:
        detail = f" ({record.end.detail})" if record.end and record.end.detail else ""
        message = f"the recording was not stopped by hand, it ended as '{record.ended}'{detail}; what there is counts"
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
    recording = Recording(ended=record.ended if record else "", events=counts, note=record.note if record else "")
    if recording.scans_refused:
        message = (
            "scans were refused or failed, as when scanning is throttled; switch off 'Wi-Fi scan throttling' in the "
            "phone's developer options"
        )
        reading.note("scans_refused", file, message, count=recording.scans_refused)
    stopped = rows.filter(pl.col("event") == "scans_stopped")
    radios = " and ".join(_RADIOS.get(word, word) for word in stopped["detail"].fill_null("").unique().sort())
    message = (
        f"with the screen off the phone brought no {radios} for 90 s and more; walk with the screen on, or free "
        "the app from battery saving in the phone's settings (Apps, vislam2tag, Battery: unrestricted)"
    )
    reading.findings += at_lines_if("scans_stopped", file, stopped["row"].to_list(), message)
    dropped = counts.get("rows_dropped", 0)
    if dropped:
        message = "rows came faster than the phone could write them, and are missing; log at a lower rate"
        reading.note("rows_dropped", file, message, count=dropped)
    return recording, _told_floors(rows)


def _told_floors(events: pl.DataFrame) -> ToldFloors | None:
    told = events.filter(event="floor").select(
        "time_ns", floor=pl.col("detail").cast(pl.Int32, strict=False).cast(pl.Int64)
    )
    told = told.drop_nulls().sort("time_ns", maintain_order=True)
    return ToldFloors(told["time_ns"].to_numpy(), told["floor"].to_numpy()) if told.height else None


register(FileFormat("phone", FILE_NAMES, _recognises, _session))
