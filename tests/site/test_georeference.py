"""From the building frame to longitude and latitude, against PROJ."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from rasterio.warp import transform

from vislam2tag.site.georeference import Georeference, from_wgs84, to_wgs84


@pytest.mark.parametrize(("latitude", "longitude"), [(50.78, 6.07), (-33.9, 151.2), (0.0, 179.999), (69.6, -18.9)])
def test_proj_says_the_same(latitude: float, longitude: float) -> None:
    position = np.array([[0.0, 0.0], [300.0, 0.0], [0.0, -250.0], [-120.5, 77.25]])
    ours = to_wgs84(position, Georeference(latitude_deg=latitude, longitude_deg=longitude))
    # Azimuthal equidistant: distances from the origin along the ellipsoid, as good as the plane this near.
    frame = f"+proj=aeqd +lat_0={latitude} +lon_0={longitude} +datum=WGS84 +units=m"
    theirs = np.array(transform(frame, "EPSG:4326", *position.T)).T
    difference = np.abs((ours - theirs + 180) % 360 - 180)
    assert difference.max() < 1e-8  # a millimetre


@given(bearing=st.floats(-720, 720), x=st.floats(-500, 500), y=st.floats(-500, 500))
def test_the_bearing_turns_clockwise(bearing: float, x: float, y: float) -> None:
    turn = np.radians(bearing)
    north_up = np.array([[x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)]])
    turned = to_wgs84(np.array([[x, y]]), Georeference(latitude_deg=48.0, longitude_deg=11.0, bearing_deg=bearing))
    straight = to_wgs84(north_up, Georeference(latitude_deg=48.0, longitude_deg=11.0))
    assert turned == pytest.approx(straight, abs=1e-11)


def test_the_plan_with_east_up() -> None:
    east_up = Georeference(latitude_deg=50.0, longitude_deg=6.0, bearing_deg=90.0)
    longitude, latitude = to_wgs84(np.array([[0.0, 100.0]]), east_up)[0]
    assert longitude > 6.001
    assert latitude == pytest.approx(50.0, abs=1e-7)


def test_no_place_on_earth() -> None:
    with pytest.raises(ValidationError):
        Georeference(latitude_deg=95.0, longitude_deg=6.0)


@given(
    latitude=st.floats(-89, 89),
    longitude=st.floats(-180, 180),
    bearing=st.floats(-360, 360),
    x=st.floats(-2000, 2000),
    y=st.floats(-2000, 2000),
)
def test_there_and_back(latitude: float, longitude: float, bearing: float, x: float, y: float) -> None:
    frame = Georeference(latitude_deg=latitude, longitude_deg=longitude, bearing_deg=bearing)
    position = np.array([[x, y]])
    # Within 2 km the ellipsoid lies up to 0.3 m below the plane; seen from above that moves a point by 0.1 mm.
    assert from_wgs84(to_wgs84(position, frame), frame) == pytest.approx(position, abs=2e-4)
