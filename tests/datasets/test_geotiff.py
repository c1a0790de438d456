"""GeoTIFFs read back in rasterio: values, place, frame and names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import rasterio
from rasterio.warp import transform

from vislam2tag.common.files.folder import Folder
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.datasets.geotiff import pixel_transform, site_transform, write_geotiff
from vislam2tag.survey.georeference import Georeference, to_wgs84

GRID = CellGrid((-3.0, 4.0), 0.5, rows=3, columns=5)
MEAN = np.arange(15, dtype=np.float32).reshape(3, 5)
MEAN[0, 1] = np.nan
LAYERS = {"mean": MEAN, "heard": 2 * MEAN}
HERE = Georeference(latitude_deg=50.78, longitude_deg=6.05, bearing_deg=30.0)


def write(folder: Path, georeference: Georeference | None = None) -> Path:
    tags = {"bssid": "00:11", "ssid": "Café <&> \U0001f600"}
    write_geotiff(Folder.at(folder), "map.tif", LAYERS, GRID, georeference, tags)
    return folder / "map.tif"


def test_values_lie_where_the_grid_has_them(tmp_path: Path) -> None:
    with rasterio.open(write(tmp_path)) as image:
        assert image.count == 2
        assert image.dtypes == ("float32", "float32")
        for band, layer in enumerate(LAYERS.values(), 1):
            np.testing.assert_array_equal(image.read(band), layer[::-1])
        for row, column in np.argwhere(np.isfinite(MEAN)):
            (place,) = GRID.centres_m(np.array([[row, column]]))
            (value,) = image.sample([tuple(place)])
            assert value[0] == MEAN[row, column]


def test_no_data_is_nan_and_masked(tmp_path: Path) -> None:
    with rasterio.open(write(tmp_path)) as image:
        assert np.isnan(image.nodata)
        assert image.read_masks(1).astype(bool).tolist() == np.isfinite(MEAN[::-1]).tolist()


def test_the_transform_is_the_grids(tmp_path: Path) -> None:
    with rasterio.open(write(tmp_path)) as image:
        assert image.transform[:6] == (0.5, 0.0, -3.0, 0.0, -0.5, 5.5)
        assert image.bounds == (-3.0, 4.0, -0.5, 5.5)
    np.testing.assert_array_equal(pixel_transform(GRID), [[0.5, 0, -3], [0, -0.5, 5.5]])


def test_without_a_place_on_earth_the_frame_is_local(tmp_path: Path) -> None:
    with rasterio.open(write(tmp_path)) as image:
        assert not image.crs.is_geographic
        assert not image.crs.is_projected
        assert "BCS of a floor" in image.crs.to_wkt()


def test_bands_and_access_point_are_named(tmp_path: Path) -> None:
    with rasterio.open(write(tmp_path)) as image:
        assert image.descriptions == ("mean", "heard")
        tags = image.tags()
    assert tags["bssid"] == "00:11"
    assert tags["ssid"] == "Café <&> \U0001f600"


@pytest.mark.parametrize("georeference", [HERE, HERE.model_copy(update={"bearing_deg": 0.0})])
def test_with_a_place_on_earth_cells_lie_there(georeference: Georeference, tmp_path: Path) -> None:
    corners: FloatArray = np.array([[0, 0], [5, 0], [5, 3], [0, 3]], dtype=float)
    bcs = corners @ pixel_transform(GRID)[:, :2].T + pixel_transform(GRID)[:, 2]
    with rasterio.open(write(tmp_path, georeference)) as image:
        assert image.crs.is_projected
        projected = np.array([image.transform @ tuple(corner) for corner in corners])
        found = np.column_stack(transform(image.crs, "EPSG:4326", *projected.T))
    np.testing.assert_allclose(found, to_wgs84(bcs, georeference), atol=1e-9)
    turned = bcs @ site_transform(georeference)[:, :2].T
    np.testing.assert_allclose(projected, turned, atol=1e-9)


def test_the_same_layers_give_the_same_bytes(tmp_path: Path) -> None:
    first = write(tmp_path).read_bytes()
    assert write(tmp_path).read_bytes() == first
