"""Tables of companions."""

from __future__ import annotations

import polars as pl
import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.sessions.foreign_tables import session_tables


def table(**columns: list[object]) -> pl.DataFrame:
    count = len(next(iter(columns.values())))
    timed = {"row": list(range(2, count + 2)), "time_ns": [10 * (i // 2) for i in range(count)]}
    return pl.DataFrame({**timed, **columns})


def test_levels_of_access_points_are_wifi_scans() -> None:
    rows = table(BSSID=["AA", "BB", "AA", "AA"], rssi=["-50", "-60,5", "-51", "none"])
    (wifi,) = session_tables(rows, "mine").values()
    assert wifi.select("row", "scan", "bssid", "rssi_dbm", "repeated").rows() == [
        (2, 1, "AA", -50.0, False), (3, 1, "BB", -60.5, False), (4, 2, "AA", -51.0, False)
    ]  # fmt: skip


def test_axes_are_sensors_whatever_they_are_called() -> None:
    turns: dict[str, list[object]] = {"wx": ["1"], "wy": ["2"], "wz": ["3"]}
    forces: dict[str, list[object]] = {"acc_x (g)": [4], "acc_y (g)": [5], "acc_z (g)": [6]}
    tables = session_tables(table(**turns, **forces), "mine")
    assert tables.keys() == {"sensors"}
    assert tables["sensors"].select("sensor", "v1", "v2", "v3").rows() == [("GYRO", 1, 2, 3), ("ACC", 4, 5, 6)]


def test_any_other_table_keeps_its_columns_under_its_own_name() -> None:
    (name,) = tables = session_tables(table(co2=["400", "400", "410"]), "co2")
    assert name == "co2"
    assert tables[name].select("time_ns", "repeated", "co2").rows() == [
        (0, False, "400"), (0, True, "400"), (10, False, "410")
    ]  # fmt: skip
    with pytest.raises(UsageError, match="a column status, which is reserved for labels; rename it"):
        session_tables(table(status=["on"]), "co2")
