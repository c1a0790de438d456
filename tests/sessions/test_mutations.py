"""Whatever bytes a file holds, a reader raises nothing and accounts for every line."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from tests.sessions.raw import clean_files, count_lines, to_bytes
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.sessions.camera import CAMERA_SCHEMA, camera_track
from vislam2tag.sessions.clock import clock_mismatch
from vislam2tag.sessions.landmark_log import LANDMARK_SCHEMA, landmark_log
from vislam2tag.sessions.raw_table import RawTable, parse_table
from vislam2tag.sessions.sensor_table import SENSOR_SCHEMA, sensor_table
from vislam2tag.sessions.wifi_table import mark_repeated, parse_wifi, wifi_findings
from vislam2tag.settings import FindingSettings
from vislam2tag.survey.ids import landmark_id

MUTATIONS = 2000
LINES = 30
SETTINGS = FindingSettings()
NASTY = [
    b"\x00",
    b"\xff\xfe",
    b"\xc3",
    b"\xed\xa0\x80",
    b"\xef\xbb\xbf",
    b"\r",
    b"\r\n",
    b"\n\n",
    b";",
    b"; ; ",
    b",",
    b".",
    b"\t",
    b'"',
    b"'",
    b"#",
    b"%s",
    b"NaN",
    b"-Infinity",
    b"1e400",
    b"-1e-400",
    b"9" * 25,
    b"9223372036854775807",
    b"-9223372036854775808",
    b"18446744073709551616",
    b"1_000",
    b"0x7f",
    b"\xe2\x80\xa8",
    b"\x1a",
    b"\\n",
    b" " * 50,
    b"A" * 300,
]


def mutate(data: bytes, rng: np.random.Generator) -> bytes:
    """Damage a file in one to three ways."""
    for _ in range(rng.integers(1, 4)):
        data = WAYS[rng.integers(len(WAYS))](data, rng)
    return data


def _place(data: bytes, rng: np.random.Generator) -> int:
    return int(rng.integers(len(data) + 1))


def _flip(data: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(data or b"x")
    for _ in range(rng.integers(1, 6)):
        changed[rng.integers(len(changed))] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def _truncate(data: bytes, rng: np.random.Generator) -> bytes:
    return data[: _place(data, rng)]


def _behead(data: bytes, rng: np.random.Generator) -> bytes:
    return data[_place(data, rng) :]


def _insert(data: bytes, rng: np.random.Generator) -> bytes:
    at = _place(data, rng)
    return data[:at] + NASTY[rng.integers(len(NASTY))] + data[at:]


def _replace_field(data: bytes, rng: np.random.Generator) -> bytes:
    fields = data.split(b"; ")
    fields[rng.integers(len(fields))] = NASTY[rng.integers(len(NASTY))]
    return b"; ".join(fields)


def _shuffle_lines(data: bytes, rng: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    i, j = rng.integers(len(lines), size=2)
    lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


def _repeat_lines(data: bytes, rng: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    i, j = sorted(rng.integers(len(lines), size=2))
    return b"\n".join(lines[:j] + lines[i:])


def _drop_lines(data: bytes, rng: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    i, j = sorted(rng.integers(len(lines), size=2))
    return b"\n".join(lines[:i] + lines[j:])


def _other_separator(data: bytes, rng: np.random.Generator) -> bytes:
    return data.replace(b"; ", (b",", b"\t", b";", b" ", b";;")[rng.integers(5)], int(rng.integers(1, 200)))


def _other_mark(data: bytes, rng: np.random.Generator) -> bytes:
    return data.replace(b".", (b",", b"..", b"\xd9\xab")[rng.integers(3)], int(rng.integers(1, 200)))


def _noise(data: bytes, rng: np.random.Generator) -> bytes:
    at = _place(data, rng)
    return data[:at] + rng.bytes(int(rng.integers(1, 40))) + data[at:]


WAYS: tuple[Callable[[bytes, np.random.Generator], bytes], ...] = (
    _flip,
    _truncate,
    _behead,
    _insert,
    _replace_field,
    _shuffle_lines,
    _repeat_lines,
    _drop_lines,
    _other_separator,
    _other_mark,
    _noise,
)


@cache
def clean_camera() -> CameraTrack:
    data = to_bytes(clean_files()["poses.csv"])
    return camera_track(parse_table(data, "poses.csv", CAMERA_SCHEMA).rows, "poses.csv", SETTINGS)[0]


def read_poses(data: bytes) -> RawTable:
    table = parse_table(data, "poses.csv", CAMERA_SCHEMA)
    camera, _ = camera_track(table.rows, "poses.csv", SETTINGS)
    assert np.all(np.diff(camera.time_ns[camera.usable]) > 0)
    assert np.isfinite(camera.position_acs[camera.usable]).all()
    assert np.allclose(np.linalg.norm(camera.orientation_acs, axis=1), 1.0)
    return table


def read_landmarks(data: bytes) -> RawTable:
    table = parse_table(data, "initPoses.csv", LANDMARK_SCHEMA)
    camera = clean_camera()
    log, _ = landmark_log(table.rows, "initPoses.csv", camera)
    assert np.isfinite(log.position_acs).all()
    pairs = log.landmark * len(camera.time_ns) + log.frame
    assert np.all(np.diff(pairs) > 0)
    assert all(landmark_id(name) == name for name in log.ids)
    return table


def read_sensors(data: bytes) -> RawTable:
    table = parse_table(data, "sensors.csv", SENSOR_SCHEMA)
    rows, _ = sensor_table(table.rows, "sensors.csv")
    clock_mismatch(rows["time_ns"].to_numpy(), "sensors.csv", clean_camera())
    assert rows.height == table.rows.height
    return table


def read_wifi(data: bytes) -> RawTable:
    table = parse_wifi(data, "wifi.csv")
    rows = mark_repeated(table.rows)
    wifi_findings(rows, "wifi.csv", SETTINGS)
    assert rows["time_ns"].min() is None or rows["time_ns"].to_numpy().min() >= 0
    return table


READERS = {
    "poses.csv": read_poses,
    "initPoses.csv": read_landmarks,
    "sensors.csv": read_sensors,
    "wifi.csv": read_wifi,
}


@pytest.mark.parametrize("name", READERS)
def test_two_thousand_damaged_files_raise_nothing_and_account_for_every_line(name: str) -> None:
    rng = np.random.default_rng(20220114)
    clean = to_bytes(clean_files()[name][:LINES])
    for number in range(MUTATIONS):
        data = mutate(clean, rng)
        table = READERS[name](data)
        unreadable = sum(f.count for f in table.findings if f.kind in ("malformed_lines", "partial_last_line"))
        assert table.lines == count_lines(data) == table.rows.height + unreadable, (number, data)
        assert sorted((*table.rows["row"].to_list(), *table.unreadable)) == list(range(1, table.lines + 1))
