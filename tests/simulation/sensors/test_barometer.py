"""Air pressure along a walk."""

from __future__ import annotations

import numpy as np
import pytest

from tests.simulation.worlds import sessions_of
from vislam2tag.core.context import PressureLog
from vislam2tag.heights.rides import altitude_m
from vislam2tag.simulation.sensors.imu import INERTIAL_TYPES, SENSOR_TYPES, with_pressure
from vislam2tag.simulation.settings import stream
from vislam2tag.simulation.walking.sampling import position_at


def test_pressure_falls_with_height_and_leaves_the_other_sensors_alone() -> None:
    session = sessions_of("clean")[0]
    walk = session.walk
    rising = walk.position.copy()
    rising[:, 2] += np.linspace(0, 12.0, len(rising))
    walk = type(walk)(**{**vars(walk), "position": rising})
    log = with_pressure(session.imu, walk, 20.0, stream(1, "pressure"))
    rows = log.sensor == SENSOR_TYPES.index("PRESSURE")
    assert rows.sum() == pytest.approx(10 * 80, abs=2)
    assert np.array_equal(log.values[~rows], session.imu.values)
    assert set(log.sensor[~rows].tolist()) == set(range(len(INERTIAL_TYPES)))
    assert np.all(np.diff(log.time_ns) >= 0)
    time_ns = log.time_ns[rows]
    height = altitude_m(PressureLog(time_ns, log.values[rows, 0]), time_ns)
    truth = position_at(walk, time_ns)[:, 2]
    assert np.abs((height - height[20]) - (truth - truth[20])).max() < 1.0
