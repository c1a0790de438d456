"""Times of tables in memory: every usual kind is read, and what is not a time is named."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pandas as pd
import polars as pl
import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.sessions.given_times import given_times, outside_walk

FIRST_NS = 708_634_175_464_000
NS = [FIRST_NS, FIRST_NS + 33_000_000, FIRST_NS + 66_000_000]
NOON_NS = int(datetime(2021, 12, 20, 12, tzinfo=UTC).timestamp()) * 10**9


@pytest.mark.parametrize(
    ("header", "values"),
    [
        ("time_ns", NS),
        ("time_ns", [str(ns) for ns in NS]),
        ("timestamp", [float(ns) for ns in NS]),
        ("time_us", [ns // 1000 for ns in NS]),
        ("time_ms", [ns / 1e6 for ns in NS]),
        ("timestamp", [ns / 1e9 for ns in NS]),
        ("timestamp", [f"{ns / 1e9:.6f}" for ns in NS]),
    ],
)
def test_numbers_are_read_in_their_unit(header: str, values: list[object]) -> None:
    assert np.allclose(given_times(pl.DataFrame({header: values}), "poses").ns, NS, rtol=0, atol=200)


@pytest.mark.parametrize(
    ("values", "local"),
    [
        (pd.Series(pd.to_datetime([NOON_NS, NOON_NS + 10**9])), True),
        (pd.Series(pd.to_datetime([NOON_NS, NOON_NS + 10**9], utc=True)).dt.tz_convert("Europe/Berlin"), False),
        (pd.Series(["2021-12-20T12:00:00", "2021-12-20T12:00:01"]), True),
        (pd.Series(["2021-12-20 13:00:00+01:00", "2021-12-20 13:00:01+01:00"]), False),
        (pd.Series(["2021-12-20T12:00:00Z", "2021-12-20T12:00:01Z"]), False),
    ],
)
def test_dates_are_read_and_without_a_zone_as_utc(values: pd.Series, local: bool) -> None:
    times = given_times(pl.from_pandas(pd.DataFrame({"timestamp": values})), "poses")
    assert (times.ns.to_list(), times.local) == ([NOON_NS, NOON_NS + 10**9], local)


def test_missing_times_are_null() -> None:
    for values in ([1, None, 3], [1.0, float("nan"), 3.0], ["1", "", "3"]):
        times = given_times(pl.DataFrame({"t": values}), "poses")
        assert times.ns.to_list() == [1, None, 3]
        assert [found.lines for found in times.missing("poses")] == [(2,)]


@pytest.mark.parametrize(
    ("header", "values", "message"),
    [
        ("time_ns", [0, -1], "table, column time_ns, row 2: expected a time, not negative; found -1"),
        ("time_ns", [3, 0.5], "row 2: expected whole numbers, nanoseconds; found 0.5. .* for example to time_s"),
        ("t", ["1", "noon"], "table, column t, row 2: expected a time, not negative; found 'noon'"),
        ("t", [1.0, float("inf")], "table, column t, row 2: expected a time, not negative; found inf"),
        ("t", [True], "table, column t: expected numbers, date-times or dates as text"),
        ("t", [0.5, 33.5, 66.5], "times such as 0.5 state no unit, and do not fit as seconds; rename .* to time_ms"),
        ("t", ["2021-12-20T12:00:00Z", "2021-12-20T12:00:00"], "row 2: '2021-12-20T12:00:00' has no time zone"),
        ("time_s", [FIRST_NS], "table, column time_s: 708634175464000 is too large for a time in s; correct the unit"),
        ("a", [1], "table: the column time_ns is missing; it has a"),
    ],
)
def test_what_is_not_a_time_is_named(header: str, values: list[object], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        given_times(pl.DataFrame({header: values}, strict=False), "table")


def test_a_table_beside_the_walk_names_the_factor_that_fits() -> None:
    walk_ns = np.array(NS)

    def said(values: list[int]) -> str:
        return outside_walk(given_times(pl.DataFrame({"time_ns": values}), "table"), "table", walk_ns)

    assert said(NS) == said([NS[1]]) == said([]) == ""
    assert said([ns // 1000 for ns in NS]).endswith("multiplied by 1,000: rename the column to time_us")
    assert said([ns // 10**6 for ns in NS]).endswith("multiplied by 1,000,000: rename the column to time_ms")
    assert "divided by 1,000: " in said([ns * 1000 for ns in NS])
    assert said([7, 9]).startswith(
        f"table, column time_ns: no row is within the walk. Its times are 7 to 9 ns, those "
        f"of the walk {NS[0]} to {NS[2]} ns"
    )
