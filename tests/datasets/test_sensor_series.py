"""Means over periods, and rotations between readings."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from vislam2tag.core.arrays import FloatArray
from vislam2tag.datasets.sensor_series import (
    RotationSeries,
    SensorSeries,
    filtered_orientation,
    logged_orientation,
    period_means,
)


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


RATE_HZ = 100
SECONDS = 30
EVEN_NS = np.arange(SECONDS * RATE_HZ) * (10**9 // RATE_HZ)


def series(values: FloatArray) -> SensorSeries:
    return SensorSeries(EVEN_NS, values, np.zeros(len(EVEN_NS), dtype=np.int8), np.zeros(len(EVEN_NS), dtype=np.int64))


def tumbling() -> Rotation:
    """A phone that turns about all its axes."""
    seconds = EVEN_NS / 1e9
    angles = np.column_stack((0.5 * seconds, 1.2 + 0.4 * np.sin(2 * seconds), 0.3 * np.sin(3 * seconds)))
    return Rotation.from_euler("ZXZ", angles)


def rates(body: Rotation) -> FloatArray:
    between = (body[:-1].inv() * body[1:]).as_rotvec() * RATE_HZ
    return np.concatenate((between[:1], (between[1:] + between[:-1]) / 2, between[-1:]))


@pytest.mark.parametrize("drift_rad_s", [0.0, 0.003])
def test_the_filter_finds_up_in_spite_of_drift_and_swinging(drift_rad_s: float) -> None:
    body = tumbling()
    swing = np.column_stack([2.0 * np.sin(2 * np.pi * hertz * EVEN_NS / 1e9) for hertz in (1.9, 0.95, 3.8)])
    force = body.inv().apply(np.array([0, 0, 9.81]) + swing)
    level = filtered_orientation(series(force), series(rates(body) + drift_rad_s))
    up = level.at(EVEN_NS).apply(body.inv().apply((0.0, 0.0, 1.0)))
    tilt = np.arccos(np.minimum(up[:, 2], 1))
    assert tilt.max() < np.radians(1.0)


def test_the_filter_turns_as_the_phone_does() -> None:
    body = tumbling()
    level = filtered_orientation(series(body.inv().apply((0.0, 0.0, 9.81))), series(rates(body)))
    difference = body * level.at(EVEN_NS).inv()
    assert (difference[0].inv() * difference).magnitude().max() < np.radians(0.5)


def test_old_phones_log_no_w() -> None:
    body = tumbling()
    quaternion = body.as_quat()
    quaternion *= np.where(quaternion[:, 3:] < 0, -1, 1)
    short = quaternion.copy()
    short[:, 3] = 0
    short[100] = 0.0  # a reading of nothing is no turn
    found, expected = logged_orientation(series(short)), logged_orientation(series(quaternion))
    ours = np.delete(np.arange(len(EVEN_NS)), 100)
    assert (found.at(EVEN_NS[ours]).inv() * expected.at(EVEN_NS[ours])).magnitude().max() < 1e-6
    assert np.max(found.at(EVEN_NS[100:101]).magnitude()) < 1e-9


@pytest.mark.filterwarnings("error")
def test_what_is_no_rotation_counts_as_level() -> None:
    logged = np.tile([0.1, 0.2, 0.3, 0.0], (len(EVEN_NS), 1))
    logged[5], logged[6, 1] = 1e200, np.inf
    level = logged_orientation(series(logged))
    assert np.isfinite(level.at(EVEN_NS).as_quat()).all()
    assert level.at(EVEN_NS[5:7]).magnitude() == pytest.approx(0, abs=1e-9)
