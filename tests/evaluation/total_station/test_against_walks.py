"""A station's frame that its shots fit and the walks contradict."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.core.arrays import FloatArray
from vislam2tag.evaluation.point_errors import PointErrors, TruthKind
from vislam2tag.evaluation.total_station.against_walks import frame_against_walks, places_apart

SIGMA_M = 0.15


def walk(seed: int, turned: float = 0.0, off: FloatArray | None = None) -> PointErrors:
    """Labels along a corridor of 40 m; its track turned about its beginning, labels ``off`` (2,) near its end."""
    rng = np.random.default_rng(seed)
    true = np.column_stack((np.arange(0.0, 40.0, 0.1), np.full(400, 5.0)))
    label = true + rng.normal(0, 0.5 * SIGMA_M, 2)
    if off is not None:
        label[true[:, 0] > 30] += off
    rotation = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
    sigma_m, nothing = np.full(400, SIGMA_M), np.full(400, np.nan)
    return PointErrors(
        TruthKind.TOTAL_STATION, np.arange(400), true @ rotation.T, label, sigma_m, nothing, np.full(400, 0.03)
    )


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
