"""Positions as rows: known ones with all they have, unknown ones with nothing."""

from __future__ import annotations

import numpy as np

from tests.positioning.radio_world import STOREYS
from vislam2tag.pipeline.positioning.locate import LOCATED, located_table
from vislam2tag.positioning.scans.places import Positions


def test_known_and_unknown_rows() -> None:
    found = Positions(
        storeys=STOREYS,
        storey=np.array([2, 1, 0]),
        xy=np.array([[1.23456, -2.0], [3.0, 4.0], [5.0, 6.0]]),
        z=np.array([np.nan, 3.0, 1.0]),
        storey_probability=np.array([[0.1, 0.2, 0.7], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
        radius_68_m=np.full(3, 2.0),
        radius_95_m=np.full(3, 4.0),
    ).without(np.array([False, False, True]))
    table = located_table(np.array(["a", "b", "c"]), found)
    assert dict(table.schema) == LOCATED
    assert table.rows() == [
        ("a", "ok", "west", 0, 1.235, -2.0, None, 2.0, 4.0, 0.7),
        ("b", "ok", "east", 1, 3.0, 4.0, 3.0, 2.0, 4.0, 1.0),
        ("c", "unknown", *[None] * 8),
    ]
    assert located_table(np.array([], dtype=np.str_), found[:0]).height == 0
