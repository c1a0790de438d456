from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.walkable.hand_made import space_of


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_walls_enclose_the_area_on_their_left(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mask = np.kron(rng.random((5, 6)) < 0.6, np.ones((8, 8))).astype(np.bool_)
    walls = space_of(mask).walls
    x0, y0, x1, y1 = walls[:, 0, 0], walls[:, 0, 1], walls[:, 1, 0], walls[:, 1, 1]
    enclosed = float((x0 * y1 - x1 * y0).sum()) / 2
    area = float(mask.sum()) * 0.01
    perimeter = float(np.linalg.norm(walls[:, 1] - walls[:, 0], axis=1).sum())
    assert abs(enclosed - area) <= 0.08 * perimeter + 1e-9


def test_straight_walls_are_one_segment() -> None:
    mask = np.zeros((60, 100), dtype=np.bool_)
    mask[10:50, 10:90] = True
    lengths = np.linalg.norm(np.diff(space_of(mask).walls, axis=1)[:, 0], axis=1)
    assert (lengths > 3.8).sum() == 4
