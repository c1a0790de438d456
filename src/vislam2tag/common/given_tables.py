"""Tables that a caller has in memory, of Polars, pandas, Arrow or others, as Polars data frames."""

from __future__ import annotations

import sys
from os import PathLike
from typing import TYPE_CHECKING, Protocol, TypeAlias, TypeGuard

import polars as pl

from vislam2tag.common.errors import UsageError, first_line, import_extra

if TYPE_CHECKING:
    import pandas as pd


class _ArrowStream(Protocol):
    """A table that gives its columns by the Arrow PyCapsule interface: of pandas, PyArrow, DuckDB and others."""

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...


GivenTable: TypeAlias = pl.DataFrame | pl.LazyFrame | _ArrowStream
"""Anything that Polars makes a data frame of: tables of Polars, pandas, PyArrow, DuckDB and others."""


def frame_of(table: GivenTable, name: str) -> pl.DataFrame:
    """Make a data frame of a table, whose columns stay; a pandas index that has a name becomes a column.

    Raises UsageError, with ``name``, if it is not a table, and MissingExtraError if pandas is there without pyarrow.
    """
    if isinstance(table, str | bytes | PathLike):
        raise UsageError(f"{name}: expected a Polars, pandas or Arrow table; found the path or text {table!r}")
    try:
        if isinstance(table, pl.LazyFrame):
            return table.collect()
        return _of_pandas(table) if _is_of_pandas(table) else pl.DataFrame(table)
    except (TypeError, ValueError, ImportError, pl.exceptions.PolarsError) as error:
        raise UsageError(f"{name}: expected a Polars, pandas or Arrow table: {first_line(error)}") from error


def _is_of_pandas(table: object) -> TypeGuard[pd.DataFrame]:
    pandas = sys.modules.get("pandas")  # a table of pandas cannot exist before pandas is imported
    return pandas is not None and isinstance(table, pandas.DataFrame)


def _of_pandas(table: pd.DataFrame) -> pl.DataFrame:
    import_extra("pyarrow")
    named = [name for name in table.index.names if name is not None and name not in table.columns]
    frame = table.reset_index(level=named) if named else table
    return pl.from_pandas(frame)


def unix_ns(values: pl.Series) -> pl.Series:
    """Turn date-times with a zone into Unix time, ns; other values are returned unchanged."""
    zoned = isinstance(values.dtype, pl.Datetime) and values.dtype.time_zone is not None
    return values.dt.epoch("ns") if zoned else values


def times_in_text(values: pl.Series) -> pl.Series:
    """As :func:`unix_ns`; date-times without a zone become text of ISO 8601, for which a zone may be given."""
    times = unix_ns(values)
    return times.dt.to_string("iso:strict") if isinstance(times.dtype, pl.Datetime) else times
