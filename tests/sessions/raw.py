"""A small clean session as text in the published raw layout, to break in tests."""

from __future__ import annotations

import codecs
from pathlib import Path

from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import read_session
from vislam2tag.site.model import SessionKey, SessionRef

START_NS = 41_000_000_000_000
FRAME_NS = 33_333_333
FRAMES = 60
SENSORS = ("ACC", "GYRO", "MAG")


def frame_ns(frame: int) -> int:
    return START_NS + frame * FRAME_NS


def pose_line(frame: int) -> str:
    return (
        f"{frame_ns(frame)}; {frame * 0.04:.6f}; 1.350000; {-frame * 0.01:.6f}; 0.000000; 0.600000; 0.000000; 0.800000"
    )


def landmark_line(landmark: str, frame: int) -> str:
    return f"{landmark}; {frame_ns(frame)}; 1.{frame:06d}; 1.400000; -0.500000; 0.000000; 0.000000; 0.000000; 1.000000"


def wifi_line(scan: int, reading: int, ssid: str = "eduroam") -> str:
    time_us = START_NS // 1000 + scan * 200_000 + reading * 1000
    return f"{scan}; {time_us}; WLAN; {ssid}; aa:bb:cc:dd:ee:{reading:02x}; {-60 - reading}"


def sensor_line(index: int) -> str:
    sensor = SENSORS[index % len(SENSORS)]
    return f"{START_NS + index * 5_000_000}; {sensor}; 0.{index:06d}; -9.810000; 1.500000; 0.000000; 0.000000; 0.000000"


def clean_files() -> dict[str, list[str]]:
    """Lines of each file of two seconds at 30 Hz: landmark 10 from frame 10, landmark 7 from frame 30."""
    seen = {"10": 10, "7": 30}
    return {
        "poses.csv": [pose_line(frame) for frame in range(FRAMES)],
        "initPoses.csv": [
            landmark_line(name, frame) for frame in range(FRAMES) for name, first in seen.items() if frame >= first
        ],
        "wifi.csv": [wifi_line(scan, reading) for scan in range(5, 9) for reading in (2, 0, 1)],
        "sensors.csv": [sensor_line(index) for index in range(300)],
        "refMarker.csv": [f"{n}; {frame_ns(20 * n + 5)}" for n in range(3)],
    }


def to_bytes(lines: list[str]) -> bytes:
    return "".join(f"{line}\n" for line in lines).encode()


def count_lines(data: bytes) -> int:
    """Count lines as a text editor does: a newline at the end starts no further line."""
    text = data.removeprefix(codecs.BOM_UTF8)
    return text.count(b"\n") + (1 if text and not text.endswith(b"\n") else 0)


def write_session(folder: Path, files: dict[str, list[str]] | dict[str, bytes]) -> SessionRef:
    """Write files into a session folder; lines get a newline each."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        (folder / name).write_bytes(content if isinstance(content, bytes) else to_bytes(content))
    return SessionRef(SessionKey(1, folder.parent.name, folder.name), folder, "published", "slug")


def read_files(folder: Path, files: dict[str, list[str]]) -> Session:
    return read_session(write_session(folder, files))


def kinds(session: Session) -> dict[tuple[str, str], int]:
    """Count of each finding by (kind, file)."""
    return {(finding.kind, finding.file): finding.count for finding in session.findings}
