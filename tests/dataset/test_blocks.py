from __future__ import annotations

import numpy as np
import polars as pl
from hypothesis import given, settings
from hypothesis import strategies as st

from vislam2tag.dataset.blocks import block_of, near_blocks

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


@given(
    st.lists(st.tuples(st.integers(0, 1), METRES, METRES), min_size=1, max_size=25),
    st.sampled_from((2.0, 5.0, 10.0)),
    st.sampled_from((0.0, 0.5, 3.0, 12.0)),
)
@settings(max_examples=30, deadline=None)
def test_the_ring_against_brute_force(points: list[tuple[int, float, float]], side_m: float, guard_m: float) -> None:
    items = block_of(items_of(points), side_m)
    blocks = items.head(len(points) // 2).select("building", "floor", "column", "line").unique()
    found = near_blocks(items, blocks, side_m, guard_m)
    for row, near in zip(items.iter_rows(named=True), found, strict=True):
        distances = [
            np.hypot(
                max(block["column"] * side_m - row["x"], 0, row["x"] - (block["column"] + 1) * side_m),
                max(block["line"] * side_m - row["y"], 0, row["y"] - (block["line"] + 1) * side_m),
            )
            for block in blocks.filter(floor=row["floor"]).iter_rows(named=True)
        ]
        assert near == any(distance < guard_m for distance in distances)
