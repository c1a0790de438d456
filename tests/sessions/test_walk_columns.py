"""Columns of walks by name: which role each has, what is asked for, and what kind of table it is."""

from __future__ import annotations

import re

import polars as pl
import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.intake.columns import time_unit
from vislam2tag.sessions.walk_columns import TableColumns, WalkColumns, kind_of, resolved, sensor_of_file, unknown_kind

POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
EUROC = (
    *("#timestamp [ns]", "p_RS_R_x [m]", "p_RS_R_y [m]", "p_RS_R_z [m]", "q_RS_w []", "q_RS_x []", "q_RS_y []"),
    *("q_RS_z []", "v_RS_R_x [m s^-1]", "v_RS_R_y [m s^-1]", "v_RS_R_z [m s^-1]"),
    *("b_w_RS_S_x [rad s^-1]", "b_w_RS_S_y [rad s^-1]", "b_w_RS_S_z [rad s^-1]"),
    *("b_a_RS_S_x [m s^-2]", "b_a_RS_S_y [m s^-2]", "b_a_RS_S_z [m s^-2]"),
)


def names(columns: tuple[str, ...], kind: str, **given: str) -> dict[str, str]:
    found = resolved(columns, kind, TableColumns.model_validate(given), "table.csv")
    return {role: column.name for role, column in found.items()}


@pytest.mark.parametrize(
    "columns",
    [
        ("time", *POSE),
        ("timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"),
        ("Time [s]", "Position X (m)", "Position Y (m)", "Position Z (m)", "Rot_X", "Rot_Y", "Rot_Z", "Rot_W"),
        ("t_ns", *(f"pose.position.{a}" for a in "xyz"), *(f"pose.orientation.{a}" for a in "xyzw")),
        ("Unix Time", *(f"camera_{a}" for a in "xyz"), *(f"quat_{a}" for a in "xyzw")),
    ],
)
def test_poses_have_many_names(columns: tuple[str, ...]) -> None:
    assert kind_of("walk.csv", columns) == "poses"
    assert names(columns, "poses") == dict(zip(("time", *POSE), columns, strict=True))


def test_poses_as_euroc_names_them() -> None:
    order = (0, 1, 2, 3, 5, 6, 7, 4)
    assert names(EUROC, "poses") == dict(zip(("time", *POSE), (EUROC[i] for i in order), strict=True))


def test_axes_belong_together() -> None:
    with_picture = ("time", "x", "y", "px", "py", "pz", "qx", "qy", "qz", "qw")
    assert [names(with_picture, "poses")[axis] for axis in "xyz"] == ["px", "py", "pz"]


def test_one_answer_decides_for_all_axes() -> None:
    two = ("time", "x", "y", "z", "tx", "ty", "tz", "qx", "qy", "qz", "qw")
    with pytest.raises(
        UsageError, match=re.escape('x and tx may both be x; choose one in columns.toml: [poses] x = "x"')
    ):
        names(two, "poses")
    assert [names(two, "poses", x="tx")[axis] for axis in "xyz"] == ["tx", "ty", "tz"]


def test_a_landmark_beside_the_camera() -> None:
    columns = ("time", "marker", *(f"cam_{a}" for a in "xyz"), *(f"marker_{a}" for a in "xyz"))
    found = names(columns, "sightings")
    assert [found[f"d{axis}"] for axis in "xyz"] == ["cam_x", "cam_y", "cam_z"]
    assert [found[axis] for axis in "xyz"] == ["marker_x", "marker_y", "marker_z"]


def test_lengths_have_the_units_of_their_names() -> None:
    found = resolved(("time", "px [cm]", "py [cm]", "pz [cm]", *POSE[3:]), "poses", TableColumns(), "poses.csv")
    assert [found[axis].metres for axis in "xyz"] == [0.01, 0.01, 0.01]


def test_an_entry_of_another_kind_of_table_is_refused() -> None:
    with pytest.raises(UsageError, match=r"\[poses\] level: a table of poses has no such column; expected time, x, y"):
        names(("time", *POSE), "poses", level="rssi")


def test_a_missing_name_is_asked_for_with_the_one_that_is_left() -> None:
    expected = (
        'expected for level one of level, rssidbm, rssi, rss; name the column in columns.toml: [wifi] level = "dB"'
    )
    with pytest.raises(UsageError, match=re.escape(expected)):
        names(("time", "bssid", "dB"), "wifi")


def test_values_count_from_zero_or_one() -> None:
    assert names(("t", "type", "v0", "v1", "v2"), "sensors")["v3"] == "v2"
    assert names(("t", "type", "values[0]", "values[1]", "values[2]"), "sensors")["v1"] == "values[0]"
    assert names(("t", "type", "v1", "v2", "v3"), "sensors")["v3"] == "v3"
    assert names(("t", "sensor", "x", "y", "z"), "sensors")["v3"] == "z"


@pytest.mark.parametrize(
    ("file", "columns", "kind"),
    [
        ("scan.csv", ("timestamp", "BSSID", "SSID", "RSSI [dBm]"), "wifi"),
        ("ble.csv", ("timestamp", "mac", "rssi"), "ble"),
        ("scan.csv", ("timestamp", "mac", "uuid", "major", "minor", "rssi"), "ble"),
        ("imu.csv", ("timestamp", "sensor", "x", "y", "z"), "sensors"),
        ("tags.csv", ("t", "tag_id", "x", "y", "z"), "sightings"),
        ("tags.csv", ("t", "id", "tx", "ty", "tz", "qx", "qy", "qz", "qw"), "sightings"),
        ("poses.csv", ("t", "id", "tx", "ty", "tz", "qx", "qy", "qz", "qw"), "poses"),
        ("notes.csv", ("time", "text"), None),
    ],
)
def test_kinds_of_tables(file: str, columns: tuple[str, ...], kind: str | None) -> None:
    assert kind_of(file, columns) == kind


def test_addresses_are_recognised_in_cells() -> None:
    sample = pl.DataFrame(
        {"t": ["1", "2"], "Kennung": ["0c:f3:ee:00:00:01", "0c:f3:ee:00:00:02"], "rssi": ["-60", "-61"]}
    )
    assert kind_of("scan.csv", sample.columns, sample) == "wifi"
    found = resolved(sample.columns, "wifi", TableColumns(), "scan.csv", sample)
    assert (found["address"].name, found["address"].why) == ("Kennung", "its addresses")


@pytest.mark.parametrize(
    ("file", "sensor"),
    [
        ("Accelerometer.csv", "acc"),
        ("TotalAcceleration.csv", "acc"),
        ("gyro_log.csv", "gyro"),
        ("MagneticField.csv", "mag"),
        ("AccelerometerUncalibrated.csv", None),
        ("linear_acceleration.csv", None),
        ("images.csv", None),
    ],
)
def test_sensors_by_the_names_of_files(file: str, sensor: str | None) -> None:
    assert sensor_of_file(file, ("time", "x", "y", "z")) == sensor
    assert sensor_of_file(file, ("time", "text")) is None


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        *(
            ("time_ms", "ms"),
            ("t [s]", "s"),
            ("timestamp (µs)", "us"),
            ("elapsedRealtimeNanos", "ns"),
            ("timens", "ns"),
        ),
        *(("timestamps", None), ("time", None), ("t", None), ("status", "us")),
    ],
)
def test_units_of_times_in_names(name: str, unit: str | None) -> None:
    assert time_unit(name) == unit


def test_the_closest_kind_of_an_unknown_table() -> None:
    assert unknown_kind(("t", "mac", "loudness")).startswith("as a table of wifi: found the columns t, mac, loudness;")
    assert unknown_kind(("a", "b")) == 'found the columns a, b; name the file in columns.toml: [wifi] file = "NAME"'


def test_the_text_of_columns() -> None:
    columns = WalkColumns(wifi=TableColumns(file="a.csv", level='dB "raw"'))
    assert columns.text == '[wifi]\nfile = "a.csv"\nlevel = "dB \\"raw\\""\n'
