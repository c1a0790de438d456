"""Windows of simulated walks against the true motion."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import polars as pl
import pytest
from scipy.spatial.transform import Rotation

from tests.datasets.labelled_rows import START_NS, S, labelled
from tests.simulation.hand_made import make_test_walk
from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.datasets.schema import MAGNETIC, SCHEMAS
from vislam2tag.datasets.sensor_windows import ImuWindows, imu_windows, magnetic_windows
from vislam2tag.datasets.settings import ImuWindowSettings
from vislam2tag.simulation.building import make_building
from vislam2tag.simulation.imu import GRAVITY_M_S2, SENSOR_TYPES, ImuSettings, simulate_imu
from vislam2tag.simulation.model import TrueWalk, orientation_at, position_at
from vislam2tag.simulation.settings import BuildingSettings, WalkSettings
from vislam2tag.simulation.walk import START_NS as WALK_START_NS
from vislam2tag.simulation.walk import make_walk

EXACT = ImuSettings(
    rate_hz=100.0,
    acc_noise_m_s2=0.0,
    acc_bias_m_s2=0.0,
    gyro_noise_rad_s=0.0,
    gyro_bias_rad_s=0.05,
    disturbance_ut=0.0,
    game_drift_rad_s=0.0,
)
SECONDS = 24.0
SECOND_NS = 1_000_000_000
DEFAULTS = ImuWindowSettings()


@dataclass(frozen=True)
class Recording:
    walk: TrueWalk
    sensors: pl.DataFrame
    trajectory: pl.DataFrame


WALK_SETTINGS = WalkSettings(pauses_per_minute=0.0)


def recorded(walk: TrueWalk, lag_s: float = 0.0, camera: Rotation | None = None) -> Recording:
    """The tables of a perfectly mapped walk; ``camera`` turns the phone's axes into the camera's."""
    log = simulate_imu(walk, EXACT, 7, np.random.default_rng(1))
    sensors = pl.DataFrame(
        {
            "time_ns": log.time_ns,
            "sensor": np.array(SENSOR_TYPES)[log.sensor].tolist(),
            **{f"v{column + 1}": values for column, values in enumerate(log.values.T)},
            "floor": 0,
            "status": "ok",
        }
    )
    time_ns = walk.time_ns[0] + np.arange(0, round((SECONDS - 0.1) * 1e9), 33_333_333)
    orientation = Rotation.from_quat(orientation_at(walk, time_ns))
    x, y, _ = position_at(walk, time_ns).T
    turned = orientation * camera.inv() if camera is not None else orientation
    trajectory = pl.DataFrame(
        {
            "device": "LG",
            "floor": 0,
            "time_ns": time_ns + round(lag_s * 1e9),
            **dict(zip(("x", "y"), (x, y), strict=True)),
            **dict(zip(("qx", "qy", "qz", "qw"), turned.as_quat().T, strict=True)),
            "sigma": 0.1,
            "status": "ok",
        }
    )
    return Recording(walk, sensors, trajectory)


@pytest.fixture(scope="module")
def walked() -> Recording:
    floor = make_building(BuildingSettings(), 1).floors[0]
    return recorded(make_walk(floor, SECONDS, WALK_SETTINGS, np.random.default_rng(4)))


def windows_of(recording: Recording, **settings: float) -> ImuWindows:
    return imu_windows(recording.sensors, recording.trajectory, "walk", ImuWindowSettings(**settings))


def samples(table: pl.DataFrame, name: str) -> FloatArray:
    return np.array(table[name].to_list()).reshape(table.height, -1, 3)


def plane(table: pl.DataFrame, x: str, y: str) -> ComplexArray:
    return table[x].to_numpy() + 1j * table[y].to_numpy()


def true_way(walk: TrueWalk, start_ns: IntArray, length_s: float = 1.0) -> ComplexArray:
    step = position_at(walk, start_ns + round(length_s * 1e9)) - position_at(walk, start_ns)
    return step[:, 0] + 1j * step[:, 1]


def ahead_of(walk: TrueWalk, time_ns: IntArray) -> ComplexArray:
    """Direction in the plane between the phone's top and the view of its back camera."""
    x, y, _ = Rotation.from_quat(orientation_at(walk, time_ns)).apply((0.0, 1.0, -1.0)).T
    ahead: ComplexArray = x + 1j * y
    return ahead


def without(recording: Recording, sensor: str) -> Recording:
    return Recording(recording.walk, recording.sensors.filter(pl.col("sensor") != sensor), recording.trajectory)


def test_rows_have_the_schema_and_cover_the_walk(walked: Recording) -> None:
    found = windows_of(walked)
    assert dict(found.table.schema) == dict(SCHEMAS["imu_windows"])
    assert found.dropped == {}
    assert found.table["window_id"].to_list() == [f"walk/imu/{number:06d}" for number in range(23)]
    assert found.table["start_ns"].diff().drop_nulls().unique().to_list() == [SECOND_NS]
    assert set(found.table["rate_hz"]) == {100.0}
    for name in ("accelerometer", "gyroscope"):
        assert set(found.table[name].list.len()) == {300}
    for name in ("sigma_start", "sigma_end"):
        assert set(found.table[name]) == {0.1}


@pytest.mark.parametrize("gyroscope", ["GYRO", "GYRO_UN"])
@pytest.mark.parametrize("gravity", ["GAME_ROT", "filter"])
def test_displacement_and_heading_are_the_true_ones(walked: Recording, gravity: str, gyroscope: str) -> None:
    log = without(walked, "GAME_ROT") if gravity == "filter" else walked
    table = windows_of(without(log, "GYRO") if gyroscope == "GYRO_UN" else log).table
    true = true_way(walked.walk, table["start_ns"].to_numpy())
    way = plane(table, "displacement_x", "displacement_y") * np.exp(1j * table["heading_rad"].to_numpy())
    assert np.abs(way - true).max() < 0.02
    assert np.abs(plane(table, "x_end", "y_end") - plane(table, "x_start", "y_start") - true).max() < 0.002
    turned = table["heading_change_rad"].to_numpy()
    start_ns = table["start_ns"].to_numpy()
    really = ahead_of(walked.walk, start_ns + SECOND_NS) / ahead_of(walked.walk, start_ns)
    assert np.abs(np.angle(np.exp(1j * turned) / really)).max() < 0.02
    next_heading = table["heading_rad"].to_numpy()[:-1] + turned[:-1] - table["heading_rad"].to_numpy()[1:]
    assert np.abs(np.angle(np.exp(1j * next_heading))).max() < 0.03
    assert np.abs(samples(table, "gyroscope")[..., 2].mean(axis=1) - turned).max() < 0.08  # rolling turns "ahead", too


def test_a_phone_that_never_tilts_does_not_tell_its_cameras_axes() -> None:
    assert windows_of(recorded(make_test_walk(SECONDS, still=True))).dropped == {"no_heading": 23}


@pytest.mark.parametrize(("gravity", "tolerance"), [("GAME_ROT", 0.02), ("filter", 0.2)])
def test_the_frame_is_level_and_starts_with_the_phone_ahead(walked: Recording, gravity: str, tolerance: float) -> None:
    table = windows_of(without(walked, "GAME_ROT") if gravity == "filter" else walked).table
    start_ns, force = table["start_ns"].to_numpy(), samples(table, "accelerometer").mean(axis=1)
    assert force[:, 2].mean() == pytest.approx(GRAVITY_M_S2, abs=0.02)
    velocity = [true_way(walked.walk, moment - 5_000_000, 0.01) / 0.01 for moment in (start_ns, start_ns + SECOND_NS)]
    gained = (velocity[1] - velocity[0]) * np.exp(-1j * table["heading_rad"].to_numpy())
    assert np.abs(force[:, 0] + 1j * force[:, 1] - gained).max() < tolerance
    ahead = ahead_of(walked.walk, start_ns) * np.exp(-1j * table["heading_rad"].to_numpy())
    assert np.abs(np.angle(ahead)).max() < 0.02


def test_twice_integrated_the_accelerometer_gives_the_way() -> None:
    walk = make_test_walk(SECONDS)
    seconds = (walk.time_ns - walk.time_ns[0]) / 1e9
    swing = np.column_stack((2 * np.sin(0.8 * seconds), np.sin(1.1 * seconds), 0 * seconds))
    walk = replace(walk, position=walk.position + swing)
    table = windows_of(recorded(walk)).table
    start_ns, heading = table["start_ns"].to_numpy(), np.exp(1j * table["heading_rad"].to_numpy())
    velocity = (true_way(walk, start_ns - 5_000_000, 0.01)) / 0.01
    force = samples(table, "accelerometer")
    accelerated = force[..., 0] + 1j * force[..., 1]
    gained = np.cumsum(accelerated, axis=1) / 100 - accelerated / 200  # velocity at the middle of each sample
    way = velocity / heading + gained.mean(axis=1)
    assert np.abs(way - plane(table, "displacement_x", "displacement_y")).max() < 0.02


@pytest.mark.parametrize("quarters", [0, 1, 2, 3])
@pytest.mark.parametrize("held", ["upright", "flat", "landscape"])
def test_the_cameras_axes_are_found_however_the_phone_is_held(walked: Recording, held: str, quarters: int) -> None:
    turned = {
        "upright": Rotation.identity(),
        "flat": Rotation.from_euler("x", -1.2),
        "landscape": Rotation.from_euler("z", np.pi / 2),
    }[held]
    holding = (Rotation.from_quat(walked.walk.orientation) * turned).as_quat()
    walk = replace(walked.walk, orientation=holding)
    table = windows_of(recorded(walk, camera=Rotation.from_euler("z", quarters * np.pi / 2))).table
    assert table.height == 23
    start_ns = table["start_ns"].to_numpy()
    assert np.abs(np.angle(ahead_of(walk, start_ns) * np.exp(-1j * table["heading_rad"].to_numpy()))).max() < 0.03
    way = plane(table, "displacement_x", "displacement_y") * np.exp(1j * table["heading_rad"].to_numpy())
    assert np.abs(way - true_way(walk, start_ns)).max() < 0.02
    if held != "landscape":
        ahead = plane(table, "displacement_x", "displacement_y").sum()
        assert abs(np.angle(ahead)) < 0.35


def test_late_pose_stamps_are_set_back(walked: Recording) -> None:
    found = windows_of(recorded(walked.walk, lag_s=0.12)).table
    true = true_way(walked.walk, found["start_ns"].to_numpy())
    x = position_at(walked.walk, found["start_ns"].to_numpy())[:, 0]
    assert np.abs(found["x_start"].to_numpy() - x).max() < 0.02
    way = plane(found, "displacement_x", "displacement_y") * np.exp(1j * found["heading_rad"].to_numpy())
    assert np.abs(way - true).max() < 0.03


def dropped_where(recording: Recording, span_s: tuple[float, float], table: str, *changes: pl.Expr) -> ImuWindows:
    """Change the rows of one table within a span of time (s since the start)."""
    low, high = (WALK_START_NS + round(second * 1e9) for second in span_s)
    inside = pl.col("time_ns").is_between(low, high)
    tables = {"sensors": recording.sensors, "trajectory": recording.trajectory}
    names = {change.meta.output_name(): change for change in changes}
    tables[table] = tables[table].with_columns(
        **{name: pl.when(inside).then(change).otherwise(pl.col(name)) for name, change in names.items()}
    )
    return imu_windows(tables["sensors"], tables["trajectory"], "walk", DEFAULTS)


def starts_s(found: ImuWindows) -> list[int]:
    return [round((start - WALK_START_NS) / 1e9 - 0.1) for start in found.table["start_ns"]]


@pytest.mark.parametrize("cause", ["tracking_lost", "break", "invalid", "gap"])
def test_no_window_lies_across_readings_without_position(walked: Recording, cause: str) -> None:
    found = dropped_where(walked, (5.5, 7.7), "sensors", pl.lit(cause).alias("status"))
    assert found.dropped == {cause: 3}
    assert starts_s(found) == [second for second in range(23) if second not in (5, 6, 7)]


def test_a_window_begins_and_ends_between_readings_with_positions(walked: Recording) -> None:
    found = dropped_where(walked, (5.08, 5.0999), "sensors", pl.lit("tracking_lost").alias("status"))
    assert found.dropped == {"tracking_lost": 2}
    assert starts_s(found) == [second for second in range(23) if second not in (4, 5)]


@pytest.mark.parametrize(("degrees", "cause"), [(10, None), (20, "orientations_disagree"), (40, "no_heading")])
def test_a_camera_whose_up_is_not_the_phones(walked: Recording, degrees: float, cause: str | None) -> None:
    tilted = recorded(walked.walk, camera=Rotation.from_euler("x", degrees, degrees=True))
    assert windows_of(tilted).dropped == ({} if cause is None else {cause: 23})


def test_no_window_lies_across_lost_frames_or_floors_or_jumps(walked: Recording) -> None:
    lost = [pl.lit(None, dtype=pl.Float64).alias(name) for name in ("x", "y", "qx", "qy", "qz", "qw")]
    found = dropped_where(walked, (5.5, 5.6), "trajectory", pl.lit("tracking_lost").alias("status"), *lost)
    assert found.dropped == {"tracking_lost": 1}
    found = dropped_where(walked, (12.5, 30.0), "sensors", (pl.col("floor") + 1).alias("floor"))
    assert found.dropped == {"floor_change": 1}
    assert found.table["floor"].to_list() == [0] * 12 + [1] * 10
    found = dropped_where(walked, (12.5, 30.0), "trajectory", (pl.col("x") + 0.4).alias("x"))
    assert found.dropped == {"jump": 1}


@pytest.mark.parametrize("sensor", ["ACC", "GYRO", "GAME_ROT"])
def test_a_silent_sensor_drops_the_window(walked: Recording, sensor: str) -> None:
    low, high = (WALK_START_NS + round(second * 1e9) for second in (5.4, 5.55))
    silent = (pl.col("sensor") == sensor) & pl.col("time_ns").is_between(low, high)
    found = windows_of(Recording(walked.walk, walked.sensors.filter(~silent), walked.trajectory))
    assert found.dropped == {"sensor_gap": 1}
    assert 5 not in starts_s(found)


@pytest.mark.parametrize(("sensor", "cause"), [("ACC", "no_accelerometer"), ("GYRO", "no_gyroscope")])
def test_missing_sensors_and_clocks_are_told(walked: Recording, sensor: str, cause: str) -> None:
    rest = without(without(walked, sensor), "GYRO_UN")
    assert windows_of(rest).dropped == {cause: 23}
    shifted = pl.when(pl.col("sensor") == sensor).then(pl.col("time_ns") + 3600 * SECOND_NS).otherwise("time_ns")
    elsewhere = walked.sensors.with_columns(time_ns=shifted)
    found = windows_of(Recording(walked.walk, elsewhere, walked.trajectory))
    assert found.dropped == {"other_clock": 23}
    assert found.table.is_empty()


@pytest.mark.parametrize("offset_s", [-9, 3, 6])
def test_sensors_of_a_clock_that_only_seems_the_same_give_no_window(walked: Recording, offset_s: int) -> None:
    shifted = walked.sensors.with_columns(pl.col("time_ns") + offset_s * SECOND_NS)
    found = windows_of(Recording(walked.walk, shifted, walked.trajectory))
    assert found.table.is_empty()
    assert set(found.dropped) == {"sensor_gap", "no_heading"}


def test_orientations_that_contradict_drop_the_windows(walked: Recording) -> None:
    turned = Rotation.from_euler("z", 2.0) * Rotation.from_quat(
        walked.trajectory.select("qx", "qy", "qz", "qw").to_numpy()
    )
    late = pl.col("time_ns") > WALK_START_NS + 12 * SECOND_NS
    trajectory = walked.trajectory.with_columns(
        **{
            name: pl.when(late).then(pl.Series(column)).otherwise(pl.col(name))
            for name, column in zip(("qx", "qy", "qz", "qw"), turned.as_quat().T, strict=True)
        }
    )
    found = windows_of(Recording(walked.walk, walked.sensors, trajectory))
    assert set(found.dropped) == {"orientations_disagree"}
    assert starts_s(found)[0] == 0
    assert starts_s(found)[-1] == 22
    assert 11 not in starts_s(found)


def test_length_step_and_rate_are_as_asked(walked: Recording) -> None:
    table = windows_of(walked, length_s=2.0, step_s=0.5, rate_hz=50.0).table
    assert table["start_ns"].diff().drop_nulls().unique().to_list() == [SECOND_NS // 2]
    assert set(table["gyroscope"].list.len()) == {300}
    true = true_way(walked.walk, table["start_ns"].to_numpy(), 2.0)
    assert np.abs(np.abs(plane(table, "displacement_x", "displacement_y")) - np.abs(true)).max() < 0.02


def test_odd_rows_of_the_sensors_do_not_count(walked: Recording) -> None:
    odd = walked.sensors.filter(pl.col("sensor") == "ACC").head(200).tail(3)
    noise = pl.concat(
        [
            odd.with_columns(pl.lit(float("nan")).alias("v1"), pl.col("time_ns") + 1),
            odd.with_columns(pl.lit(500.0).alias("v1"), pl.lit("duplicate").alias("status")),
        ]
    )
    mixed = pl.concat([noise, walked.sensors.reverse()])
    found = windows_of(Recording(walked.walk, mixed, walked.trajectory))
    assert found.table.equals(windows_of(walked).table)


def test_nothing_mapped_and_nothing_walked(walked: Recording) -> None:
    none = [pl.lit(None, dtype=pl.Float64).alias(name) for name in ("x", "y", "qx", "qy", "qz", "qw")]
    unmapped = Recording(
        walked.walk,
        walked.sensors.with_columns(status=pl.lit("no_mapping")),
        walked.trajectory.with_columns(*none, status=pl.lit("no_mapping")),
    )
    assert windows_of(unmapped).dropped == {"no_mapping": 23}
    for empty in (walked.trajectory.clear(), walked.trajectory.head(5)):
        found = windows_of(Recording(walked.walk, walked.sensors, empty))
        assert found.table.is_empty()
        assert found.dropped == {}


def test_a_frame_far_ahead_makes_no_windows_up_to_it(walked: Recording) -> None:
    ahead = walked.trajectory.tail(1).with_columns(pl.col("time_ns") + 10**17)
    found = windows_of(Recording(walked.walk, walked.sensors, pl.concat([walked.trajectory, ahead])))
    assert found.table.height == 23
    assert sum(found.dropped.values()) <= 2


FIELD = np.array([12.0, 16.0, -44.0])
"""In the building: 20 microtesla level, 44 down."""
TURNS = Rotation.from_euler("zyx", np.random.default_rng(3).uniform(-60, 60, (50, 3)), degrees=True)
"""The phone, turned about at random: phone to building."""


def sensors(*names: str, step_ns: int = S // 50, positions: bool = True) -> pl.DataFrame:
    """One second of these sensors, all at the same times, as the phone turns about."""
    of = {
        "MAG": TURNS.inv().apply(FIELD),
        "MAG_UN": np.hstack((TURNS.inv().apply(FIELD) + 30.0, np.full((50, 3), 30.0))),
        "ROT": TURNS.as_quat(),
        "GAME_ROT": (Rotation.from_euler("z", 70, degrees=True) * TURNS).as_quat(),
    }
    rows: list[dict[str, Any]] = []
    for number in range(50):
        for name in names:
            values = dict(zip(("v1", "v2", "v3", "v4", "v5", "v6"), of[name][number].tolist(), strict=False))
            place = {"x": 0.02 * number, "y": 3.0, "z": 1.3, "sigma": 0.2} if positions else {"x": None}
            rows.append({"sensor": name, "time_ns": START_NS + number * step_ns} | values | place)
    return labelled("sensors", rows)


def windows(table: pl.DataFrame) -> pl.DataFrame:
    return magnetic_windows(table, "slug", "main", 0.5)


@pytest.mark.parametrize("names", [("MAG", "GAME_ROT"), ("MAG", "ROT"), ("MAG_UN", "ROT"), ("MAG", "MAG_UN", "ROT")])
def test_strength_and_parts_do_not_depend_on_how_the_phone_is_turned(names: tuple[str, ...]) -> None:
    found = windows(sensors(*names))
    assert list(found.schema.items()) == list(SCHEMAS[MAGNETIC].items())
    assert found["window_id"].to_list() == ["slug/magnetic/000000", "slug/magnetic/000001"]
    assert found["readings"].to_list() == [25, 25]
    for name, expected in (("norm_ut", np.linalg.norm(FIELD)), ("vertical_ut", -44.0), ("horizontal_ut", 20.0)):
        assert found[name].to_list() == pytest.approx([expected, expected], abs=1e-6)
    assert found["norm_deviation_ut"].to_list() == pytest.approx([0, 0], abs=1e-6)
    assert found["x"].to_list() == pytest.approx([0.24, 0.74])
    assert found.select("y", "z", "sigma", "floor", "building", "device", "session").row(0) == pytest.approx(
        (3.0, 1.3, 0.2, 1, "main", "LG", "slug")
    )
    assert (found["start_ns"][0], found["end_ns"][0]) == (START_NS, START_NS + 24 * (S // 50))


def test_parts_are_unknown_without_tilt_or_far_from_it() -> None:
    found = windows(sensors("MAG"))
    assert found["vertical_ut"].null_count() == found["horizontal_ut"].null_count() == 2
    assert found["norm_ut"].to_list() == pytest.approx([np.linalg.norm(FIELD)] * 2)
    both = sensors("MAG", "ROT")
    late = both.filter((pl.col("sensor") == "MAG") | (pl.col("time_ns") > START_NS + 9 * S // 10))
    assert windows(late)["vertical_ut"].is_null().to_list() == [True, False]


def test_gravity_of_the_accelerometer_where_no_rotation_is_logged() -> None:
    still = labelled(
        "sensors",
        [
            {"sensor": name, "time_ns": START_NS + number * S // 50, "v1": values[0], "v2": values[1], "v3": values[2]}
            for number in range(50)
            for name, values in (("ACC", (0.0, 9.81, 0.0)), ("GYRO", (0.0, 0.0, 0.0)), ("MAG", (20.0, -44.0, 0.0)))
        ],
    )
    found = windows(still)
    assert found["vertical_ut"].to_list() == pytest.approx([-44.0, -44.0])
    assert found["horizontal_ut"].to_list() == pytest.approx([20.0, 20.0])


def test_no_position_without_label_and_no_window_without_magnetometer() -> None:
    found = windows(sensors("MAG", "ROT", positions=False))
    assert found.select("x", "y", "z", "sigma", "floor").null_count().row(0) == (2, 2, 2, 2, 2)
    for table in (sensors("ROT"), sensors("ROT").clear()):
        assert len(windows(table)) == 0
        assert list(windows(table).schema.items()) == list(SCHEMAS[MAGNETIC].items())


def test_readings_that_are_no_numbers_or_repeated_do_not_count() -> None:
    table = sensors("MAG", "ROT").with_columns(
        v1=pl.when(pl.int_range(pl.len()) == 0).then(float("nan")).otherwise("v1"),
        status=pl.when(pl.int_range(pl.len()) == 2).then(pl.lit("duplicate")).otherwise("status"),
    )
    assert windows(table)["readings"].to_list() == [23, 25]
