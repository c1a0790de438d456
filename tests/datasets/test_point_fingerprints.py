"""Fingerprints at points become a data set: ids, order, sessions, the split that came with them."""

from __future__ import annotations

import datetime as dt
from pathlib import Path

import polars as pl
import pytest

from vislam2tag.datasets.folder import write_dataset
from vislam2tag.datasets.model import DatasetInfo, DatasetSource
from vislam2tag.datasets.point_fingerprints import OFFICIAL, PointFingerprints, floor_infos, point_dataset
from vislam2tag.datasets.schema import SCHEMAS

ROWS = pl.DataFrame(
    {
        "row": [0, 1, 2, 3],
        "floor": [1, 0, 1, None],
        "x": [1.0, 2.0, 3.0, 4.0],
        "y": [5.0, 6.0, 7.0, 8.0],
        "device": ["b", "a", "b", "b"],
        "session": ["b one", "a", "b one", "b one"],
        "time_ns": [2_000_000_000, 7_000_000_000, 1_000_000_000, 9_000_000_000],
        "date": [dt.date(1970, 1, 1)] * 4,
        "part": ["train", "test", "train", None],
    }
)
HEARD = pl.DataFrame(
    {"row": [0, 0, 1, 3], "bssid": ["WAP002", "WAP001", "WAP001", "WAP003"], "rssi_dbm": [-50.0, -60.0, -70.0, -80.0]}
)
INFO = DatasetInfo(
    name="p",
    clock="unix",
    floors=floor_infos(ROWS),
    sources=(DatasetSource(kind="p", name="p", version="0", inputs={}),),
)


def test_order_and_ids() -> None:
    dataset = point_dataset(INFO, PointFingerprints(ROWS, HEARD))
    found = dataset.fingerprints.collect()
    assert found["scan_id"].to_list() == ["a/wifi/000000", *(f"b-one/wifi/{i:06d}" for i in range(3))]
    assert found["x"].to_list() == [2.0, 3.0, 1.0, None]
    assert found["readings"].to_list() == [1, 0, 2, 1]
    readings = dataset.readings.collect()
    assert readings["bssid"].to_list() == ["WAP001", "WAP001", "WAP002", "WAP003"]
    assert readings["x"].to_list()[:3] == [2.0, 1.0, 1.0]


def test_a_fingerprint_without_floor_is_unlabelled_and_so_are_its_readings() -> None:
    dataset = point_dataset(INFO, PointFingerprints(ROWS, HEARD))
    last = dataset.fingerprints.collect().row(-1, named=True)
    assert (last["x"], last["y"], last["status"], last["labelled"], last["readings"]) == (None, None, "invalid", 0, 1)
    assert dataset.readings.collect().row(-1, named=True)["x"] is None
    assert [(finding.kind, finding.count) for finding in dataset.info.findings] == [("unlabelled_fingerprints", 1)]


@pytest.mark.parametrize("x", [float("nan"), float("inf"), 1e300])
def test_a_position_off_the_earth_is_none(x: float) -> None:
    dataset = point_dataset(INFO, PointFingerprints(ROWS.with_columns(x=pl.lit(x)), HEARD))
    assert dataset.fingerprints.collect()["x"].null_count() == 4


def test_sessions_tell_what_their_fingerprints_share() -> None:
    one, other = point_dataset(INFO, PointFingerprints(ROWS, HEARD)).sessions.collect().rows(named=True)
    assert (one["session"], one["name"], one["floor"], one["device"], one["fingerprints"]) == ("a", "a", 0, "a", 1)
    assert (other["session"], other["name"], other["duration_s"], other["floor"]) == ("b-one", "b one", 8.0, 1)
    assert other["started"] == dt.datetime(1970, 1, 1, 0, 0, 1)


def test_the_split_that_came_with_the_data() -> None:
    split = point_dataset(INFO, PointFingerprints(ROWS, HEARD)).splits[OFFICIAL]
    train, test = split.train_test_ids(split.fold(OFFICIAL))
    assert train.to_list() == ["b-one/wifi/000000", "b-one/wifi/000001"]
    assert test.to_list() == ["a/wifi/000000"]
    assert not point_dataset(INFO, PointFingerprints(ROWS.drop("part"), HEARD)).splits


def test_rows_alone_are_enough_and_schemas_hold(tmp_path: Path) -> None:
    dataset = write_dataset(point_dataset(INFO, PointFingerprints(ROWS.select("row"), HEARD)), tmp_path / "set")
    for name, table in dataset.tables.items():
        assert dict(table.collect_schema()) == dict(SCHEMAS[name])
    assert dataset.fingerprints.collect()["session"].unique().to_list() == ["fingerprints"]


def test_the_order_of_rows_does_not_matter(tmp_path: Path) -> None:
    for name, order in (("a", 1), ("b", -1)):
        write_dataset(point_dataset(INFO, PointFingerprints(ROWS[::order], HEARD[::order])), tmp_path / name)
    for file in ("fingerprints.parquet", "readings.parquet", "dataset.json"):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_floors_by_building() -> None:
    rows = pl.DataFrame({"building": ["B", None, "B"], "floor": [2, 1, 2]})
    assert [(floor.building, floor.number, floor.elevation_m) for floor in floor_infos(rows, {2: 7.4})] == [
        ("", 1, None),
        ("B", 2, 7.4),
    ]
