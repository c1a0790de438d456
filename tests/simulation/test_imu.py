from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.simulation.hand_made import START_NS, make_test_walk
from tests.simulation.worlds import sessions_of
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import PressureLog
from vislam2tag.estimation.vertical import altitude_m
from vislam2tag.simulation.building import make_building
from vislam2tag.simulation.imu import (
    GRAVITY_M_S2,
    INERTIAL_TYPES,
    SENSOR_TYPES,
    ImuLog,
    ImuSettings,
    simulate_imu,
    with_pressure,
)
from vislam2tag.simulation.model import TrueWalk, orientation_at, position_at
from vislam2tag.simulation.settings import BuildingSettings, WalkSettings, stream
from vislam2tag.simulation.walk import make_walk

EXACT = ImuSettings(
    jitter_s=0.0,
    acc_noise_m_s2=0.0,
    acc_bias_m_s2=0.0,
    gyro_noise_rad_s=0.0,
    mag_noise_ut=0.0,
    disturbance_ut=0.0,
    game_drift_rad_s=0.0,
)


def simulated(walk: TrueWalk, settings: ImuSettings, seed: int = 0) -> ImuLog:
    return simulate_imu(walk, settings, 7, np.random.default_rng(seed))


def of_type(log: ImuLog, name: str) -> tuple[IntArray, FloatArray]:
    rows = log.sensor == SENSOR_TYPES.index(name)
    return log.time_ns[rows], log.values[rows]


def body(walk: TrueWalk, time_ns: IntArray) -> Rotation:
    return Rotation.from_quat(orientation_at(walk, time_ns))


@pytest.fixture(scope="module")
def real_walk() -> TrueWalk:
    floor = make_building(BuildingSettings(), 1).floors[0]
    return make_walk(floor, 40.0, WalkSettings(pauses_per_minute=0), np.random.default_rng(4))


def test_rates_order_and_unused_values() -> None:
    log = simulated(make_test_walk(20.0), ImuSettings())
    assert (np.diff(log.time_ns) >= 0).all()
    for name in INERTIAL_TYPES:
        time_ns, values = of_type(log, name)
        assert len(time_ns) == pytest.approx(20 * 50, abs=3)
        assert (np.diff(time_ns) > 0).all()
        used = {"GYRO_UN": 6, "MAG_UN": 6, "ROT": 4, "GAME_ROT": 4}.get(name, 3)
        assert (values[:, used:] == 0).all()
        assert (values[:, :used] != 0).all()
    period = np.diff(of_type(log, "ACC")[0])
    assert period.mean() == pytest.approx(2e7, rel=1e-3)
    assert 1e4 < period.std() < 1e6


def test_integrated_gyroscope_gives_the_orientation(real_walk: TrueWalk) -> None:
    time_ns, values = of_type(simulated(real_walk, EXACT), "GYRO")
    step_s = np.diff(time_ns) / 1e9
    turned = body(real_walk, time_ns[:1])[0]
    for turn in Rotation.from_rotvec((values[1:, :3] + values[:-1, :3]) / 2 * step_s[:, None]):
        turned = turned * turn
    assert (turned.inv() * body(real_walk, time_ns[-1:])[0]).magnitude() < np.radians(1.0)


def test_uncalibrated_sensors_show_their_bias() -> None:
    log = simulated(make_test_walk(still=True), EXACT)
    for name, calibrated in (("GYRO_UN", "GYRO"), ("MAG_UN", "MAG")):
        raw = of_type(log, name)[1]
        assert np.ptp(raw[:, 3:], axis=0).max() == 0
        assert np.abs(raw[:, 3:]).max() > 0
        assert np.allclose(raw[:, :3] - raw[:, 3:], of_type(log, calibrated)[1][0, :3], atol=1e-9)


def test_accelerometer_at_rest_shows_gravity_upwards() -> None:
    walk = make_test_walk(still=True)
    time_ns, values = of_type(simulated(walk, EXACT), "ACC")
    assert np.allclose(body(walk, time_ns).apply(values[:, :3]), [0, 0, GRAVITY_M_S2], atol=1e-6)


def test_accelerometer_shows_gravity_and_gait(real_walk: TrueWalk) -> None:
    values = of_type(simulated(real_walk, ImuSettings()), "ACC")[1]
    norm = np.linalg.norm(values[:, :3], axis=1)
    assert norm.mean() == pytest.approx(GRAVITY_M_S2, abs=0.3)
    spectrum = np.abs(np.fft.rfft(norm - norm.mean()))
    frequency = np.fft.rfftfreq(len(norm), 0.02)
    assert 1.2 < frequency[np.argmax(spectrum)] < 2.8


def test_accelerometer_is_the_second_derivative_of_the_position(real_walk: TrueWalk) -> None:
    time_ns, values = of_type(simulated(real_walk, EXACT), "ACC")
    world = body(real_walk, time_ns).apply(values[:, :3]) - [0, 0, GRAVITY_M_S2]
    moved = np.diff(position_at(real_walk, time_ns), axis=0)[[0, -1]] / 0.02
    change = np.sum((world[1:] + world[:-1])[1:-1] / 2 * 0.02, axis=0)
    assert np.allclose(change, moved[1] - moved[0], atol=0.1)


def test_rotation_vector_points_east_north_up() -> None:
    walk = make_test_walk()
    time_ns, values = of_type(simulated(walk, EXACT), "ROT")
    enu = Rotation.from_quat(values[:, :4])
    bcs_to_enu = Rotation.from_euler("z", np.pi / 2 - EXACT.north_rad)
    assert (enu.inv() * bcs_to_enu * body(walk, time_ns)).magnitude().max() < 1e-6
    mag_ns, mag = of_type(simulated(walk, EXACT), "MAG")
    north = (bcs_to_enu * body(walk, mag_ns)).apply(mag[:, :3])
    assert np.allclose(north, [0, EXACT.earth_horizontal_ut, -EXACT.earth_down_ut], atol=1e-3)


def test_game_rotation_vector_differs_by_a_constant_heading() -> None:
    walk = make_test_walk()
    time_ns, values = of_type(simulated(walk, EXACT), "GAME_ROT")
    between = (Rotation.from_quat(values[:, :4]) * body(walk, time_ns).inv()).as_rotvec()
    assert np.abs(between[:, :2]).max() < 1e-6
    assert np.ptp(between[:, 2]) < 1e-6
    other = of_type(simulated(walk, EXACT, seed=1), "GAME_ROT")[1]
    assert np.abs(other[0, :4] - values[0, :4]).max() > 1e-3


def test_magnetic_disturbance_depends_on_the_place() -> None:
    walk = make_test_walk(still=True)
    settings = replace(EXACT, disturbance_ut=5.0)
    moved = replace(walk, position=walk.position + np.array((8.0, 3.0, 0.0)))
    here, there = (of_type(simulated(item, settings), "MAG")[1] for item in (walk, moved))
    again = of_type(simulated(walk, settings, seed=9), "MAG")[1]
    assert np.allclose(here[0], again[0])
    assert np.linalg.norm(here[0] - there[0]) > 1


def test_the_walk_starts_the_clock() -> None:
    log = simulated(make_test_walk(), ImuSettings())
    assert START_NS < log.time_ns[0] < START_NS + 30_000_000


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
