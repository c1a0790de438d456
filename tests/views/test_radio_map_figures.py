"""Radio maps are drawn where they are, on one scale, the same bytes each time."""

from __future__ import annotations

import io

import numpy as np
import pytest
from matplotlib.image import AxesImage
from PIL import Image

from tests.datasets.factory import small_dataset
from vislam2tag.datasets.model import Storey
from vislam2tag.datasets.radio_maps import FloorMaps, radio_maps
from vislam2tag.datasets.settings import RadioMapSettings
from vislam2tag.site.model import Floor
from vislam2tag.views.radio_map_page import (
    SCALES,
    SHEET,
    THRESHOLDS_DBM,
    Scale,
    access_point_map,
    contact_sheet,
    heard_access_points,
    strongest_signal,
    thumbnail,
)

SCALE = Scale("x", "dB", 0.0, 10.0, "viridis")


@pytest.fixture(scope="module")
def maps() -> FloorMaps:
    return next(radio_maps(small_dataset(), RadioMapSettings(cell_m=2.0)))


@pytest.fixture(scope="module")
def floor() -> Floor:
    return small_dataset().site_floor(Storey("", 0))


def cells_of(image: AxesImage) -> np.ndarray:
    shown = image.get_array()
    assert shown is not None
    return np.asarray(np.ma.filled(shown, np.nan))


def test_the_sheet_shows_each_access_point_with_its_cells(maps: FloorMaps, floor: Floor) -> None:
    figure = contact_sheet(maps, floor)
    panels = [axes for axes in figure.axes if axes.images]
    assert len(panels) == len(maps.maps) <= SHEET
    for number, axes in enumerate(panels):
        assert maps.maps[number].bssid in axes.get_title(loc="left")
        (image,) = axes.images
        np.testing.assert_array_equal(cells_of(image), maps.mean_dbm[number])
        assert tuple(image.get_extent()) == maps.grid.extent_m
        assert image.origin == "lower"


def test_one_access_point_has_a_panel_for_each_layer(maps: FloorMaps, floor: Floor) -> None:
    panels = [axes for axes in access_point_map(maps, floor, 2).axes if axes.images]
    for axes, (layer, scale) in zip(panels, SCALES.items(), strict=True):
        np.testing.assert_array_equal(cells_of(axes.images[0]), getattr(maps, layer)[2])
        assert scale.title in axes.get_title(loc="left")


def test_a_thumbnail_has_north_up_and_is_clear_where_nothing_is_known() -> None:
    values = np.array([[0.0, 10.0], [np.nan, 5.0]], dtype=np.float32)
    image = np.asarray(Image.open(io.BytesIO(thumbnail(values, SCALE))).convert("RGBA"))
    assert image.shape == (2, 2, 4)
    assert (image[..., 3] == [[0, 255], [255, 255]]).all()
    dark, bright = image[1, 0, :3].astype(int), image[1, 1, :3].astype(int)
    assert abs(dark - [68, 1, 84]).max() <= 3
    assert abs(bright - [253, 231, 36]).max() <= 3


def test_values_beyond_the_scale_have_its_last_colour() -> None:
    ends, beyond = (np.array([[low, high]], dtype=np.float32) for low, high in ((0, 10), (-99, 99)))
    assert thumbnail(ends, SCALE) == thumbnail(beyond, SCALE)


def test_the_strongest_signal_is_in_classes_whose_shares_add_up(maps: FloorMaps) -> None:
    image, classes = strongest_signal(maps)
    loudest = np.nanmax(np.where(np.isfinite(maps.mean_dbm), maps.mean_dbm, -np.inf), axis=0)
    known = loudest[np.isfinite(loudest)]
    shares = [share for _, _, share in classes]
    assert sum(shares) == pytest.approx(1.0)
    assert shares[0] == pytest.approx((known >= THRESHOLDS_DBM[0]).mean())
    assert sum(shares[:-1]) == pytest.approx((known >= THRESHOLDS_DBM[-1]).mean())
    assert Image.open(io.BytesIO(image)).size == maps.mean_dbm.shape[:0:-1]


def test_access_points_that_a_scan_hears_are_summed_over_their_shares(maps: FloorMaps) -> None:
    _, scale, median = heard_access_points(maps)
    number = np.nansum(maps.heard, axis=0)[np.isfinite(maps.heard).any(axis=0)]
    assert scale.high == pytest.approx(max(1.0, number.max()))
    assert median == pytest.approx(np.median(number))
