"""A station's frame that its shots fit and the walks contradict."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.core.arrays import FloatArray
from vislam2tag.quality.evaluation.point_errors import PointErrors, TruthKind
from vislam2tag.quality.evaluation.total_station.against_walks import frame_against_walks, places_apart

SIGMA_M = 0.15


def walk(
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
    label = true + rng.normal(0, 0.5 * SIGMA_M, 2)
    if shared is not None:
        label += shared[(true[:, 0] / 10).astype(int)]
    if off is not None:
        label[true[:, 0] > 30] += off
    rotation = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
    sigma_m, nothing, truth_m = (np.full(count, value) for value in (SIGMA_M, np.nan, 0.03))
    return PointErrors(TruthKind.TOTAL_STATION, np.arange(count), true @ rotation.T, label, sigma_m, nothing, truth_m)


def test_walks_that_the_station_agrees_with_say_nothing() -> None:
    for seed in range(5):
        assert frame_against_walks([walk(10 * seed + one) for one in range(5)]) == []


def test_a_frame_that_is_turned_is_named_by_where_it_is_farthest_off() -> None:
    [finding] = frame_against_walks([walk(seed, turned=0.03) for seed in range(5)])
    assert finding.kind == "station_frame"
    assert finding.message.startswith("around (35, ")
    farthest = max(places_apart([walk(seed, turned=0.03) for seed in range(5)]), key=lambda one: abs(one.offset))
    assert abs(farthest.offset) == pytest.approx(0.03 * 35, abs=0.15)


def test_one_place_of_four_alone_is_not_the_frame_and_one_walk_alone_says_nothing() -> None:
    assert frame_against_walks([walk(seed, off=np.array([0.0, 1.0])) for seed in range(5)]) == []
    assert frame_against_walks([walk(0, turned=0.03)]) == []


def test_two_places_are_too_few_and_so_is_one_that_contradicts_of_three() -> None:
    assert frame_against_walks([walk(seed, turned=0.05, length_m=19) for seed in range(5)]) == []
    shared = np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 0.8]])
    assert frame_against_walks([walk(seed, length_m=29, shared=shared) for seed in range(5)]) == []
    [finding] = frame_against_walks([walk(seed, turned=0.05, length_m=29) for seed in range(5)])
    assert finding.count >= 2


def test_what_sessions_share_at_places_does_not_make_a_frame_odd_however_many_they_are() -> None:
    for seed in range(10):
        shared = np.random.default_rng(seed).normal(0, 0.15, (8, 2))
        walks = [walk(100 * seed + one, length_m=79, shared=shared) for one in range(40)]
        assert frame_against_walks(walks) == []


def test_what_the_track_is_off_by_is_the_same_for_all_sessions() -> None:
    walks = [walk(seed) for seed in range(50)]
    for one in walks:
        one.truth_sigma_m[:] = 0.3
    assert all(one.sigma_m > 0.3 for one in places_apart(walks))
