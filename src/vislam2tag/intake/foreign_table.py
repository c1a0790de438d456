"""Read tables of other programs (CSV, TSV, Parquet, XLSX) as columns of text with the line of each row.

Encoding, lines above the table, separator, header rows and a column of row numbers are found by looking.
"""

from __future__ import annotations

import codecs
import csv
import errno
import io
import re
from array import array
from collections import Counter
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
from vislam2tag.intake.cells import length_unit, surplus_fields
from vislam2tag.intake.columns import is_known
from vislam2tag.intake.readings import is_address

PARQUET = (".parquet", ".pq")
XLSX = ".xlsx"
SUFFIXES = (".csv", ".tsv", ".txt", XLSX, *PARQUET)
"""Ends of the names of tables."""
NOT_UTF8 = "is not UTF-8 and was read as Windows-1252; check names with special letters"
Line: TypeAlias = tuple[int, tuple[str, ...]]
"""1-based line, or row of a sheet, and its fields, stripped."""
CELLS_AT_ONCE = 500_000
"""Cells that are in memory at once, if a large table is read in batches."""
_SEPARATORS = (";", "\t", "|", ",")
_BLANKS = " "
_LOOKED_AT = 50
"""Lines from which the form of a table is found."""
_FIRST_BYTES = 4096
_SEPARATOR_LINE = re.compile(r'"?sep=(.)"?')
_NUMBER = re.compile(
    r"[+\-−]?(?:\d[\d '’]*(?:[.,]\d*)*|[.,]\d+)(?:[eE][+-]?\d+)?\s*(?:dBm?)?|nan|[+-]?inf", re.IGNORECASE
)
_MOMENT = re.compile(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}.*|\d{1,2}:\d{2}(?::\d{2}.*)?")
_EMPTY = frozenset({"", "-", "na", "n/a", "none", "null"})
_UNITS = re.compile(r"s|ms|us|ns|sec|dbm?|deg|rad|°|mhz|hz|m/s\^?2?|rad/s|ut|µt|hpa|-|1", re.IGNORECASE)
_UNNAMED = re.compile(r"|unnamed: ?\d+(?:_level_\d+)?|__index_level_\d+__", re.IGNORECASE)
_MOST_HEADER_ROWS = 3
_FIRST_TIME = 1e9
"""Whole numbers from here on are times, not row numbers."""


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

    def head(self, count: int = _LOOKED_AT) -> pl.DataFrame:
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
        if self._separator == _BLANKS:
            texts = [_BLANKS.join(text.split()) for text in texts]
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
            return _of_frame(path, scan_parquet(path).head(_LOOKED_AT).collect() if only_head else read_parquet(path))
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
    if b"\0" in raw[:_FIRST_BYTES] and not raw.startswith(_UTF16):
        raise UsageError(f"{path}: is not text; expected a table as CSV, Parquet or XLSX")
    raw, other_line = _utf8(raw)
    notes = [] if other_line is None else [f"line {other_line} {NOT_UTF8}"]
    numbers, texts = _whole_lines(raw)
    return _of_lines(path, numbers, texts, notes, None)


_HEAD_BYTES = 1_000_000
_UTF16 = (b"\xff\xfe", b"\xfe\xff")


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
        if _UNNAMED.fullmatch(name) and _are_row_numbers(table[name].head(_LOOKED_AT).to_list())
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
    form = _form(texts[:_LOOKED_AT], separator)
    names = [name or f"column_{place}" for place, name in enumerate(form.names, 1)]
    unique = _unique(names)
    below = [_fields(line, form.separator) for line in texts[form.first_row : _LOOKED_AT]]
    columns = list(zip(unique, form.names, strict=True))
    cells = {name: [row[place] if place < len(row) else "" for row in below] for place, (name, _) in enumerate(columns)}
    numbered = [name for name, said in columns[:1] if _UNNAMED.fullmatch(said) and _are_row_numbers(cells[name])]
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


@dataclass(frozen=True)
class _Form:
    separator: str
    names: tuple[str, ...]
    first_row: int
    """Place of the first row of values among the lines."""
    has_header: bool
    notes: tuple[str, ...]


def _form(texts: Sequence[str], separator: str | None) -> _Form:
    """Find separator, header and first row of values from the first lines that are not blank."""
    stated = _SEPARATOR_LINE.fullmatch(texts[0].strip())
    above = 1 if stated else 0
    plain = [place for place in range(above, len(texts)) if not texts[place].lstrip().startswith("#")]
    table_lines = [texts[place] for place in plain] or [text.lstrip("# ") for text in texts[above:]]
    mark = stated[1] if stated else separator or _separator(table_lines)
    widths = [len(_fields(line, mark)) for line in table_lines]
    # A header that is no comment may be narrower than the rows: then the rows are wrong.
    width = Counter(widths).most_common(1)[0][0] if widths else 1
    rows = {place: _fields(texts[place], mark) for place in plain}
    first = next(place for place in plain if len(rows[place]) == width) if plain else len(texts)
    values = [rows[place] for place in plain if place > first]
    header_like = plain and _is_header(rows[first], values)
    comment = first - 1 if plain and first - 1 not in rows and first > above else None
    if not plain:
        comment = len(texts) - 1
    said = _fields(texts[comment].lstrip("# "), mark) if comment is not None else ()
    notes = [f"fields are separated by {_NAMES[mark]}"] if mark in _NAMES else []
    if (
        said
        and len(said) == (width if plain else len(said))
        and (len(said) > 1 or any(map(is_known, said)))
        and not header_like
    ):
        notes += _skipped(first - 1 if plain else len(texts) - 1)
        return _Form(mark, said, first if plain else len(texts), True, tuple(notes))
    if not header_like and plain and first != plain[0] and _is_header(rows[plain[0]], []):
        first = plain[0]
        header_like = True
        values = [rows[place] for place in plain if place > first]
    notes += _skipped(first)
    if not header_like:
        return _Form(mark, tuple("" for _ in range(width)), first, False, tuple(notes))
    headers, next_row = [rows[first]], first + 1
    while len(headers) < _MOST_HEADER_ROWS and next_row in rows and _continues(rows[next_row], values[len(headers) :]):
        headers.append(rows[next_row])
        next_row += 1
    if len(headers) > 1:
        notes.append(f"{len(headers)} header rows were read")
    names = _combined(headers)
    most = max((len(row) for row in values), default=0)
    spare = [cell for row in values for cell in row[len(names) :]]
    if most > len(names) and not any(spare):
        names = (*names, *[""] * (most - len(names)))
    return _Form(mark, names, next_row, True, tuple(notes))


_NAMES = {"\t": "tabs", ";": "semicolons", "|": "bars", _BLANKS: "blanks"}


def _skipped(count: int) -> list[str]:
    return (
        []
        if count <= 0
        else ["the line above the table is not used" if count == 1 else f"{count} lines above the table are not used"]
    )


def _separator(lines: Sequence[str]) -> str:
    """The mark by which most lines have the same number of fields."""
    best, mark_found = (0.0, 1), ","
    for mark in _SEPARATORS:
        width, count = Counter(len(_fields(line, mark)) for line in lines).most_common(1)[0]
        if width > 1 and (count / len(lines), width) > best:
            best, mark_found = (count / len(lines), width), mark
    if best[0] == 0.0:
        widths = {len(line.split()) for line in lines}
        if len(lines) > 1 and len(widths) == 1 and widths != {1}:
            return _BLANKS
        return max((",", ";", "\t", "|"), key=lines[0].count)
    return mark_found


def _is_header(row: Sequence[str], below: Sequence[Sequence[str]]) -> bool:
    """Whether a row contains names: known ones, no value at all, or text above numbers."""
    if any(map(is_known, row)):
        return True
    if not any(_is_value(cell) for cell in row if cell):
        return True
    return _above_values(row, below)


def _continues(row: Sequence[str], below: Sequence[Sequence[str]]) -> bool:
    """Whether a row below a header is another header: names or units above values."""
    filled = [cell for cell in row if cell]
    return bool(filled) and not any(map(_is_value, filled)) and _above_values(row, below)


def _above_values(row: Sequence[str], below: Sequence[Sequence[str]]) -> bool:
    for place, cell in enumerate(row):
        if cell and not _is_value(cell):
            under = [other[place] for other in below if place < len(other) and other[place].lower() not in _EMPTY]
            if under and all(map(_is_value, under)):
                return True
    return False


def _is_value(cell: str) -> bool:
    return bool(_NUMBER.fullmatch(cell) or _MOMENT.fullmatch(cell) or is_address(cell)) or cell.lower() in _EMPTY


def _combined(headers: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """One name for each column of several header rows: a unit goes in brackets, the last name counts."""
    names = list(headers[0])
    for row in headers[1:]:
        cells = [row[place] if place < len(row) else "" for place in range(len(names))]
        if all(_is_unit(cell) for cell in cells if cell):
            pairs = zip(names, cells, strict=True)
            names = [
                f"{name} [{unit}]" if length_unit(unit) or unit in ("s", "ms", "us", "ns") else name
                for name, unit in pairs
            ]
            continue
        filled = [cell for cell in cells if cell]
        groups = list(names)
        for place in range(1, len(groups)):
            groups[place] = groups[place] or groups[place - 1]
        if len(set(filled)) < len(filled):
            cells = [" ".join(filter(None, pair)) for pair in zip(groups, cells, strict=True)]
        names = [cell or name for name, cell in zip(names, cells, strict=True)]
    return tuple(names)


def _is_unit(cell: str) -> bool:
    text = cell.strip("[]() ")
    return length_unit(text) is not None or _UNITS.fullmatch(text) is not None


def _unique(names: Sequence[str]) -> list[str]:
    """The names, with a number behind one that came before."""
    found: dict[str, int] = {}
    result = []
    for name in names:
        found[name] = found.get(name, 0) + 1
        result.append(name if found[name] == 1 else f"{name} ({found[name]})")
    return result


def _are_row_numbers(cells: Sequence[object]) -> bool:
    texts = [str(cell) for cell in cells if cell not in (None, "")]
    return bool(texts) and all(re.fullmatch(r"\d+", text) and int(text) < _FIRST_TIME for text in texts)


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


def _fields(line: str, separator: str) -> tuple[str, ...]:
    if separator == _BLANKS:
        return tuple(line.split())
    reader = csv.reader([line], delimiter=separator, skipinitialspace=True)
    try:
        return tuple(name.strip() for name in next(reader))
    except (csv.Error, StopIteration):
        return ("",)


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
    if raw.startswith(_UTF16):
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
