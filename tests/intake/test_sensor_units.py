"""Units of sensors are those that the columns' names state or that the magnitude shows, else values are not used."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from vislam2tag.core.arrays import FloatArray
from vislam2tag.intake.sensor_units import SENSOR_UNITS, in_sensor_unit, stated_unit, with_axes_in_place

RNG = np.random.default_rng(3)
GRAVITY = np.array((1.0, 3.0, 9.28))
WALKS: dict[str, FloatArray] = {
    "ACC": GRAVITY + RNG.normal(0, 1.5, (2000, 3)),
    "GYRO": RNG.normal(0, 0.6, (2000, 3)),
    "MAG": np.array((20.0, -10.0, 40.0)) + RNG.normal(0, 4, (2000, 3)),
    "PRESSURE": 1003 + RNG.normal(0, 0.1, (200, 1)),
}
UNITS = [(sensor, unit) for sensor, rule in SENSOR_UNITS.items() for unit in rule.units]


@pytest.mark.parametrize(("sensor", "name"), UNITS)
def test_a_stated_unit_is_converted_and_reported(sensor: str, name: str) -> None:
    true, unit = WALKS[sensor], SENSOR_UNITS[sensor].units[name]
    for stated in unit.names:
        values, odd = in_sensor_unit(true / unit.factor, sensor, stated, "t.csv")
        assert values == pytest.approx(true)
        assert [each.kind for each in odd] == ([] if unit.factor == 1 else ["sensor_unit"])


@pytest.mark.parametrize(("sensor", "name"), [each for each in UNITS if SENSOR_UNITS[each[0]].units[each[1]].detected])
def test_a_unit_is_detected_by_magnitude(sensor: str, name: str) -> None:
    true, factor = WALKS[sensor], SENSOR_UNITS[sensor].units[name].factor
    values, odd = in_sensor_unit(true / factor, sensor, None, "t.csv")
    assert values == pytest.approx(true)
    assert [name in each.message for each in odd] == ([] if factor == 1 else [True])


@pytest.mark.parametrize(
    ("sensor", "values", "stated"),
    [
        ("ACC", WALKS["ACC"] - GRAVITY, None),
        ("ACC", WALKS["ACC"] - GRAVITY, "m/s2"),
        ("ACC", WALKS["ACC"] / 9.81, "m/s2"),
        ("ACC", WALKS["ACC"] * 1671, None),
        ("GYRO", WALKS["GYRO"] * 57.3, "rad/s"),
        ("GYRO", WALKS["GYRO"] * 6, None),
        ("MAG", WALKS["MAG"] * 1e6, None),
        ("PRESSURE", WALKS["PRESSURE"] - 1003, None),
    ],
)
def test_values_that_are_not_usual_in_a_unit_are_not_used(sensor: str, values: FloatArray, stated: str | None) -> None:
    made, (finding,) = in_sensor_unit(values, sensor, stated, "t.csv")
    assert made is None
    assert (finding.kind, finding.count) == ("unknown_unit", len(values))


def test_a_unit_of_another_sensor_or_unknown_text_is_not_a_stated_unit() -> None:
    assert stated_unit("ACC", [None, "left", "deg/s"]) is None
    assert stated_unit("GYRO", ["left", "deg / s"]) == "deg/s"


GYRO, ACC = ["gyro_x", "gyro_y", "gyro_z"], ["acc_x", "acc_y", "acc_z"]


@pytest.mark.parametrize("factor", [1.0, 1 / 9.80665])
def test_columns_of_gyroscope_and_accelerometer_that_are_exchanged_are_read_the_other_way_round(factor: float) -> None:
    right = pl.DataFrame(np.hstack((WALKS["GYRO"], WALKS["ACC"] * factor)), [*GYRO, *ACC])
    wrong = right.rename(dict(zip([*GYRO, *ACC], [*ACC, *GYRO], strict=True)))
    made, (finding,) = with_axes_in_place(wrong, GYRO, ACC, "band.csv")
    assert made.select(right.columns).equals(right)
    assert (finding.kind, finding.count) == ("exchanged_columns", 2000)


@pytest.mark.parametrize(
    ("rates", "accelerations"),
    [
        (WALKS["GYRO"], WALKS["ACC"]),
        (np.degrees(WALKS["GYRO"]), WALKS["ACC"]),
        (WALKS["GYRO"], WALKS["ACC"] - GRAVITY),
        (WALKS["GYRO"] * 0.001, WALKS["ACC"]),  # at rest
        (WALKS["ACC"], WALKS["ACC"]),
        (WALKS["ACC"][:80], WALKS["GYRO"][:80]),
    ],
)
def test_columns_of_motion_that_may_be_right_stay(rates: FloatArray, accelerations: FloatArray) -> None:
    rows = pl.DataFrame(np.hstack((rates, accelerations)), [*GYRO, *ACC])
    assert with_axes_in_place(rows, GYRO, ACC, "band.csv")[1] == []
    assert with_axes_in_place(rows, GYRO, [], "band.csv")[1] == []
