"""Wide CSV tables: one row for each fingerprint, one column for each access point, a stated level if not heard."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError, first_line
from vislam2tag.common.files.given_files import plain
from vislam2tag.common.files.table_files import scan_csv
from vislam2tag.common.findings import ROWS_NAMED, Finding, Severity, finding_if
from vislam2tag.intake import fillers
from vislam2tag.intake.cells import separator_of, with_numbers
from vislam2tag.intake.level_scales import NOT_HEARD, SIGNAL_STRENGTH, LevelRange, LevelScale, other_levels
from vislam2tag.intake.readings import level_findings
from vislam2tag.intake.time_units import ROUNDED, rounded_step

_ROWS_AT_ONCE = 2000
"""Rows of the wide table in memory at once; there are about twenty times as many cells as heard levels."""


@dataclass(frozen=True)
class LevelRules:
    """What a format and the user say about the levels in a table."""

    not_heard: float = NOT_HEARD
    """The level that means "not heard" in the format."""
    strength: LevelRange = SIGNAL_STRENGTH
    said: float | None = None
    """The number that means "not heard" according to the user; no other is looked for then."""
    scale: LevelScale | None = None
    """What the numbers mean according to the user; the format's own level for "not heard" does not hold then."""

    @property
    def stated(self) -> float:
        """The number that means "not heard"; NaN if nothing says so."""
        formats = self.not_heard if self.scale is None else float("nan")
        return formats if self.said is None else self.said


USUAL = LevelRules()


@dataclass(frozen=True)
class WideTable:
    """Content of a wide table.

    ``rows``: ``row`` (int64, 0-based) and the other requested columns (null if an optional one is missing).
    ``heard``: ``row``, ``bssid`` (the access point's column), ``rssi_dbm`` of each level, by row, then column.
    """

    rows: pl.DataFrame
    heard: pl.DataFrame
    access_points: tuple[str, ...]
    findings: tuple[Finding, ...]


def read_wide(
    path: Path,
    columns: Mapping[str, pl.DataType],
    is_access_point: Callable[[str], bool],
    rules: LevelRules = USUAL,
    times: frozenset[str] = frozenset(),
) -> WideTable:
    """Read a wide table with a header. ``columns`` are the other columns to read, with their types.

    Columns of ``times`` that are rounded are empty and reported; other rounded numbers are errors.

    Unknown columns are skipped and reported. Raises DatasetError with file and line if there are no access points or a
    cell is not a number, and with a question if a level may mean "not heard".
    """
    known = {name.lower(): name for name in columns}

    def usual(name: str) -> str:
        """The name as the format writes it, where the table differs by case only."""
        upper = name if is_access_point(name) else name.upper()
        return known.get(name.lower(), upper if is_access_point(upper) else name)

    header = tuple(map(usual, _top_fields(path)))
    return _read(path, header, columns, is_access_point, rules, times, has_header=True)


def read_matrix(path: Path, rules: LevelRules = USUAL) -> WideTable:
    """Read a table of levels only, without a header; columns are named WAP001, WAP002, ...; raises as above."""
    count = len(_top_fields(path))
    digits = max(3, len(str(count)))
    names = tuple(f"WAP{number:0{digits}d}" for number in range(1, count + 1))
    return _read(path, names, {}, lambda _: True, rules, frozenset(), has_header=False)


def read_columns(path: Path, columns: Mapping[str, pl.DataType]) -> pl.DataFrame:
    """Read a comma separated table without a header that has exactly these columns.

    Raises DatasetError with file and line if it has other columns, or a cell is not a number.
    """
    width = len(_top_fields(path))
    if width != len(columns):
        raise _wrong_width(path, 1, width, len(columns), f" ({', '.join(columns)})")
    table = pl.concat(_batches(path, columns, has_header=False))
    _refuse_short_lines(path, [row + 1 for row in table.to_series(-1).is_null().arg_true()], width)
    return table


def is_wide(path: Path, names: frozenset[str]) -> bool:
    """Whether a file is a CSV table whose header has all these columns."""
    try:
        return {name.lower() for name in names} <= {name.lower() for name in _top_fields(path)}
    except DatasetError:
        return False


def _top_fields(path: Path) -> list[str]:
    line = _top_line(path)
    return [name.strip().strip('"') for name in line.split(separator_of(line))]


def _top_line(path: Path) -> str:
    try:
        with plain(path).open(encoding="utf-8-sig") as file:
            line = file.readline().rstrip("\r\n")
    except (OSError, UnicodeDecodeError) as error:
        raise DatasetError(f"{path}: cannot be read as a table ({error}); expected comma separated text") from error
    if not line:
        raise DatasetError(f"{path}: the file is empty; expected a table with one row for each fingerprint")
    return line


def _read(
    path: Path,
    header: tuple[str, ...],
    columns: Mapping[str, pl.DataType],
    is_access_point: Callable[[str], bool],
    rules: LevelRules,
    times: frozenset[str],
    *,
    has_header: bool,
) -> WideTable:
    access_points = tuple(name for name in header if name not in columns and is_access_point(name))
    if not access_points:
        raise DatasetError(f"{path}: line 1 names no access point; expected columns such as WAP001 with levels in dBm")
    if len(set(header)) < len(header):
        twice = next(name for number, name in enumerate(header) if name in header[:number])
        raise DatasetError(f"{path}: the column {twice} is twice in line 1")
    schema = {name: pl.Float32() if name in access_points else columns.get(name, pl.String()) for name in header}
    first_line = 2 if has_header else 1
    names = pl.Series("bssid", access_points, dtype=pl.String)
    rows, heard, gaps, short = [], [], [], []
    first_row = empty = 0
    rounded: dict[str, str] = {}
    for batch in _batches(path, schema, has_header=has_header, times=times, rounded=rounded):
        levels = batch.select(access_points).to_numpy()
        column, row = np.divmod(np.flatnonzero(rules.stated != levels.T), len(levels))  # columns are together in memory
        order = np.argsort(row, kind="stable")
        row, column = row[order], column[order]
        level = levels[row, column]
        known = ~np.isnan(level)
        empty += int((~known).sum())
        gaps.append(np.unique(row[~known])[:ROWS_NAMED] + first_row + first_line)
        cells = {"row": row[known] + first_row, "bssid": names.gather(column[known]), "rssi_dbm": level[known]}
        heard.append(pl.DataFrame(cells))
        rows.append(batch.select(name for name in header if name in columns))
        short += [row + first_row + first_line for row in batch[header[-1]].is_null().arg_true()]
        first_row += batch.height
    if not first_row:
        raise DatasetError(f"{path}: contains no fingerprint; expected one row for each")
    _refuse_short_lines(path, short, len(header))
    table = pl.concat(rows) if any(name in columns for name in header) else pl.DataFrame(height=first_row)
    lacking = [pl.lit(None, kind).alias(name) for name, kind in columns.items() if name not in header]
    numbered = table.with_columns(lacking).with_row_index("row").with_columns(pl.col("row").cast(pl.Int64))
    unknown = [name for name in header if name not in columns and name not in access_points]
    cells_heard = pl.concat(heard)
    not_heard = first_row * len(access_points) - cells_heard.height
    counts = CellCounts(len(access_points), empty, not_heard - empty)
    measured, odd, _ = measured_levels(path, cells_heard, counts, first_line, rules)
    lines = np.concatenate(gaps)[:ROWS_NAMED].tolist()
    message = "cells are empty; they count as not heard"
    if empty:
        odd.insert(0, Finding(kind="empty_levels", file=path.name, count=empty, message=message, lines=tuple(lines)))
    odd += [_rounded(path, name, example, first_row) for name, example in rounded.items()]
    numbered = numbered.with_columns(pl.lit(None, columns[name]).alias(name) for name in rounded)
    return WideTable(numbered, measured, access_points, (*odd, *unknown_columns(path, unknown)))


def _rounded(path: Path, name: str, example: str, rows: int) -> Finding:
    message = f"column {name}: times such as {example} are rounded and not used; {ROUNDED}"
    return Finding(kind="rounded_times", file=path.name, count=rows, message=message, severity=Severity.WARNING)


@dataclass(frozen=True)
class CellCounts:
    """Numbers of access points, of empty cells, and of those with the level that is stated as "not heard"."""

    access_points: int
    empty: int
    stated: int


def measured_levels(
    path: Path, heard: pl.DataFrame, counts: CellCounts, first_line: int, rules: LevelRules
) -> tuple[pl.DataFrame, list[Finding], float]:
    """Keep the measured cells; report a filler and levels out of range.

    ``first_line`` is that of the first row. The last result is the level, dBm, that was found to mean "not heard"; NaN
    if none was. Raises DatasetError if levels are not in dBm, or one may mean "not heard".
    """
    if rules.scale is not None:
        heard = heard.with_columns(rules.scale.dbm(pl.col("rssi_dbm").cast(pl.Float64)).cast(pl.Float32))
    filler = fillers.filler_of(heard, counts.access_points, counts.empty + counts.stated, rules.strength)
    measured, findings = _without_filler(path, heard, filler, rules)
    found = filler.level if findings else float("nan")
    if rules.said is not None and not counts.stated and not np.isnan(rules.said):
        findings.append(fillers.never_not_heard(path.name, rules.said, _in_file(filler, rules)))
    if (other := other_levels(measured["rssi_dbm"])) is not None:
        raise DatasetError(f"{path}: {'' if rules.scale is None else 'with --levels, '}{other.question}")
    lines = measured.select("rssi_dbm", row=pl.col("row") + first_line)
    absurd = level_findings(lines, path.name, "these cells count as not heard", rules.strength)
    findings += [each.model_copy(update={"lines": tuple(dict.fromkeys(each.lines))}) for each in absurd]
    if rules.said is None and not findings and measured.height and not counts.empty + counts.stated:
        findings.append(fillers.all_heard(path.name, measured["row"].n_unique()))
    return measured.filter(rules.strength.contains(pl.col("rssi_dbm"))), findings, found


def _in_file(filler: fillers.Filler, rules: LevelRules) -> fillers.Filler:
    """A filler with the file's own numbers."""
    if rules.scale is None:
        return filler
    number = rules.scale.number
    return replace(filler, level=number(filler.level), nearest=number(filler.nearest))


def _without_filler(
    path: Path, heard: pl.DataFrame, filler: fillers.Filler, rules: LevelRules
) -> tuple[pl.DataFrame, list[Finding]]:
    """Drop the cells with the filler, which is reported by the file's own number."""
    if rules.said is not None or filler.judgement is fillers.Judgement.NONE:
        return heard, []
    cell = pl.col("rssi_dbm") == filler.level
    filler = _in_file(filler, rules)
    if filler.judgement is fillers.Judgement.ASK:
        raise DatasetError(f"{path}: {fillers.question(filler, rules.stated)}")
    found = fillers.filler_found(path.name, filler, heard.filter(cell).height, rules.stated)
    return heard.filter(~cell), [found]


def _batches(
    path: Path,
    schema: Mapping[str, pl.DataType],
    *,
    has_header: bool,
    times: frozenset[str] = frozenset(),
    rounded: dict[str, str] | None = None,
) -> Iterator[pl.DataFrame]:
    """Yield the rows with their types; from the first cell on that is written in another way, by way of texts.

    Columns of ``times`` that are rounded are added to ``rounded``, with an example.
    """
    separator = separator_of(_top_line(path))

    def rows(kinds: Mapping[str, pl.DataType]) -> Iterator[pl.DataFrame]:
        table = scan_csv(path, dict(kinds), has_header=has_header, separator=separator)
        yield from table.collect_batches(maintain_order=True, chunk_size=_ROWS_AT_ONCE)

    done = 0
    try:
        for batch in rows(schema):
            yield batch
            done += batch.height
        return
    except pl.exceptions.PolarsError:
        texts = rows(dict.fromkeys(schema, pl.String()))
    first = 1 + has_header
    try:
        for batch in texts:
            left_out = min(done, batch.height)
            done -= left_out
            found = {} if rounded is None else rounded
            yield _typed(path, batch.with_row_index("row", first)[left_out:], schema, times, found)
            first += batch.height
    except pl.exceptions.PolarsError as error:
        raise _wrong_line(path, len(schema), separator) or DatasetError(
            f"{path}: cannot be read ({first_line(error)}); expected comma separated numbers"
        ) from error


def _typed(
    path: Path,
    texts: pl.DataFrame,
    schema: Mapping[str, pl.DataType],
    times: frozenset[str],
    rounded: dict[str, str],
) -> pl.DataFrame:
    """Convert texts to the types of their columns; raises DatasetError with line and column if a cell is no number."""
    texts = texts.with_columns(pl.col("row").cast(pl.Int64))
    numeric = [name for name, kind in schema.items() if kind.is_numeric()]
    numbers, _ = with_numbers(texts, numeric, path.name)
    for name in numeric:
        wrong = texts.filter(numbers[name].is_null() & (texts[name].str.strip_chars() != ""))
        if wrong.height:
            line, cell = wrong["row"][0], wrong[name][0]
            raise DatasetError(f"{path}: line {line}, column {name}: '{cell}' is not a number; correct the file")
    for name in (name for name in numeric if schema[name].is_integer()):
        step, example = rounded_step(texts[name])
        if step > 1 and name in times:
            rounded.setdefault(name, example)
        elif step > 1:
            raise DatasetError(f"{path}: column {name}: values such as {example} are rounded to {step:g}; {ROUNDED}")
        broken = numbers.filter(pl.col(name) != pl.col(name).round())
        if broken.height:
            line, value = broken.row(0)[0], broken[name][0]
            raise DatasetError(f"{path}: line {line}, column {name}: {value:g} is not a whole number; correct the file")
    return numbers.select(pl.col(name).cast(kind) for name, kind in schema.items())


def _wrong_line(path: Path, width: int, separator: str) -> DatasetError | None:
    """Return an error for the first line with another number of cells."""
    with plain(path).open(encoding="utf-8-sig", errors="replace") as file:
        counts = (line.count(separator) + 1 for line in file)
        return next(
            (_wrong_width(path, line, count, width) for line, count in enumerate(counts, 1) if count != width), None
        )


def _refuse_short_lines(path: Path, lines: list[int], width: int) -> None:
    """Raise an error if a line with an empty last cell actually has too few cells."""
    if not lines:
        return
    wanted, separator = set(lines), separator_of(_top_line(path))
    with plain(path).open(encoding="utf-8-sig", errors="replace") as file:
        for number, line in enumerate(file, start=1):
            if number in wanted and line.count(separator) + 1 != width:
                raise _wrong_width(path, number, line.count(separator) + 1, width)


def _wrong_width(path: Path, line: int, found: int, expected: int, names: str = "") -> DatasetError:
    return DatasetError(f"{path}: line {line} has {found} values, expected {expected}{names}; correct the file")


def unknown_columns(path: Path, names: Sequence[str]) -> tuple[Finding, ...]:
    """Report the columns of a table that are not used."""
    shown = ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")
    return finding_if(len(names), "unknown_columns", f"unknown columns are skipped: {shown}", path.name)


def without_shared_fillers(
    files: Sequence[str],
    heard: Sequence[pl.DataFrame],
    found: Sequence[float],
    levels: tuple[tuple[float, float], tuple[float, float]] | None,
    findings: Sequence[Finding],
) -> tuple[list[pl.DataFrame], list[Finding]]:
    """Drop the level, dBm, that was ``found`` to mean "not heard" in one of the files from those without one (NaN).

    ``levels`` are two of the files' numbers with their dBm, ``findings`` those of all files.
    """
    known = {level: file for level, file in zip(found, files, strict=True) if not np.isnan(level)}
    measured, said, changed = list[pl.DataFrame](), list[Finding](), set[str]()
    for file, own, filler in zip(files, heard, found, strict=True):
        shared = own.filter(pl.col("rssi_dbm").is_in(list(known))) if np.isnan(filler) else own.clear()
        measured.append(own.filter(~pl.col("rssi_dbm").is_in(list(known))) if shared.height else own)
        if shared.height:
            changed.add(file)
            level = shared["rssi_dbm"][0]
            number = level if levels is None else LevelScale(*levels).number(level)
            message = f"{number:g} is read as 'not heard', as in {known[level]}. No action needed if that is right"
            said += finding_if(shared.height, "unstated_filler", message, file, Severity.WARNING)
    return measured, [*(each for each in findings if each.kind != "all_heard" or each.file not in changed), *said]
