"""The phone's inertial and magnetic sensors along a true walk, in Android's types, axes and units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.transforms import multiply
from vislam2tag.simulation.model import TrueWalk, blend_at, continuous_signs, make_fields, orientation_at, position_at
from vislam2tag.simulation.settings import stream

INERTIAL_TYPES = ("ACC", "GYRO", "GYRO_UN", "MAG", "MAG_UN", "ROT", "GAME_ROT")
SENSOR_TYPES = (*INERTIAL_TYPES, "PRESSURE")
GRAVITY_M_S2 = 9.80665
VALUES = 6
"""Value columns of the raw layout; unused ones are 0."""


@dataclass(frozen=True)
class ImuSettings:
    """Sensor errors and the magnetic field."""

    rate_hz: float = 50.0
    jitter_s: float = 2e-4
    acc_noise_m_s2: float = 0.03
    acc_bias_m_s2: float = 0.04
    gyro_noise_rad_s: float = 0.002
    gyro_bias_rad_s: float = 0.01
    """Standard deviation of the bias that only the uncalibrated gyroscope shows, rad/s."""
    mag_noise_ut: float = 0.4
    mag_bias_ut: float = 20.0
    """Standard deviation of the phone's own (hard-iron) field, in the uncalibrated magnetometer only, microtesla."""
    north_rad: float = 1.9
    """Direction of north in the BCS, counter-clockwise from x."""
    earth_horizontal_ut: float = 20.0
    earth_down_ut: float = 44.0
    disturbance_ut: float = 5.0
    disturbance_length_m: float = 2.0
    heading_memory_s: float = 8.0
    """Seconds over which the rotation vector averages the disturbed magnetic heading."""
    game_drift_rad_s: float = 2e-4
    """Standard deviation of the constant drift of the game rotation vector's heading, rad/s."""


@dataclass(frozen=True)
class ImuLog:
    """Rows in time order: ``time_ns`` (k,) boot clock, ``sensor`` (k,) index into SENSOR_TYPES, ``values`` (k, 6)."""

    time_ns: IntArray
    sensor: IntArray
    values: FloatArray


def simulate_imu(walk: TrueWalk, settings: ImuSettings, seed: int, rng: np.random.Generator) -> ImuLog:
    """Sample all seven sensor types at ``rate_hz`` each; ``seed`` fixes the building's magnetic field.

    Units: ACC m/s^2 (specific force, gravity included), GYRO rad/s, MAG microtesla, all in the body frame. ``*_UN``
    have the bias in v4-v6. ROT (body to east-north-up) and GAME_ROT (body to an arbitrary heading) are unit quaternions
    x, y, z, w.
    """
    times = [_sample_times_ns(walk, settings, rng) for _ in INERTIAL_TYPES]
    acc, gyro, gyro_un, mag, mag_un, rot, game = times
    gyro_bias = rng.normal(0, settings.gyro_bias_rad_s, 3)
    mag_bias = rng.normal(0, settings.mag_bias_ut, 3)
    field = _magnetic_field_bcs(walk, settings, seed)
    values = [
        _padded(_specific_force(walk, acc, settings, rng)),
        _padded(_body_rates(walk, gyro) + _noise(gyro, settings.gyro_noise_rad_s, rng)),
        _padded(_body_rates(walk, gyro_un) + gyro_bias + _noise(gyro_un, settings.gyro_noise_rad_s, rng), gyro_bias),
        _padded(_in_body(walk, field, mag) + _noise(mag, settings.mag_noise_ut, rng)),
        _padded(_in_body(walk, field, mag_un) + mag_bias + _noise(mag_un, settings.mag_noise_ut, rng), mag_bias),
        _padded(_rotation_vector(walk, field, rot, settings)),
        _padded(_game_rotation_vector(walk, game, settings, rng)),
    ]
    return _in_order([ImuLog(*log) for log in zip(times, map(_rows_of, INERTIAL_TYPES, times), values, strict=True)])


def _rows_of(name: str, time_ns: IntArray) -> IntArray:
    """Index (k,) of a sensor, repeated for each of its readings."""
    return np.full(len(time_ns), SENSOR_TYPES.index(name))


def _in_order(logs: Sequence[ImuLog]) -> ImuLog:
    """Several logs as one."""
    times = np.concatenate([log.time_ns for log in logs])
    order = np.argsort(times, kind="stable")
    sensors, values = [log.sensor for log in logs], [log.values for log in logs]
    return ImuLog(times[order], np.concatenate(sensors)[order], np.concatenate(values)[order])


def _sample_times_ns(walk: TrueWalk, settings: ImuSettings, rng: np.random.Generator) -> IntArray:
    """Times (k,) of one sensor's readings, boot-clock ns."""
    period_s = 1 / settings.rate_hz
    duration_s = (walk.time_ns[-1] - walk.time_ns[0]) / 1e9
    seconds = np.arange(rng.uniform(0.1, 0.9) * period_s, duration_s - period_s, period_s)
    jitter = np.clip(rng.normal(0, settings.jitter_s, len(seconds)), -0.05 * period_s, 0.05 * period_s)
    return np.asarray(walk.time_ns[0] + ((seconds + jitter) * 1e9).astype(np.int64))


def _specific_force(walk: TrueWalk, time_ns: IntArray, settings: ImuSettings, rng: np.random.Generator) -> FloatArray:
    """Second derivative of the position plus gravity at times (k,), in the body frame (k, 3), with bias and noise,
    m/s^2.
    """
    acceleration = np.zeros_like(walk.position)
    acceleration[1:-1] = np.diff(walk.position, n=2, axis=0) * walk.rate_hz**2
    acceleration[0], acceleration[-1] = acceleration[1], acceleration[-2]
    force = _in_body(walk, acceleration + np.array((0.0, 0.0, GRAVITY_M_S2)), time_ns)
    bias = rng.normal(0, settings.acc_bias_m_s2, 3)
    return force + bias + _noise(time_ns, settings.acc_noise_m_s2, rng)


def _body_rates(walk: TrueWalk, time_ns: IntArray) -> FloatArray:
    """Angular velocity (k, 3) in the body frame, rad/s: the rotation between neighbouring samples over its time."""
    orientation = walk.orientation * continuous_signs(walk.orientation)[:, None]
    step = multiply(_conjugate(orientation[:-1]), orientation[1:])
    # Small-angle logarithm of a unit quaternion, exact to third order at 200 Hz.
    between = 2 * step[:, :3] / step[:, 3:] * walk.rate_hz
    rates = np.concatenate((between[:1], (between[1:] + between[:-1]) / 2, between[-1:]))
    return blend_at(walk, rates, time_ns)


def _magnetic_field_bcs(walk: TrueWalk, settings: ImuSettings, seed: int) -> FloatArray:
    """Earth's field plus the building's disturbance (n, 3) along the walk, BCS axes, microtesla."""
    earth = np.array(
        (
            settings.earth_horizontal_ut * np.cos(settings.north_rad),
            settings.earth_horizontal_ut * np.sin(settings.north_rad),
            -settings.earth_down_ut,
        )
    )
    draws = [stream(seed, "magnetic field", walk.floor, axis) for axis in "xyz"]
    fields = make_fields(draws, settings.disturbance_ut, settings.disturbance_length_m)
    stride = max(int(walk.rate_hz / settings.rate_hz), 1)
    sparse = np.append(np.arange(0, len(walk.position) - 1, stride), len(walk.position) - 1)
    every = np.arange(len(walk.position))
    components = []
    for axis in range(3):
        value = fields.at(walk.position[sparse], np.full(len(sparse), axis))
        components.append(np.interp(every, sparse, value))
    return earth + np.column_stack(components)


def _rotation_vector(walk: TrueWalk, field_bcs: FloatArray, time_ns: IntArray, settings: ImuSettings) -> FloatArray:
    """Quaternions (k, 4), body to east-north-up, at times (k,); their heading follows the disturbed magnetic field (n,
    3) slowly.
    """
    magnetic_north = np.unwrap(np.arctan2(field_bcs[:, 1], field_bcs[:, 0]))
    window = max(int(settings.heading_memory_s * walk.rate_hz), 1)
    believed_north = uniform_filter1d(magnetic_north, min(window, len(magnetic_north)), mode="nearest")
    turn = np.pi / 2 - blend_at(walk, believed_north[:, None], time_ns)[:, 0]
    return _turned(orientation_at(walk, time_ns), turn)


def _game_rotation_vector(
    walk: TrueWalk, time_ns: IntArray, settings: ImuSettings, rng: np.random.Generator
) -> FloatArray:
    """Quaternions (k, 4) at times (k,), body to a frame of arbitrary and drifting heading."""
    start, drift = rng.uniform(-np.pi, np.pi), rng.normal(0, settings.game_drift_rad_s)
    return _turned(orientation_at(walk, time_ns), start + drift * (time_ns - walk.time_ns[0]) / 1e9)


def _turned(orientation: FloatArray, angle_rad: FloatArray) -> FloatArray:
    """Turn quaternions (k, 4) by angles (k,) about the vertical; ``w >= 0``."""
    zeros = np.zeros_like(angle_rad)
    about_z = np.column_stack((zeros, zeros, np.sin(angle_rad / 2), np.cos(angle_rad / 2)))
    turned = multiply(about_z, orientation)
    return np.asarray(np.where(turned[:, 3:] < 0, -turned, turned))


def _in_body(walk: TrueWalk, vectors_bcs: FloatArray, time_ns: IntArray) -> FloatArray:
    """Vectors (n, 3) along the walk, from BCS axes to body axes at times (k,)."""
    orientation = orientation_at(walk, time_ns)
    vector = blend_at(walk, vectors_bcs, time_ns)
    pure = np.column_stack((vector, np.zeros(len(vector))))
    return np.asarray(multiply(multiply(_conjugate(orientation), pure), orientation)[:, :3])


def _conjugate(quaternion: FloatArray) -> FloatArray:
    """The inverse rotations (k, 4)."""
    return quaternion * (-1.0, -1.0, -1.0, 1.0)


def _noise(time_ns: IntArray, sigma: float, rng: np.random.Generator) -> FloatArray:
    """White noise (k, 3) at times (k,)."""
    return rng.normal(0, sigma, (len(time_ns), 3))


def _padded(values: FloatArray, bias: FloatArray | None = None) -> FloatArray:
    """Six value columns (k, 6): the given ones (k, v), the bias (3,) if there is one, then zeros."""
    padded = np.zeros((len(values), VALUES))
    padded[:, : values.shape[1]] = values
    if bias is not None:
        padded[:, 3:] = bias
    return padded


RATE_HZ = 10.0
NOISE_HPA = 0.02
SEA_LEVEL_SIGMA_HPA = 8.0
"""Weather and the sensor's own offset, different for each walk."""
WEATHER_HPA_PER_SQRT_S = 0.003
"""Random walk of the pressure; 0.01 hPa is about 8 cm."""


def with_pressure(imu: ImuLog, walk: TrueWalk, elevation_m: float, rng: np.random.Generator) -> ImuLog:
    """Add PRESSURE readings (v1 in hPa) to a walk's sensor log; ``elevation_m`` is that of the walk's floor."""
    duration_ns = int(walk.time_ns[-1] - walk.time_ns[0])
    time_ns = walk.time_ns[0] + np.arange(int(1e9 / RATE_HZ / 3), duration_ns, int(1e9 / RATE_HZ), dtype=np.int64)
    height = elevation_m + position_at(walk, time_ns)[:, 2]
    ground = 1013.25 + SEA_LEVEL_SIGMA_HPA * rng.standard_normal()
    weather = np.cumsum(rng.standard_normal(len(time_ns))) * WEATHER_HPA_PER_SQRT_S / np.sqrt(RATE_HZ)
    pressure = ground * (1 - height / 44330.77) ** (1 / 0.190263) + weather
    values = _padded((pressure + NOISE_HPA * rng.standard_normal(len(time_ns)))[:, None])
    return _in_order((imu, ImuLog(time_ns, _rows_of("PRESSURE", time_ns), values)))
