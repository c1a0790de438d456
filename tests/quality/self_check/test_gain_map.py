"""Gains of sessions added up, and the best places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.walks import landmarks_at
from vislam2tag.quality.self_check.gain_map import APART_M, BESIDE_M, BEST, GainMap, SessionGains, session_gains
from vislam2tag.quality.self_check.landmark_gain import Gains

NONE = landmarks_at({})


def session(cells: dict[tuple[int, int, int], float], factor: float = 1.0) -> SessionGains:
    """Gains by floor and cell of a session with 10 frames on floor 1 and 30 on floor 2, expected errors 0.2 m."""
    found = Gains(
        cell=np.array([key[1:] for key in cells], dtype=np.int64).reshape(-1, 2),
        floor=np.array([key[0] for key in cells], dtype=np.int64),
        gain_m=np.array(list(cells.values()), dtype=np.float64),
    )
    return session_gains(found, factor, np.repeat([1, 2], [10, 30]), np.full(40, 0.2))


def test_sessions_add_up_floor_by_floor_and_are_means_over_frames() -> None:
    total = GainMap()
    total.add(session({(1, 0, 0): 1.0, (2, 5, 5): 3.0}))
    total.add(session({(1, 0, 0): 0.5}, factor=2.0))
    first, second = total.floors(NONE)
    assert (first.number, first.frames, second.number, second.frames) == (1, 20, 2, 60)
    assert first.expected_m == second.expected_m == pytest.approx(0.3)
    assert total.mean_gain_m(1) == {(0, 0): pytest.approx(2.0 / 20)}
    assert [(place.x_m, place.y_m, place.gain_m) for place in second.places] == [(5.5, 5.5, 0.05)]


def test_the_best_places_come_first_and_lie_apart() -> None:
    total = GainMap()
    total.add(session({(1, x, 0): 30.0 - abs(x - 20) for x in range(9, 40)} | {(1, 0, 30): 0.1}))
    places = total.floors(NONE)[0].places
    assert len(places) == BEST
    assert (places[0].x_m, places[0].y_m) == (20.5, 0.5)
    assert [place.gain_m for place in places] == sorted((place.gain_m for place in places), reverse=True)
    for i, place in enumerate(places):
        assert all(np.hypot(place.x_m - other.x_m, place.y_m - other.y_m) >= APART_M for other in places[:i])


def test_a_floor_that_was_only_walked_through_has_no_places() -> None:
    total = GainMap()
    total.add(session({}))
    assert [floor.places for floor in total.floors(NONE)] == [[], []]


def test_no_place_is_beside_a_landmark_that_hangs_there_and_each_is_told_by_them() -> None:
    total = GainMap()
    total.add(session({(1, x, 0): 30.0 - abs(x - 20) for x in range(9, 40)}))
    hanging = replace(landmarks_at({"7": (20.5, 0.0), "3": (0.0, 0.5)}), floor=np.array([1, 1]))
    first = total.floors(hanging)[0].places[0]
    assert np.hypot(first.x_m - 20.5, first.y_m) >= BESIDE_M
    assert first.x_m == 17.5
    assert first.near == "3 m from landmark 7, 18 m from landmark 3"
