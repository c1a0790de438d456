"""A small clean session in the phone app's format, to break in tests."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import read_session
from vislam2tag.site.model import SessionKey, SessionRef

START_NS = 41_000_000_000_000
FRAME_NS = 33_333_333
FRAMES = 60
NAME = "2021-12-20T132523"

HEADERS = {
    "CameraPose.csv": "time_ns,logged_ns,frame_ns,nano_ns,frame_clock,part,state,failure,tx_m,ty_m,tz_m,qx,qy,qz,qw",
    "LandmarkPose.csv": "time_ns,id,state,method,tx_m,ty_m,tz_m,qx,qy,qz,qw,extent_x_m,extent_z_m",
    "AnchorPose.csv": "time_ns,anchor,state,tx_m,ty_m,tz_m,qx,qy,qz,qw",
    "Sensors.csv": "time_ns,sensor,v1,v2,v3,v4,v5,v6,accuracy",
    "WiFi.csv": "time_ns,scan,bssid,ssid,rssi_dbm,frequency_mhz,channel_width_mhz,center_0_mhz,center_1_mhz,"
    "received_ns,result,throttling",
    "Ble.csv": "time_ns,address,name,rssi_dbm,tx_power_dbm,uuid,major,minor",
    "Rtt.csv": "time_ns,bssid,responder,range_m,range_sigma_m,rssi_dbm,attempted,successful",
    "ControlPoint.csv": "time_ns,n,action",
    "Events.csv": "time_ns,event,detail",
}
IDENTITY = "0.0,0.0,0.0,1.0"

Rows = dict[str, list[str]]


def frame_ns(frame: int) -> int:
    return START_NS + frame * FRAME_NS


def camera_line(frame: int, state: str = "TRACKING", failure: str = "NONE", pose: str | None = None) -> str:
    now = frame_ns(frame)
    where = f"{frame * 0.04:.6f},1.35,{-frame * 0.01:.6f},{IDENTITY}" if pose is None else pose
    return f"{now},{now + 40_000_000},{now},{now - 5},boot,0,{state},{failure},{where}"


def landmark_line(name: str, frame: int, method: str = "FULL_TRACKING", state: str = "TRACKING") -> str:
    return f"{frame_ns(frame)},{name},{state},{method},1.0{frame:04d},1.4,-0.5,{IDENTITY},0.2,0.2"


def anchor_line(anchor: int, frame: int, state: str = "TRACKING") -> str:
    return f"{frame_ns(frame)},{anchor},{state},{anchor * 5.0},1.35,0.0,{IDENTITY}"


def wifi_line(scan: int, reading: int, ssid: str = "eduroam") -> str:
    time_ns = START_NS + scan * 200_000_000 + reading * 1_000_000
    return (
        f"{time_ns},{scan},aa:bb:cc:dd:ee:{reading:02x},{ssid},{-60 - reading},5180,80,5210,,{time_ns + 10},fresh,off"
    )


def clean_rows() -> Rows:
    """Rows of each table of two seconds at 30 Hz: landmark 10 from frame 10, landmark 7 from frame 30."""
    seen = {"10": 10, "7": 30}
    return {
        "CameraPose.csv": [camera_line(frame) for frame in range(FRAMES)],
        "LandmarkPose.csv": [
            landmark_line(name, frame) for frame in range(FRAMES) for name, first in seen.items() if frame >= first
        ],
        "AnchorPose.csv": [anchor_line(0, frame) for frame in range(FRAMES)],
        "Sensors.csv": [
            f"{START_NS + i * 10_000_000},{'ACC' if i % 2 else 'PRESSURE'},{990.0 + i},,,,,,3" for i in range(100)
        ],
        "WiFi.csv": [wifi_line(scan, reading) for scan in range(4) for reading in (2, 0, 1)],
        "Ble.csv": [f"{frame_ns(5)},C2:00:00:00:00:01,,-70,,1A7C877A-F875-49AB-B0EF-BEB8A92F46CA,1,2"],
        "Rtt.csv": [f"{frame_ns(5)},AA:bb:00:00:00:01,1,4.31,0.52,-55,8,7"],
        "ControlPoint.csv": [f"{frame_ns(20 * n + 5)},{n},press" for n in range(3)],
        "Events.csv": [f"{START_NS},started,"],
    }


def record(**changes: object) -> bytes:
    content: dict[str, object] = {
        "format": "vislam2tag-phone",
        "version": 1,
        "session": NAME,
        "site": "",
        "floor": 1,
        "device": "LG",
        "note": "a note",
        "end": {"state": "stopped", "detail": ""},
    }
    return json.dumps(content | changes).encode()


def write_session(folder: Path, rows: Mapping[str, list[str]], record_bytes: bytes | None = None) -> SessionRef:
    """Write a session with headers; a record of None is the clean one, of ``b""`` is not written."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, lines in rows.items():
        text = "".join(f"{line}\n" for line in (HEADERS[name], *lines))
        (folder / name).write_text(text, encoding="utf-8", newline="")
    content = record() if record_bytes is None else record_bytes
    if content:
        (folder / "session.json").write_bytes(content)
    return SessionRef(SessionKey(1, folder.parent.name, folder.name), folder, "phone", "slug")


def read_rows(folder: Path, rows: Mapping[str, list[str]], record_bytes: bytes | None = None) -> Session:
    return read_session(write_session(folder, rows, record_bytes))


def kinds(session: Session) -> dict[tuple[str, str], int]:
    """Count of each finding by (kind, file)."""
    return {(finding.kind, finding.file): finding.count for finding in session.findings}
