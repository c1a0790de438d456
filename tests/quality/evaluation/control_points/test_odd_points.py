"""Control points that are not where the file says."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.quality.evaluation.control_points.odd_points import (
    PooledOffset,
    PressOffset,
    odd_points,
    pooled_offsets,
    press_offsets,
    shared_m,
)
from vislam2tag.quality.evaluation.point_errors import PointErrors, TruthKind

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
    errors = PointErrors(
        TruthKind.CONTROL_POINTS,
        np.arange(2),
        np.zeros((2, 2)),
        np.array([[0.3, -0.1], [np.nan, np.nan]]),
        np.array([0.3, np.nan]),
        np.zeros(2),
        np.array([0.4, 0.4]),
    )
    [one] = press_offsets(["a", "b"], errors)
    assert (one.point, one.x_m, one.y_m) == ("a", 0.3, -0.1)
    assert one.sigma_m == pytest.approx(0.5)
