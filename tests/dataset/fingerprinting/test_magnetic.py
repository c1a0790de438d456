from __future__ import annotations

from typing import Any

import numpy as np
import polars as pl
import pytest
from scipy.spatial.transform import Rotation

from tests.dataset.labelled_rows import START_NS, S, labelled
from vislam2tag.dataset.fingerprinting.magnetic import magnetic_windows
from vislam2tag.dataset.schema import MAGNETIC, SCHEMAS

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
