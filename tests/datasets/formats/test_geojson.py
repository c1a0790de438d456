"""GeoJSON: a feature collection that any reader takes, in degrees or in metres."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from rasterio.features import bounds

from tests.datasets.factory import SCANS, small_dataset
from tests.datasets.formats.round_trip import exported, odd_dataset, signatures, signatures_of_geojson
from vislam2tag.common.errors import DatasetError
from vislam2tag.datasets.formats.geojson import FILE
from vislam2tag.datasets.model import Dataset
from vislam2tag.site.georeference import Georeference

HOME = Georeference(latitude_deg=50.7796, longitude_deg=6.0685, bearing_deg=90.0)


def content(folder: Path) -> dict[str, Any]:
    read: dict[str, Any] = json.loads((folder / FILE).read_text(encoding="utf-8"))
    return read


def georeferenced(floors: int) -> Dataset:
    dataset = small_dataset()
    known = [floor.model_copy(update={"georeference": HOME}) for floor in dataset.info.floors[:floors]]
    info = dataset.info.model_copy(update={"floors": (*known, *dataset.info.floors[floors:])})
    return replace(dataset, info=info)


def test_metres_where_there_is_no_georeference(tmp_path: Path) -> None:
    dataset = odd_dataset()
    findings = exported(dataset, "geojson", tmp_path / "out")
    read = content(tmp_path / "out")
    assert read["crs"] is None
    assert read["frame"] == "BCS of each floor, metres; not longitude and latitude"
    assert bounds(read) == (5.0, 10.0, 35.0, 16.0)
    assert signatures_of_geojson(tmp_path / "out") == signatures(dataset)
    assert findings[-1].kind == "no_georeference"
    assert findings[-1].count == 2


def test_degrees_where_every_floor_has_one(tmp_path: Path) -> None:
    findings = exported(georeferenced(2), "geojson", tmp_path / "out")
    read = content(tmp_path / "out")
    assert "crs" not in read
    assert "frame" not in read
    first = read["features"][0]
    longitude, latitude = first["geometry"]["coordinates"]
    # The plan's up is east: 10 m up are 10 m east, 5 m right are 5 m south.
    assert (longitude - HOME.longitude_deg) * 111_320 * 0.6323 == pytest.approx(10.0, abs=0.1)
    assert (latitude - HOME.latitude_deg) * 111_245 == pytest.approx(-5.0, abs=0.05)
    assert (first["properties"]["x"], first["properties"]["y"]) == (5.0, 10.0)
    assert [finding.kind for finding in findings] == ["unlabelled_left_out"]


def test_one_floor_without_makes_all_metres(tmp_path: Path) -> None:
    findings = exported(georeferenced(1), "geojson", tmp_path / "out")
    assert content(tmp_path / "out")["crs"] is None
    assert "floors without a georeference (1)" in findings[-1].message


def test_everything_about_a_fingerprint_is_a_property(tmp_path: Path) -> None:
    exported(small_dataset(), "geojson", tmp_path / "out")
    features = content(tmp_path / "out")["features"]
    assert len(features) == 4 * (SCANS - 1)
    about = features[0]["properties"]
    assert (about["date"], about["sigma"], about["user"]) == ("2026-03-01", 0.1, None)
    reading = about["readings"][0]
    assert {"bssid": reading["bssid"], "frequency_mhz": reading["frequency_mhz"]} == {
        "bssid": "00:11:22:33:00:00",
        "frequency_mhz": 2412.0,
    }


def test_nothing_labelled(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="no fingerprint has a position"):
        exported(small_dataset(unlabelled=SCANS), "geojson", tmp_path / "out")
