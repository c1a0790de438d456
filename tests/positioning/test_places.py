"""Training scans and their places as arrays and back.

Which scans speak for which: whole walks apart, and no storey left without any.

Cells near places, and what densities over them answer.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.positioning.radio_world import radio_world
from vislam2tag.core.arrays import FloatArray
from vislam2tag.datasets.model import Storey
from vislam2tag.positioning.places import (
    CALIBRATED_WITH,
    DensityCells,
    ScanPlaces,
    area_numbers,
    calibration_rows,
    cells_near,
    folds,
    usable_validation,
    walk_numbers,
)
from vislam2tag.positioning.radio_scans import CheckedArrays, RadioScans


def test_what_is_kept_comes_back() -> None:
    scans, places = radio_world(walks=1)
    again = RadioScans.restored(CheckedArrays(scans.arrays()), scans.access_points)
    np.testing.assert_array_equal(again.dense(), scans.dense())
    there = ScanPlaces.restored(CheckedArrays(places.arrays()), places.storeys)
    assert there.storeys == places.storeys
    for name in ("storey", "xy", "z"):
        np.testing.assert_array_equal(getattr(there, name), getattr(places, name))


SCANS, PLACES = radio_world(walks=2)


def test_walks_are_numbered_and_scans_without_one_stand_alone() -> None:
    walk = walk_numbers(SCANS, PLACES)
    assert len(np.unique(walk)) == 6
    for number in np.unique(walk):
        assert len(np.unique(SCANS.session[walk == number])) == 1
    session = SCANS.session.copy()
    session[:3] = ""
    assert len(np.unique(walk_numbers(replace(SCANS, session=session), PLACES)[:3])) == 3


def test_a_walk_alone_on_its_storey_falls_apart() -> None:
    own = (PLACES.storey > 0) | (SCANS.session == "walk-0")
    walk = walk_numbers(SCANS[own], PLACES[own])
    alone = SCANS[own].session == "walk-0"
    assert len(np.unique(walk[alone])) == alone.sum()
    assert len(np.unique(walk[~alone])) == 4


@given(st.lists(st.integers(0, 8), min_size=1, max_size=40), st.integers(2, 6), st.integers(0, 3))
def test_folds_hold_each_scan_out_once_and_never_part_a_walk(walks: list[int], count: int, seed: int) -> None:
    walk = np.array(walks)
    held_out = np.zeros(len(walk), dtype=np.int64)
    for learned, left in folds(walk, count, seed):
        assert (learned ^ left).all()
        assert learned.any()
        assert left.any()
        assert not set(walk[learned]) & set(walk[left])
        held_out += left
    assert (held_out == (1 if len(set(walks)) > 1 else 0)).all()


def test_areas_are_squares_of_all_storeys() -> None:
    area = area_numbers(PLACES, 5.0)
    square = np.floor(PLACES.xy / 5.0)
    for number in np.unique(area):
        assert len(np.unique(square[area == number], axis=0)) == 1
    assert len(np.unique(area)) == len(np.unique(square, axis=0))


def test_some_are_drawn_evenly() -> None:
    assert calibration_rows(0).tolist() == calibration_rows(1).tolist() == []
    assert calibration_rows(5).tolist() == [0, 1, 2, 3, 4]
    many = calibration_rows(10 * CALIBRATED_WITH)
    assert len(many) == CALIBRATED_WITH
    assert set(np.diff(many).tolist()) <= {10, 11}


def test_what_can_be_checked_against() -> None:
    assert usable_validation(None) is None
    assert usable_validation((SCANS.over(["stranger"]), PLACES)) is None
    lost = replace(PLACES, xy=np.where(np.arange(len(PLACES))[:, None] < 5, np.nan, PLACES.xy))
    part = usable_validation((SCANS, lost))
    assert part is not None
    assert len(part[0]) == len(part[1]) == len(SCANS) - 5


STOREYS = (Storey(building="A", floor=0), Storey(building="A", floor=1))


def places(storey: list[int], xy: list[tuple[float, float]], sigma_m: float = np.nan) -> ScanPlaces:
    count = len(storey)
    return ScanPlaces(
        storeys=STOREYS,
        storey=np.array(storey),
        xy=np.array(xy),
        z=np.full(count, np.nan),
        sigma_m=np.full(count, sigma_m),
    )


def line(*x: float) -> DensityCells:
    return DensityCells(np.zeros(len(x), dtype=np.int64), np.column_stack((x, np.zeros(len(x)))))


def test_cells_hold_the_places_and_their_neighbours_on_the_same_storey() -> None:
    cells = cells_near(places([0, 1, 1], [(0.5, 0.5), (-0.1, 4.0), (-0.2, 6.1)]), side_m=2.0)
    assert np.bincount(cells.storey).tolist() == [9, 12]
    lower = cells.centre_m[cells.storey == 0]
    assert sorted(map(tuple, lower.tolist())) == [(x, y) for x in (-1.0, 1.0, 3.0) for y in (-1.0, 1.0, 3.0)]
    assert (np.diff(cells.storey) >= 0).all()


def test_a_label_spreads_over_its_storey_alone_and_wider_where_it_is_unsure() -> None:
    cells = DensityCells(np.array([0, 0, 1]), np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 0.0]]))
    near, unsure = (cells.label_densities(places([0], [(0.0, 0.0)], sigma_m), 1.5)[0] for sigma_m in (np.nan, 3.0))
    assert near[2] == 0
    assert near.sum() == pytest.approx(1)
    assert near[1] / near[0] == pytest.approx(np.exp(-2.0))
    assert unsure[1] / unsure[0] == pytest.approx(np.exp(-9 / (2 * (1.5**2 + 3.0**2))))


def test_the_median_is_not_pulled_by_a_far_second_guess() -> None:
    density: FloatArray = np.array([[0.45, 0.35, 0.2]])
    cells = line(0.0, 1.0, 100.0)
    median = cells.median(density)
    assert median[0, 0] < 2.0
    assert median[0, 1] == 0
    assert cells.spread_m(2 * density, np.zeros((1, 2))) == pytest.approx([0.35 + 20.0])
