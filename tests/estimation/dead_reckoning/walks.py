"""Made walks without a tracker: a phone carried along straight legs, its sensors by a simple gait."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import FixLog, InertialLog
from vislam2tag.simulation.imu import SENSOR_TYPES, ImuSettings, simulate_imu
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import stream
from vislam2tag.simulation.survey import walk_and_track

START_NS = 1_574_149_352_000_000_000
G = 9.81


def corners(*legs_m: tuple[float, float]) -> FloatArray:
    """Corners (k, 2) of a way of legs (dx, dy), metres, from the origin."""
    return np.concatenate((np.zeros((1, 2)), np.cumsum(legs_m, axis=0)))


def walked(
    way: FloatArray,
    *,
    speed_m_s: float = 1.2,
    rate_hz: float = 50.0,
    noise: float = 0.0,
    hold: Rotation | None = None,
    seed: int = 0,
) -> tuple[InertialLog, FixLog]:
    """Walk along corners (k, 2) with 1.8 steps a second; ``hold`` turns the device against one that points ahead.

    A fix lies at every corner, exactly; turns take half a second.
    """
    rng = np.random.default_rng(seed)
    leg = np.linalg.norm(np.diff(way, axis=0), axis=1)
    at_s = np.concatenate(([0.0], np.cumsum(leg / speed_m_s)))
    time_s = np.arange(0.0, at_s[-1] + 1 / rate_hz, 1 / rate_hz)
    headings = np.unwrap(np.arctan2(*np.diff(way, axis=0).T[::-1]))
    turns = [np.clip((time_s - corner) / 0.5 + 0.5, 0, 1) for corner in at_s[1:-1]]
    heading = headings[0] + sum((step * turn for step, turn in zip(np.diff(headings), turns, strict=True)), 0 * time_s)
    gait = 2 * np.pi * 1.8 * time_s
    bounce = 3.0 * np.sin(gait) + np.sin(2 * gait)
    force = np.column_stack((0.8 * np.sin(gait / 2), np.sin(gait + 0.8), G + bounce))
    turn_rate = np.gradient(heading, time_s)
    rate = np.column_stack((0.3 * np.sin(gait), 0.2 * np.sin(gait / 2), turn_rate + 0.2 * np.cos(gait / 2)))
    body = hold or Rotation.identity()
    attitude = Rotation.from_rotvec(np.outer(heading - np.pi / 2, (0.0, 0.0, 1.0))) * body
    force, rate = (body.inv().apply(each) + rng.normal(0, noise, each.shape) for each in (force, rate))
    time_ns = START_NS + np.round(time_s * 1e9).astype(np.int64)
    quaternion = attitude.as_quat()
    fixes = FixLog(START_NS + np.round(at_s * 1e9).astype(np.int64), way, tuple(f"corner {i}" for i in range(len(way))))
    return InertialLog(time_ns, force, time_ns, rate, time_ns, quaternion), fixes


def simulated(seed: int, seconds: float) -> tuple[InertialLog, IntArray, FloatArray]:
    """A walk of the simulator: its inertial readings, times (n,) in ns and true places (n, 2).

    Its speed and its north are unlike those that the settings were calibrated with.
    """
    scenario = regular_survey(seed, "none", (0,), ("LG",), 1, seconds)
    (planned,) = scenario.sessions
    walk, _ = walk_and_track(scenario, planned)
    imu = simulate_imu(walk, ImuSettings(), seed, stream(seed, "sensors", planned.key))
    of = {name: imu.sensor == SENSOR_TYPES.index(name) for name in ("ACC", "GYRO", "ROT")}
    log = InertialLog(
        imu.time_ns[of["ACC"]],
        imu.values[of["ACC"], :3],
        imu.time_ns[of["GYRO"]],
        imu.values[of["GYRO"], :3],
        imu.time_ns[of["ROT"]],
        imu.values[of["ROT"], :4],
    )
    return log, walk.time_ns, walk.position[:, :2]


def true_fixes(time_ns: IntArray, place: FloatArray, count: int, margin_s: float = 10.0) -> FixLog:
    """Fixes of a walk at equal distances in time, from a margin after its start to one before its end; exact."""
    margin_ns = int(margin_s * 1e9)
    at_ns = np.linspace(time_ns[0] + margin_ns, time_ns[-1] - margin_ns, count).astype(np.int64)
    places = np.column_stack([np.interp(at_ns, time_ns, place[:, axis]) for axis in (0, 1)])
    return FixLog(at_ns, places, tuple(f"fix {number}" for number in range(count)))
