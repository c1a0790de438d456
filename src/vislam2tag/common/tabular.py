"""Results as tables: ``to_frame`` for Polars and ``to_pandas`` for pandas, and a short form at a prompt.

A table has a row for each entry of a list, or of a mapping, whose keys are then the column ``name``. Parts of an entry
are columns of their own, ``sigma_median`` for ``sigma.median``. Lists of further records, arrays and tables within an
entry are not in the table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from datetime import date, timedelta
from enum import Enum
from functools import partial
from numbers import Number
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, TypeAlias, get_args, get_origin

from pydantic import BaseModel

from vislam2tag.common.errors import UsageError, import_extra
from vislam2tag.common.records import Record
from vislam2tag.core.notebook import Summarised

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl

SUMMARY = "summary"
"""The table of one row with all single values of a result."""
_LONGEST = 40
_MOST_FACTS = 8
_NO_FACTS = frozenset(("program", "version", "slug", "fingerprint"))
Frames: TypeAlias = "Mapping[str, Callable[[], pl.DataFrame]]"
"""Functions that make tables, by name."""


class Tabular:
    """A result with tables."""

    main_table: ClassVar[str] = SUMMARY
    """The table that ``to_frame()`` returns if none is named."""

    def table_names(self) -> tuple[str, ...]:
        """Names of the tables for ``to_frame`` and ``to_pandas``, the main one first."""
        names = self._frames()
        return (self.main_table, *(name for name in names if name != self.main_table))

    def to_frame(self, table: str | None = None) -> pl.DataFrame:
        """Return a table as a Polars data frame: the main one, or the one named.

        Raises UsageError, with the names that exist, for an unknown name.
        """
        frames = self._frames()
        name = self.main_table if table is None else table
        if name not in frames:
            raise UsageError(
                f"a {type(self).__name__} has no table '{name}'; its tables are: {', '.join(self.table_names())}"
            )
        return frames[name]()

    def to_pandas(self, table: str | None = None) -> pd.DataFrame:
        """Return the same table for pandas.

        Raises UsageError, which names the extra to install, if pandas or pyarrow is missing.
        """
        for package in ("pandas", "pyarrow"):
            import_extra(package)
        return self.to_frame(table).to_pandas()

    def _frames(self) -> Frames:
        """Functions that make the tables, by name."""
        values = _values(self)
        listed = {
            name: value
            for name, value in values.items()
            if isinstance(value, Mapping | list | tuple) and _is_table(self, name, value)
        }
        single = {name: value for name, value in values.items() if name not in listed}
        return {
            SUMMARY: partial(row_frame, [single], ()),
            **{name: partial(listed_frame, value, _columns(self, name)) for name, value in listed.items()},
        }


class TabularResult(Summarised, Tabular):
    """A dataclass that a function returns: it shows a few facts instead of all its content."""

    def _facts(self) -> dict[str, object]:
        values = {name: value for name, value in _values(self).items() if name not in _NO_FACTS}
        facts = {name: fact for name, value in values.items() if (fact := _fact(value)) is not None}
        return dict(list(facts.items())[:_MOST_FACTS])


class Result(TabularResult, Record):
    """A record that a command returns: it shows a few facts instead of all its content."""

    def __str__(self) -> str:
        """The same line."""
        return repr(self)


def _fact(value: object) -> object | None:
    """A value in a word or two; None if it is not one."""
    if isinstance(value, str | int | float | Enum):
        text = str(value)
        return text if text and len(text) <= _LONGEST else None
    return len(value) if isinstance(value, Sequence) and value else None


def _values(record: object) -> dict[str, object]:
    """The fields of a record or a dataclass by name."""
    if isinstance(record, BaseModel):
        return {name: getattr(record, name) for name in type(record).model_fields}
    assert is_dataclass(record)
    return {field.name: getattr(record, field.name) for field in fields(record)}


def _is_record(value: object) -> bool:
    return isinstance(value, BaseModel) or (is_dataclass(value) and not isinstance(value, type))


def _is_table(owner: object, name: str, value: Mapping[object, object] | Sequence[object]) -> bool:
    """Whether a field is a mapping, or a list of records, which an empty list is by its type."""
    if not isinstance(value, Mapping) and value:
        return all(map(_is_record, value))
    return isinstance(value, Mapping) or bool(_columns(owner, name))


def _columns(owner: object, name: str) -> tuple[str, ...]:
    """Columns of the records in a list, by the type of the field; empty if it is not such a list."""
    kind = type(owner).model_fields[name].annotation if isinstance(owner, BaseModel) else None
    if get_origin(kind) not in (list, tuple):
        return ()
    inside = get_args(kind)[0]
    return tuple(inside.model_fields) if isinstance(inside, type) and issubclass(inside, BaseModel) else ()


def listed_frame(value: object, columns: Iterable[str] = ()) -> pl.DataFrame:
    """Make a table of a list of records, or of a mapping; if it is empty, it has these columns."""
    if not isinstance(value, Mapping):
        assert isinstance(value, Sequence)
        return row_frame(map(_values, value), columns)
    rows = [{"name": key, **(_mapped(each) or {"value": each})} for key, each in value.items()]
    return row_frame(rows, ("name", "value"))


def column_frame(columns: Mapping[str, object]) -> pl.DataFrame:
    """Make a table of columns; null for numbers that are NaN."""
    import polars as pl

    return pl.DataFrame(columns).fill_nan(None)


def _mapped(value: object) -> dict[str, object]:
    """The parts of a mapping or a record by name; empty for another value."""
    if isinstance(value, Mapping):
        return {str(name): part for name, part in value.items()}
    return _values(value) if _is_record(value) else {}


def row_frame(rows: Iterable[Mapping[str, object]], columns: Iterable[str]) -> pl.DataFrame:
    """A data frame of rows; without any, it has these columns."""
    import polars as pl

    flat = [dict(_cells(row, "")) for row in rows]
    if not flat:
        return pl.DataFrame(schema=list(columns))
    names = list(dict.fromkeys(name for row in flat for name in row))
    return pl.DataFrame(
        {name: pl.Series(name, [row.get(name) for row in flat], strict=False) for name in names},
    )


def _cells(row: Mapping[str, object], prefix: str) -> Iterator[tuple[str, object]]:
    """Name and value of each cell; a part called ``value`` has the name of what it is a part of."""
    for name, value in row.items():
        full = prefix.removesuffix("_") if prefix and name == "value" else f"{prefix}{name}"
        if parts := _mapped(value):
            yield from _cells(parts, f"{full}_")
        elif isinstance(value, Enum | Path):
            yield full, str(value.value if isinstance(value, Enum) else value)
        elif _fits_a_cell(value):
            yield full, list(value) if isinstance(value, tuple | set | frozenset) else value


def _fits_a_cell(value: object) -> bool:
    if isinstance(value, list | tuple | set | frozenset):
        return all(map(_fits_a_cell, value))
    return value is None or isinstance(value, str | Number | date | timedelta)
