"""Points for GIS, read by geopandas."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import pandas as pd
import pytest

from tests.datasets.factory import SCANS, small_dataset
from tests.datasets.formats.round_trip import exported, odd_dataset
from tests.datasets.formats.test_geojson import HOME, georeferenced
from vislam2tag.common.errors import DatasetError
from vislam2tag.datasets.model import Dataset
from vislam2tag.site.georeference import to_wgs84

FORMATS = ("geoparquet", "geopackage")


def read(name: str, dataset: Dataset, folder: Path) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame]:
    """The points and the readings of a format."""
    exported(dataset, name, folder)
    if name == "geopackage":
        return tuple(gpd.read_file(folder / "fingerprints.gpkg", layer=each) for each in ("fingerprints", "readings"))
    return gpd.read_parquet(folder / "fingerprints.parquet"), pd.read_parquet(folder / "readings.parquet")


@pytest.mark.parametrize("name", FORMATS)
def test_metres_have_a_local_frame(name: str, tmp_path: Path) -> None:
    dataset = odd_dataset()
    points, readings = read(name, dataset, tmp_path)
    known = dataset.fingerprints.drop_nulls(["x", "y", "floor"]).collect()
    assert len(points) == known.height
    by_id = points.set_index("scan_id").loc[known["scan_id"].to_list()]
    assert by_id.geometry.x.tolist() == known["x"].to_list() == by_id["x"].tolist()
    assert by_id.geometry.y.tolist() == known["y"].to_list()
    assert by_id["floor"].tolist() == known["floor"].to_list()
    assert not points.crs.is_geographic
    assert points.crs.axis_info[0].unit_name == "metre"
    heard = dataset.readings.join(known.lazy().select("scan_id"), on="scan_id", how="semi").collect()
    assert sorted(readings["bssid"]) == sorted(heard["bssid"].to_list())
    assert sorted(readings["rssi_dbm"].dropna()) == sorted(heard["rssi_dbm"].drop_nulls().to_list())


@pytest.mark.parametrize("name", FORMATS)
def test_degrees_if_every_floor_has_a_georeference(name: str, tmp_path: Path) -> None:
    points, _ = read(name, georeferenced(2), tmp_path)
    assert points.crs.is_geographic
    expected = to_wgs84(points[["x", "y"]].to_numpy(), HOME)
    assert points.geometry.x.to_numpy() == pytest.approx(expected[:, 0], abs=1e-8)
    assert points.geometry.y.to_numpy() == pytest.approx(expected[:, 1], abs=1e-8)


@pytest.mark.parametrize("name", FORMATS)
def test_what_has_no_position_is_counted_and_none_at_all_refused(name: str, tmp_path: Path) -> None:
    assert "unlabelled_left_out" in {each.kind for each in exported(georeferenced(2), name, tmp_path / "some")}
    with pytest.raises(DatasetError, match="no fingerprint has a position"):
        exported(small_dataset(unlabelled=SCANS), name, tmp_path / "none")


def test_one_floor_without_georeference_is_reported(tmp_path: Path) -> None:
    findings = exported(georeferenced(1), "geopackage", tmp_path)
    assert [each.kind for each in findings][-1] == "no_georeference"
