"""Distances to points, walls and each other: where they meet, and how they change."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.preparation.registration.distance_equations import (
    Equation,
    adjusted_at,
    design_matrix,
    least_squares_places,
    misclosure,
    starting_places,
)
from vislam2tag.preparation.registration.tape_and_clicks import TapeDistance, Target

CORNER = Target("corner", 0j, None, 0.0)
COLUMN = Target("column", 8 + 1j, None, 0.03)
WALL = Target("wall", -1 + 5j, 9 + 5j, 0.0)
PLACES = {"a": 3 + 2j, "b": 5 + 3.5j}
NAMES = ("a", "b")


def equation(landmark: str, target: Target | None, other: str = "", side: int = -1, off_m: float = 0.0) -> Equation:
    """The distance as it is, and by how much the tape is off."""
    exact = Equation(tape(landmark, 1.0), target, other, side)
    return Equation(tape(landmark, exact.from_to(PLACES)[1] + off_m), target, other, side)


def tape(landmark: str, distance_m: float) -> TapeDistance:
    return TapeDistance(landmark, "", distance_m, 0.01, "tape.csv:1")


def all_equations(off_m: float = 0.0) -> list[Equation]:
    return [
        equation("a", CORNER, off_m=off_m),
        equation("a", WALL, off_m=off_m),
        equation("b", COLUMN, off_m=off_m),
        equation("b", WALL, off_m=off_m),
        equation("b", None, "a", off_m=off_m),
    ]


def test_distances_are_those_of_the_places_in_their_own_sigmas() -> None:
    assert [one.from_to(PLACES)[1] for one in all_equations()] == pytest.approx([13**0.5, 3, 15.25**0.5, 1.5, 2.5])
    np.testing.assert_allclose(misclosure(all_equations(), PLACES), 0, atol=1e-9)
    sigma_m = np.array([0.01, 0.01, np.hypot(0.01, 0.03), 0.01, 0.01])
    np.testing.assert_allclose(misclosure(all_equations(0.02), PLACES), -0.02 / sigma_m)


def test_derivatives_are_those_of_small_steps() -> None:
    equations, found = all_equations(), design_matrix(all_equations(), NAMES, PLACES)
    for column, (name, step) in enumerate((name, step) for name in NAMES for step in (1e-6, 1e-6j)):
        moved = PLACES | {name: PLACES[name] + step}
        change = (misclosure(equations, moved) - misclosure(equations, PLACES)) / 1e-6
        np.testing.assert_allclose(found[:, column], -change, atol=1e-3)


def test_a_foot_beyond_the_wall_is_none() -> None:
    wall = equation("a", WALL)
    assert not wall.beyond(PLACES)
    assert wall.beyond({"a": 20 + 2j})
    assert not equation("a", CORNER).beyond({"a": 20 + 2j})


def test_starts_hold_the_places_and_least_squares_leads_there() -> None:
    equations = all_equations()
    starts = starting_places(equations, NAMES)
    assert any(abs(start.places["a"] - PLACES["a"]) + abs(start.places["b"] - PLACES["b"]) < 1e-6 for start in starts)
    best = starts[0]
    assert np.abs(misclosure(best.equations, best.places)).max() < 1e-6
    near = type(best)({name: place + 0.2 - 0.1j for name, place in PLACES.items()}, tuple(equations))
    found = least_squares_places(near, NAMES)
    assert [found[name] for name in NAMES] == pytest.approx([PLACES[name] for name in NAMES])
    assert adjusted_at(equations, NAMES, found, 10.0).variance_factor < 1.0


def test_two_walls_or_two_circles_meet_where_the_landmark_is() -> None:
    across = Target("across", 0j, 9j, 0.0)
    for pair in ((equation("a", WALL), equation("a", across)), (equation("a", CORNER), equation("a", COLUMN))):
        places = [start.places["a"] for start in starting_places(pair, ("a",))]
        assert min(abs(place - PLACES["a"]) for place in places) < 1e-9
