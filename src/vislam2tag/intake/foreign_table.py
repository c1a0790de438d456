"""Read tables of other programs (CSV, TSV, Parquet, XLSX) as columns of text with the line of each row.

Encoding, lines above the table, separator, header rows and a column of row numbers are found by looking.
"""

from __future__ import annotations

import codecs
import csv
import errno
import io
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias, overload

import numpy as np
import polars as pl

from vislam2tag.common.errors import MissingExtraError, UsageError, first_line, import_extra
from vislam2tag.common.files.given_files import plain, read_bytes
from vislam2tag.common.files.table_files import read_csv, read_parquet, scan_parquet
from vislam2tag.core.arrays import IntArray
from vislam2tag.intake.cells import surplus_fields
from vislam2tag.intake.table_form import BLANKS, LOOKED_AT, UNNAMED, are_row_numbers, fields_of, form_of, unique_names

PARQUET = (".parquet", ".pq")
XLSX = ".xlsx"
SUFFIXES = (".csv", ".tsv", ".txt", XLSX, *PARQUET)
"""Ends of the names of tables."""
NOT_UTF8 = "is not UTF-8 and was read as Windows-1252; check names with special letters"
Line: TypeAlias = tuple[int, tuple[str, ...]]
"""1-based line, or row of a sheet, and its fields, stripped."""
CELLS_AT_ONCE = 500_000
"""Cells that are in memory at once, if a large table is read in batches."""
_FIRST_BYTES = 4096


@dataclass(frozen=True)
class ForeignTable:
    """A table of another program. Cells are text without blanks around it, null if empty; Parquet keeps its types."""

    path: Path
    columns: tuple[str, ...]
    header_line: int
    """1-based line of the last header row; 0 if the table has no header."""
    notes: tuple[str, ...]
    """What was assumed about its form: clauses."""
    _numbers: IntArray = field(repr=False)
    """1-based lines (n,) of the rows."""
    _texts: Sequence[str] = field(repr=False)
    """All lines that are not blank; the last n are rows."""
    _separator: str = ","
    _width: tuple[str, ...] = ()
    """Names of all columns in the file."""
    _whole: pl.DataFrame | None = field(default=None, repr=False)

    @property
    def height(self) -> int:
        """Number of rows."""
        return len(self._numbers)

    @property
    def lines(self) -> pl.Series:
        """1-based line of each row (n,), int64."""
        return pl.Series("row", self._numbers)

    @property
    def rows(self) -> pl.DataFrame:
        """All rows; raises UsageError if a line has more fields than the header."""
        parts = [part for _, part in self.batches(max(self.height, 1))]
        return parts[0] if parts else pl.DataFrame(schema=dict.fromkeys(self.columns, pl.String()))

    def head(self, count: int = LOOKED_AT) -> pl.DataFrame:
        """The first rows; raises as :attr:`rows`."""
        return next(iter(self.batches(count)))[1] if self.height else self.rows

    def batches(self, size: int | None = None) -> Iterator[tuple[pl.Series, pl.DataFrame]]:
        """Yield the lines and cells of ``size`` rows (by default as many as memory allows); raises as :attr:`rows`."""
        size = size or max(1, CELLS_AT_ONCE // max(len(self.columns), 1))
        above = len(self._texts) - self.height
        for first in range(0, self.height, size):
            if self._whole is not None:
                part = self._whole[first : first + size]
            else:
                part = self._cells(first, self._texts[above + first : above + first + size])
            yield self.lines[first : first + size], part

    def _cells(self, first: int, texts: Sequence[str]) -> pl.DataFrame:
        if self._separator == BLANKS:
            texts = [BLANKS.join(text.split()) for text in texts]
        full = "x" + self._separator * (len(self._width) - 1)  # a short first row hides columns
        content = "\n".join((full, *texts, "")).encode()
        schema = dict.fromkeys(self._width, pl.String())
        try:
            cells = read_csv(content, separator=self._separator, has_header=False, schema=schema)[1:]
        except pl.exceptions.PolarsError as error:
            for number, text in zip(self._numbers[first:], texts, strict=False):
                if surplus := surplus_fields(f"{full}\n{text}", self._separator, int(number) - 2):
                    raise UsageError(f"{self.path}: {surplus}") from error
            raise UsageError(f"{self.path}: cannot be read as a table ({first_line(error)})") from error
        stripped = pl.col(pl.String).str.strip_chars().replace("", None)
        return cells.select(self.columns).with_columns(stripped)


def read_foreign_table(path: Path, *, only_head: bool = False) -> ForeignTable:
    """Read a CSV, Parquet or XLSX file; raises UsageError if it cannot be read or is empty.

    ``only_head``: some rows are enough, to look at the columns.
    """
    try:
        suffix = path.suffix.lower()
        if suffix in PARQUET:
            return _of_frame(path, scan_parquet(path).head(LOOKED_AT).collect() if only_head else read_parquet(path))
        if suffix == XLSX:
            lines, notes = sheet_lines(path)
            return _of_lines(path, [number for number, _ in lines], [_joined(row) for _, row in lines], notes, ",")
        raw = _first_lines(path) if only_head else read_bytes(path)
    except MissingExtraError:
        raise
    except (OSError, pl.exceptions.PolarsError) as error:
        why = error.strerror if isinstance(error, OSError) and error.strerror else first_line(error)
        raise UsageError(
            f"{path}: cannot be read as CSV, Parquet or XLSX ({why}); save the table as CSV and pass that"
        ) from error
    if raw.startswith(b"PK"):
        raise UsageError(f"{path}: is a spreadsheet (XLSX) or a zip; save the table as CSV and pass that")
    if b"\0" in raw[:_FIRST_BYTES] and not raw.startswith(UTF16_MARKS):
        raise UsageError(f"{path}: is not text; expected a table as CSV, Parquet or XLSX")
    raw, other_line = _utf8(raw)
    notes = [] if other_line is None else [f"line {other_line} {NOT_UTF8}"]
    numbers, texts = _whole_lines(raw)
    return _of_lines(path, numbers, texts, notes, None)


_HEAD_BYTES = 1_000_000
UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")


def _first_lines(path: Path) -> bytes:
    """The first whole lines of a file, at least one."""
    with plain(path).open("rb") as file:
        raw = file.read(_HEAD_BYTES)
        return raw if len(raw) < _HEAD_BYTES else raw + file.readline()


def table_of_frame(table: pl.DataFrame) -> ForeignTable:
    """A data frame as a table; its first row is line 2, as in the CSV file that it would be."""
    return _of_frame(Path("the data frame"), table)


def _of_frame(path: Path, table: pl.DataFrame) -> ForeignTable:
    numbered = [
        name
        for name in table.columns
        if UNNAMED.fullmatch(name) and are_row_numbers(table[name].head(LOOKED_AT).to_list())
    ]
    kept = table.drop(numbered)
    return ForeignTable(
        path, tuple(kept.columns), 1, tuple(_not_used(numbered)), np.arange(2, table.height + 2), (), _whole=kept
    )


def _of_lines(
    path: Path, numbers: Sequence[int], texts: Sequence[str], notes: Sequence[str], separator: str | None
) -> ForeignTable:
    """Find the form of a table from its lines that are not blank."""
    if not texts:
        raise UsageError(f"{path}: the file is empty; expected a table with a header")
    form = form_of(texts[:LOOKED_AT], separator)
    names = [name or f"column_{place}" for place, name in enumerate(form.names, 1)]
    unique = unique_names(names)
    below = [fields_of(line, form.separator) for line in texts[form.first_row : LOOKED_AT]]
    columns = list(zip(unique, form.names, strict=True))
    cells = {name: [row[place] if place < len(row) else "" for row in below] for place, (name, _) in enumerate(columns)}
    numbered = [name for name, said in columns[:1] if UNNAMED.fullmatch(said) and are_row_numbers(cells[name])]
    blank = [name for name, said in columns if not said and name not in numbered and not any(cells[name])]
    dropped = (*numbered, *blank) if form.has_header else ()
    found = [*notes, *form.notes, *(_not_used(numbered) if form.has_header else ())]
    if not form.has_header:
        found.append("the table has no header")
    return ForeignTable(
        path,
        tuple(name for name in unique if name not in dropped),
        numbers[form.first_row - 1] if form.has_header else 0,
        tuple(found),
        np.array(numbers[form.first_row :], dtype=np.int64),
        texts,
        form.separator,
        tuple(unique),
    )


def _not_used(numbered: Sequence[str]) -> list[str]:
    return ["the column of row numbers is not used"] if numbered else []


class _Lines(Sequence[str]):
    """Parts of a text in UTF-8, decoded when they are used."""

    def __init__(self, raw: bytes, ends: Sequence[int]) -> None:
        """``ends`` (2k,): start and end of each part in turn."""
        self._raw, self._ends = raw, ends

    def __len__(self) -> int:
        return len(self._ends) // 2

    @overload
    def __getitem__(self, place: int) -> str: ...
    @overload
    def __getitem__(self, place: slice) -> list[str]: ...
    def __getitem__(self, place: int | slice) -> str | list[str]:
        if isinstance(place, slice):
            return [self[each] for each in range(*place.indices(len(self)))]
        return self._raw[self._ends[2 * place] : self._ends[2 * place + 1]].rstrip(b"\r").decode(errors="replace")


def _whole_lines(raw: bytes) -> tuple[Sequence[int], Sequence[str]]:
    """1-based numbers and texts of the lines that are not blank; a quoted field may have several lines."""
    numbers, ends, open_quote = _line_ends(raw, quoted=b'"' in raw)
    if open_quote:  # a lone quote is no field of several lines
        numbers, ends, _ = _line_ends(raw, quoted=False)
    return numbers, _Lines(raw, ends)


def _line_ends(raw: bytes, *, quoted: bool) -> tuple[array[int], array[int], bool]:
    """Numbers of the lines that are not blank, their starts and ends, and whether a quote is open at the end."""
    numbers, ends = array("q"), array("q")
    start, number, open_quote = 0, 1, False
    while start < len(raw):
        end = raw.find(b"\n", start)
        end = len(raw) if end < 0 else end
        line = raw[start:end]
        if open_quote:
            ends[-1] = end
        elif line.strip():
            numbers.append(number)
            ends.extend((start, end))
        if quoted and line.count(b'"') % 2:
            open_quote = not open_quote
        start, number = end + 1, number + 1
    return numbers, ends, open_quote


def _joined(row: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="").writerow(row)
    return text.getvalue()


def decoded(raw: bytes) -> tuple[str, int | None]:
    """Text in UTF-8 or UTF-16 (by its byte order mark), else in Windows' code page, and the line that shows it."""
    text, other_line = _utf8(raw)
    return text.decode(errors="replace"), other_line


def _utf8(raw: bytes) -> tuple[bytes, int | None]:
    """The text in UTF-8 without a byte order mark, and the line that shows another encoding."""
    if raw.startswith(UTF16_MARKS):
        return raw.decode("utf-16", errors="replace").encode(), None
    try:
        raw.decode()
    except UnicodeDecodeError as error:
        return raw.decode("cp1252", errors="replace").encode(), raw[: error.start].count(b"\n") + 1
    return raw.removeprefix(codecs.BOM_UTF8), None


def sheet_lines(path: Path) -> tuple[list[Line], list[str]]:
    """Rows of the first sheet of an XLSX file that are not blank, and its name where there are more sheets.

    Raises OSError if it cannot be read, MissingExtraError if the package that reads it is missing.
    """
    raw = read_bytes(path)
    try:
        openpyxl = import_extra("openpyxl")
        book = openpyxl.load_workbook(io.BytesIO(raw), read_only=True, data_only=True)
        sheet = book.worksheets[0]
        rows = [tuple(map(_cell_text, row)) for row in sheet.iter_rows(values_only=True)]
    except MissingExtraError:
        raise
    except Exception as error:  # a damaged archive or document: its reader has errors of many libraries
        raise OSError(errno.EINVAL, f"it is not a readable XLSX file: {first_line(error)}", str(path)) from error
    guesses = (
        [f"of {len(book.worksheets)} sheets the first, {sheet.title}, was read"] if len(book.worksheets) > 1 else []
    )
    return [(number, row) for number, row in enumerate(rows, start=1) if any(row)], guesses


def _cell_text(value: object) -> str:
    if isinstance(value, float) and value.is_integer():
        value = int(value)  # a spreadsheet has no other numbers: an id 7 is 7.0 there
    return "" if value is None else str(value).strip()
