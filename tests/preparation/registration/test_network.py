from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.preparation.registration.networks import (
    Survey,
    as_array,
    shot_of,
    squares,
    survey,
    swapped_known,
    swapped_shots,
)
from vislam2tag.common.errors import SurveyError
from vislam2tag.core.transforms import Similarity2
from vislam2tag.preparation.registration.least_squares import SingularError
from vislam2tag.preparation.registration.network import (
    KNOWN,
    Measurement,
    PlaneFit,
    adjust_heights,
    adjust_plane,
)
from vislam2tag.preparation.registration.network_search import GrossError, search_network


@settings(max_examples=20)
@given(st.integers(0, 10**6))
def test_without_noise_every_point_is_where_it_is(seed: int) -> None:
    exact = survey(seed, landmarks=5, noise=0.0)
    fit = search_network(exact.all)[0]
    for name, place in fit.places.items():
        assert place == pytest.approx(exact.truth[name], abs=1e-6)


def test_stated_regions_hold_as_many_errors_as_they_say() -> None:
    square = []
    for seed in range(60):
        drawn = survey(seed)
        fit = search_network(drawn.all)[0]
        square += [
            squares(as_array(fit.places[name] - drawn.truth[name]), fit.covariance(name))
            for name in fit.places
            if not name.startswith("K")
        ]
    assert 0.62 < np.mean(np.array(square) < 2.279) < 0.74
    assert 0.92 < np.mean(np.array(square) < 5.991) < 0.98


def test_joint_covariance_holds_the_single_ones() -> None:
    drawn = survey(1)
    fit = search_network(drawn.all)[0]
    both = fit.covariance("3", "5")
    assert both[:2, :2] == pytest.approx(fit.covariance("3"))
    assert both[2:, 2:] == pytest.approx(fit.covariance("5"))
    assert np.abs(both[:2, 2:]).max() > 0


def test_a_free_scale_is_found_and_a_fixed_one_is_not_changed() -> None:
    drawn = survey(2, noise=0.3)
    longer = [replace(shot, place=1.001 * shot.place) for shot in drawn.shots]
    free = search_network([*longer, *drawn.known], free_scale=True)[0]
    assert free.scale is not None
    value, sigma = free.scale
    assert value == pytest.approx(1 / 1.001, abs=4 * sigma)
    assert sigma < 2e-4
    assert all(abs(one.scale - 1) < 1e-12 for one in search_network(drawn.all)[0].maps.values())


def test_one_known_point_leaves_the_frame_undetermined() -> None:
    shots = [Measurement(point=name, station="S", place=place, sigma_m=0.003) for name, place in (("a", 0j), ("b", 5j))]
    with pytest.raises(SingularError):
        adjust_plane([*shots, Measurement(point="a", place=0j, sigma_m=0.003)], {"S": Similarity2.identity()})


def test_sums_of_squares_do_not_depend_on_the_order() -> None:
    drawn = survey(5)
    fit = search_network(drawn.all)[0]
    other = search_network(drawn.all[::-1])[0]
    assert other.adjusted.square == pytest.approx(fit.adjusted.square)
    assert other.covariance("3") == pytest.approx(fit.covariance("3"))


def height(point: str, station: str, height_m: float, source: str = "") -> Measurement:
    return Measurement(point=point, station=station, place=0j, sigma_m=1.0, height_m=height_m, source=source)


def heights(seed: int = 0, noise_m: float = 0.005) -> tuple[list[Measurement], dict[str, float]]:
    """Three known points, six others, two stations."""
    rng = np.random.default_rng(seed)
    truth = {name: float(rng.uniform(0, 2)) for name in ("A", "B", "C", *"123456")}
    found = [height(name, KNOWN, truth[name]) for name in "ABC"]
    for station, shift in (("S1", 100.0), ("S2", -7.0)):
        found += [height(name, station, z + shift + rng.normal(0, noise_m)) for name, z in truth.items()]
    return found, truth


def test_heights_come_back_exactly_without_noise() -> None:
    found, truth = heights(noise_m=0.0)
    fit = adjust_heights(found, 0.005)
    assert {name: z for name, (z, _) in fit.heights.items()} == pytest.approx(truth)
    assert (fit.errors, fit.untied) == ((), ())


def test_stated_sigmas_hold() -> None:
    off = []
    for seed in range(80):
        (found, truth), rng = heights(seed), np.random.default_rng(seed + 999)
        known = [one if one.station else replace(one, height_m=one.height_m + rng.normal(0, 0.005)) for one in found]
        fit = adjust_heights(known, 0.005).heights
        off += [(fit[name][0] - truth[name]) / fit[name][1] for name in "123456"]
    assert 0.60 < np.mean(np.abs(off) < 1) < 0.78


def test_a_known_height_that_is_off_is_named() -> None:
    found, truth = heights(noise_m=0.001)
    found[1] = height("B", KNOWN, truth["B"] + 1.0, "known.csv:3")
    fit = adjust_heights(found, 0.005)
    assert fit.errors == ("known height of B (known.csv:3) is wrong",)
    assert fit.heights["4"][0] == pytest.approx(truth["4"], abs=0.01)


def test_stations_without_a_known_height_are_told() -> None:
    found, _ = heights()
    fit = adjust_heights([*found, height("9", "S3", 5.0)], 0.005)
    assert fit.untied == ("S3",)
    assert "9" not in fit.heights
    assert adjust_heights([height("9", "S3", 5.0)], 0.005).heights == {}
    assert adjust_heights([], 0.005).heights == {}


def searched(drawn: Survey) -> tuple[PlaneFit, tuple[GrossError, ...]]:
    return search_network(drawn.all)


def texts(drawn: Survey) -> list[str]:
    return [error.text for error in searched(drawn)[1]]


def test_good_surveys_are_left_alone() -> None:
    assert sum(bool(searched(survey(seed))[1]) for seed in range(60)) <= 2


@pytest.mark.parametrize("seed", range(6))
def test_interchanged_known_points_are_named(seed: int) -> None:
    drawn = swapped_known(survey(seed), 0, 1)
    assert texts(drawn) == ["the known points K0 and K1 seem to be interchanged"]


def test_two_of_three_known_points_interchanged_are_named() -> None:
    drawn = swapped_known(survey(3, known=3, seen=1.0), 0, 2)
    with pytest.raises(
        SurveyError,
        match=r"shares only point K1 .* skipped as wrong: the known points K0 and K2 seem to be interchanged",
    ):
        searched(drawn)


@pytest.mark.parametrize("seed", range(6))
def test_interchanged_shots_are_named_and_what_they_spoil_is_left_out(seed: int) -> None:
    drawn = swapped_shots(survey(seed, stations=3, seen=1.0), "S1", "3", "4")
    fit, errors = searched(drawn)
    assert [error.text for error in errors] == ["3 and 4 seem to be interchanged in the shots from S1"]
    assert abs(fit.places["3"] - drawn.truth["3"]) < 0.02


def test_of_two_stations_either_may_have_interchanged_them() -> None:
    (error,) = searched(swapped_shots(survey(1, seen=1.0), "S1", "3", "4"))[1]
    assert error.text.startswith("either 3 and 4 seem to be interchanged in the shots from S")
    assert error.text.endswith("(it cannot be determined which)")
    assert error.points == ("3", "4")


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        (lambda place: complex(place.imag, place.real), "E and N (exchanged)"),
        (lambda place: complex(place.real, -place.imag), "N (sign)"),
        (lambda place: complex(place.real + 10, place.imag), "E (one digit wrong)"),
        (lambda place: complex(place.real * 10, place.imag), "E (decimal mark)"),
    ],
)
def test_mistyped_known_points_are_named_with_what_would_fit(wrong: object, text: str) -> None:
    drawn = survey(7)
    place = round(drawn.known[2].place.real, 3) + 1j * round(drawn.known[2].place.imag, 3)
    typed = Measurement(point="K2", place=wrong(place), sigma_m=0.005, source="known.csv:4")  # type: ignore[operator]
    (found,) = texts(replace(drawn, known=[*drawn.known[:2], typed, *drawn.known[3:]]))
    assert found.startswith(f"known point K2 (known.csv:4) seems to be mistyped in {text}: ")
    assert f"{place.real:.3f}, {place.imag:.3f} would fit" in found


def test_exchanged_digits_are_named() -> None:
    truth = {"a": 2.5 + 3.25j, "b": 23.871 + 4.215j, "c": 41.5 + 20.75j, "d": 8.125 + 18.5j}
    shots = [
        Measurement(point=name, station="S", place=(0.8 + 0.6j) * place, sigma_m=0.003) for name, place in truth.items()
    ]
    typed = truth | {"b": 28.371 + 4.215j}
    known = [Measurement(point=name, place=place, sigma_m=0.003) for name, place in typed.items()]
    (error,) = search_network([*shots, *known])[1]
    assert error.text == "known point b seems to be mistyped in E (digits exchanged): 23.871, 4.215 would fit"


def test_a_shot_that_is_off_is_named_with_how_far() -> None:
    drawn = survey(9, stations=3, seen=1.0)
    i = shot_of(drawn, "S2", "6")
    drawn.shots[i] = replace(drawn.shots[i], place=drawn.shots[i].place + 0.061 + 0.033j)
    (found,) = texts(drawn)
    assert found.startswith("shot of 6 from S2 is wrong by 0.0")


def test_a_shot_with_another_points_name_is_named() -> None:
    drawn = survey(10, stations=3, seen=1.0)
    i, j = shot_of(drawn, "S2", "6"), shot_of(drawn, "S2", "7")
    drawn.shots[i] = replace(drawn.shots[i], place=drawn.shots[j].place + 0.002)
    (found,) = texts(drawn)
    assert found.endswith("; it is at the position of 7, so its name may be wrong")


def test_of_two_shots_that_contradict_each_other_neither_counts() -> None:
    drawn = survey(11, seen=1.0)
    i = shot_of(drawn, "S0", "2")
    drawn.shots[i] = replace(drawn.shots[i], place=drawn.shots[i].place + 0.5 + 0.3j)
    fit, errors = searched(drawn)
    assert "(it cannot be determined which)" in errors[0].text
    assert "2" not in fit.places


def test_several_errors_are_all_named() -> None:
    drawn = swapped_known(survey(12, known=8, stations=3, seen=1.0), 2, 5)
    i = shot_of(drawn, "S1", "6")
    drawn.shots[i] = replace(drawn.shots[i], place=drawn.shots[i].place + 2.0 + 1.3j)
    found = texts(drawn)
    assert len(found) == 2
    assert "the known points K2 and K5 seem to be interchanged" in found
    assert any(text.startswith("shot of 6 from S1 is wrong by 2.3") for text in found)


def test_noise_greater_than_stated_is_no_gross_error() -> None:
    fit, errors = searched(survey(13, noise=3.0, stations=3))
    assert not errors
    assert fit.adjusted.sigma0 is not None
    assert 2 < fit.adjusted.sigma0 < 4
    assert not fit.adjusted.plausible


def test_repeated_shots_are_each_judged() -> None:
    drawn = survey(14, seen=1.0)
    again = [replace(one, place=one.place + 0.001) for one in drawn.shots if one.point == "3"]
    wrong = replace(again[0], place=again[0].place + 0.7, source="S0.csv:99")
    (found,) = texts(replace(drawn, shots=[*drawn.shots, *again, wrong]))
    assert found.startswith("shot of 3 from S0 (S0.csv:99) is wrong by 0.7")


def test_two_known_points_are_enough_and_cannot_be_checked() -> None:
    shots = [
        Measurement(point=name, station="S", place=place, sigma_m=0.003)
        for name, place in (("a", 0j), ("b", 10 + 0j), ("7", 4 + 3j))
    ]
    known = [Measurement(point="a", place=1j, sigma_m=0.003), Measurement(point="b", place=11j, sigma_m=0.003)]
    fit, _ = search_network([*shots, *known])
    assert fit.places["7"] == pytest.approx(-3 + 5j)
    assert fit.adjusted.redundancy == 1
    assert np.trace(fit.covariance("7")) > 2 * 0.003**2
