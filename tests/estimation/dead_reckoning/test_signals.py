"""One clock and one band for sensors of any rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.estimation.dead_reckoning.walks import corners, walked
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import InertialLog
from vislam2tag.estimation.dead_reckoning.signals import RATE_HZ, WalkSignals, low_pass

WAY = corners((12, 0), (0, 9))


def signals(log: InertialLog) -> WalkSignals:
    found = WalkSignals.of(log)
    assert found is not None
    return found


@pytest.mark.parametrize("rate_hz", [20.0, 100.0, 207.0])
def test_what_changes_slowly_is_the_same_at_any_rate(rate_hz: float) -> None:
    log, _ = walked(WAY, rate_hz=rate_hz)
    at = (log.rate_ns - log.rate_ns[0]) * 1e-9

    def slow(time_s: FloatArray) -> FloatArray:
        return np.column_stack((np.sin(time_s), np.cos(time_s / 2), time_s / 9))

    found = signals(replace(log, rate=slow(at)))
    inner = slice(10, -10)
    assert np.abs(found.rate - slow(found.time_s))[inner].max() < 2e-3
    assert found.known.all()


def test_a_gap_is_known_as_one() -> None:
    log, _ = walked(WAY)
    at = (log.force_ns - log.force_ns[0]) * 1e-9
    kept = (at < 4) | (at > 6)
    found = signals(replace(log, force_ns=log.force_ns[kept], force=log.force[kept]))
    inside = (found.time_s > 4.1) & (found.time_s < 5.9)
    assert not found.known[inside].any()
    assert found.known[(found.time_s < 3.9) | (found.time_s > 6.1)].all()


def test_sensors_that_never_meet_make_no_walk() -> None:
    log, _ = walked(WAY)
    assert WalkSignals.of(replace(log, rate_ns=log.rate_ns + 60_000_000_000)) is None
    assert WalkSignals.of(replace(log, rate_ns=log.rate_ns[:1], rate=log.rate[:1])) is None


@pytest.mark.parametrize(("cutoff_hz", "order"), [(6.0, 4), (0.25, 2)])
@pytest.mark.parametrize("shape", [(60,), (2000, 3)])
def test_the_low_pass_is_the_one_of_scipy(cutoff_hz: float, order: int, shape: tuple[int, ...]) -> None:
    from scipy.signal import butter, sosfiltfilt

    values = 9.8 + 0.1 * np.random.default_rng(1).normal(size=shape).cumsum(axis=0)
    sections = butter(order, cutoff_hz, fs=RATE_HZ, output="sos")
    wanted = sosfiltfilt(sections, values, axis=0, padtype="odd", padlen=min(len(values) - 1, 300))
    found = low_pass(values, cutoff_hz, order)
    assert found.shape == shape
    assert np.abs(found - wanted).max() < 1e-9
