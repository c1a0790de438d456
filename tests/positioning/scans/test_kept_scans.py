"""Training scans as arrays and back."""

from __future__ import annotations

import numpy as np

from tests.positioning.radio_world import radio_world
from vislam2tag.positioning.scans.kept_scans import place_arrays, places_kept, scan_arrays, scans_kept


def test_what_is_kept_comes_back() -> None:
    scans, places = radio_world(walks=1)
    again = scans_kept(scan_arrays(scans), scans.access_points)
    np.testing.assert_array_equal(again.dense(), scans.dense())
    there = places_kept(place_arrays(places), places.storeys)
    assert there.storeys == places.storeys
    for name in ("storey", "xy", "z"):
        np.testing.assert_array_equal(getattr(there, name), getattr(places, name))
