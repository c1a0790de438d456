"""Walks as tables with headers: each layout gives what the published layout of the same walk gives."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from tests.surveys import make_survey
from vislam2tag.common.errors import SessionError, SurveyError
from vislam2tag.common.findings import Finding
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.prepared import SessionTask, prepared_session
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.site.corrections.file import Corrections

POSE = ["px", "py", "pz", "qx", "qy", "qz", "qw"]
NAMES = {
    "poses.csv": ["t", *POSE],
    "initPoses.csv": ["marker", "t", *POSE],
    "wifi.csv": ["scan", "t", "kind", "ssid", "mac", "rssi"],
    "sensors.csv": ["t", "type", *(f"v{i}" for i in range(1, 7))],
}
Tables = dict[str, pd.DataFrame]


def raw(folder: Path) -> Tables:
    """The published files of a session, read by pandas; times in ns."""
    tables = {}
    for name, columns in NAMES.items():
        decimal = "," if b"," in (folder / name).read_bytes() else "."
        table = pd.read_csv(folder / name, sep=r";\s*", header=None, engine="python", decimal=decimal)
        tables[name] = table.set_axis(columns, axis=1)
    tables["wifi.csv"]["t"] *= 1000
    return tables


def own_names(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        table.to_csv(folder / name, index=False)


def decimal_commas(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        table.to_csv(folder / name, index=False, sep=";", decimal=",")


def separator_line(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        (folder / name).write_text("sep=;\n" + table.to_csv(index=False, sep=";"), encoding="utf-8")


def pandas_index(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        table.to_csv(folder / name, sep="\t")


def seconds(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        renamed = table.assign(t=[f"{t // 10**9}.{t % 10**9:09d}" for t in table["t"]])
        renamed.rename(columns={"t": "time_s"}).to_csv(folder / name, index=False)


def microseconds(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        table.assign(t=table["t"] // 1000).rename(columns={"t": "timestamp [us]"}).to_csv(folder / name, index=False)


def unix_times(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        table.assign(t=table["t"] + UNIX_AHEAD_NS).to_csv(folder / name, index=False)


def real_part_first_z_up(tables: Tables, folder: Path) -> None:
    z_up = Rotation.from_euler("x", 90, degrees=True)
    for name, table in tables.items():
        if "qw" in table.columns:
            turned = (z_up * Rotation.from_quat(table[POSE[3:]].to_numpy())).as_quat()
            moved = z_up.apply(table[POSE[:3]].to_numpy())
            first = [column for column in table.columns if column not in POSE]
            values = np.column_stack((moved, turned[:, 3], turned[:, :3]))
            pose = pd.DataFrame(values, columns=["tx", "ty", "tz", "rot_w", "rot_x", "rot_y", "rot_z"])
            table = pd.concat((table[first], pose), axis=1)
        table.to_csv(folder / name, index=False)


def foreign_names(tables: Tables, folder: Path) -> None:
    poses = tables["poses.csv"].rename(columns={"px": "east_of_start", "py": "up"})
    for name, table in {**tables, "poses.csv": poses}.items():
        table.to_csv(folder / name, index=False)
    text = '[poses]\nx = "east_of_start"\ny = "up"\n'
    (folder.parent / "columns.toml").write_text(text, encoding="utf-8")


def comment_lines(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        text = f"# recorded with a tracker of our own\n# version 2\n{table.to_csv(index=False)}"
        (folder / name).write_text(text, encoding="utf-8")


def local_dates(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        table.assign(t=pd.to_datetime(table["t"] + UNIX_AHEAD_NS)).to_csv(folder / name, index=False)


def dates_with_zone(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        dates = pd.to_datetime(table["t"] + UNIX_AHEAD_NS, utc=True).dt.tz_convert("Europe/Berlin")
        table.assign(t=dates.map(pd.Timestamp.isoformat)).to_csv(folder / name, index=False)


def millimetres(tables: Tables, folder: Path) -> None:
    for name, table in tables.items():
        if "px" in table.columns:
            table = table.assign(**{axis: table[axis] * 1000 for axis in POSE[:3]})
        table.rename(columns={axis: f"{axis} [mm]" for axis in POSE[:3]}).to_csv(folder / name, index=False)


def pixels_beside(tables: Tables, folder: Path) -> None:
    """Poses with the place of something in the picture, which has no z."""
    poses = tables["poses.csv"].assign(x=320, y=240)
    own_names({**tables, "poses.csv": poses}, folder)


def euroc(tables: Tables, folder: Path) -> None:
    """Poses as EuRoC writes them: the real part first, then velocities and biases."""
    poses = tables["poses.csv"]
    names = ["p_RS_R_x [m]", "p_RS_R_y [m]", "p_RS_R_z [m]", "q_RS_w []", "q_RS_x []", "q_RS_y []", "q_RS_z []"]
    named = poses[["t", *POSE[:3], "qw", *POSE[3:6]]].set_axis(["#timestamp [ns]", *names], axis=1)
    for unit in ("v_RS_R_{} [m s^-1]", "b_w_RS_S_{} [rad s^-1]", "b_a_RS_S_{} [m s^-2]"):
        named = named.assign(**{unit.format(axis): 0.0 for axis in "xyz"})
    named.to_csv(folder / "data.csv", index=False)
    own_names({name: table for name, table in tables.items() if name != "poses.csv"}, folder)


def rtabmap(tables: Tables, folder: Path) -> None:
    """Poses as RTAB-Map exports them, in seconds of Unix time and with ids."""
    poses = tables["poses.csv"]
    times = [f"{t // 10**9}.{t % 10**9 // 1000:06d}" for t in poses["t"] + UNIX_AHEAD_NS]
    rows = zip(times, *(poses[name].map("{:.6f}".format) for name in POSE), range(1, len(poses) + 1), strict=True)
    lines = ["#timestamp x y z qx qy qz qw id", *(" ".join(map(str, row)) for row in rows)]
    (folder / "rtabmap_poses.txt").write_text("\n".join([*lines, ""]), encoding="utf-8")
    unix_times({name: table for name, table in tables.items() if name != "poses.csv"}, folder)


UNIX_AHEAD_NS = 1_700_000_000 * 10**9
LAYOUTS = [
    own_names,
    decimal_commas,
    separator_line,
    pandas_index,
    seconds,
    microseconds,
    unix_times,
    real_part_first_z_up,
    foreign_names,
    comment_lines,
    local_dates,
    dates_with_zone,
    millimetres,
    pixels_beside,
    euroc,
    rtabmap,
]


@pytest.fixture(scope="module")
def published(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(tmp_path_factory.mktemp("published"), devices=("LG",), seconds=40)


def session_of(root: Path) -> Session:
    survey = open_survey(root)
    return prepared_session(SessionTask(survey.sessions[0], survey.site, Corrections())).session


def rewritten(published: Path, out: Path, layout: Callable[[Tables, Path], None]) -> Path:
    """A copy of the survey whose session is in another layout; returns the session's folder."""
    shutil.copytree(published, out)
    (folder,) = out.glob("floor_*/*/*")
    tables = raw(folder)
    for name in tables:
        (folder / name).unlink()
    layout(tables, folder)
    return folder


@pytest.mark.parametrize("layout", LAYOUTS)
def test_each_layout_is_the_same_walk(published: Path, tmp_path: Path, layout: Callable[[Tables, Path], None]) -> None:
    root = tmp_path / "survey"
    rewritten(published, root, layout)
    assert [ref.format for ref in open_survey(root).sessions] == ["csv-walk"]
    ours, theirs = session_of(root), session_of(published)
    np.testing.assert_allclose(ours.camera.position_acs, theirs.camera.position_acs, atol=1e-3)
    cosine = np.abs(np.sum(ours.camera.orientation_acs * theirs.camera.orientation_acs, axis=1))
    assert 2 * np.degrees(np.arccos(cosine.clip(max=1))).max() < 1
    assert ours.landmarks.ids == theirs.landmarks.ids
    np.testing.assert_array_equal(ours.landmarks.frame, theirs.landmarks.frame)
    np.testing.assert_allclose(ours.landmarks.position_acs, theirs.landmarks.position_acs, atol=1e-3)
    since = [each.camera.time_ns[0] for each in (ours, theirs)]
    for name in ("wifi", "sensors"):
        times = [
            each.tables[name]["time_ns"].to_numpy() - start for each, start in zip((ours, theirs), since, strict=True)
        ]
        np.testing.assert_allclose(times[0], times[1], atol=2000)
    assert ours.tables["wifi"]["rssi_dbm"].equals(theirs.tables["wifi"]["rssi_dbm"])
    assert "columns_guessed" in {each.kind for each in ours.findings}
    assert "[poses]" in ours.columns


def test_sensors_of_no_type_are_read_without_their_rate(published: Path, tmp_path: Path) -> None:
    def layout(tables: Tables, folder: Path) -> None:
        own_names({**tables, "sensors.csv": tables["sensors.csv"].assign(type="")}, folder)

    rewritten(published, tmp_path / "survey", layout)
    session = session_of(tmp_path / "survey")
    assert session.camera.time_ns.size == session_of(published).camera.time_ns.size


def test_a_column_that_is_not_recognised_is_asked_for_by_name(published: Path, tmp_path: Path) -> None:
    def layout(tables: Tables, folder: Path) -> None:
        own_names({**tables, "poses.csv": tables["poses.csv"].rename(columns={"px": "abscissa"})}, folder)

    rewritten(published, tmp_path / "survey", layout)
    ref = open_survey(tmp_path / "survey").sessions[0]
    expected = r"found the columns t, abscissa.*expected for x one of x, px, tx.*\[poses\] x = \"abscissa\""
    with pytest.raises(SessionError, match=expected):
        read_session(ref)


def test_two_columns_for_one_role_are_asked_about(published: Path, tmp_path: Path) -> None:
    def layout(tables: Tables, folder: Path) -> None:
        poses = tables["poses.csv"]
        both = poses.assign(tx=poses["px"], ty=poses["py"], tz=poses["pz"])
        own_names({**tables, "poses.csv": both}, folder)

    rewritten(published, tmp_path / "survey", layout)
    ref = open_survey(tmp_path / "survey").sessions[0]
    with pytest.raises(SessionError, match=r"px and tx may both be x; choose one in columns\.toml"):
        read_session(ref)


def test_a_wrong_name_in_columns_toml_is_reported(published: Path, tmp_path: Path) -> None:
    folder = rewritten(published, tmp_path / "survey", own_names)
    (folder / "columns.toml").write_text('[poses]\nx = "pX"\n', encoding="utf-8")
    ref = open_survey(tmp_path / "survey").sessions[0]
    with pytest.raises(SessionError, match=r"poses\.csv has no such column \(the closest name is px\); found t, px"):
        read_session(ref)


def test_offsets_in_the_cameras_axes(published: Path, tmp_path: Path) -> None:
    def layout(tables: Tables, folder: Path) -> None:
        poses = tables["poses.csv"].set_index("t")
        seen = tables["initPoses.csv"]
        at = poses.loc[seen["t"]]
        turn = Rotation.from_quat(at[POSE[3:]].to_numpy())
        offset = turn.inv().apply(seen[POSE[:3]].to_numpy() - at[POSE[:3]].to_numpy())
        offsets = pd.DataFrame(offset, columns=["cam_x", "cam_y", "cam_z"])
        own_names({**tables, "initPoses.csv": pd.concat((seen[["t", "marker"]], offsets), axis=1)}, folder)

    rewritten(published, tmp_path / "survey", layout)
    ours, theirs = session_of(tmp_path / "survey"), session_of(published)
    np.testing.assert_allclose(ours.landmarks.position_acs, theirs.landmarks.position_acs, atol=1e-3)


def with_file(name: str, table: pd.DataFrame, *without: str) -> Callable[[Tables, Path], None]:
    """A layout that has a further file, and does not have some."""

    def layout(tables: Tables, folder: Path) -> None:
        own_names({each: tables[each] for each in tables if each not in without}, folder)
        table.to_csv(folder / name, index=False)

    return layout


def read_with(published: Path, root: Path, layout: Callable[[Tables, Path], None], columns: str = "") -> Session:
    """The session in a layout, with a columns.toml."""
    folder = rewritten(published, root, layout)
    if columns:
        (folder / "columns.toml").write_text(columns, encoding="utf-8")
    return read_session(open_survey(root).sessions[0])


def found(session: Session, kind: str) -> list[Finding]:
    return [each for each in session.findings if each.kind == kind]


@pytest.fixture(scope="module")
def tables(published: Path) -> Tables:
    (folder,) = published.glob("floor_*/*/*")
    return raw(folder)


def readings(session: Session, sensor: str) -> np.ndarray:
    rows = session.tables["sensors"]
    return rows.filter(rows["sensor"] == sensor).select("time_ns", "v1", "v2", "v3").to_numpy()


def of_sensor(tables: Tables, sensor: str) -> pd.DataFrame:
    sensors = tables["sensors.csv"]
    return sensors[sensors["type"] == sensor][["t", "v1", "v2", "v3"]].reset_index(drop=True)


def test_a_wide_table_of_sensors_with_units(published: Path, tmp_path: Path, tables: Tables) -> None:
    acc, gyro = (of_sensor(tables, sensor) for sensor in ("ACC", "GYRO"))
    wide = pd.DataFrame({"timestamp_ms": acc["t"] / 1e6})
    for axis, v in zip("xyz", ("v1", "v2", "v3"), strict=True):
        wide[f"acc_{axis} (g)"] = acc[v] / 9.80665
        wide[f"gyro_{axis} (deg/s)"] = np.degrees(gyro[v])
    session = read_with(published, tmp_path / "survey", with_file("imu.csv", wide, "sensors.csv"))
    np.testing.assert_allclose(readings(session, "ACC"), acc.to_numpy(), rtol=1e-9, atol=1e-5)
    np.testing.assert_allclose(readings(session, "GYRO")[:, 1:], gyro.to_numpy()[:, 1:], atol=1e-9)
    assert {each.count for each in found(session, "sensor_unit")} == {len(acc)}


def test_one_file_for_each_sensor(published: Path, tmp_path: Path, tables: Tables) -> None:
    names = {"ACC": "Accelerometer.csv", "GYRO": "Gyroscope.csv", "MAG": "magnetic_field.csv"}

    def layout(given: Tables, folder: Path) -> None:
        own_names({name: table for name, table in given.items() if name != "sensors.csv"}, folder)
        for sensor, file in names.items():
            part = of_sensor(tables, sensor).set_axis(["time", "x", "y", "z"], axis=1)
            part[["time", "z", "y", "x"]].to_csv(folder / file, index=False)
        pressure = pd.DataFrame({"time": part["time"], "relativeAltitude": 0.0, "pressure": 101_320.0})
        pressure.to_csv(folder / "Barometer.csv", index=False)

    session = read_with(published, tmp_path / "survey", layout)
    for sensor in names:
        np.testing.assert_allclose(readings(session, sensor), of_sensor(tables, sensor).to_numpy())
    np.testing.assert_allclose(readings(session, "PRESSURE")[:, 1], 1013.2)
    assert '[gyro]\nfile = "Gyroscope.csv"' in session.columns
    assert "Barometer.csv" in {each.file for each in found(session, "sensor_unit")}


def test_sections_name_the_columns_of_sensors(published: Path, tmp_path: Path, tables: Tables) -> None:
    acc = of_sensor(tables, "ACC").set_axis(["when", "a", "b", "c"], axis=1)
    columns = '[acc]\nfile = "imu.csv"\ntime = "when"\ntime_unit = "ns"\nv1 = "c"\nv2 = "b"\nv3 = "a"\n'
    session = read_with(published, tmp_path / "survey", with_file("imu.csv", acc, "sensors.csv"), columns)
    np.testing.assert_allclose(readings(session, "ACC"), acc[["when", "c", "b", "a"]].to_numpy())


def test_a_long_table_of_sensors_in_other_units(published: Path, tmp_path: Path, tables: Tables) -> None:
    def layout(given: Tables, folder: Path) -> None:
        long = given["sensors.csv"].replace({"type": {"ACC": "accelerometer", "GYRO": "android.sensor.gyroscope"}})
        values = ["v1", "v2", "v3"]
        long.loc[long["type"] == "accelerometer", values] /= 9.80665
        renamed = long.rename(columns={f"v{i + 1}": f"values[{i}]" for i in range(6)})
        own_names({**given, "sensors.csv": renamed}, folder)

    session = read_with(published, tmp_path / "survey", layout)
    np.testing.assert_allclose(readings(session, "ACC"), of_sensor(tables, "ACC").to_numpy(), atol=1e-4)
    np.testing.assert_allclose(readings(session, "GYRO"), of_sensor(tables, "GYRO").to_numpy())
    (unit,) = found(session, "sensor_unit")
    assert "accelerations are in g" in unit.message
    turned = session.tables["sensors"].filter(session.tables["sensors"]["sensor"] == "ROT")
    sensors = tables["sensors.csv"]
    np.testing.assert_allclose(turned["v4"].to_numpy(), sensors[sensors["type"] == "ROT"]["v4"].to_numpy())


def wigle(tables: Tables) -> tuple[str, pd.DataFrame]:
    """A WiGLE export of a walk's scans, with a mobile phone cell, and the table behind its first line."""
    wifi = tables["wifi.csv"]
    table = pd.DataFrame(
        {
            "MAC": wifi["mac"],
            "SSID": wifi["ssid"],
            "AuthMode": "[WPA2-PSK-CCMP][ESS]",
            "FirstSeen": pd.to_datetime(wifi["t"] + UNIX_AHEAD_NS).dt.strftime("%Y-%m-%d %H:%M:%S"),
            "Channel": 6,
            "RSSI": wifi["rssi"],
            "CurrentLatitude": 52.5,
            "CurrentLongitude": 13.4,
            "AltitudeMeters": 34.0,
            "AccuracyMeters": 4.0,
            "Type": "WIFI",
        }
    )
    cell, beacon = table.iloc[:1].assign(Type="GSM", MAC="26202_1_2"), table.iloc[1:3].assign(Type="BLE")
    table = pd.concat((table, cell, beacon))
    first = "WigleWifi-1.4,appRelease=2.26,model=Pixel 4,release=11,device=flame,display=,board=flame,brand=google"
    return f"{first}\n{table.to_csv(index=False)}", table


def test_an_export_of_wigle(published: Path, tmp_path: Path, tables: Tables) -> None:
    text, table = wigle(tables)

    def layout(given: Tables, folder: Path) -> None:
        unix_times({name: each for name, each in given.items() if name != "wifi.csv"}, folder)
        (folder / "WigleWifi_20231114.csv").write_text(text, encoding="utf-8")

    session = read_with(published, tmp_path / "survey", layout, '[wifi]\nzone = "UTC"\n')
    own = table[table["Type"] == "WIFI"]
    wifi = session.tables["wifi"]
    assert wifi["bssid"].to_list() == own["MAC"].to_list()
    assert wifi["rssi_dbm"].to_list() == own["RSSI"].to_list()
    np.testing.assert_array_equal(
        wifi["time_ns"], pd.to_datetime(own["FirstSeen"]).astype("datetime64[ns]").astype(int)
    )
    assert session.tables["ble"]["rssi_dbm"].to_list() == table[table["Type"] == "BLE"]["RSSI"].to_list()
    (left_out,) = found(session, "technology_left_out")
    assert (left_out.count, "gsm" in left_out.message) == (1, True)
    assert not found(session, "clock_mismatch")


def test_bluetooth(published: Path, tmp_path: Path, tables: Tables) -> None:
    times = tables["poses.csv"]["t"].iloc[::50]
    ble = pd.DataFrame(
        {
            "timestamp": times,
            "uuid": "f7826da6-4fa2-4e98-8024-bc5b71e0893e",
            "major": 7,
            "minor": np.arange(len(times)) % 3,
            "mac_address": "0c:f3:ee:00:00:01",
            "rssi": [f"{-60 - i % 20} dBm" for i in range(len(times))],
        }
    )
    session = read_with(published, tmp_path / "survey", with_file("beacons.csv", ble))
    rows = session.tables["ble"]
    assert rows["time_ns"].to_list() == ble["timestamp"].to_list()
    assert rows["rssi_dbm"].to_list() == [-60.0 - i % 20 for i in range(len(times))]
    assert rows["minor"].to_list() == ble["minor"].to_list()


def test_addresses_in_a_column_of_any_name(published: Path, tmp_path: Path, tables: Tables) -> None:
    def layout(given: Tables, folder: Path) -> None:
        own_names({**given, "wifi.csv": given["wifi.csv"].rename(columns={"mac": "Kennung"})}, folder)

    session = read_with(published, tmp_path / "survey", layout)
    assert session.tables["wifi"]["bssid"].to_list() == tables["wifi.csv"]["mac"].to_list()
    assert 'address = "Kennung"' in session.columns


def test_another_clock_is_reported(published: Path, tmp_path: Path, tables: Tables) -> None:
    def layout(given: Tables, folder: Path) -> None:
        other = {name: given[name].assign(t=given[name]["t"] + UNIX_AHEAD_NS) for name in ("wifi.csv", "sensors.csv")}
        own_names({**given, **other}, folder)

    session = read_with(published, tmp_path / "survey", layout)
    assert {each.file for each in found(session, "clock_mismatch")} == {"wifi.csv", "sensors.csv"}


def test_dates_without_a_zone_beside_numbers_are_asked_about(published: Path, tmp_path: Path) -> None:
    def layout(given: Tables, folder: Path) -> None:
        wifi = given["wifi.csv"]
        dates = wifi.assign(t=pd.to_datetime(wifi["t"] + UNIX_AHEAD_NS + 3600 * 10**9))
        unix_times({**given, "wifi.csv": wifi}, folder)
        dates.to_csv(folder / "wifi.csv", index=False)

    asked = r"wifi\.csv: column t: '2023-.*' has no time zone.*\[wifi\] zone = \"Europe/Berlin\""
    with pytest.raises(SessionError, match=asked):
        read_with(published, tmp_path / "survey", layout)
    with pytest.raises(SessionError, match=r"\[wifi\] zone = Berlin: is not a time zone"):
        read_with(published, tmp_path / "other", layout, '[wifi]\nzone = "Berlin"\n')
    session = read_with(published, tmp_path / "right", layout, '[wifi]\nzone = "Europe/Berlin"\n')
    assert not found(session, "clock_mismatch")


def test_local_dates_of_all_tables_are_one_clock(published: Path, tmp_path: Path) -> None:
    session = read_with(published, tmp_path / "survey", local_dates)
    assert session.columns.count('zone = "UTC"') == 4
    assert not found(session, "clock_mismatch")


def test_columns_toml_of_a_reading_gives_the_same_without_guesses(published: Path, tmp_path: Path) -> None:
    first = read_with(published, tmp_path / "survey", real_part_first_z_up)
    second = read_with(published, tmp_path / "again", real_part_first_z_up, first.columns)
    assert not found(second, "columns_guessed")
    assert second.columns == first.columns
    np.testing.assert_array_equal(second.camera.position_acs, first.camera.position_acs)


def test_a_table_of_unknown_kind_is_reported_with_what_is_missing(published: Path, tmp_path: Path) -> None:
    def layout(given: Tables, folder: Path) -> None:
        own_names({**given, "wifi.csv": given["wifi.csv"].rename(columns={"rssi": "loudness"})}, folder)
        (folder / "notes.txt").write_text("a walk, on a rainy day\n", encoding="utf-8")

    session = read_with(published, tmp_path / "survey", layout)
    notes, wifi = sorted(found(session, "unread_file"), key=lambda each: each.file)
    assert "the table has no rows" in notes.message
    expected = "found the columns scan, t, kind, ssid, mac, loudness; expected for level one of level,"
    assert expected in wifi.message
    named = read_with(published, tmp_path / "named", layout, '[wifi]\nlevel = "loudness"\n')
    assert len(named.tables["wifi"])


def test_an_offset_that_is_not_whole_is_asked_for(published: Path, tmp_path: Path) -> None:
    def layout(given: Tables, folder: Path) -> None:
        seen = given["initPoses.csv"][["t", "marker", "px", "py"]]
        seen = seen.rename(columns={"px": "offset_x", "py": "offset_y"})
        own_names({**given, "initPoses.csv": seen}, folder)

    session = read_with(published, tmp_path / "survey", layout)
    (unread,) = found(session, "unread_file")
    assert "expected for dz one of dz, offz, offsetz" in unread.message


def test_a_zipped_session_is_recognised_by_its_headers(published: Path, tmp_path: Path) -> None:
    folder = rewritten(published, tmp_path / "survey", own_names)
    shutil.make_archive(str(folder), "zip", folder)
    shutil.rmtree(folder)
    (ref,) = open_survey(tmp_path / "survey").sessions
    assert ref.format == "csv-walk"
    assert len(read_session(ref).tables["wifi"])


def test_lengths_in_another_unit_are_asked_about(published: Path, tmp_path: Path) -> None:
    def layout(given: Tables, folder: Path) -> None:
        own_names({name: each.assign(**centimetres(each)) for name, each in given.items()}, folder)

    def centimetres(table: pd.DataFrame) -> dict[str, pd.Series]:
        return {axis: table[axis] * 100 for axis in POSE[:3] if axis in table.columns}

    with pytest.raises(SessionError, match=r"walking person in metres, but in cm; write that to columns\.toml"):
        read_with(published, tmp_path / "survey", layout)
    columns = '[poses]\nlength_unit = "cm"\n[sightings]\nlength_unit = "cm"\n'
    ours = read_with(published, tmp_path / "named", layout, columns)
    theirs = session_of(published)
    np.testing.assert_allclose(ours.camera.position_acs, theirs.camera.position_acs, atol=1e-3)


def test_a_file_that_is_not_the_named_one_is_reported(published: Path, tmp_path: Path) -> None:
    session = read_with(published, tmp_path / "survey", own_names, '[wifi]\nfile = "wlan.csv"\n')
    (unread,) = found(session, "unread_file")
    assert 'columns.toml names another file as wifi ([wifi] file = "wlan.csv")' in unread.message
    assert "wlan.csv" in {each.file for each in found(session, "missing_file")}


def test_two_tables_of_one_kind_are_asked_about(published: Path, tmp_path: Path, tables: Tables) -> None:
    with pytest.raises(SessionError, match=r'poses\.csv and slam\.csv may be poses.*\[poses\] file = "poses\.csv"'):
        read_with(published, tmp_path / "survey", with_file("slam.csv", tables["poses.csv"]))


def test_rounded_times_are_refused(published: Path, tmp_path: Path, tables: Tables) -> None:
    rounded = tables["wifi.csv"].assign(t=[f"{t:.5E}" for t in tables["wifi.csv"]["t"]])
    with pytest.raises(SessionError, match=r"wifi\.csv: column t: times such as 2\.\d+E\+14 are rounded; use the orig"):
        read_with(published, tmp_path / "survey", with_file("wifi.csv", rounded))


def test_another_column_of_times_is_named(published: Path, tmp_path: Path, tables: Tables) -> None:
    wifi = tables["wifi.csv"].rename(columns={"t": "time"})
    both = wifi.assign(seconds_elapsed=(wifi["time"] - wifi["time"].min()) / 1e9)
    session = read_with(published, tmp_path / "survey", with_file("wifi.csv", both))
    (guess,) = (each for each in found(session, "columns_guessed") if each.file == "wifi.csv")
    assert 'time = "time"' in guess.message
    assert "(not seconds_elapsed)" in guess.message


def test_a_long_table_of_one_sensor(published: Path, tmp_path: Path, tables: Tables) -> None:
    acc = of_sensor(tables, "ACC").assign(type="accelerometer")
    session = read_with(published, tmp_path / "survey", with_file("imu.csv", acc, "sensors.csv"))
    assert set(session.tables["sensors"]["sensor"]) == {"ACC"}
    np.testing.assert_allclose(readings(session, "ACC"), of_sensor(tables, "ACC").to_numpy())


def test_sightings_without_an_id_belong_to_no_landmark(published: Path, tmp_path: Path) -> None:
    def layout(given: Tables, folder: Path) -> None:
        own_names({**given, "initPoses.csv": given["initPoses.csv"].assign(marker="")}, folder)

    assert read_with(published, tmp_path / "survey", layout).landmarks.ids == ("",)


HOW_TO = (Path(__file__).resolve().parents[3] / "docs" / "how-to" / "csv-walk.md").read_text(encoding="utf-8")


def in_camera_axes(tables: Tables, flip: bool = False) -> Tables:
    """Tables with the names of the how-to; with ``flip`` the camera's y axis points down and its z axis forward."""
    flipped = Rotation.from_euler("x", 180 if flip else 0, degrees=True)
    poses, seen, wifi = tables["poses.csv"], tables["initPoses.csv"], tables["wifi.csv"]
    turn = Rotation.from_quat(poses[POSE[3:]].to_numpy()) * flipped
    values = np.column_stack((poses["t"] / 1e6, poses[POSE[:3]], turn.as_quat()))
    at = np.searchsorted(poses["t"], seen["t"])
    offset = turn[at].inv().apply(seen[POSE[:3]].to_numpy() - poses[POSE[:3]].to_numpy()[at])
    sightings = pd.DataFrame(offset, columns=["cam_x", "cam_y", "cam_z"])
    names = ["time_ms", "tx", "ty", "tz", *POSE[3:]]
    return {
        "camera.csv": pd.DataFrame(values, columns=names),
        "markers.csv": sightings.assign(time_ms=seen["t"] / 1e6, marker_id=seen["marker"]),
        "wifi.csv": pd.DataFrame(
            {"time_ms": wifi["t"] / 1e6, "bssid": wifi["mac"], "ssid": wifi["ssid"], "rssi": wifi["rssi"]}
        ),
    }


def test_the_example_of_the_how_to(published: Path, tmp_path: Path) -> None:
    example = re.search(r"```toml\n(.*?)```", HOW_TO, re.DOTALL)
    assert example is not None

    def layout(tables: Tables, folder: Path) -> None:
        given = in_camera_axes(tables, flip=True)
        for name, table in given.items():
            (header,) = re.findall(rf"^ *{re.escape(name)} +(\S+)$", HOW_TO, re.MULTILINE)
            assert sorted(header.split(",")) == sorted(map(str, table))
        renamed = given["camera.csv"].rename(columns={"tx": "east_of_start"})
        own_names({**given, "camera.csv": renamed}, folder)
        (folder.parents[2] / "columns.toml").write_text(example[1], encoding="utf-8")

    rewritten(published, tmp_path / "survey", layout)
    assert [ref.format for ref in open_survey(tmp_path / "survey").sessions] == ["csv-walk"]
    ours, theirs = session_of(tmp_path / "survey"), session_of(published)
    np.testing.assert_allclose(ours.camera.position_acs, theirs.camera.position_acs, atol=1e-3)
    np.testing.assert_allclose(ours.landmarks.position_acs, theirs.landmarks.position_acs, atol=1e-3)
    assert len(ours.tables["wifi"]) == len(theirs.tables["wifi"])


@pytest.mark.parametrize(
    ("renamed", "columns", "wifi"),
    [
        ({"tx": "east"}, '[poses]\nfile = "camera.csv"\nx = "east"\n', "wifi.csv"),
        (dict(zip(POSE[3:], ["i", "j", "k", "r"], strict=True)), None, "wifi.csv"),
        ({"tx": "east"}, '[poses]\nx = "east"\n', "scans.csv"),
        ({"time_ms": "frame"}, '[poses]\ntime = "frame"\ntime_unit = "ms"\n', "wifi.csv"),
    ],
)
def test_named_poses_make_a_walk(
    published: Path, tmp_path: Path, renamed: dict[str, str], columns: str | None, wifi: str
) -> None:
    names = {name: renamed.get(name, name) for name in ("time_ms", "tx", "ty", "tz", *POSE[3:])}
    roles = ("time", "x", "y", "z", "qx", "qy", "qz", "qw")
    every = "\n".join(("[poses]", *(f'{role} = "{name}"' for role, name in zip(roles, names.values(), strict=True))))

    def layout(tables: Tables, folder: Path) -> None:
        given = in_camera_axes(tables)
        given["camera.csv"] = given["camera.csv"].rename(columns=renamed)
        given[wifi] = given.pop("wifi.csv")
        own_names(given, folder)

    session = read_with(published, tmp_path / "survey", layout, columns or every)
    assert (len(session.tables["wifi"]) > 0, len(session.landmarks.ids) > 0) == (True, True)
    np.testing.assert_allclose(session.camera.position_acs, session_of(published).camera.position_acs, atol=1e-3)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (lambda poses: poses.rename(columns={"tx": "abscissa"}), r'expected for x one of x.*\[poses\] x = "abscissa"'),
        (lambda poses: poses.drop(columns="qw"), r"found the columns time_ms, tx.*expected for qw one of qw"),
        (lambda poses: poses.drop(columns="tz"), r"expected for z one of z, pz"),
        (lambda poses: poses.rename(columns={"time_ms": "frame_no"}), r'expected for time one.*time = "frame_no"'),
        (
            lambda poses: poses.drop(columns=POSE[3:]).assign(roll=0.0, pitch=0.0, yaw=0.0),
            r"roll, pitch, yaw are angles, but quaternions are expected.*Rotation\.from_euler",
        ),
        (
            lambda poses: poses.rename(columns=dict(zip(POSE[3:], ["q1", "q2", "q3", "q0"], strict=True))),
            r'the order of q0, q1, q2, q3 is not known.*\[poses\] qw = "q0", qx = "q1", qy = "q2", qz = "q3"',
        ),
    ],
)
@pytest.mark.parametrize("wifi", ["wifi.csv", "scans.csv"])
def test_poses_in_part_are_asked_about(
    published: Path, tmp_path: Path, changed: Callable[[pd.DataFrame], pd.DataFrame], message: str, wifi: str
) -> None:
    def layout(tables: Tables, folder: Path) -> None:
        given = in_camera_axes(tables)
        own_names({"camera.csv": changed(given["camera.csv"]), "markers.csv": given["markers.csv"]}, folder)
        given["wifi.csv"].to_csv(folder / wifi, index=False)

    with pytest.raises(SessionError, match=rf"camera\.csv: .*{message}"):
        read_with(published, tmp_path / "survey", layout)


def test_scans_and_sensors_alone_are_not_a_walk(published: Path, tmp_path: Path, tables: Tables) -> None:
    def layout(given: Tables, folder: Path) -> None:
        wifi = given["wifi.csv"].rename(columns={"t": "time", "mac": "bssid"})
        wifi.assign(x=1.0, y=2.0).to_csv(folder / "scans.csv", index=False)
        acc = of_sensor(tables, "ACC").set_axis(["time", "x", "y", "z"], axis=1)
        acc.to_csv(folder / "Accelerometer.csv", index=False)

    rewritten(published, tmp_path / "survey", layout)
    with pytest.raises(SurveyError, match="not a survey"):
        open_survey(tmp_path / "survey")


@pytest.mark.parametrize(("unit", "factor"), [("mm", 1000.0), ("cm", 100.0)])
def test_the_unit_of_lengths_is_that_of_a_walking_person(
    published: Path, tmp_path: Path, unit: str, factor: float
) -> None:
    def layout(tables: Tables, folder: Path) -> None:
        given = in_camera_axes(tables)
        given["camera.csv"][["tx", "ty", "tz"]] *= factor
        given["markers.csv"][["cam_x", "cam_y", "cam_z"]] *= factor
        own_names(given, folder)

    with pytest.raises(SessionError, match=rf'in metres, but in {unit}; .*: length_unit = "{unit}" in \[poses\]'):
        read_with(published, tmp_path / "survey", layout)
    columns = f'[poses]\nlength_unit = "{unit}"\n[sightings]\nlength_unit = "{unit}"\n'
    ours, theirs = read_with(published, tmp_path / "named", layout, columns), session_of(published)
    np.testing.assert_allclose(ours.camera.position_acs, theirs.camera.position_acs, atol=1e-3)
    np.testing.assert_allclose(ours.landmarks.position_acs, theirs.landmarks.position_acs, atol=1e-3)


def test_both_units_are_named_if_a_slow_walk_may_have_either(published: Path, tmp_path: Path) -> None:
    def layout(tables: Tables, folder: Path) -> None:
        given = in_camera_axes(tables)
        given["camera.csv"][["tx", "ty", "tz"]] *= 1000.0
        given["camera.csv"]["time_ms"] *= 4.0
        own_names({"camera.csv": given["camera.csv"]}, folder)

    expected = r'but in mm or cm; .*: length_unit = "mm" or length_unit = "cm" in \[poses\]'
    with pytest.raises(SessionError, match=expected):
        read_with(published, tmp_path / "survey", layout)


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("without", [(), ("markers.csv",)])
def test_rotations_from_world_to_camera_are_refused(
    published: Path, tmp_path: Path, flip: bool, without: tuple[str, ...]
) -> None:
    def layout(tables: Tables, folder: Path) -> None:
        given = in_camera_axes(tables, flip)
        given["camera.csv"][POSE[3:6]] *= -1.0
        own_names({name: table for name, table in given.items() if name not in without}, folder)

    expected = r"camera\.csv: the rotations seem to map the world to the camera.*change the signs of qx, qy and qz"
    with pytest.raises(SessionError, match=expected):
        read_with(published, tmp_path / "survey", layout)
    named = '[poses]\ncamera = "{}"\nframe = "y-up"\n'.format("y-down" if flip else "y-up")
    if without:
        assert len(read_with(published, tmp_path / "named", layout, named).camera.time_ns)
    else:
        with pytest.raises(SessionError, match=r"Only then do the sightings of a landmark in markers\.csv fall"):
            read_with(published, tmp_path / "named", layout, named)


@pytest.mark.parametrize("severity", ["none", "default", "3.0"])
@pytest.mark.parametrize("flip", [False, True])
def test_right_rotations_are_not_refused(tmp_path: Path, severity: str, flip: bool) -> None:
    source = make_survey(tmp_path / "source", devices=("LG",), seconds=60, severity=severity, seed=7)

    def layout(tables: Tables, folder: Path) -> None:
        given = in_camera_axes(tables, flip)
        first = given["markers.csv"].groupby("marker_id").head(20)
        own_names({**given, "markers.csv": first}, folder)

    for name, chosen in (("all", lambda t, f: own_names(in_camera_axes(t, flip), f)), ("first", layout)):
        session = read_with(source, tmp_path / name, chosen)
        assert f'camera = "{"y-down" if flip else "y-up"}"' in session.columns


def test_offsets_in_other_axes_than_those_of_the_camera(published: Path, tmp_path: Path) -> None:
    def layout(tables: Tables, folder: Path) -> None:
        given, opencv = in_camera_axes(tables), in_camera_axes(tables, flip=True)
        own_names({**given, "markers.csv": opencv["markers.csv"]}, folder)

    ours, theirs = read_with(published, tmp_path / "survey", layout), session_of(published)
    np.testing.assert_allclose(ours.landmarks.position_acs, theirs.landmarks.position_acs, atol=1e-3)
    (guess,) = (each for each in found(ours, "columns_guessed") if each.file == "markers.csv")
    assert 'camera = "y-down"' in guess.message
