from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.common.errors import SurveyError
from vislam2tag.preparation.registration.network_search import agree, rough_frames

POINTS = {"a": 0j, "b": 20 + 1j, "c": 5 + 15j, "d": 30 + 22j, "e": 12 + 3j}


def seen(names: str, turn_rad: float = 0.7, shift: complex = 100 - 40j) -> dict[str, complex]:
    """Points in a station's frame."""
    return {name: complex(np.exp(1j * turn_rad) * POINTS[name] + shift) for name in names}


@given(st.floats(-3.1, 3.1), st.complex_numbers(max_magnitude=1000))
def test_a_frame_without_errors_is_found_exactly(turn_rad: float, shift: complex) -> None:
    found = rough_frames(POINTS, {"S": seen("abcde", turn_rad, shift)}, 0.1)["S"]
    for name, place in seen("abcde", turn_rad, shift).items():
        assert found.a * place + found.b == pytest.approx(POINTS[name], abs=1e-6)


def test_most_points_decide() -> None:
    wrong = seen("abcde") | {"a": 7 + 7j, "b": -50j}
    found = rough_frames(POINTS, {"S": wrong}, 0.1)["S"]
    assert found.a * wrong["d"] + found.b == pytest.approx(POINTS["d"])


def test_two_of_three_interchanged_do_not_turn_the_frame_around() -> None:
    place = seen("abc")
    place["a"], place["b"] = place["b"], place["a"]
    found = agree(place, POINTS, 0.1)
    assert found is not None
    assert found.agreeing == 3
    assert found.map.a * place["c"] + found.map.b == pytest.approx(POINTS["c"])


def test_a_station_without_known_points_follows_through_shared_ones() -> None:
    known = {name: POINTS[name] for name in "ab"}
    stations = {"S2": seen("cde", 2.0, 5j), "S1": seen("abcde")}
    found = rough_frames(known, stations, 0.1)["S2"]
    assert found.a * stations["S2"]["e"] + found.b == pytest.approx(POINTS["e"])


def test_one_known_point_each_suffices_where_stations_share_others() -> None:
    known = {name: POINTS[name] for name in "ab"}
    stations = {"S1": seen("acd"), "S2": seen("bcde", 2.0, 5j)}
    found = rough_frames(known, stations, 0.1)
    assert found["S1"].a * stations["S1"]["d"] + found["S1"].b == pytest.approx(POINTS["d"])


def test_exchanged_east_and_north_are_told() -> None:
    mirrored = {name: place.conjugate() for name, place in seen("abcd").items()}
    with pytest.raises(SurveyError, match=r"station S fits the building better if mirrored .* probably N, E"):
        rough_frames(POINTS, {"S": mirrored}, 0.1)


@pytest.mark.parametrize(
    ("known", "shots", "message"),
    [
        ("a", "abc", "station S shares only point a with the building, but its frame needs two"),
        ("", "abc", "station S shares no point with the building"),
        ("de", "abc", "station S shares no point with the building"),
    ],
)
def test_too_few_common_points_are_told(known: str, shots: str, message: str) -> None:
    with pytest.raises(SurveyError, match=message):
        rough_frames({name: POINTS[name] for name in known}, {"S": seen(shots)}, 0.1)


def test_two_points_at_one_place_are_told() -> None:
    same = {"a": 1j, "b": 1j}
    with pytest.raises(SurveyError, match=r"shares the points a, b with the building, but they are at the same place"):
        rough_frames(same, {"S": {"a": 5 + 0j, "b": 5 + 0j}}, 0.1)


def test_feet_are_told_by_the_ratio() -> None:
    feet = {name: place / 0.3048 for name, place in seen("abcd").items()}
    with pytest.raises(SurveyError, match=r"are 0\.305 times as long\. .* feet"):
        rough_frames(POINTS, {"S": feet}, 0.1)
