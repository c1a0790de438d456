"""Slips of a tracker, told by inertial sensors that do not slip along."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.core.arrays import BoolArray, ComplexArray
from vislam2tag.estimation.dead_reckoning.bridging import tracker_slips

TIME_S = np.arange(0.0, 60.0, 0.1)
SOUND = np.ones(len(TIME_S) - 1, dtype=bool)


def ways(slip: complex, at_s: float = 30.0) -> tuple[ComplexArray, ComplexArray]:
    """A tracker's path with a slip of half a second round a bend, and the inertial one, turned, scaled and noisy."""
    rng = np.random.default_rng(0)
    step = 0.12 * np.exp(1j * np.clip((TIME_S - 20) / 2, 0, 1)) + rng.normal(0, 0.003, (len(TIME_S), 2)) @ (1, 1j)
    felt = np.cumsum(0.9 * np.exp(0.7j) * (step + rng.normal(0, 0.004, (len(TIME_S), 2)) @ (1, 1j)))
    return np.cumsum(step) + slip * np.clip((TIME_S - at_s) / 0.5, 0, 1), felt


@pytest.mark.parametrize("slip", [0.7 + 0j, -0.5j, -0.6 + 0.3j])
def test_a_slip_is_found_with_its_size_and_way(slip: complex) -> None:
    (found,) = tracker_slips(TIME_S, *ways(slip), SOUND)
    assert found.off == pytest.approx(slip, abs=0.12)
    assert TIME_S[found.start] <= 30.1
    assert TIME_S[found.stop] >= 30.4


def told(slip: complex, sound: BoolArray) -> int:
    return len(tracker_slips(TIME_S, *ways(slip), sound))


def test_nothing_is_found_where_ways_agree_or_one_of_them_is_not_known() -> None:
    assert told(0j, SOUND) == 0
    assert told(0.7, SOUND & (np.abs(TIME_S[1:] - 30.2) > 0.5)) == 0
    assert told(0.7, np.zeros_like(SOUND)) == 0
    seen, walked = ways(0.7)
    assert tracker_slips(TIME_S[:5], seen[:5], walked[:5], SOUND[:4]) == []
