"""A trajectory as a table: each row with its own floor, and back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.core.tracks import Trajectory
from vislam2tag.labeling.schemas import SCHEMAS
from vislam2tag.labeling.tables import trajectory_of, trajectory_table
from vislam2tag.site.model import SessionKey


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
