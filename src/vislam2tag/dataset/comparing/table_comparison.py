"""Where two tables with the same keys differ."""

from __future__ import annotations

from collections.abc import Sequence

import polars as pl

from vislam2tag.common.records import Record

POSITIONS = (("x", "y"), ("x_median", "y_median"), ("x_start", "y_start"), ("x_end", "y_end"), ("x_coord", "y_coord"))
"""Pairs of columns that are a position: their difference is a distance."""
ROWS_NAMED = 5
_ROW = "__row"


class ColumnDifference(Record):
    """One column (or the two of a position) whose values differ in some rows."""

    column: str
    rows: int
    greatest: float | None
    """Greatest difference in the column's unit; None where values are no numbers, or one is missing."""
    where: str
    """Key of the row with the greatest difference, else of the first that differs."""


class TableDifferences(Record):
    """What differs between two tables of one session (or of the whole set)."""

    session: str
    table: str
    matched: int
    """Rows whose key is in both."""
    missing: int
    """Rows that only the first has."""
    extra: int
    """Rows that only the second has."""
    missing_rows: tuple[str, ...] = ()
    """Keys of the first few of them."""
    extra_rows: tuple[str, ...] = ()
    missing_columns: tuple[str, ...] = ()
    """Columns that only the first has, or whose type differs."""
    extra_columns: tuple[str, ...] = ()
    columns: tuple[ColumnDifference, ...] = ()

    @property
    def same(self) -> bool:
        """Whether nothing differs."""
        return not (self.missing or self.extra or self.missing_columns or self.extra_columns or self.columns)


def compare_tables(
    session: str, table: str, one: pl.DataFrame, other: pl.DataFrame, keys: Sequence[str], tolerance: float
) -> TableDifferences:
    """Compare row by row; rows with equal keys are matched in their order.

    Positions may lie ``tolerance`` metres apart, and numbers that are no whole numbers differ by as much in their own
    unit; times, whole numbers and texts must be equal. A missing value equals a missing value only.
    """
    both = [name for name in one.columns if name in other.columns and _alike(one.schema[name], other.schema[name])]
    missing, extra, pairs = _matched(one.select(both), other.select(both), keys)
    found = [_difference(pairs, columns, keys, tolerance) for columns in _compared(both, keys)]
    return TableDifferences(
        session=session,
        table=table,
        matched=pairs.height,
        missing=missing.height,
        extra=extra.height,
        missing_rows=_names(missing, keys),
        extra_rows=_names(extra, keys),
        missing_columns=tuple(name for name in one.columns if name not in both),
        extra_columns=tuple(name for name in other.columns if name not in both),
        columns=tuple(difference for difference in found if difference is not None),
    )


def _alike(one: pl.DataType, other: pl.DataType) -> bool:
    """Whether values of two types can be compared: widths of numbers do not matter."""
    return one == other or (one.is_numeric() and other.is_numeric())


def _matched(
    one: pl.DataFrame, other: pl.DataFrame, keys: Sequence[str]
) -> tuple[pl.DataFrame, pl.DataFrame, pl.DataFrame]:
    """Rows of one, rows of the other, and pairs (the other's columns with ``_other``) in the order of one."""
    on = [*keys, _ROW]
    numbered = pl.int_range(pl.len()).over(keys).alias(_ROW)
    one, other = one.with_columns(numbered), other.with_columns(numbered)
    join = {"on": on, "nulls_equal": True, "maintain_order": "left"}
    return (
        one.join(other, how="anti", **join),  # type: ignore[arg-type]
        other.join(one, how="anti", **join),  # type: ignore[arg-type]
        one.join(other, how="inner", suffix="_other", **join),  # type: ignore[arg-type]
    )


def _names(rows: pl.DataFrame, keys: Sequence[str]) -> tuple[str, ...]:
    return tuple(" ".join(str(value) for value in row) for row in rows.head(ROWS_NAMED).select(keys).iter_rows())


def _compared(columns: Sequence[str], keys: Sequence[str]) -> list[tuple[str, ...]]:
    """Positions as pairs, every other column that is no key by itself."""
    positions = [pair for pair in POSITIONS if set(pair) <= set(columns)]
    used = {name for pair in positions for name in pair} | set(keys)
    return [*positions, *((name,) for name in columns if name not in used)]


def _difference(
    pairs: pl.DataFrame, columns: tuple[str, ...], keys: Sequence[str], tolerance: float
) -> ColumnDifference | None:
    """Compare one column, or the two of a position."""
    sizes = [_size(pairs, name) for name in columns]
    size = pl.sum_horizontal(pl.Series(size) ** 2 for size in sizes).sqrt() if len(sizes) > 1 else pl.lit(sizes[0])
    rows = pairs.select(*keys, size=size).filter(pl.col("size") > tolerance)
    if rows.is_empty():
        return None
    finite = rows.filter(pl.col("size").is_finite())
    first = (rows if finite.is_empty() else finite.sort("size", descending=True, maintain_order=True)).head(1)
    greatest = None if finite.is_empty() else float(first["size"].item())
    return ColumnDifference(
        column=", ".join(columns), rows=rows.height, greatest=greatest, where=_names(first, keys)[0]
    )


def _size(pairs: pl.DataFrame, name: str) -> pl.Series:
    """How much a column differs in each pair of rows; infinite where values cannot be subtracted and are unequal."""
    one, other = pairs[name], pairs[f"{name}_other"]
    unequal = one.ne_missing(other)
    size = pl.select(pl.when(unequal).then(float("inf")).otherwise(0.0)).to_series()
    if one.dtype.is_float() or other.dtype.is_float():
        apart = (one.cast(pl.Float64) - other.cast(pl.Float64)).abs()
        if name.endswith("_deg"):
            apart = pl.select(pl.min_horizontal(apart, (360 - apart).abs())).to_series()
    elif isinstance(one.dtype, pl.List) and one.dtype.inner.is_float():
        apart = _greatest_in_lists(one, other)
    else:
        return size
    return pl.select(
        pl.when(unequal & apart.is_not_nan()).then(apart.fill_null(float("inf"))).otherwise(size)
    ).to_series()


def _greatest_in_lists(one: pl.Series, other: pl.Series) -> pl.Series:
    """Greatest difference between two lists of numbers of one length; null where lengths differ."""
    lists = pl.DataFrame({"one": one, "other": other}).with_row_index("row")
    equal = lists.filter(pl.col("one").list.len() == pl.col("other").list.len()).explode("one", "other")
    greatest = equal.group_by("row").agg(apart=(pl.col("one") - pl.col("other")).abs().max().cast(pl.Float64))
    return lists.join(greatest, on="row", how="left", maintain_order="left")["apart"]
