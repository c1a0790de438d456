"""Means over periods, and rotations between readings."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from vislam2tag.dataset.inertial.sensor_series import RotationSeries, period_means


def test_the_mean_of_a_line_is_its_middle() -> None:
    time_ns = np.array([0, 70, 130, 200, 1000]) * 1_000_000
    values = np.column_stack((time_ns * 2e-9, 5 - time_ns * 1e-9))
    found = period_means(time_ns, values, np.array([100, 250]) * 1_000_000, 4, 20.0)
    middle = np.array([0.1, 0.25])[:, None] + (np.arange(4) + 0.5) / 20
    assert np.allclose(found, np.stack((2 * middle, 5 - middle), axis=-1))


@given(st.lists(st.floats(-9, 9), min_size=12, max_size=12), st.sampled_from((3.0, 10.0, 47.0)))
def test_what_is_integrated_stays_the_same_at_any_rate(values: list[float], rate_hz: float) -> None:
    time_ns = np.cumsum(np.arange(1, 13)) * 50_000_000
    signal = np.array(values)[:, None]
    start_ns = np.array([130_000_000])
    count = round(3 * rate_hz)
    found = period_means(time_ns, signal, start_ns, count, rate_hz)[0, :, 0]
    fine = np.linspace(0.13, 3.13, 30001)
    sampled = np.interp(fine, time_ns / 1e9, signal[:, 0])
    assert abs(found.sum() / rate_hz - np.trapezoid(sampled, fine)) < 1e-3


def test_a_hum_above_the_rate_does_not_alias() -> None:
    time_ns = np.arange(0, 4_000_000_000, 2_000_000)
    hum = np.sin(2 * np.pi * 60.0 * time_ns * 1e-9)[:, None]
    assert np.abs(period_means(time_ns, hum, np.array([10**9]), 40, 20.0)).max() < 0.01


TIME_NS = 10**15 + np.arange(50) * 20_000_000


def test_between_readings_of_a_turning_phone_as_good_as_slerp() -> None:
    rng = np.random.default_rng(1)
    steps = Rotation.from_rotvec(rng.uniform(-0.05, 0.05, (50, 3)))
    turned = [Rotation.identity()]
    for step in steps[1:]:
        turned.append(turned[-1] * step)
    rotation = Rotation.concatenate(turned)
    signs = np.where(rng.random(50) < 0.5, -1.0, 1.0)
    at_ns = rng.integers(TIME_NS[0], TIME_NS[-1], 200)
    found = RotationSeries(TIME_NS, Rotation.from_quat(rotation.as_quat() * signs[:, None])).at(at_ns)
    slerp = Slerp((TIME_NS - TIME_NS[0]) * 1e-9, rotation)((at_ns - TIME_NS[0]) * 1e-9)
    assert (found.inv() * slerp).magnitude().max() < 1e-5


def test_held_outside() -> None:
    rotation = Rotation.from_rotvec(np.linspace(0, 1, 50)[:, None] * [0.0, 0.0, 1.0])
    ends = RotationSeries(TIME_NS, rotation).at(np.array([0, 2 * 10**15]))
    np.testing.assert_allclose(ends.magnitude(), [0, 1], atol=1e-12)
