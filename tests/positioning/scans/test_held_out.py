"""Which scans speak for which: whole walks apart, and no storey left without any."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.positioning.radio_world import radio_world
from vislam2tag.positioning.scans.held_out import (
    CALIBRATED_WITH,
    area_numbers,
    calibration_rows,
    folds,
    usable_validation,
    walk_numbers,
)

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
