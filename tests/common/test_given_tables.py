"""Tables of other libraries as Polars data frames."""

from __future__ import annotations

import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.common.given_tables import GivenTable, frame_of, times_in_text, unix_ns

COLUMNS = {"time_ns": [1, 2], "note": ["a", None]}


@pytest.mark.parametrize(
    "table", [pl.DataFrame(COLUMNS), pl.LazyFrame(COLUMNS), pd.DataFrame(COLUMNS), pa.table(COLUMNS)]
)
def test_tables_of_every_library_are_the_same(table: GivenTable) -> None:
    assert frame_of(table, "table").to_dict(as_series=False) == COLUMNS


def test_an_index_with_a_name_is_a_column() -> None:
    assert frame_of(pd.DataFrame(COLUMNS).set_index("time_ns"), "table").to_dict(as_series=False) == COLUMNS
    filtered = pd.DataFrame(COLUMNS).iloc[1:]
    assert frame_of(filtered, "table").columns == ["time_ns", "note"]


def test_something_else_is_refused() -> None:
    with pytest.raises(UsageError, match="table: expected a Polars, pandas or Arrow table"):
        frame_of("poses.csv", "table")  # type: ignore[arg-type]


def test_times_with_a_zone_are_unix_time() -> None:
    times = pd.Series(pd.to_datetime(["2022-01-14T17:35:30+01:00"]))
    assert unix_ns(pl.from_pandas(times)).to_list() == [1642178130 * 10**9]
    assert unix_ns(pl.Series([5])).to_list() == [5]


def test_times_without_a_zone_are_text() -> None:
    times = pd.Series(pd.to_datetime(["2022-01-14T17:35:30.5"]))
    (text,) = times_in_text(pl.from_pandas(times)).to_list()
    assert pd.Timestamp(text) == times[0]
    assert times_in_text(pl.Series([5])).to_list() == [5]
