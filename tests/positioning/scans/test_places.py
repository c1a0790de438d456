"""Training scans and their places as arrays and back."""

from __future__ import annotations

import numpy as np

from tests.positioning.radio_world import radio_world
from vislam2tag.positioning.checked_arrays import CheckedArrays
from vislam2tag.positioning.scans.places import ScanPlaces
from vislam2tag.positioning.scans.radio_scans import RadioScans


def test_what_is_kept_comes_back() -> None:
    scans, places = radio_world(walks=1)
    again = RadioScans.restored(CheckedArrays(scans.arrays()), scans.access_points)
    np.testing.assert_array_equal(again.dense(), scans.dense())
    there = ScanPlaces.restored(CheckedArrays(places.arrays()), places.storeys)
    assert there.storeys == places.storeys
    for name in ("storey", "xy", "z"):
        np.testing.assert_array_equal(getattr(there, name), getattr(places, name))
