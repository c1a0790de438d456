"""Radio tables take one form, and the mean position of readings weighs how sure each is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.dataset.labelled_rows import labelled
from vislam2tag.dataset.fingerprinting.radio_tables import LEAST_SIGMA_M, mean_position, radio_rows
from vislam2tag.labeling.schemas import SCHEMAS


def test_beacons_are_known_by_their_identity_others_by_their_address() -> None:
    rows = [
        {"address": "c2:01", "name": "desk", "uuid": "32ff", "major": 1, "minor": 7, "rssi_dbm": -60.0},
        {"address": "c2:02", "name": "", "rssi_dbm": -70.0},
    ]
    table = radio_rows(labelled("ble", rows), "ble")
    assert table["bssid"].to_list() == ["32ff-1-7", "c2:02"]
    assert table["ssid"].to_list() == ["desk", ""]
    assert set(table.columns) == set(SCHEMAS["wifi"])
    assert all(table.schema[name] == kind for name, kind in SCHEMAS["wifi"].items())


def test_wifi_stays_as_it_is() -> None:
    table = labelled("wifi", [{"scan": 1, "bssid": "a", "ssid": "", "rssi_dbm": -60.0}])
    assert radio_rows(table, "wifi") is table


Reading = tuple[float, float, float | None, bool, int]
METRES = st.floats(-1e3, 1e3)
SIGMA = st.none() | st.floats(0.0, 5.0)
READINGS = st.lists(st.tuples(METRES, METRES, SIGMA, st.booleans(), st.integers(0, 2)), min_size=1, max_size=8)
SCHEMA = {
    "x": pl.Float64(),
    "y": pl.Float64(),
    "z": pl.Float64(),
    "sigma": pl.Float64(),
    "floor": pl.Int32(),
    "placed": pl.Boolean(),
}


def mean_of(rows: Sequence[tuple[object, ...]]) -> dict[str, Any]:
    table = pl.DataFrame(rows, schema=SCHEMA, orient="row")
    return table.group_by(pl.lit(0)).agg(**mean_position(pl.col("placed"))).drop("literal").row(0, named=True)


@given(READINGS)
def test_the_mean_weighs_by_certainty_and_shares_its_error(
    readings: list[tuple[float, float, float | None, bool, int]],
) -> None:
    found = mean_of([(x, y, 1.5, sigma, floor, placed) for x, y, sigma, placed, floor in readings])
    used = [(x, y, sigma, floor) for x, y, sigma, placed, floor in readings if placed]
    if not used:
        assert found == dict.fromkeys(found)
        return
    stated = [max(sigma, LEAST_SIGMA_M) for _, _, sigma, _ in used if sigma is not None]
    sigma = np.array([max(s, LEAST_SIGMA_M) if s is not None else max(stated, default=1.0) for _, _, s, _ in used])
    weight = sigma**-2.0
    assert found["x"] == pytest.approx(np.average([x for x, *_ in used], weights=weight), abs=1e-6)
    assert found["y"] == pytest.approx(np.average([y for _, y, *_ in used], weights=weight), abs=1e-6)
    floors = [floor for *_, floor in used]
    assert found["floor"] == min(set(floors), key=lambda floor: (-floors.count(floor), floor))
    if not stated:
        assert found["sigma"] is None
        return
    assert found["sigma"] == pytest.approx(np.average(sigma, weights=weight))
    assert sigma.min() - 1e-9 <= found["sigma"] <= sigma.max() + 1e-9


def test_a_height_needs_all_readings() -> None:
    both = [(0.0, 0.0, 1.0, 0.1, 1, True), (0.0, 0.0, 3.0, 0.1, 1, True)]
    assert mean_of(both)["z"] == pytest.approx(2.0)
    assert mean_of([both[0], (0.0, 0.0, None, 0.1, 1, True)])["z"] is None
    assert mean_of([both[0], (0.0, 0.0, None, 0.1, 1, False)])["z"] == 1.0
