"""Air pressure beside the camera's poses."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.sessions.raw import START_NS, clean_files, read_files
from vislam2tag.sessions.corrected import corrected_session
from vislam2tag.sessions.model import Session
from vislam2tag.site.corrections.file import Corrections, ShiftClock


def session_with(tmp_path: Path, readings: list[tuple[int, str]]) -> Session:
    files = clean_files()
    rows = [f"{START_NS + at}; PRESSURE; {value}; 0.0; 0.0; 0.0; 0.0; 0.0" for at, value in readings]
    files["sensors.csv"] += rows
    return read_files(tmp_path / "LG" / "walk", files)


def test_pressure_rows_are_the_cameras_barometer_in_time_order(tmp_path: Path) -> None:
    odd = [(40, "NaN"), (50, "0.0"), (30, "1001.75")]
    session = session_with(tmp_path, [(20, "1001.5"), (10, "1001.25"), *odd, (30, "999.0")])
    pressure = session.camera.pressure
    assert pressure is not None
    assert (pressure.time_ns - START_NS).tolist() == [10, 20, 30]
    assert pressure.pressure_hpa.tolist() == [1001.25, 1001.5, 1001.75]
    assert (session.tables["sensors"]["sensor"] == "PRESSURE").sum() == 6


@pytest.mark.parametrize("readings", [[], [(10, "1001.5")], [(10, "1001.5"), (20, "7.0")]])
def test_fewer_than_two_readings_are_none(tmp_path: Path, readings: list[tuple[int, str]]) -> None:
    assert session_with(tmp_path, readings).camera.pressure is None


def test_a_shifted_clock_shifts_the_barometer(tmp_path: Path) -> None:
    session = session_with(tmp_path, [(10, "1001.5"), (20, "1001.6")])
    shift = Corrections(shift_clock=(ShiftClock(table="sensors", offset_s=-1.0),))
    pressure = corrected_session(session, shift)[0].camera.pressure
    assert pressure is not None
    assert (pressure.time_ns - START_NS).tolist() == [10 - 10**9, 20 - 10**9]
