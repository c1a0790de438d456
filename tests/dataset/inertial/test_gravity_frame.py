from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray
from vislam2tag.dataset.inertial.gravity_frame import filtered_orientation, logged_orientation
from vislam2tag.dataset.inertial.sensor_series import SensorSeries

RATE_HZ = 100
SECONDS = 30
TIME_NS = np.arange(SECONDS * RATE_HZ) * (10**9 // RATE_HZ)


def series(values: FloatArray) -> SensorSeries:
    return SensorSeries(TIME_NS, values, np.zeros(len(TIME_NS), dtype=np.int8), np.zeros(len(TIME_NS), dtype=np.int64))


def tumbling() -> Rotation:
    """A phone that turns about all its axes."""
    seconds = TIME_NS / 1e9
    angles = np.column_stack((0.5 * seconds, 1.2 + 0.4 * np.sin(2 * seconds), 0.3 * np.sin(3 * seconds)))
    return Rotation.from_euler("ZXZ", angles)


def rates(body: Rotation) -> FloatArray:
    between = (body[:-1].inv() * body[1:]).as_rotvec() * RATE_HZ
    return np.concatenate((between[:1], (between[1:] + between[:-1]) / 2, between[-1:]))


@pytest.mark.parametrize("drift_rad_s", [0.0, 0.003])
def test_the_filter_finds_up_in_spite_of_drift_and_swinging(drift_rad_s: float) -> None:
    body = tumbling()
    swing = np.column_stack([2.0 * np.sin(2 * np.pi * hertz * TIME_NS / 1e9) for hertz in (1.9, 0.95, 3.8)])
    force = body.inv().apply(np.array([0, 0, 9.81]) + swing)
    level = filtered_orientation(series(force), series(rates(body) + drift_rad_s))
    up = level.at(TIME_NS).apply(body.inv().apply((0.0, 0.0, 1.0)))
    tilt = np.arccos(np.minimum(up[:, 2], 1))
    assert tilt.max() < np.radians(1.0)


def test_the_filter_turns_as_the_phone_does() -> None:
    body = tumbling()
    level = filtered_orientation(series(body.inv().apply((0.0, 0.0, 9.81))), series(rates(body)))
    difference = body * level.at(TIME_NS).inv()
    assert (difference[0].inv() * difference).magnitude().max() < np.radians(0.5)


def test_old_phones_log_no_w() -> None:
    body = tumbling()
    quaternion = body.as_quat()
    quaternion *= np.where(quaternion[:, 3:] < 0, -1, 1)
    short = quaternion.copy()
    short[:, 3] = 0
    short[100] = 0.0  # a reading of nothing is no turn
    found, expected = logged_orientation(series(short)), logged_orientation(series(quaternion))
    ours = np.delete(np.arange(len(TIME_NS)), 100)
    assert (found.at(TIME_NS[ours]).inv() * expected.at(TIME_NS[ours])).magnitude().max() < 1e-6
    assert np.max(found.at(TIME_NS[100:101]).magnitude()) < 1e-9


@pytest.mark.filterwarnings("error")
def test_what_is_no_rotation_counts_as_level() -> None:
    logged = np.tile([0.1, 0.2, 0.3, 0.0], (len(TIME_NS), 1))
    logged[5], logged[6, 1] = 1e200, np.inf
    level = logged_orientation(series(logged))
    assert np.isfinite(level.at(TIME_NS).as_quat()).all()
    assert level.at(TIME_NS[5:7]).magnitude() == pytest.approx(0, abs=1e-9)
