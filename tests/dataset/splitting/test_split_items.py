from __future__ import annotations

import datetime as dt
from dataclasses import replace

import polars as pl

from tests.dataset.factory import FIRST_NS, SESSION_KEYS, small_dataset
from vislam2tag.dataset.schema import IMU_WINDOWS, MAGNETIC, in_schema
from vislam2tag.dataset.splitting.split_items import COLUMNS, kind_order, split_items

SMALL = small_dataset()
SESSION = SESSION_KEYS[1][2]


def test_what_each_kind_is_split_by() -> None:
    imu = pl.DataFrame(
        {
            "window_id": ["w/imu/0"],
            "floor": [0],
            "x_start": [1.0],
            "x_end": [2.0],
            "y_start": [4.0],
            "y_end": [8.0],
            "device": ["Pixel"],
            "session": [SESSION],
            "start_ns": [7],
        }
    )
    magnetic = pl.DataFrame(
        {"window_id": ["w/magnetic/0"], "building": ["A"], "floor": [1], "x": [3.0], "start_ns": [4], "end_ns": [10]}
    )
    tables = {IMU_WINDOWS: in_schema(IMU_WINDOWS, imu).lazy(), MAGNETIC: in_schema(MAGNETIC, magnetic).lazy()}
    items = split_items(replace(SMALL, tables={**SMALL.tables, **tables}))
    assert tuple(items.columns) == COLUMNS
    rows = {row["id"]: row for row in items.iter_rows(named=True)}
    day = dt.date(2026, 3, 2)
    assert tuple(rows["w/imu/0"].values()) == ("w/imu/0", "imu", "", 0, 1.5, 6.0, "Pixel", SESSION, day, 7, True)
    assert tuple(rows["w/magnetic/0"].values())[1:] == ("magnetic", "A", 1, 3.0, None, None, None, None, 7, False)
    first = rows[f"{SESSION}/wifi/000000"]
    assert first["time_ns"] == FIRST_NS + 750_000_000
    assert (first["kind"], first["date"], first["labelled"]) == ("wifi", day, True)
    assert not rows[f"{SESSION}/wifi/000011"]["labelled"]


def test_wifi_leads_and_windows_come_last() -> None:
    kinds = pl.Series(["imu", "magnetic", "ble", "wifi", "uwb", "ble"])
    assert kind_order(kinds) == ["wifi", "ble", "uwb", "magnetic", "imu"]
