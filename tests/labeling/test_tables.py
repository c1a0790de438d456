"""Labelled tables: one output row for each raw row, in file order, nulls where there is no position.

A trajectory as a table: each row with its own floor, and back.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.labeling.settings import LabelRule, LabelSettings
from vislam2tag.labeling.tables import SCHEMAS, label_readings, mark_uncertain, trajectory_of, trajectory_table
from vislam2tag.site.model import SessionKey


@pytest.fixture
def walk() -> Trajectory:
    n = 11
    position = np.column_stack((np.arange(n) * 1.0, np.zeros(n), np.full(n, np.nan)))
    status = np.zeros(n, dtype=np.int8)
    status[8:] = Status.AFTER_LAST_LANDMARK
    position[8:] = np.nan
    return Trajectory(
        np.arange(n, dtype=np.int64) * 100, position, np.full((n, 4), np.nan), np.full((n, 2, 2), np.nan), status
    )


def table(time_ns: list[int], repeated: list[bool]) -> pl.DataFrame:
    return pl.DataFrame(
        {"row": range(1, len(time_ns) + 1), "time_ns": time_ns, "value": [0.5] * len(time_ns), "repeated": repeated}
    )


def test_rows_order_and_nulls(walk: Trajectory) -> None:
    raw = table([350, 50, 50, 950, 5000], [False, False, True, False, False])
    labelled = label_readings(raw, walk, LabelSettings())
    assert labelled.columns == ["row", "time_ns", "value", "x", "y", "z", "sigma", "status"]
    assert labelled["row"].to_list() == [1, 2, 3, 4, 5]
    assert labelled["status"].to_list() == ["ok", "ok", "duplicate", "after_last_landmark", "outside_frames"]
    assert labelled["x"].to_list() == [3.5, 0.5, None, None, None]
    assert labelled["z"].to_list() == [None] * 5
    assert labelled["sigma"].null_count() == 5


def test_readings_within_excluded_spans_are_invalid_their_ends_excepted(walk: Trajectory) -> None:
    raw = table([99, 100, 299, 300, 300], [False, False, False, False, True])
    labelled = label_readings(raw, walk, LabelSettings(), [(100, 300), (5000, 6000)])
    assert labelled["status"].to_list() == ["ok", "invalid", "invalid", "ok", "duplicate"]
    assert labelled["x"].to_list() == [0.99, None, None, 3.0, None]


def test_next_frame_rule(walk: Trajectory) -> None:
    labelled = label_readings(table([350], [False]), walk, LabelSettings(rule=LabelRule.NEXT_FRAME))
    assert labelled["x"].to_list() == [4.0]


def test_zero_rows_keep_their_types(walk: Trajectory) -> None:
    empty = table([1], [False]).clear()
    labelled = label_readings(empty, walk, LabelSettings())
    assert labelled.schema == label_readings(table([350], [False]), walk, LabelSettings()).schema
    assert len(labelled) == 0


def test_a_reading_is_uncertain_by_its_own_sigma(walk: Trajectory) -> None:
    sigma_m = np.linspace(0.0, 1.0, len(walk.time_ns))
    unsure = replace(walk, covariance_bcs=np.eye(2) * sigma_m[:, None, None] ** 2)
    labelled = label_readings(table([440, 490, 510, 600], [False] * 4), unsure, LabelSettings(max_sigma_m=0.5))
    assert labelled["sigma"].to_list() == pytest.approx([0.44, 0.49, 0.51, 0.6])
    assert labelled["status"].to_list() == ["ok", "ok", "uncertain", "uncertain"]
    assert labelled["x"].to_list() == pytest.approx([4.4, 4.9, 5.1, 6.0])


SIGMAS = st.lists(st.one_of(st.just(float("nan")), st.floats(0.0, 5.0)), min_size=1, max_size=20)


def trajectory(sigma_m: list[float], status: list[int] | None = None) -> Trajectory:
    n = len(sigma_m)
    return Trajectory(
        np.arange(n, dtype=np.int64),
        np.random.default_rng(0).normal(size=(n, 3)),
        np.zeros((n, 4)),
        np.eye(2) * np.square(sigma_m)[:, None, None],
        np.array(status or [Status.OK] * n, dtype=np.int8),
    )


@given(SIGMAS, st.floats(0.01, 4.0))
def test_exactly_the_frames_above_the_limit_are_uncertain_and_nothing_is_lost(
    sigma_m: list[float], limit: float
) -> None:
    walk = trajectory(sigma_m)
    marked = mark_uncertain(walk, limit)
    np.testing.assert_array_equal(marked.status == Status.UNCERTAIN, walk.sigma_m > limit)
    assert set(marked.status) <= {Status.OK, Status.UNCERTAIN}
    np.testing.assert_array_equal(marked.position_bcs, walk.position_bcs)
    np.testing.assert_array_equal(marked.sigma_m, walk.sigma_m)
    assert (walk.status == Status.OK).all()


@given(SIGMAS)
def test_infinite_marks_nothing(sigma_m: list[float]) -> None:
    assert (mark_uncertain(trajectory(sigma_m), float("inf")).status == Status.OK).all()


def test_only_ok_becomes_uncertain() -> None:
    causes = [status for status in Status if status != Status.OK]
    walk = trajectory([9.0] * len(causes), list(causes))
    np.testing.assert_array_equal(mark_uncertain(walk, 0.5).status, walk.status)


def test_rows_have_their_own_floor_and_come_back_with_it() -> None:
    unknown = np.full((3, 4), np.nan)
    covariance = np.full((3, 2, 2), np.nan)
    position = np.arange(9.0).reshape(3, 3)
    walk = Trajectory(
        np.arange(3), position, unknown, covariance, np.zeros(3, dtype=np.int8), floor=np.array([1, 1, 2])
    )
    key = SessionKey(1, "LG", "walk")
    table = trajectory_table(key, walk)
    assert table["floor"].to_list() == [1, 1, 2]
    assert list(table.schema.items()) == list(SCHEMAS["trajectory"].items())
    back = trajectory_of(table)
    assert back.floor.tolist() == [1, 1, 2]
    assert back.position_bcs.tolist() == position.tolist()
    one_floor = trajectory_table(key, replace(walk, floor=np.empty(0, dtype=np.int64)))
    assert one_floor["floor"].to_list() == [1, 1, 1]
