"""Faults that single streams tell: clocks, repeated scans, other devices."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from vislam2tag.common.findings import FaultKind
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.quality.diagnosis.stream_faults import StreamSigns, sensor_clock_offset_s, stream_faults
from vislam2tag.quality.diagnosis.wifi_clock import ClockOffset
from vislam2tag.site.model import SessionKey

SOUND = StreamSigns(switched_on_s=1000.0, scans=40, repeated=0, sensor_offset_s=0.05)


def key(device: str, number: int) -> SessionKey:
    return SessionKey(0, device, f"2022-01-10T09:0{number}:00")


def signs(**changed: StreamSigns) -> dict[SessionKey, StreamSigns]:
    """Three walks of A, started at 1000 s, three of B, started a day later; some of them changed."""
    later = StreamSigns(87400.0, 40, 0, 0.03)
    found = {key("A", i): SOUND for i in range(3)} | {key("B", i): later for i in range(3)}
    return found | {key(name[0], int(name[1])): one for name, one in changed.items()}


def test_nothing_is_named_of_sound_streams() -> None:
    assert stream_faults(signs()) == []


def test_a_walk_in_another_devices_folder() -> None:
    (fault,) = stream_faults(signs(B1=StreamSigns(1030.0, 40, 0, 0.05)))
    assert (fault.kind, fault.sessions) == (FaultKind.OTHER_DEVICE, [str(key("B", 1))])
    assert fault.corrections[0].values["to"] == "A"


def test_a_phone_that_was_restarted_is_no_other_device() -> None:
    assert stream_faults(signs(B1=StreamSigns(50000.0, 40, 0, 0.05))) == []


def test_scans_delivered_again() -> None:
    (fault,) = stream_faults(signs(A0=StreamSigns(1000.0, 40, 9, 0.05), A2=StreamSigns(1000.0, 40, 2, 0.05)))
    assert (fault.kind, fault.sessions) == (FaultKind.REPEATED_SCANS, [str(key("A", 0))])
    assert fault.corrections == []
    assert "they are not used" in fault.summary


def test_one_entry_for_all_walks_of_a_device_whose_clock_is_off() -> None:
    off = {f"A{i}": StreamSigns(1000.0, 40, 0, -2.0 + 0.05 * i) for i in range(3)}
    (fault,) = stream_faults(signs(**off))
    assert (fault.kind, len(fault.sessions)) == (FaultKind.CLOCK, 3)
    assert fault.corrections[0].values["offset_s"] == -1.95
    (one,) = stream_faults(signs(A1=off["A1"]))
    assert one.corrections[0].values["session"] == key("A", 1).session


@pytest.mark.parametrize(
    ("sensors_s", "wifi", "table", "entry_s"),
    [
        (0.05, ClockOffset(6.0, 0.3), "wifi", 6.0),
        (6.2, ClockOffset(0.2, 0.3), "sensors", 6.2),
        (6.2, None, "sensors", 6.2),
        (6.2, ClockOffset(5.5, 0.3), "camera", -6.2),
        (1.1, ClockOffset(1.0, 0.3), "camera", -1.1),
    ],
)
def test_which_clock_is_off(sensors_s: float, wifi: ClockOffset | None, table: str, entry_s: float) -> None:
    """Sensors and scans off alike: it is the poses that are, even where the scans alone would not be sure."""
    (fault,) = stream_faults(signs(A1=StreamSigns(1000.0, 40, 0, sensors_s, wifi)))
    values = fault.corrections[0].values
    assert (values["table"], values["offset_s"], values["session"]) == (table, entry_s, key("A", 1).session)


@pytest.mark.parametrize("offset_s", [0.0, 1.3, -20.0, 4000.0])
def test_the_offset_of_the_gyroscopes_clock(offset_s: float) -> None:
    """Poses and gyroscope of one random turning; the gyroscope's times lack the offset."""
    rng = np.random.default_rng(2)
    time_s = np.arange(0, 120, 0.02)
    smooth = np.convolve(rng.normal(0, 3, len(time_s)), np.ones(40) / 40, mode="same")
    angle = np.cumsum(smooth) * 0.02
    quaternion = np.column_stack((np.zeros((len(angle), 2)), np.sin(angle / 2), np.cos(angle / 2)))
    frames = slice(None, None, 2)
    camera = CameraTrack(
        time_ns=((time_s[frames] + 500) * 1e9).astype(np.int64),
        position_acs=np.zeros((len(time_s[frames]), 3)),
        orientation_acs=quaternion[frames],
        status=np.zeros(len(time_s[frames]), dtype=np.int8),
    )
    sensors = pl.DataFrame(
        {
            "time_ns": ((time_s + 500 - offset_s) * 1e9).astype(np.int64),
            "sensor": "GYRO",
            "repeated": False,
            "v1": 0.0,
            "v2": 0.0,
            "v3": smooth,
        }
    )
    assert sensor_clock_offset_s(camera, sensors) == pytest.approx(offset_s, abs=0.06)
    still = sensors.with_columns(v3=pl.lit(0.0))
    assert sensor_clock_offset_s(camera, still) is None
