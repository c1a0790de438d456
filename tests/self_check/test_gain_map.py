"""Gains of sessions added up, and the best places."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.self_check.gain_map import APART_M, BEST, GainMap, SessionGains, session_gains
from vislam2tag.self_check.landmark_gain import Gains


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
    first, second = total.floors()
    assert (first.number, first.frames, second.number, second.frames) == (1, 20, 2, 60)
    assert first.expected_m == second.expected_m == pytest.approx(0.3)
    assert total.mean_gain_m(1) == {(0, 0): pytest.approx(2.0 / 20)}
    assert [(place.x_m, place.y_m, place.gain_m) for place in second.places] == [(5.5, 5.5, 0.05)]


def test_the_best_places_come_first_and_lie_apart() -> None:
    total = GainMap()
    total.add(session({(1, x, 0): 30.0 - abs(x - 20) for x in range(9, 40)} | {(1, 0, 30): 0.1}))
    places = total.floors()[0].places
    assert len(places) == BEST
    assert (places[0].x_m, places[0].y_m) == (20.5, 0.5)
    assert [place.gain_m for place in places] == sorted((place.gain_m for place in places), reverse=True)
    for i, place in enumerate(places):
        assert all(np.hypot(place.x_m - other.x_m, place.y_m - other.y_m) >= APART_M for other in places[:i])


def test_a_floor_that_was_only_walked_through_has_no_places() -> None:
    total = GainMap()
    total.add(session({}))
    assert [floor.places for floor in total.floors()] == [[], []]
