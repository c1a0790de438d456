from __future__ import annotations

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.dataset.splitting.splits import block_of, near_blocks

METRES = st.floats(-40, 40, allow_nan=False)


def items_of(points: list[tuple[int, float, float]]) -> pl.DataFrame:
    return pl.DataFrame(
        points, schema={"floor": pl.Int32, "x": pl.Float64, "y": pl.Float64}, orient="row"
    ).with_columns(building=pl.lit(""))


@given(st.lists(st.tuples(st.integers(0, 1), METRES, METRES), max_size=30), st.floats(1, 15))
def test_each_point_lies_in_its_block(points: list[tuple[int, float, float]], side_m: float) -> None:
    found = block_of(items_of(points), side_m)
    for axis, index in (("x", "column"), ("y", "line")):
        low = found[index] * side_m
        assert (found[axis] >= low - 1e-9).all()
        assert (found[axis] <= low + side_m + 1e-9).all()


@pytest.mark.parametrize(
    ("side_m", "guard_m"), [(2.0, 0.5), (2.0, 9.0), (5.0, 0.0), (5.0, 3.0), (10.0, 3.0), (10.0, 15.0)]
)
@pytest.mark.parametrize("seed", range(4))
def test_the_ring_against_brute_force(side_m: float, guard_m: float, seed: int) -> None:
    places = np.random.default_rng(seed).uniform(-25, 25, (120, 2)).round(1)
    items = block_of(items_of([(index % 2, x, y) for index, (x, y) in enumerate(places.tolist())]), side_m)
    blocks = items.head(12).select("building", "floor", "column", "line").unique()
    found = near_blocks(items, blocks, side_m, guard_m)
    expected = []
    for row in items.iter_rows(named=True):
        distances = [
            np.hypot(
                max(block["column"] * side_m - row["x"], 0, row["x"] - (block["column"] + 1) * side_m),
                max(block["line"] * side_m - row["y"], 0, row["y"] - (block["line"] + 1) * side_m),
            )
            for block in blocks.filter(floor=row["floor"]).iter_rows(named=True)
        ]
        expected.append(any(distance < guard_m for distance in distances))
    assert found.to_list() == expected
    assert (guard_m == 0) == (sum(expected) == 0)
