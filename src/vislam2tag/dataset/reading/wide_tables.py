"""Wide CSV tables: one row a fingerprint, one column an access point, 100 where it was not heard."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError, first_line
from vislam2tag.common.files.plain_files import plain
from vislam2tag.common.files.table_files import scan_csv
from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import ROWS_NAMED, Finding, Severity
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.sessions.tables.radio_text import GREATEST_DBM, LEAST_DBM

NOT_HEARD = 100.0
"""The level that stands for "not heard"; another that no radio measures is a fault."""
_ROWS_AT_ONCE = 2000
"""Rows of the wide table in memory at once; it holds some twenty times as many cells as levels heard."""


@dataclass(frozen=True)
class WideTable:
    """What a wide table holds.

    ``rows``: ``row`` (int64, 0-based) and the other columns asked for (null where the file lacks one that may lack).
    ``heard``: ``row``, ``bssid`` (the access point's column), ``rssi_dbm`` of each level, by row, then column.
    """

    rows: pl.DataFrame
    heard: pl.DataFrame
    access_points: tuple[str, ...]
    findings: tuple[Finding, ...]


def read_wide(path: Path, columns: Mapping[str, pl.DataType], is_access_point: Callable[[str], bool]) -> WideTable:
    """Read a wide table with a header. ``columns`` are the others to take, with their types.

    Columns that are neither are left out and reported. Raises DatasetError, naming file and line, where it has no
    access points or a cell is no number.
    """
    header = _top_line(path).split(",")
    return _read(path, tuple(name.strip().strip('"') for name in header), columns, is_access_point, has_header=True)


def read_matrix(path: Path) -> WideTable:
    """Read a table of levels alone, without a header; the columns are called WAP001, WAP002, ..."""
    count = len(_top_line(path).split(","))
    digits = max(3, len(str(count)))
    names = tuple(f"WAP{number:0{digits}d}" for number in range(1, count + 1))
    return _read(path, names, {}, lambda _: True, has_header=False)


def read_columns(path: Path, columns: Mapping[str, pl.DataType]) -> pl.DataFrame:
    """Read a comma separated table without a header that has exactly these columns.

    Raises DatasetError, naming file and line, where it has not, or a cell is no number.
    """
    width = len(_top_line(path).split(","))
    if width != len(columns):
        raise _wrong_width(path, 1, width, len(columns), f" ({', '.join(columns)})")
    table = pl.concat(_batches(path, columns, has_header=False))
    _refuse_short_lines(path, [row + 1 for row in table.to_series(-1).is_null().arg_true()], width)
    return table


def is_wide(path: Path, names: frozenset[str]) -> bool:
    """Whether a file is a CSV table whose header has all these columns."""
    try:
        return names <= {name.strip().strip('"') for name in _top_line(path).split(",")}
    except DatasetError:
        return False


def _top_line(path: Path) -> str:
    try:
        with plain(path).open(encoding="utf-8-sig") as file:
            line = file.readline().rstrip("\r\n")
    except (OSError, UnicodeDecodeError) as error:
        raise DatasetError(f"{path}: cannot be read as a table ({error}); expected comma separated text") from error
    if not line:
        raise DatasetError(f"{path}: is empty; expected a table with one row a fingerprint")
    return line


def _read(
    path: Path,
    header: tuple[str, ...],
    columns: Mapping[str, pl.DataType],
    is_access_point: Callable[[str], bool],
    *,
    has_header: bool,
) -> WideTable:
    access_points = tuple(name for name in header if name not in columns and is_access_point(name))
    if not access_points:
        raise DatasetError(f"{path}: line 1 names no access point; expected columns like WAP001 with levels in dBm")
    if len(set(header)) < len(header):
        twice = next(name for number, name in enumerate(header) if name in header[:number])
        raise DatasetError(f"{path}: line 1 has the column {twice} twice; expected each once")
    schema = {name: pl.Float32() if name in access_points else columns.get(name, pl.String()) for name in header}
    names = pl.Series("bssid", access_points, dtype=pl.String)
    first_row_line = 2 if has_header else 1
    rows, heard, short, odd = [], [], [], _OddLevels(first_row_line)
    first_row = 0
    for batch in _batches(path, schema, has_header=has_header):
        levels = batch.select(access_points).to_numpy()
        row, column, level = odd.sort_out(levels, first_row)
        heard.append(pl.DataFrame({"row": row + first_row, "bssid": names.gather(column), "rssi_dbm": level}))
        rows.append(batch.select(name for name in header if name in columns))
        short += [row + first_row + first_row_line for row in batch[header[-1]].is_null().arg_true()]
        first_row += batch.height
    if not first_row:
        raise DatasetError(f"{path}: holds no fingerprint; expected one row each")
    _refuse_short_lines(path, short, len(header))
    table = pl.concat(rows) if any(name in columns for name in header) else pl.DataFrame(height=first_row)
    lacking = [pl.lit(None, kind).alias(name) for name, kind in columns.items() if name not in header]
    numbered = table.with_columns(lacking).with_row_index("row").with_columns(pl.col("row").cast(pl.Int64))
    unknown = [name for name in header if name not in columns and name not in access_points]
    findings = (*odd.findings(path.name), *_unknown_columns(path.name, unknown))
    return WideTable(numbered, pl.concat(heard), access_points, findings)


def _batches(path: Path, schema: Mapping[str, pl.DataType], *, has_header: bool) -> Iterator[pl.DataFrame]:
    try:
        yield from scan_csv(path, schema=dict(schema), has_header=has_header).collect_batches(
            maintain_order=True, chunk_size=_ROWS_AT_ONCE
        )
    except pl.exceptions.PolarsError as error:
        raise _wrong_cell(path, schema, has_header=has_header) or DatasetError(
            f"{path}: cannot be read ({first_line(error)}); expected comma separated numbers"
        ) from error


def _wrong_cell(path: Path, schema: Mapping[str, pl.DataType], *, has_header: bool) -> DatasetError | None:
    """Say which cell of a table that cannot be parsed is wrong: the first, by line."""
    kinds = list(schema.items())
    with plain(path).open(encoding="utf-8-sig", errors="replace") as file:
        for number, line in enumerate(file, start=1):
            cells = line.rstrip("\r\n").split(",")
            if number == 1 and has_header:
                continue
            if len(cells) != len(kinds):
                return _wrong_width(path, number, len(cells), len(kinds))
            for cell, (name, kind) in zip(cells, kinds, strict=True):
                if kind.is_numeric() and not _is_number(cell):
                    return DatasetError(
                        f"{path}: line {number}, column {name}: '{cell}' is no number; correct the file"
                    )
    return None


def _refuse_short_lines(path: Path, lines: list[int], width: int) -> None:
    """Raise where a line whose last cell is empty has in truth too few of them."""
    if not lines:
        return
    wanted = set(lines)
    with plain(path).open(encoding="utf-8-sig", errors="replace") as file:
        for number, line in enumerate(file, start=1):
            if number in wanted and line.count(",") + 1 != width:
                raise _wrong_width(path, number, line.count(",") + 1, width)


def _wrong_width(path: Path, line: int, found: int, expected: int, names: str = "") -> DatasetError:
    return DatasetError(f"{path}: line {line} has {found} values, expected {expected}{names}; correct the file")


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


class _OddLevels:
    """Counts the levels that no phone reports and remembers their lines."""

    def __init__(self, first_row_line: int) -> None:
        self._first_row_line = first_row_line
        self._empty_lines: list[int] = []
        self._absurd_lines: list[int] = []
        self._empty = self._absurd = 0

    def sort_out(self, levels: FloatArray, first_row: int) -> tuple[IntArray, IntArray, FloatArray]:
        """Row, column and level (h,) of what was heard, by row, then column, of a batch of rows."""
        column, row = np.divmod(np.flatnonzero(levels.T != NOT_HEARD), len(levels))  # columns lie together in memory
        order = np.argsort(row, kind="stable")
        row, column = row[order], column[order]
        level = levels[row, column]
        empty = np.isnan(level)
        measured = (level >= LEAST_DBM) & (level <= GREATEST_DBM)
        absurd = ~empty & ~measured
        self._empty += int(empty.sum())
        self._absurd += int(absurd.sum())
        self._empty_lines += (np.unique(row[empty]) + first_row + self._first_row_line).tolist()
        self._absurd_lines += (np.unique(row[absurd]) + first_row + self._first_row_line).tolist()
        return row[measured], column[measured], level[measured]

    def findings(self, file: str) -> Iterator[Finding]:
        """One for each kind of odd level."""
        odd: tuple[tuple[FindingKind, int, list[int], str], ...] = (
            ("empty_levels", self._empty, self._empty_lines, "cells are empty"),
            (
                "absurd_levels",
                self._absurd,
                self._absurd_lines,
                f"levels are not between {LEAST_DBM:g} and {GREATEST_DBM:g} dBm",
            ),
        )
        for kind, count, lines, what in odd:
            if count:
                message = f"{what}; they count as not heard"
                yield Finding(kind=kind, file=file, count=count, message=message, lines=tuple(lines[:ROWS_NAMED]))


def _unknown_columns(file: str, names: list[str]) -> Iterator[Finding]:
    if names:
        shown = ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")
        message = f"columns that are not known are left out: {shown}"
        yield Finding(kind="unknown_columns", file=file, count=len(names), message=message, severity=Severity.INFO)
