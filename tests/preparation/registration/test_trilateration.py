"""Distances to points, walls and each other: where they meet, and how they change."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.preparation.registration.networks import as_array, squares
from vislam2tag.preparation.registration.distance_equations import (
    Equation,
    adjusted_at,
    design_matrix,
    least_squares_places,
    misclosure,
    starting_places,
)
from vislam2tag.preparation.registration.record import RegisteredPoint
from vislam2tag.preparation.registration.tape_and_clicks import TapeDistance, Target
from vislam2tag.preparation.registration.trilateration import trilaterate

CORNERS = {"c1": 10 + 10j, "c2": 22 + 10j, "c3": 22 + 18j, "c4": 10 + 18j}
ROOM = (10.0, 22.0, 10.0, 18.0)
INSIDE = st.tuples(st.floats(10.5, 21.5), st.floats(10.5, 17.5))


def targets(rng: np.random.Generator | None = None) -> dict[str, Target]:
    """Corners and two walls of a room, as drawn: off by 3 cm where there is a generator."""

    def off() -> float:
        return float(rng.normal(0, 0.03)) if rng else 0.0

    found = {name: Target(name, place + complex(off(), off()), None, 0.03) for name, place in CORNERS.items()}
    x, y = 10 + off(), 10 + off()
    return found | {
        "west": Target("west", complex(x, 10), complex(x, 18), 0.03),
        "south": Target("south", complex(10, y), complex(22, y), 0.03),
    }


def at(point: RegisteredPoint) -> complex:
    return complex(point.x_m, point.y_m)


def taped(place: complex, to: str, rng: np.random.Generator | None = None, name: str = "7") -> TapeDistance:
    true_m = {"west": place.real - 10, "south": place.imag - 10}.get(to)
    true_m = abs(place - CORNERS[to]) if true_m is None else true_m
    return TapeDistance(name, to, max(true_m + (rng.normal(0, 0.02) if rng else 0.0), 0.0), 0.02)


@settings(max_examples=30)
@given(INSIDE, st.sampled_from([("c1", "c2", "c3"), ("west", "south"), ("c1", "south", "c3"), ("c1", "c3", "west")]))
def test_exact_distances_give_the_exact_place(place: tuple[float, float], to: tuple[str, ...]) -> None:
    where = complex(*place)
    found = trilaterate([taped(where, name) for name in to], targets(), extent_m=ROOM)
    if found.placed:
        assert at(found.placed["7"]) == pytest.approx(where, abs=1e-4)
    else:
        assert found.unplaced["7"].startswith("may be at")


@pytest.mark.parametrize("to", [("c1", "c2", "c3", "c4"), ("west", "south"), ("c1", "c2", "south", "west")])
def test_stated_regions_hold_as_many_errors_as_they_say(to: tuple[str, ...]) -> None:
    square = []
    for seed in range(50):
        rng = np.random.default_rng(seed)
        where = complex(rng.uniform(10.5, 21.5), rng.uniform(10.5, 17.5))
        found = trilaterate([taped(where, name, rng) for name in to], targets(rng), extent_m=ROOM)
        if one := found.placed.get("7"):
            square.append(squares(as_array(at(one) - where), np.array(one.covariance_m2)))
    assert len(square) > 46
    assert 0.55 < np.mean(np.array(square) < 2.279) < 0.82
    assert np.mean(np.array(square) < 5.991) > 0.88


def test_distances_none_of_which_can_be_are_told() -> None:
    """As where another column is read for the distance: all are far shorter than from target to target."""
    distances = [TapeDistance(name, to, 0.02, 0.02) for name in "123" for to in ("c1", "c2", "c3")]
    found = trilaterate(distances, targets(), extent_m=ROOM)
    assert found.errors or set(found.unplaced) == {"1", "2", "3"}


def test_mirror_places_are_told_and_decided_by_what_was_expected() -> None:
    where, mirror = 15 + 12j, 15 + 8j
    distances = [taped(where, "c1"), taped(where, "c2")]
    told = trilaterate(distances, targets()).unplaced["7"]
    assert told.startswith("may be at (15.00, ")
    assert "12.00)" in told
    assert "8.00)" in told
    near = trilaterate(distances, targets(), expected={"7": mirror + 0.3}).placed["7"]
    assert at(near) == pytest.approx(mirror, abs=1e-4)
    assert near.note == "two positions are possible; the one closer to the expected position was used"
    assert not trilaterate(distances, targets(), expected={"7": 15 + 10.2j}).placed
    inside = trilaterate(distances, targets(), extent_m=ROOM).placed["7"]
    assert at(inside) == pytest.approx(where, abs=1e-4)


def test_a_wall_counts_only_beside_itself() -> None:
    short = {"w": Target("w", 10 + 0j, 14 + 0j, 0.01), "p": Target("p", 15 + 3j, None, 0.01)}
    distances = [TapeDistance("7", "w", 2.0, 0.01), TapeDistance("7", "p", 3.0, 0.01)]
    found = trilaterate(distances, short)
    assert at(found.placed["7"]) == pytest.approx(15 - 8**0.5 + 2j, abs=1e-4)


@pytest.mark.parametrize("wrong", range(5))
def test_a_wrong_distance_is_named_and_left_out(wrong: int) -> None:
    rng = np.random.default_rng(wrong)
    where = 13.2 + 15.1j
    distances = [taped(where, name, rng) for name in ("c1", "c2", "c3", "c4", "south")]
    distances[wrong] = replace(distances[wrong], distance_m=distances[wrong].distance_m + 0.73)
    found = trilaterate(distances, targets(rng), extent_m=ROOM)
    (error,) = found.errors
    assert error.startswith(
        (f"distance 7 to {distances[wrong].to} is wrong by +0.", f"distance 7 to {distances[wrong].to} seems")
    )
    assert abs(at(found.placed["7"]) - where) < 0.15


def test_a_mistyped_distance_is_named_with_what_would_fit() -> None:
    where = 13 + 15j
    distances = [replace(taped(where, name), decimals=2) for name in ("c1", "c2", "c3", "c4", "south")]
    assert distances[1].distance_m == pytest.approx(10.30, abs=0.01)
    distances[1] = replace(distances[1], distance_m=13.00)
    (error,) = trilaterate(distances, targets()).errors
    assert error == "distance 7 to c2 seems to be mistyped (digits exchanged): 10.30 would fit"


def test_of_three_distances_nothing_tells_which_is_wrong() -> None:
    where = 13 + 15j
    distances = [taped(where, name) for name in ("c1", "c2", "south")]
    distances[0] = replace(distances[0], distance_m=distances[0].distance_m + 0.77)
    found = trilaterate(distances, targets(), extent_m=ROOM)
    assert found.errors[0].startswith("one of distance 7 to c1, distance 7 to c2 and distance 7 to south is wrong")
    assert found.unplaced["7"].startswith("it has fewer than two usable distances")


def test_landmarks_tie_one_another() -> None:
    places = {"7": 13 + 12j, "8": 18 + 13j, "9": 16 + 16j}
    distances = [taped(places["7"], name) for name in ("west", "south")]
    distances += [taped(places["8"], name, name="8") for name in ("south", "c2")]
    distances += [
        TapeDistance(one, two, abs(places[one] - places[two]), 0.02) for one, two in itertools.combinations(places, 2)
    ]
    found = trilaterate(distances, targets(), extent_m=ROOM, expected={"9": 16 + 15j})
    assert {name: at(one) for name, one in found.placed.items()} == pytest.approx(places, abs=1e-3)


def test_too_little_is_told() -> None:
    distances = [taped(13 + 12j, "c1"), TapeDistance("8", "nowhere", 3.0, 0.02)]
    found = trilaterate(distances, targets())
    assert set(found.unplaced) == {"7", "8"}
    assert found.errors == ["nowhere is neither a known point, a wall nor a landmark: distances to it are skipped"]
    parallel = {"a": Target("a", 0j, 10 + 0j, 0.01), "b": Target("b", 5j, 10 + 5j, 0.01)}
    flat = trilaterate([TapeDistance("7", "a", 2.0, 0.02), TapeDistance("7", "b", 3.0, 0.02)], parallel)
    assert set(flat.unplaced) == {"7"}


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
    assert adjusted_at(equations, NAMES, found).variance_factor < 1.0


def test_two_walls_or_two_circles_meet_where_the_landmark_is() -> None:
    across = Target("across", 0j, 9j, 0.0)
    for pair in ((equation("a", WALL), equation("a", across)), (equation("a", CORNER), equation("a", COLUMN))):
        places = [start.places["a"] for start in starting_places(pair, ("a",))]
        assert min(abs(place - PLACES["a"]) for place in places) < 1e-9
