"""Sigma of walks with few fixes covers walkers and buildings unlike the calibrated ones; of many fixes it stays."""

from __future__ import annotations

import numpy as np
import pytest

from tests.estimation.dead_reckoning.walks import simulated, true_fixes
from vislam2tag.core.arrays import FloatArray
from vislam2tag.estimation.dead_reckoning.gait import speed_model
from vislam2tag.estimation.dead_reckoning.walk import ReckonedWalk, SensedWalk
from vislam2tag.estimation.settings import DeadReckoningSettings

SEEDS = range(6)
INSIDE_95 = 2.45


def errors_and_sigmas_m(seed: int, seconds: float, count: int) -> tuple[FloatArray, FloatArray, ReckonedWalk]:
    """Errors (n,), sigmas per axis (n,) at five moments a second, and the walk, through so many true fixes."""
    log, time_ns, place = simulated(seed, seconds)
    sensed = SensedWalk.of(log)
    assert sensed is not None
    walk = sensed.path(true_fixes(time_ns, place, count), speed_model(), DeadReckoningSettings())
    at_s = np.arange(0.0, sensed.signals.time_s[-1], 0.2)
    found, covariance = walk.at(at_s)
    at_ns = sensed.signals.start_ns + (at_s * 1e9).astype(np.int64)
    true = np.column_stack([np.interp(at_ns, time_ns, place[:, axis]) for axis in (0, 1)])
    return np.linalg.norm(found - true, axis=1), np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2), walk


@pytest.mark.parametrize(("seconds", "count"), [(120.0, 2), (300.0, 2), (300.0, 3), (120.0, 5)])
def test_stated_regions_contain_the_walk_however_few_its_fixes_are(seconds: float, count: int) -> None:
    walks = [errors_and_sigmas_m(seed, seconds, count)[:2] for seed in SEEDS]
    error_m, sigma_m = (np.concatenate(parts) for parts in zip(*walks, strict=True))
    assert np.mean(error_m < INSIDE_95 * sigma_m) > 0.93
    assert (error_m < 5 * sigma_m + 0.5).all()


@pytest.mark.parametrize(("seconds", "count"), [(120.0, 5), (120.0, 9), (300.0, 20)])
def test_with_enough_fixes_sigma_stays_that_of_the_path(seconds: float, count: int) -> None:
    for seed in SEEDS:
        _, sigma_m, walk = errors_and_sigmas_m(seed, seconds, count)
        own = np.trace(walk.path.covariance[:, :2, :2], axis1=1, axis2=2) / 2 + walk.path.scatter_m**2
        own_m = np.sqrt(np.interp(np.arange(len(sigma_m)) * 0.2, walk.nodes.time_s, own))
        assert np.median(sigma_m / own_m) == pytest.approx(1.0, abs=0.03)
