"""Square blocks of a floor, and what lies within a ring around some of them."""

from __future__ import annotations

import itertools
import math

import numpy as np
import polars as pl

from vislam2tag.core.arrays import BoolArray, FloatArray

_KEY = ("building", "floor", "column", "line")


def block_of(items: pl.DataFrame, side_m: float) -> pl.DataFrame:
    """Add the block of each ``x``, ``y`` (m, BCS): its ``column`` along x and ``line`` along y, from the origin."""
    return items.with_columns(
        column=(pl.col("x") / side_m).floor().cast(pl.Int64), line=(pl.col("y") / side_m).floor().cast(pl.Int64)
    )


def near_blocks(items: pl.DataFrame, blocks: pl.DataFrame, side_m: float, guard_m: float) -> pl.Series:
    """Tell which items (n,), of :func:`block_of`, lie nearer than ``guard_m`` to one of the blocks of their floor."""
    near = np.zeros(items.height, dtype=bool)
    if guard_m > 0:
        reach = math.ceil(guard_m / side_m)
        for column, line in itertools.product(range(-reach, reach + 1), repeat=2):
            beside = items.with_columns(pl.col("column") + column, pl.col("line") + line)
            near |= _among(beside, blocks) & (_distance_m(beside, side_m) < guard_m)
    return pl.Series("near", near)


def _among(items: pl.DataFrame, blocks: pl.DataFrame) -> BoolArray:
    known = blocks.select(_KEY).with_columns(known=pl.lit(True))
    found = items.select(_KEY).join(known, on=_KEY, how="left", maintain_order="left", nulls_equal=True)
    return found["known"].fill_null(False).to_numpy()


def _distance_m(items: pl.DataFrame, side_m: float) -> FloatArray:
    """Distance (n,) from each item to the block that its row names."""
    ways = []
    for axis, index in (("x", "column"), ("y", "line")):
        low = items[index].to_numpy() * side_m
        place = items[axis].to_numpy()
        ways.append(np.maximum(np.maximum(low - place, place - low - side_m), 0.0))
    distance: FloatArray = np.hypot(ways[0], ways[1])
    return distance
