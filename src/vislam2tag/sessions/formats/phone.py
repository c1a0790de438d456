"""The phone app's own format: tables with headers, exposure times, what the tracker says of itself, anchors.

docs/reference/phone-format.md is its specification.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.files.plain_files import plain
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.arrays import IntArray
from vislam2tag.core.context import AnchorLog, ToldFloors
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.intake.readings import admitted, normal_uuids
from vislam2tag.sessions.clocks import (
    clock_mismatch,
    clock_of,
    pose_lag_of,
    with_frame_times,
    with_landmark_times,
    with_reading_times,
    with_scan_times,
    with_times_of,
)
from vislam2tag.sessions.model import FindingSettings, Recording, Session
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
from vislam2tag.sessions.readings import (
    SENSOR_VALUES,
    ble_findings,
    mark_repeated,
    mark_repeated_ble,
    pressure_log,
    sensor_table,
    wifi_findings,
)
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.session_files import SessionFiles, existing_files
from vislam2tag.sessions.text_tables import PhoneSchema, RawTable, parse_phone_table
from vislam2tag.sessions.tracker_tables import frames_of, landmark_log, poses_of
from vislam2tag.sessions.without_poses import FIXES_FILE, with_fixes, with_taps
from vislam2tag.survey.model import SessionKey, SessionRef
from vislam2tag.survey.site_table import is_file

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


class PhoneFormat:
    """Reads the folders of the phone app."""

    name = "phone"

    def recognises(self, folder: Path) -> bool:
        """A session holds ``session.json``, or a table of a known name that begins with our header."""
        if is_file(folder / RECORD_FILE):
            return True
        return any(_has_header(path) for path in existing_files(folder, FILE_NAMES))

    def input_files(self, folder: Path) -> list[Path]:
        """The files that :meth:`read` looks at, as far as they are there."""
        return existing_files(folder, FILE_NAMES)

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read a session whole; problems are findings. Raises SessionError for an unknown version."""
        return _session(SessionFiles(ref.folder, FILE_NAMES), ref.key, settings)

    def read_track(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read what the tracker and the walker said; raises as :meth:`read`."""
        return _session(SessionFiles(ref.folder, FILE_NAMES, track_only=True), ref.key, settings)


def _session(reading: SessionFiles, key: SessionKey, settings: FindingSettings) -> Session:
    record = _record(reading, key)
    camera = _camera(reading, settings)
    landmarks = _landmarks(reading, camera)
    anchors = _anchors(reading, camera)
    sensors = _sensors(reading, camera)
    clock_ns = clock_of(camera, sensors)
    tables = {"wifi": _wifi(reading, camera, clock_ns, settings), "sensors": sensors}
    ble = _ble(reading, camera, clock_ns)
    if len(ble):
        tables["ble"] = ble
    rtt = _rtt(reading, camera, clock_ns)
    if len(rtt):
        tables["rtt"] = rtt
    presses_ns, taps, taps_file = _presses(reading, camera, clock_ns)
    recording, told_floors = _recording(reading, record, clock_ns)
    camera = replace(camera, anchors=anchors, told_floors=told_floors, pressure=pressure_log(tables["sensors"]))
    session = Session(
        key=key,
        camera=replace(camera, pose_lag_s=pose_lag_of(camera, tables["sensors"])),
        landmarks=landmarks,
        presses_ns=presses_ns,
        tables=tables,
        files=tuple(reading.files),
        findings=tuple(reading.findings),
        recording=recording,
    )
    return with_taps(with_fixes(session, reading), reading, taps, taps_file)


def _has_header(path: Path) -> bool:
    try:
        with plain(path).open("rb") as file:
            return file.read(len(FIRST_COLUMN)) == FIRST_COLUMN
    except OSError:
        return False


def _table(reading: SessionFiles, role: str, schema: PhoneSchema) -> tuple[str, bytes, RawTable]:
    file, data = reading.load(role)
    return file, data, parse_phone_table(data, file, schema)


def _record(reading: SessionFiles, key: SessionKey) -> PhoneRecord | None:
    """The session's record; where it says another floor or device than the folders do, these count."""
    file, data = reading.load("record")
    if not reading.has("record"):
        message = "floor and device are the folders'; how the recording ended is not known"
        reading.findings.append(Finding(kind="missing_file", file=file, count=1, message=message))
        return None
    try:
        record = parse_record(data, str(reading.folder / file))
    except ValueError as error:
        message = f"{error}; the folders tell floor and device, how the recording ended is not known"
        reading.findings.append(Finding(kind="unreadable_record", file=file, count=1, message=message))
        return None
    reading.account("record", data, RawTable(file, 1, pl.DataFrame({"row": [1]}), (), ()))
    if record.floor != key.floor:
        message = (
            f"the collector chose floor {record.floor}, and the session lies under floor {key.floor}, which counts; "
            "move its folder if that is wrong"
        )
        reading.findings.append(Finding(kind="other_floor", file=file, count=1, message=message))
    if record.ended != STOPPED:
        detail = f" ({record.end.detail})" if record.end and record.end.detail else ""
        message = f"the recording was not stopped by hand, it ended as '{record.ended}'{detail}; what there is counts"
        reading.findings.append(
            Finding(kind="recording_ended", file=file, count=1, message=message, severity=Severity.INFO)
        )
    return record


def _camera(reading: SessionFiles, settings: FindingSettings) -> CameraTrack:
    file, data, table = _table(reading, "poses", CAMERA)
    rows, unit = with_frame_times(reading.account("poses", data, table), file)
    camera, findings = phone_camera(rows, file, settings)
    reading.findings += [*unit, *findings]
    return camera


def _landmarks(reading: SessionFiles, camera: CameraTrack) -> LandmarkLog:
    """Rows that the tracker stands for; one that it does not track, or in a lost frame, counts as lost."""
    file, data, table = _table(reading, "landmarks", LANDMARKS)
    rows, unit = with_landmark_times(unit_poses(reading.account("landmarks", data, table)), file, clock_of(camera))
    reading.findings += unit
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
    file, data, table = _table(reading, "anchors", ANCHORS)
    rows, unit = with_landmark_times(unit_poses(reading.account("anchors", data, table)), file, clock_of(camera))
    rows = rows.filter(pl.col("state") == TRACKING)
    position, orientation, sound, findings = poses_of(rows, file)
    reading.findings += [*unit, *findings]
    frame, _ = frames_of(rows["time_ns"].to_numpy(), camera)
    used = sound & (frame >= 0)
    if camera.state is not None and len(camera.time_ns):
        used &= camera.state.tracking[frame]
    if not used.any():
        return None
    anchor = rows["anchor"].to_numpy()
    order = np.flatnonzero(used)
    order = order[np.lexsort((frame[order], anchor[order]))]
    once = np.ones(len(order), dtype=bool)
    once[1:] = (np.diff(anchor[order]) != 0) | (np.diff(frame[order]) != 0)
    order = order[once]
    return AnchorLog(anchor[order], frame[order], position[order], orientation[order])


def _wifi(reading: SessionFiles, camera: CameraTrack, clock_ns: IntArray, settings: FindingSettings) -> pl.DataFrame:
    file, data, table = _table(reading, "wifi", WIFI)
    rows, unit = with_scan_times(reading.account("wifi", data, table), file, clock_ns)
    rows, odd = admitted(rows.with_columns(pl.col("ssid").fill_null("")), "bssid", file)
    reading.findings += unit
    rows = mark_repeated(rows)
    reading.findings += odd
    reading.findings += wifi_findings(rows, file, settings)
    reading.findings += clock_mismatch(rows["time_ns"].to_numpy(), file, camera)
    return rows


def _sensors(reading: SessionFiles, camera: CameraTrack) -> pl.DataFrame:
    file, data, table = _table(reading, "sensors", SENSORS)
    rows, unit = with_reading_times(reading.account("sensors", data, table), file, clock_of(camera))
    sensors, findings = sensor_table(rows.with_columns(pl.col(SENSOR_VALUES).fill_null(0.0)), file)
    reading.findings += [*unit, *findings]
    reading.findings += clock_mismatch(sensors["time_ns"].to_numpy(), file, camera)
    return sensors


def _ble(reading: SessionFiles, camera: CameraTrack, clock_ns: IntArray) -> pl.DataFrame:
    file, data, table = _table(reading, "ble", BLE)
    rows, unit = with_times_of(reading.account("ble", data, table), file, clock_ns)
    rows = rows.with_columns(pl.col("name").fill_null(""), normal_uuids(rows["uuid"]))
    rows, odd = admitted(rows, "address", file, pl.col("uuid").is_not_null())
    rows = mark_repeated_ble(rows)
    reading.findings += [*unit, *odd, *ble_findings(rows, file)]
    reading.findings += clock_mismatch(rows["time_ns"].to_numpy(), file, camera)
    return rows


def _rtt(reading: SessionFiles, camera: CameraTrack, clock_ns: IntArray) -> pl.DataFrame:
    """Ranges to access points; none of apps before them, which have no such file."""
    file, data = reading.load("rtt")
    table = parse_phone_table(data, file, RTT)
    rows, unit = with_times_of(reading.account("rtt", data, table), file, clock_ns)
    rows, odd = admitted(rows, "bssid", file)
    rows = mark_repeated(rows.with_columns(responder=pl.col("responder") != 0))
    reading.findings += [*unit, *odd]
    reading.findings += clock_mismatch(rows["time_ns"].to_numpy(), file, camera)
    return rows


def _presses(reading: SessionFiles, camera: CameraTrack, clock_ns: IntArray) -> tuple[IntArray, pl.DataFrame, str]:
    """Times (k,) of presses of the button, ns; the taps on the plan; their file. What was taken back is left out."""
    file, data = reading.load("presses")
    has_places = b"x_m" in data.partition(b"\n")[0].split(b",")
    table = parse_phone_table(data, file, TAPS if has_places else PRESSES)
    rows, unit = with_times_of(reading.account("presses", data, table), file, clock_ns)
    reading.findings += unit
    undone = rows.filter(pl.col("action") == "undo")["n"]
    kept = rows.filter(~pl.col("n").is_in(undone.to_list()))
    presses_ns = kept.filter(action="press")["time_ns"].to_numpy().astype(np.int64)
    reading.findings += clock_mismatch(presses_ns, file, camera)
    if not has_places:
        return presses_ns, kept.clear(), file
    x, y = (pl.col(name).fill_null(np.nan).alias(name[0]) for name in ("x_m", "y_m"))
    return presses_ns, kept.filter(action="tap").select("row", "time_ns", x, y, "sigma_m"), file


def _recording(
    reading: SessionFiles, record: PhoneRecord | None, clock_ns: IntArray
) -> tuple[Recording, ToldFloors | None]:
    """What the recorder says of itself, and where the walker said to have come to another floor."""
    file, data, table = _table(reading, "events", EVENTS)
    rows, unit = with_times_of(reading.account("events", data, table), file, clock_ns)
    reading.findings += unit
    counts = dict(rows["event"].value_counts().sort("event").iter_rows())
    recording = Recording(ended=record.ended if record else "", events=counts, note=record.note if record else "")
    if recording.scans_refused:
        message = (
            "scans were refused or failed, as when scanning is throttled; switch off 'Wi-Fi scan throttling' in the "
            "phone's developer options"
        )
        reading.findings.append(
            Finding(kind="scans_refused", file=file, count=recording.scans_refused, message=message)
        )
    stopped = rows.filter(pl.col("event") == "scans_stopped")
    if stopped.height:
        radios = " and ".join(_RADIOS.get(word, word) for word in stopped["detail"].fill_null("").unique().sort())
        message = (
            f"with the screen off the phone brought no {radios} for 90 s and more; walk with the screen on, or free "
            "the app from battery saving in the phone's settings (Apps, vislam2tag, Battery: unrestricted)"
        )
        lines = stopped["row"].to_list()
        reading.findings.append(Finding.at_lines("scans_stopped", file, lines, message))
    dropped = counts.get("rows_dropped", 0)
    if dropped:
        message = "rows came faster than the phone could write them, and are missing; log at a lower rate"
        reading.findings.append(Finding(kind="rows_dropped", file=file, count=dropped, message=message))
    return recording, _told_floors(rows)


def _told_floors(events: pl.DataFrame) -> ToldFloors | None:
    told = events.filter(event="floor").select(
        "time_ns", floor=pl.col("detail").cast(pl.Int32, strict=False).cast(pl.Int64)
    )
    told = told.drop_nulls().sort("time_ns", maintain_order=True)
    return ToldFloors(told["time_ns"].to_numpy(), told["floor"].to_numpy()) if told.height else None


register(PhoneFormat())
