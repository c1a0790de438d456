"""Labelled tables: one output row for each raw row, in file order, nulls where there is no position."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.labeling.readings import label_readings
from vislam2tag.labeling.settings import LabelRule, LabelSettings


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
