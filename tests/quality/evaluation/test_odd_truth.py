"""Control points, and a station's frame that its shots fit, contradicted by walks."""

from __future__ import annotations

import numpy as np
import pytest

from tests.quality.evaluation.maps import errors_at_origin
from vislam2tag.core.arrays import FloatArray
from vislam2tag.quality.evaluation.odd_truth import (
    PooledOffset,
    PressOffset,
    frame_against_walks,
    odd_points,
    places_apart,
    pooled_offsets,
    press_offsets,
    shared_m,
)
from vislam2tag.quality.evaluation.truth import PointErrors, TruthKind

SIGMA_M = 0.4


def walk(seed: int, moved: dict[str, complex], common: complex = 0j) -> list[PressOffset]:
    """Presses at eight points, twice each, with the errors stated."""
    rng = np.random.default_rng(seed)
    made = []
    for name in "abcdefgh" * 2:
        x, y = rng.normal(0, SIGMA_M, 2)
        off = common - moved.get(name, 0j)
        made.append(PressOffset(point=name, x_m=x + off.real, y_m=y + off.imag, sigma_m=SIGMA_M))
    return made


def test_where_points_are_as_measured_none_is_odd() -> None:
    assert odd_points([(0, walk(seed, {})) for seed in range(6)]) == []


def test_a_point_measured_a_metre_off_is_named_on_its_floor() -> None:
    walks = [(1, walk(seed, {"c": 0.8 - 0.6j})) for seed in range(4)]
    [odd] = odd_points([*walks, *((2, walk(seed, {})) for seed in range(4, 8))])
    assert (odd.floor, odd.point, odd.sessions) == (1, "c", 4)
    assert odd.size_m == pytest.approx(1.0, abs=4 * odd.sigma_m)
    assert "control point c on floor 1" in odd.summary


def test_presses_that_err_alike_at_each_point_make_none_odd_but_one_a_metre_off() -> None:
    rng = np.random.default_rng(0)
    shared = dict(zip("abcdefgh", 0.2 * (rng.standard_normal((8, 2)) @ (1, 1j)), strict=True))
    assert odd_points([(0, walk(seed, shared)) for seed in range(12)]) == []
    moved = {**shared, "c": shared["c"] + 1.2}
    assert [odd.point for odd in odd_points([(0, walk(seed, moved)) for seed in range(12)])] == ["c"]


def test_what_presses_at_a_point_share_is_told_by_how_far_points_are_off() -> None:
    rng = np.random.default_rng(0)
    for shared in (0.05, 0.3):
        off = np.hypot(shared, 0.1) * (rng.standard_normal((400, 2)) @ (1, 1j))
        off[:20] += 5.0
        assert shared_m([PooledOffset(one, 0.1, 3) for one in off]) == pytest.approx(shared, abs=0.03)


def test_a_session_that_is_off_everywhere_makes_no_point_odd() -> None:
    assert odd_points([(0, walk(0, {}, common=3 + 1j)), (0, walk(1, {}))]) == []


@pytest.mark.parametrize("pressed", ["c", "cd"])
def test_sessions_that_pressed_at_one_or_two_points_alone_say_nothing(pressed: str) -> None:
    walks = [[one for one in walk(seed, {"c": 1.2 + 0j}) if one.point in pressed] for seed in range(6)]
    assert odd_points([(0, one) for one in walks]) == []
    assert pooled_offsets([(0, one) for one in walks]) == {}


def test_of_three_points_that_sessions_pressed_at_the_one_that_is_off_is_named() -> None:
    walks = [[one for one in walk(seed, {"c": 2.0 + 0j}) if one.point in "cde"] for seed in range(6)]
    assert [odd.point for odd in odd_points([(0, one) for one in walks])] == ["c"]


def test_one_session_alone_names_none() -> None:
    assert odd_points([(0, walk(0, {"a": 5j}))]) == []


def test_presses_without_a_label_are_left_out() -> None:
    label = np.array([[0.3, -0.1], [np.nan, np.nan]])
    errors = errors_at_origin(label, np.array([0.3, np.nan]), truth_m=0.4)
    [one] = press_offsets(["a", "b"], errors)
    assert (one.point, one.x_m, one.y_m) == ("a", 0.3, -0.1)
    assert one.sigma_m == pytest.approx(0.5)


TRACK_SIGMA_M = 0.15


def track_of_walk(
    seed: int,
    turned: float = 0.0,
    off: FloatArray | None = None,
    length_m: float = 39.0,
    shared: FloatArray | None = None,
) -> PointErrors:
    """Labels along a corridor; its track turned about its beginning, labels ``off`` (2,) beyond 30 m, and in each
    stretch of 10 m by what is ``shared`` (n, 2).
    """
    rng = np.random.default_rng(seed)
    count = round(10 * length_m)
    true = np.column_stack((0.5 + 0.1 * np.arange(count), np.full(count, 5.0)))
    label = true + rng.normal(0, 0.5 * TRACK_SIGMA_M, 2)
    if shared is not None:
        label += shared[(true[:, 0] / 10).astype(int)]
    if off is not None:
        label[true[:, 0] > 30] += off
    rotation = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
    sigma_m, nothing, truth_m = (np.full(count, value) for value in (TRACK_SIGMA_M, np.nan, 0.03))
    return PointErrors(TruthKind.TOTAL_STATION, np.arange(count), true @ rotation.T, label, sigma_m, nothing, truth_m)


def test_walks_that_the_station_agrees_with_say_nothing() -> None:
    for seed in range(5):
        assert frame_against_walks([track_of_walk(10 * seed + one) for one in range(5)]) == []


def test_a_frame_that_is_turned_is_named_by_where_it_is_farthest_off() -> None:
    [finding] = frame_against_walks([track_of_walk(seed, turned=0.03) for seed in range(5)])
    assert finding.kind == "station_frame"
    assert finding.message.startswith("around (35, ")
    farthest = max(
        places_apart([track_of_walk(seed, turned=0.03) for seed in range(5)]), key=lambda one: abs(one.offset)
    )
    assert abs(farthest.offset) == pytest.approx(0.03 * 35, abs=0.15)


def test_one_place_of_four_alone_is_not_the_frame_and_one_walk_alone_says_nothing() -> None:
    assert frame_against_walks([track_of_walk(seed, off=np.array([0.0, 1.0])) for seed in range(5)]) == []
    assert frame_against_walks([track_of_walk(0, turned=0.03)]) == []


def test_two_places_are_too_few_and_so_is_one_that_contradicts_of_three() -> None:
    assert frame_against_walks([track_of_walk(seed, turned=0.05, length_m=19) for seed in range(5)]) == []
    shared = np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 0.8]])
    assert frame_against_walks([track_of_walk(seed, length_m=29, shared=shared) for seed in range(5)]) == []
    [finding] = frame_against_walks([track_of_walk(seed, turned=0.05, length_m=29) for seed in range(5)])
    assert finding.count >= 2


def test_what_sessions_share_at_places_does_not_make_a_frame_odd_however_many_they_are() -> None:
    for seed in range(10):
        shared = np.random.default_rng(seed).normal(0, 0.15, (8, 2))
        walks = [track_of_walk(100 * seed + one, length_m=79, shared=shared) for one in range(40)]
        assert frame_against_walks(walks) == []


def test_what_the_track_is_off_by_is_the_same_for_all_sessions() -> None:
    walks = [track_of_walk(seed) for seed in range(50)]
    for one in walks:
        one.truth_sigma_m[:] = 0.3
    assert all(one.sigma_m > 0.3 for one in places_apart(walks))
