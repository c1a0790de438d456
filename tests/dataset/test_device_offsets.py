from __future__ import annotations

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.dataset.device_offsets import PlaceMeans, device_offsets

DEVICES = ("A", "B", "C", "D")


def readings(rows: list[tuple[str, str, float, float]]) -> pl.DataFrame:
    """Device, access point, x, RSSI."""
    return pl.DataFrame(
        [
            {
                "technology": "wifi",
                "building": "",
                "floor": 0,
                "x": x,
                "y": 0.5,
                "bssid": access_point,
                "device": device,
                "rssi_dbm": rssi_dbm,
            }
            for device, access_point, x, rssi_dbm in rows
        ]
    )


def shared(*walks: list[tuple[str, str, float, float]]) -> pl.DataFrame:
    means = PlaceMeans()
    for walk in walks:
        means.add(readings(walk))
    return means.shared()


@given(st.tuples(*[st.floats(-10, 10)] * 3), st.data())
def test_offsets_come_back_whatever_is_heard_where(offsets: tuple[float, ...], data: st.DataObject) -> None:
    level = st.floats(-90, -30)
    places = [(f"ap{number}", 2.0 * number + 0.1) for number in range(4)]
    walks = []
    for name, x in places:
        loud = data.draw(level)
        # A and B share each place; C hears the second one only.
        hearing = "ABC" if name == "ap1" else "AB"
        walks.append([(device, name, x, loud + offsets["ABC".index(device)]) for device in hearing])
    found = device_offsets(shared(*walks), "ABC")
    mean = sum(offsets) / 3
    assert [found[device].offset_db for device in "ABC"] == pytest.approx([one - mean for one in offsets], abs=1e-3)
    assert [found[device].shared for device in "ABC"] == [4, 4, 1]


def test_a_device_alone_at_its_places_has_no_offset() -> None:
    found = device_offsets(shared([("A", "x", 0.5, -50), ("B", "x", 0.6, -54), ("D", "x", 9.0, -40)]), DEVICES)
    assert {device: one.offset_db for device, one in found.items()} == {"A": 2.0, "B": -2.0, "C": None, "D": None}


def test_neighbouring_cells_and_other_access_points_are_no_common_place() -> None:
    assert len(shared([("A", "x", 1.9, -50), ("B", "x", 2.1, -54), ("B", "y", 1.9, -50)])) == 0
    assert device_offsets(shared(), ["A"])["A"].offset_db is None


def test_means_are_the_same_however_many_walks_they_come_from() -> None:
    rows = [("A" if number % 2 else "B", "x", 0.5, -50.0 - number % 7) for number in range(70)]
    one, many = shared(rows), shared(*([row] for row in rows))
    assert one.equals(many)


def test_offsets_of_thousands_of_places_have_a_mean_of_zero() -> None:
    rng = np.random.default_rng(1)
    walk = [
        (device, f"ap{place}", 0.5, float(level + offset))
        for place, level in enumerate(rng.uniform(-90, -40, 4000))
        for device, offset in zip("ABC", (0.7, -1.9, 3.3), strict=True)
        if rng.random() < 0.9
    ]
    found = device_offsets(shared(walk), "ABC")
    assert [found[device].offset_db for device in "ABC"] == pytest.approx([0.0, -2.6, 2.6], abs=1e-3)
