"""Results as tables of Polars and pandas."""

from __future__ import annotations

import sys
from typing import ClassVar

import pandas as pd
import polars as pl
import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result


class Figure(Record):
    value: float | None
    low: float | None = None


class Row(Record):
    name: str
    error_m: Figure
    tags: tuple[str, ...] = ()
    inner: list[Figure] = []


class Made(Result):
    main_table: ClassVar[str] = "rows"

    version: str = "1"
    sessions: int = 3
    rows: list[Row] = []
    shares: dict[str, float] = {}


MADE = Made(
    rows=[
        Row(name="a", error_m=Figure(value=1.5, low=1.0), tags=("x",), inner=[Figure(value=1.0)]),
        Row(name="b", error_m=Figure(value=None)),
    ],
    shares={"LG": 0.5},
)


def test_rows_are_flat_in_both_libraries() -> None:
    frame = MADE.to_frame()
    assert frame.drop("inner").to_dicts() == [
        {"name": "a", "error_m": 1.5, "error_m_low": 1.0, "tags": ["x"]},
        {"name": "b", "error_m": None, "error_m_low": None, "tags": []},
    ]
    found = MADE.to_pandas()
    assert isinstance(found, pd.DataFrame)
    assert found["name"].tolist() == ["a", "b"]
    assert found["error_m"].iloc[0] == 1.5
    assert pd.isna(found["error_m"].iloc[1])


def test_other_tables_are_named() -> None:
    assert MADE.table_names() == ("rows", "summary", "shares")
    assert MADE.to_frame("shares").rows() == [("LG", 0.5)]
    assert MADE.to_frame("summary").to_dicts() == [{"version": "1", "sessions": 3}]
    with pytest.raises(UsageError, match="a Made has no table 'walks'; its tables are: rows, summary, shares"):
        MADE.to_frame("walks")


def test_an_empty_table_has_its_columns() -> None:
    assert Made().to_frame().columns == ["name", "error_m", "tags", "inner"]
    assert Made().to_frame("shares").columns == ["name", "value"]


def test_it_shows_a_few_facts() -> None:
    assert repr(MADE) == str(MADE) == "Made(sessions: 3, rows: 2)"
    assert "<th>sessions</th><td>3</td>" in MADE._repr_html_()


@pytest.mark.parametrize("package", ["pandas", "pyarrow"])
def test_a_missing_package_names_the_extra(package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(UsageError, match=rf"needs {package}: pip install 'vislam2tag\[pandas\]'"):
        MADE.to_pandas()
    assert isinstance(MADE.to_frame(), pl.DataFrame)
