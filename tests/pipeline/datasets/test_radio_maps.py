"""Radio maps as a folder of files, and their GeoTIFFs."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rasterio
from PIL import Image
from rasterio.warp import transform

from tests.datasets.factory import small_dataset
from tests.surveys import bytes_of
from tests.undrawn import undrawn
from vislam2tag.common.errors import DatasetError, OutputError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.datasets.folder import sha256_of, write_dataset
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.radio_maps import radio_maps
from vislam2tag.datasets.settings import RadioMapSettings
from vislam2tag.pipeline.datasets import radio_maps as written_maps
from vislam2tag.site.georeference import Georeference, to_wgs84

GRID = CellGrid((-3.0, 4.0), 0.5, rows=3, columns=5)
MEAN = np.arange(15, dtype=np.float32).reshape(3, 5)
MEAN[0, 1] = np.nan
BANDS = {"mean": MEAN, "heard": 2 * MEAN}
ORIGIN = Georeference(latitude_deg=50.78, longitude_deg=6.05, bearing_deg=30.0)


def write(folder: Path, georeference: Georeference | None = None) -> Path:
    tags = {"bssid": "00:11", "ssid": "Café <&> \U0001f600"}
    written_maps.write_geotiff(Folder.at(folder), "map.tif", BANDS, GRID, georeference, tags)
    return folder / "map.tif"


def test_values_lie_where_the_grid_has_them(tmp_path: Path) -> None:
    with rasterio.open(write(tmp_path)) as image:
        assert image.count == 2
        assert image.dtypes == ("float32", "float32")
        for band, layer in enumerate(BANDS.values(), 1):
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
    np.testing.assert_array_equal(written_maps.pixel_transform(GRID), [[0.5, 0, -3], [0, -0.5, 5.5]])


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


@pytest.mark.parametrize("georeference", [ORIGIN, ORIGIN.model_copy(update={"bearing_deg": 0.0})])
def test_with_a_place_on_earth_cells_lie_there(georeference: Georeference, tmp_path: Path) -> None:
    corners: FloatArray = np.array([[0, 0], [5, 0], [5, 3], [0, 3]], dtype=float)
    bcs = corners @ written_maps.pixel_transform(GRID)[:, :2].T + written_maps.pixel_transform(GRID)[:, 2]
    with rasterio.open(write(tmp_path, georeference)) as image:
        assert image.crs.is_projected
        projected = np.array([image.transform @ tuple(corner) for corner in corners])
        found = np.column_stack(transform(image.crs, "EPSG:4326", *projected.T))
    np.testing.assert_allclose(found, to_wgs84(bcs, georeference), atol=1e-9)
    turned = bcs @ written_maps.site_transform(georeference)[:, :2].T
    np.testing.assert_allclose(projected, turned, atol=1e-9)


SETTINGS = RadioMapSettings(cell_m=2.0, most=2)
HERE = Georeference(latitude_deg=50.0, longitude_deg=6.0, bearing_deg=20.0)
PLAN = (600, 300)


def planned(plan: Path) -> Dataset:
    """The small data set, floor 0 with a plan, floor 1 with a place on earth."""
    Image.new("RGB", PLAN, "orange").save(plan)
    dataset = small_dataset()
    first, second = dataset.info.floors
    floors = (
        first.model_copy(update={"plan": "plans/0.png"}),
        second.model_copy(update={"georeference": HERE}),
    )
    return replace(dataset, info=dataset.info.model_copy(update={"floors": floors}), files={"plans/0.png": plan})


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("radio")
    write_dataset(planned(folder / "plan.png"), folder / "set")
    return folder / "set"


@pytest.fixture(scope="module")
def written(source: Path) -> Path:
    with undrawn():
        written_maps.write_radio_maps(source, source.parent / "maps", SETTINGS)
    return source.parent / "maps"


@pytest.fixture(scope="module")
def index(written: Path) -> written_maps.RadioMapIndex:
    return written_maps.RadioMapIndex.model_validate_json((written / written_maps.INDEX_FILE).read_bytes())


def test_arrays_are_the_maps(source: Path, written: Path, index: written_maps.RadioMapIndex) -> None:
    for floor, maps in zip(index.floors, radio_maps(small_dataset(), SETTINGS), strict=True):
        with np.load(written / floor.npz) as arrays:
            assert arrays["bssids"].tolist() == [one.bssid for one in maps.maps]
            assert tuple(arrays["origin_m"]) == maps.grid.origin_m
            assert arrays["cell_m"] == 2.0
            for layer in written_maps.LAYERS:
                np.testing.assert_array_equal(arrays[layer], getattr(maps, layer))
    assert index.dataset_sha256 == sha256_of(source / "dataset.json")


def test_geotiffs_hold_the_same_where_the_index_says(written: Path, index: written_maps.RadioMapIndex) -> None:
    for floor in index.floors:
        with np.load(written / floor.npz) as arrays:
            for number, one in enumerate(floor.access_points):
                with rasterio.open(written / one.geotiff) as image:
                    assert image.descriptions == written_maps.LAYERS
                    assert image.tags()["bssid"] == one.bssid
                    for band, layer in enumerate(written_maps.LAYERS, 1):
                        np.testing.assert_array_equal(image.read(band)[::-1], arrays[layer][number])
                    to_site, pixel = (np.vstack((part, (0, 0, 1))) for part in (floor.bcs_to_site, floor.pixel_to_bcs))
                    expected = (to_site @ pixel)[:2].ravel()
                    np.testing.assert_allclose(image.transform[:6], expected, atol=1e-12)
                    assert image.crs.is_projected == (floor.floor == 1)


def test_the_page_shows_every_map_and_the_plan_once(written: Path, index: written_maps.RadioMapIndex) -> None:
    page = (written / written_maps.PAGE_FILE).read_text("utf-8")
    maps = sum(len(floor.access_points) for floor in index.floors)
    assert page.count("data:image/png;base64,") == 3 * maps + 2 * len(index.floors)
    assert "Wi-Fi: a scan receives" in page
    assert page.count("data:image/jpeg;base64,") == 1
    assert page.count('class="paper plan plan-1"') == len(index.floors[0].access_points) + 2
    for floor in index.floors:
        for one in floor.access_points:
            assert f'href="{one.geotiff}"' in page
    assert "http" not in page


def test_files_that_the_page_names_exist(written: Path, index: written_maps.RadioMapIndex) -> None:
    for floor in index.floors:
        stem = Path(floor.npz).stem
        for name in (f"{stem}.npz", f"figures/{stem}.pdf", f"figures/{stem}.png", f"figures/{stem}.most_heard.pdf"):
            assert (written / name).stat().st_size > 0


@pytest.mark.usefixtures("undrawn_figures")
def test_the_same_set_gives_the_same_bytes_and_files_of_the_user_s_stay(source: Path, written: Path) -> None:
    before = bytes_of(written)
    copy = Path(shutil.copytree(written, written.with_name("again")))
    (copy / "notes.txt").write_text("x")
    written_maps.write_radio_maps(source, copy, SETTINGS)
    assert (copy / "notes.txt").read_text() == "x"
    (copy / "notes.txt").unlink()
    assert bytes_of(copy) == before


def test_a_foreign_folder_is_left_alone(source: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("x")
    with pytest.raises(OutputError, match="is not empty"):
        written_maps.write_radio_maps(source, tmp_path, SETTINGS)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_an_error_leaves_nothing(source: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="--ap nobody"):
        written_maps.write_radio_maps(source, tmp_path / "maps", SETTINGS, ("nobody",))
    with pytest.raises(DatasetError, match="not a data set"):
        written_maps.write_radio_maps(tmp_path, tmp_path / "maps", SETTINGS)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("undrawn_figures")
def test_floors_of_several_buildings_have_names_of_their_own(tmp_path: Path) -> None:
    dataset = small_dataset()
    floors = tuple(floor.model_copy(update={"building": f"Haus/{floor.number}"}) for floor in dataset.info.floors)
    info = dataset.info.model_copy(update={"floors": floors})
    tables = {
        name: table.with_columns(building="Haus/" + table.collect()["floor"].cast(str))
        if name == "fingerprints"
        else table
        for name, table in dataset.tables.items()
    }
    write_dataset(Dataset(info, tables), tmp_path / "set")
    found = written_maps.write_radio_maps(tmp_path / "set", tmp_path / "maps", SETTINGS)
    assert [floor.npz for floor in found.floors] == ["Haus-0.floor_0.wifi.npz", "Haus-1.floor_1.wifi.npz"]
    assert json.loads((tmp_path / "maps" / written_maps.INDEX_FILE).read_text())["floors"][1]["building"] == "Haus/1"
