"""The phone's barometer along a true walk."""

from __future__ import annotations

import numpy as np

from vislam2tag.simulation.imu import SENSOR_TYPES, VALUES, ImuLog
from vislam2tag.simulation.model import TrueWalk
from vislam2tag.simulation.sampling import position_at

RATE_HZ = 10.0
NOISE_HPA = 0.02
SEA_LEVEL_SIGMA_HPA = 8.0
"""Weather and the sensor's own offset, from walk to walk."""
WEATHER_HPA_PER_SQRT_S = 0.003
"""Random walk of the pressure: a hundredth of a hectopascal is 8 cm."""


def with_pressure(imu: ImuLog, walk: TrueWalk, elevation_m: float, rng: np.random.Generator) -> ImuLog:
    """Add PRESSURE readings (v1 in hPa) to a walk's sensor log; ``elevation_m`` is that of the walk's own floor."""
    duration_ns = int(walk.time_ns[-1] - walk.time_ns[0])
    time_ns = walk.time_ns[0] + np.arange(int(1e9 / RATE_HZ / 3), duration_ns, int(1e9 / RATE_HZ), dtype=np.int64)
    height = elevation_m + position_at(walk, time_ns)[:, 2]
    ground = 1013.25 + SEA_LEVEL_SIGMA_HPA * rng.standard_normal()
    weather = np.cumsum(rng.standard_normal(len(time_ns))) * WEATHER_HPA_PER_SQRT_S / np.sqrt(RATE_HZ)
    pressure = ground * (1 - height / 44330.77) ** (1 / 0.190263) + weather
    values = np.zeros((len(time_ns), VALUES))
    values[:, 0] = pressure + NOISE_HPA * rng.standard_normal(len(time_ns))
    times = np.concatenate((imu.time_ns, time_ns))
    order = np.argsort(times, kind="stable")
    sensor = np.concatenate((imu.sensor, np.full(len(time_ns), SENSOR_TYPES.index("PRESSURE"))))
    return ImuLog(times[order], sensor[order], np.concatenate((imu.values, values))[order])
