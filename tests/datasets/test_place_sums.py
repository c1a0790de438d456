from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.datasets.changing import Survey, bssid, surveyed, usual_places
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.place_sums import PLACE, PlaceMeans, PlaceSums, _robust_offsets, device_offsets, place_sums
from vislam2tag.datasets.schema import FINGERPRINTS

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
    assert [found[device][0] for device in "ABC"] == pytest.approx([one - mean for one in offsets], abs=1e-3)
    assert [found[device][1] for device in "ABC"] == [4, 4, 1]


def test_a_device_alone_at_its_places_has_no_offset() -> None:
    found = device_offsets(shared([("A", "x", 0.5, -50), ("B", "x", 0.6, -54), ("D", "x", 9.0, -40)]), DEVICES)
    assert {device: one[0] for device, one in found.items()} == {"A": 2.0, "B": -2.0, "C": None, "D": None}


def test_neighbouring_cells_and_other_access_points_are_no_common_place() -> None:
    assert len(shared([("A", "x", 1.9, -50), ("B", "x", 2.1, -54), ("B", "y", 1.9, -50)])) == 0
    assert device_offsets(shared(), ["A"]) == {"A": (None, 0)}


def test_offsets_of_thousands_of_places_have_a_mean_of_zero() -> None:
    rng = np.random.default_rng(1)
    walk = [
        (device, f"ap{place}", 0.5, float(level + offset))
        for place, level in enumerate(rng.uniform(-90, -40, 4000))
        for device, offset in zip("ABC", (0.7, -1.9, 3.3), strict=True)
        if rng.random() < 0.9
    ]
    found = device_offsets(shared(walk), "ABC")
    assert [found[device][0] for device in "ABC"] == pytest.approx([0.0, -2.6, 2.6], abs=1e-3)


CELL_M = 4.0


def sums(base: Survey, later: Survey) -> PlaceSums:
    return place_sums({"base": surveyed(base), "later": surveyed(later)}, "wifi", CELL_M)


def test_offsets_of_phones_are_found_between_surveys() -> None:
    found = sums(Survey("base", offsets_db={"LG": 0.0, "Pixel": 4.0}), Survey("later", offsets_db={"LG": -3.0}))
    offsets = found.offsets_db
    assert offsets["base", "Pixel"] - offsets["base", "LG"] == pytest.approx(4.0, abs=0.5)
    assert offsets["later", "LG"] - offsets["base", "LG"] == pytest.approx(-3.0, abs=0.5)


def test_access_points_that_moved_do_not_pass_for_an_offset() -> None:
    moved = usual_places() | dict.fromkeys(range(6), (55.0, 25.0))
    offsets = sums(Survey("base"), Survey("later", places=moved)).offsets_db
    assert offsets["later", "LG"] - offsets["base", "LG"] == pytest.approx(0.0, abs=0.6)


def test_loudness_counts_from_what_every_phone_hears() -> None:
    found = sums(Survey("base", sensitivity_dbm=-70.0), Survey("later", sensitivity_dbm=-88.0))
    assert found.faintest_dbm == pytest.approx(-70.0, abs=1.0)
    assert (found.heard["sum_later"] >= 0.0).all()


def test_scans_count_once_a_place_heard_or_not() -> None:
    base = surveyed(Survey("base"))
    found = place_sums({"base": base, "later": surveyed(Survey("later"))}, "wifi", CELL_M)
    assert found.places["scans_base"].sum() == base.fingerprints.collect().height
    joined = found.heard.join(found.places, on=PLACE)
    assert (joined["heard_base"] <= joined["scans_base"]).all()


def test_what_has_no_label_counts_nowhere() -> None:
    base = surveyed(Survey("base"))
    nowhere = [pl.lit(None, pl.Float64).alias(name) for name in ("x", "y")]
    unlabelled = replace(base, tables={**base.tables, FINGERPRINTS: base.fingerprints.with_columns(*nowhere)})
    found = place_sums({"base": unlabelled, "later": surveyed(Survey("later"))}, "wifi", CELL_M)
    assert found.places["scans_base"].sum() == 0
    assert found.places["scans_later"].sum() > 0


def test_a_technology_that_nobody_logged_has_no_places() -> None:
    base: Dataset = surveyed(Survey("base"))
    found = place_sums({"base": base, "later": base}, "ble", CELL_M)
    assert found.places.is_empty()
    assert found.heard.is_empty()


def test_an_access_point_of_one_survey_has_zeros_in_the_other() -> None:
    places = usual_places()
    del places[3]
    found = sums(Survey("base", places=places), Survey("later"))
    new = found.heard.filter(pl.col("bssid") == bssid(3))
    assert new["sum_base"].sum() == 0.0
    assert new["sum_later"].sum() > 0.0


def test_a_building_without_a_name_is_a_place() -> None:
    base = surveyed(Survey("base"))
    unnamed = base.fingerprints.with_columns(building=pl.lit(None, pl.String))
    found = place_sums(
        {"base": replace(base, tables={**base.tables, FINGERPRINTS: unnamed}), "later": base}, "wifi", CELL_M
    )
    assert (found.places["scans_base"] == found.places["scans_later"]).all()
    assert (found.heard["heard_base"] == found.heard["heard_later"]).all()


def test_what_is_left_out_settles() -> None:
    """The farthest of what one phone hears louder, by 1 to 29 dB, are left out one after the other: in four rounds."""
    louder_db = [0.0] * 20 + [float(number) for number in range(1, 30)]
    rows = [
        ("wifi", "", 0, place, 0, "ap", device, level)
        for place, difference in enumerate(louder_db)
        for device, level in (("a", -60.0), ("b", -60.0 + difference))
    ]
    names = ("technology", "building", "floor", "column", "row", "bssid", "device", "rssi_dbm")
    offsets = _robust_offsets(pl.DataFrame(rows, schema=names, orient="row"), ["a", "b"])
    found_db = offsets["b"] - offsets["a"]
    kept = [difference for difference in louder_db if abs(difference - found_db) <= 10.0]
    assert found_db == pytest.approx(sum(kept) / len(kept), abs=2e-4)
