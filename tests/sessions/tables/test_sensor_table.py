from __future__ import annotations

import math

import polars as pl
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.common.findings import Finding
from vislam2tag.sessions.tables.sensor_table import SENSOR_SCHEMA, sensor_table


def table_of(readings: list[tuple[int, str]], first_value: float = 0.5) -> tuple[pl.DataFrame, dict[str, Finding]]:
    rows = [(i + 1, t, name, first_value, 0.0, 0.0, 0.0, 0.0, 0.0) for i, (t, name) in enumerate(readings)]
    frame = pl.DataFrame(rows, schema={"row": pl.Int64, **SENSOR_SCHEMA}, orient="row")
    table, findings = sensor_table(frame, "sensors.csv")
    return table, {finding.kind: finding for finding in findings}


def test_columns_are_in_the_order_of_the_contract() -> None:
    table, findings = table_of([(10, "ACC"), (10, "GYRO")])
    assert table.columns == ["row", "time_ns", "repeated", "sensor", "v1", "v2", "v3", "v4", "v5", "v6"]
    assert not table["repeated"].any()
    assert not findings


def test_sensors_may_interleave_out_of_order() -> None:
    _, findings = table_of([(10, "ACC"), (8, "GYRO"), (20, "ACC"), (18, "GYRO")])
    assert not findings


def test_repeated_and_backward_readings_of_one_sensor_are_reported_and_kept() -> None:
    table, findings = table_of([(10, "ACC"), (10, "ACC"), (20, "ACC"), (15, "ACC"), (10, "ACC"), (10, "GYRO")])
    assert table["repeated"].to_list() == [False, True, False, False, True, False]
    assert findings["repeated_rows"].lines == (2, 5)
    assert findings["backward_times"].lines == (4,)


def test_values_that_are_not_finite_are_kept_and_reported() -> None:
    table, findings = table_of([(10, "ACC"), (20, "ACC")], math.inf)
    assert table["v1"].to_list() == [math.inf, math.inf]
    assert findings["non_finite_values"].lines == (1, 2)


@given(st.lists(st.tuples(st.integers(0, 12), st.sampled_from(("ACC", "GYRO"))), max_size=40))
def test_repeated_agrees_with_a_plain_reading(readings: list[tuple[int, str]]) -> None:
    table, _ = table_of(readings)
    assert table["repeated"].to_list() == [reading in readings[:i] for i, reading in enumerate(readings)]
