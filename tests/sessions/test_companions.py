"""Tables of companions: which columns they have, in which units, and when."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.intake.foreign_table import read_foreign_table
from vislam2tag.sessions.foreign_tables import TableTimes, session_tables, table_times, time_findings


def table(**columns: list[object]) -> pl.DataFrame:
    count = len(next(iter(columns.values())))
    timed = {"row": list(range(2, count + 2)), "time_ns": [10 * (i // 2) for i in range(count)]}
    return pl.DataFrame({**timed, **columns})


def test_levels_of_access_points_are_wifi_scans() -> None:
    rows = table(BSSID=["AA", "BB", "AA", "AA"], rssi=["-50", " -60,5", "-51dBm", "none"])
    tables, (finding,) = session_tables(rows, "mine", "mine.csv")
    assert tables["wifi"].select("row", "scan", "bssid", "rssi_dbm", "repeated").rows() == [
        (2, 1, "AA", -50.0, False), (3, 1, "BB", -60.5, False), (4, 2, "AA", -51.0, False)
    ]  # fmt: skip
    assert (finding.kind, finding.lines) == ("unreadable_cells", (5,))


@pytest.mark.parametrize(
    ("turns", "force"),
    [
        ("w{}", "acc_{} (g)"),
        ("Gyroscope {} (rad/s)", "Acceleration {} (m/s^2)"),
        ("gyro_{}_dps", "acc_{}_g"),
        ("gyro{}[deg/s]", "Accelerometer (mg) {}"),
        ("gyroRotation{}(rad/s)", "accelerometerAcceleration{}(G)"),
    ],
)
def test_axes_are_sensors_whatever_they_are_called(turns: str, force: str) -> None:
    scales = {"dps": 180 / np.pi, "deg": 180 / np.pi, "mg": 1000 / 9.80665, "(g": 1 / 9.80665, "_g": 1 / 9.80665}
    turned, felt = (
        next((scale for unit, scale in scales.items() if unit in name.lower().replace("gyro", "")), 1.0)
        for name in (turns, force)
    )
    axes = [(turns, turned, (0.1, 0.2, 0.3)), (force, felt, (0.0, 0.0, 9.8))]
    columns: dict[str, list[object]] = {
        name.format(axis): [str(scale * values["xyz".index(axis)])] for name, scale, values in axes for axis in "xyz"
    }
    tables, _ = session_tables(table(**columns), "mine", "mine.csv")
    assert tables.keys() == {"sensors"}
    (gyro, acc) = tables["sensors"].select("sensor", "v1", "v2", "v3").rows()
    assert gyro == ("GYRO", *(pytest.approx(value) for value in (0.1, 0.2, 0.3)))
    assert acc == ("ACC", *(pytest.approx(value) for value in (0.0, 0.0, 9.8)))


def test_the_field_and_the_pressure_are_read_beside_motion() -> None:
    columns: dict[str, list[object]] = {"wx": [0.1], "wy": [0.2], "wz": [0.3], "pressure (kPa)": ["100,3"]}
    columns |= {"mag_x": [0.2], "mag_y": [0.1], "mag_z": [0.4]}
    rows = table(**columns)
    tables, odd = session_tables(rows, "mine", "mine.csv")
    values = dict(tables["sensors"].select("sensor", "v1").rows())
    assert values == {"GYRO": 0.1, "MAG": pytest.approx(20.0), "PRESSURE": pytest.approx(1003.0)}
    assert [each.kind for each in odd] == ["sensor_unit", "sensor_unit"]


def test_readings_that_share_their_times_are_refused() -> None:
    turns: dict[str, list[object]] = {f"gyro_{axis}": [0.1] * 40 for axis in "xyz"}
    rows = table(**turns).with_columns(time_ns=pl.lit(17 * 10**17))
    with pytest.raises(UsageError, match=r"mine\.csv: most readings share their time.*use the original file"):
        session_tables(rows, "mine", "mine.csv")


def test_any_other_table_keeps_its_columns_under_its_own_name() -> None:
    (name,) = tables = session_tables(table(co2=["400", "400", "410"]), "co2", "co2.csv")[0]
    assert name == "co2"
    assert tables[name].select("time_ns", "repeated", "co2").rows() == [
        (0, False, "400"), (0, True, "400"), (10, False, "410")
    ]  # fmt: skip
    with pytest.raises(UsageError, match="a column status, which is reserved for labels; rename it"):
        session_tables(table(status=["on"]), "co2", "co2.csv")


def times(*cells: object, name: str = "time", zone: str | None = None) -> TableTimes:
    none = np.empty((0, 2), dtype=np.int64)
    return table_times(pl.Series(name, cells), none, clock=None, unit=None, zone=zone, aligned=True)


@pytest.mark.parametrize("cell", ["1.70000E+18", "7.25494E+14", "1,23754E+12", "1.70000e+09"])
def test_rounded_times_are_refused_with_the_advice_to_use_the_original(cell: str) -> None:
    with pytest.raises(UsageError, match=r"column time: times such as .* are rounded to .* s; use the original file"):
        times(*[cell] * 8)


def test_times_with_exponents_that_are_precise_are_read() -> None:
    assert times("1,70136286270131E+018").time_ns.tolist() == pytest.approx([1701362862701310000])


def test_daylight_saving_within_a_table_is_named() -> None:
    before = [f"2023-10-29T02:{minute:02}:00" for minute in range(40, 60)]
    after = [f"2023-10-29T02:{minute:02}:00" for minute in range(20)]
    with pytest.raises(UsageError, match="the clock was changed by an hour at line 22, as for daylight saving"):
        times(*before, *after, zone="Europe/Berlin")


def test_times_that_cannot_be_read_are_reported_with_their_line() -> None:
    column = pl.Series("time_s", ["1.0", "soon", "", "2.0"])
    (finding,) = time_findings(column, times(*column, name="time_s"), "t.csv")
    assert (finding.kind, finding.lines) == ("unreadable_cells", (3,))


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("time,x\n1,2\n", 1),
        ("sep=;\r\ntime;x\r\n1;2\r\n", 2),
        ("# made by a logger, 2021\n\ntime,x\n1,2\n", 3),
        ("# time|x\n1|2\n", 1),
        ("Wigle-1.6,app=2,model=X\nMAC,SSID,FirstSeen,RSSI\n02:1a,n,2023-11-14 22:13:21,-60\n", 2),
        ("when,x\n1,2\n", 1),
    ],
)
def test_lines_above_the_header_are_no_part_of_a_table(tmp_path: Path, text: str, line: int) -> None:
    (tmp_path / "t.csv").write_text(text, encoding="utf-8")
    table = read_foreign_table(tmp_path / "t.csv")
    rows = table.rows
    assert table.header_line == line
    assert rows.height == 1
    assert rows.columns[0] in ("time", "MAC", "when")
