"""Radii hold the shares that they promise on errors never seen, and grow with the spread of guesses.

Circles hold by what scans left out in several ways erred, and a walk's scans tell which way they are like.
"""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.positioning.error_radii import (
    UNKNOWN_M,
    HeldOut,
    HeldOutRadii,
    SpreadRadii,
    fitted_radii,
    group_quantiles,
    held_out_radii,
)
from vislam2tag.positioning.radio_scans import CheckedArrays


def test_few_errors_give_the_greatest() -> None:
    _, r95 = fitted_radii(np.array([1.0, 2.0, np.nan]), np.zeros(3)).radii_m(np.zeros(1))
    assert r95 == pytest.approx(2.0)


@pytest.mark.parametrize("heavy", [False, True])
def test_radii_hold_new_errors_and_are_saved(heavy: bool) -> None:
    rng = np.random.default_rng(2)
    spread = rng.uniform(0, 6, 4000)
    error = np.hypot(1.0, spread) * (np.abs(rng.standard_t(3, 4000)) if heavy else rng.rayleigh(1.0, 4000))
    radii = fitted_radii(error[:2000], spread[:2000])
    assert radii.base_m == pytest.approx(np.median(error[:2000]))
    r68, r95 = SpreadRadii.restored(CheckedArrays({"radii": radii.array()}), "radii").radii_m(spread[2000:])
    assert np.mean(error[2000:] <= r68) == pytest.approx(0.68, abs=0.03)
    assert np.mean(error[2000:] <= r95) == pytest.approx(0.95, abs=0.015)
    assert (np.diff(r95[np.argsort(spread[2000:])]) >= 0).all()


def test_without_any_error_nothing_is_promised() -> None:
    r68, r95 = fitted_radii(np.full(3, np.nan), np.zeros(3)).radii_m(np.zeros(2))
    assert (r68 >= UNKNOWN_M).all()
    assert (r95 > r68).all()


NEAR_M, FAR_M, FAR_AWAY = 1.0, 4.0, 2.0
"""Errors of scans whose walk was learned, and of others; their features overlap."""


def left_out(seed: int, error_m: float, at: float, count: int = 600) -> HeldOut:
    """Errors that also follow a feature; another hints at how the scans were left out."""
    rng = np.random.default_rng(seed)
    hard = rng.uniform(0.0, 1.0, count)
    error = error_m * np.exp(hard) * np.hypot(*rng.standard_normal((2, count)))
    return HeldOut(error, np.column_stack([hard, rng.normal(at, 1.0, count)]), np.arange(count) // 10, at == 0.0)


@pytest.fixture(scope="module")
def radii() -> HeldOutRadii:
    return held_out_radii([left_out(0, FAR_M, FAR_AWAY), left_out(1, NEAR_M, 0.0)])


def named(count: int, of: int) -> np.ndarray:
    """Walks of so many scans each."""
    return np.char.add("walk ", (np.arange(count) // of).astype(np.str_))


@pytest.mark.parametrize(("error_m", "at"), [(NEAR_M, 0.0), (FAR_M, FAR_AWAY)])
def test_circles_of_walks_hold_whichever_way_they_are_like(radii: HeldOutRadii, error_m: float, at: float) -> None:
    asked = left_out(2, error_m, at)
    radius_68_m, radius_95_m = radii.radii_m(asked.features, named(600, 100))
    for rows in (asked.features[:, 0] < 0.5, asked.features[:, 0] >= 0.5):
        assert 0.6 <= np.mean(asked.error_m[rows] <= radius_68_m[rows]) <= 0.76
    assert 0.9 <= np.mean(asked.error_m <= radius_95_m) <= 0.985
    assert (radius_95_m >= radius_68_m).all()


def test_a_scan_alone_gets_a_circle_between_those_of_walks(radii: HeldOutRadii) -> None:
    near, far = (left_out(3, 1.0, at).features for at in (0.0, FAR_AWAY))
    alone = np.median(radii.radii_m(near, np.full(600, ""))[0])
    of_walks = [np.median(radii.radii_m(features, named(600, 60))[0]) for features in (near, far)]
    assert of_walks[0] < alone < of_walks[1]
    np.testing.assert_allclose(radii.radii_m(near, named(600, 1))[0], radii.radii_m(near, np.full(600, ""))[0])


def test_whether_its_walk_was_learned_is_the_same_for_all_scans_of_a_walk(radii: HeldOutRadii) -> None:
    share = radii.shares(left_out(7, NEAR_M, 0.0, 200).features, named(200, 20))[:, 1]
    np.testing.assert_allclose(share, np.repeat(share[::20], 20))
    assert share.mean() > 0.8 > radii.shares(left_out(7, NEAR_M, 0.0, 200).features, np.full(200, ""))[:, 1].mean()


def test_walks_do_not_tell_of_each_other(radii: HeldOutRadii) -> None:
    features = np.concatenate([left_out(seed, 1.0, at, 60).features for seed, at in ((4, 0.0), (5, FAR_AWAY))])
    both = radii.radii_m(features, named(120, 60))[1]
    np.testing.assert_allclose(both[:60], radii.radii_m(features[:60], np.full(60, "other name"))[1])


def test_features_beyond_all_that_were_seen_count_as_the_greatest(radii: HeldOutRadii) -> None:
    walk = np.full(1, "")
    most = radii.bounds[1]
    assert radii.radii_m(most[None] + 50.0, walk)[1] == pytest.approx(radii.radii_m(most[None], walk)[1])


def test_what_is_saved_says_the_same(radii: HeldOutRadii) -> None:
    features = left_out(6, 1.0, 0.0).features
    again = HeldOutRadii.restored(CheckedArrays(radii.arrays()))
    for one, other in zip(*(some.radii_m(features, named(600, 10)) for some in (radii, again)), strict=True):
        np.testing.assert_array_equal(one, other)


def test_one_way_needs_no_likeness_and_three_are_told_apart() -> None:
    one = held_out_radii([left_out(0, 1.0, 0.0)])
    assert (
        np.mean(left_out(1, 1.0, 0.0).error_m <= one.radii_m(left_out(1, 1.0, 0.0).features, named(600, 10))[0]) < 0.76
    )
    three = held_out_radii([left_out(0, 1.0, 0.0), left_out(1, 4.0, 3.0), left_out(2, 16.0, 6.0)])
    share = three.shares(left_out(3, 1.0, 3.0).features, named(600, 100))
    assert share.mean(axis=0).argmax() == 1
    np.testing.assert_allclose(share.sum(axis=1), 1.0)


def test_where_no_error_is_known_nothing_is_promised() -> None:
    nothing = HeldOut(np.empty(0), np.empty((0, 3)), np.empty(0, np.int64), learned=False)
    small, large = held_out_radii([nothing]).radii_m(np.zeros((2, 3)), np.full(2, ""))
    assert small.tolist() == pytest.approx([100.0, 100.0])
    assert large.tolist() == pytest.approx([200.0, 200.0])


def test_each_group_counts_the_same() -> None:
    values, group = np.array([1.0, 1.0, 1.0, 1.0, 5.0, 9.0]), np.array([0, 0, 0, 0, 1, 2])
    assert group_quantiles(values, group, np.array([0.2, 0.5, 0.75, 0.99])).tolist() == [1.0, 5.0, 9.0, 9.0]


@pytest.mark.parametrize("correlated", [0.0, 0.3, 0.7])
def test_few_groups_make_quantiles_no_greater_than_promised(correlated: float) -> None:
    rng, group = np.random.default_rng(0), np.repeat(np.arange(24), 30)

    def drawn() -> np.ndarray:
        common, own = rng.standard_normal(24)[group], rng.standard_normal(len(group))
        return np.asarray(np.sqrt(correlated) * common + np.sqrt(1 - correlated) * own)

    shares = np.array([[0.68], [0.95]])
    below = [drawn() <= group_quantiles(drawn(), group, shares) for _ in range(200)]
    held_68, held_95 = np.mean(below, axis=(0, 2))
    assert held_68 == pytest.approx(0.68, abs=0.02)
    assert held_95 == pytest.approx(0.945, abs=0.015)
