"""Tables of text, whatever their separator, decimal mark, units and style of numbers."""

from __future__ import annotations

import csv
import itertools
import math
import re
import string
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.common.visible_text import excerpt
from vislam2tag.intake.cells import has_decimal_commas, length_unit, without_unit
from vislam2tag.intake.foreign_table import NOT_UTF8, Line, decoded, sheet_lines
from vislam2tag.preparation.registration.foreign_files import is_workbook, refuse_foreign_file
from vislam2tag.site.site_table import LineCounts

Row = TypeVar("Row")
SEPARATORS = (";", "\t", ",", " ")
"""In the order in which ties are decided."""
COMMENTS = ("#", "//", "%")
_LOOKED_AT = 200
"""Lines that decide on separator and decimal mark."""
_UNIT_LETTERS = string.ascii_letters + "è. \u00a0\u2009\u202f"
_GROUP = re.compile(r"(?<=\d)['\u2019\u02bc\u00b4`\u00a0\u2009\u202f ](?=\d{3}(?!\d))")
"""Between groups of three digits."""
_NUMBERS = {
    mark: re.compile(
        rf"[+-]?([1-9]\d{{0,2}}({other}\d{{3}})+{each}\d+|[1-9]\d{{0,2}}({other}\d{{3}}){{2,}}|\d+{each}?\d*|{each}\d+)"
        r"([eE][+-]?\d+)?"
    )
    for mark, each, other in ((".", r"\.", ","), (",", ",", r"\."))
}
"""By decimal mark; the other mark may be between groups of digits if it cannot be mistaken."""
_BEGINS_GROUPS, _GOES_ON = re.compile(r"[+-]?\d{1,3}"), re.compile(r"\d{3}[.,]\d+")
_LINE_END = re.compile(r"\r?\n|\r(?!\n)")
_IN_BRACKETS = re.compile(r"[\[(].*[\])]")


@dataclass(frozen=True)
class TextTable:
    """Rows of one file: each 1-based line number with its fields, stripped."""

    file: str
    rows: tuple[Line, ...]
    separator: str
    decimal: str
    """``,`` or ``.``."""
    findings: tuple[Finding, ...] = ()
    comments: tuple[Line, ...] = ()
    """Comment lines before the first row: one may be the header."""
    unit_m: tuple[float, ...] = ()
    """Metres a unit of each column, from a header; empty without one."""

    def number(self, text: str) -> float:
        """Read a number with the file's decimal mark; NaN for no text. A unit of length after it makes it metres.

        Raises ValueError for what is not a number.
        """
        return self._converted(text, 1.0)

    def length(self, fields: tuple[str, ...], column: int) -> float:
        """Read a length in metres, whatever its unit; NaN for no text. Raises ValueError for what is not a number."""
        return self._converted(fields[column] if column < len(fields) else "", self._column_unit_m(column))

    def decimals(self, fields: tuple[str, ...], column: int) -> int:
        """Digits after the decimal mark of a length in metres; 3 if it was converted from another unit."""
        digits, unit = _parted(fields[column])
        return len(digits.partition(self.decimal)[2]) if _unit_m(unit, self._column_unit_m(column)) == 1.0 else 3

    def place(self, line: int) -> str:
        """Name a line, ``shots.csv:3``."""
        return f"{self.file}:{line}"

    def quoted(self, row: Line) -> str:
        """A row as a message quotes it."""
        return excerpt(self.separator.join(row[1]))

    def below(self, header: tuple[str, ...], first: int) -> TextTable:
        """The rows from number ``first`` on, in the units of a header or of a row of units below it."""
        units = [without_unit(field)[1] for field in header]
        rows = self.rows[first:]
        if header and rows and (row_of_units := _units(rows[0][1])):
            units = [one or other for one, other in itertools.zip_longest(row_of_units, units)]
            rows = rows[1:]
        return replace(self, rows=rows, unit_m=tuple(unit or 1.0 for unit in units))

    def _converted(self, text: str, unit_m: float) -> float:
        if not text:
            return math.nan
        digits, unit = _parted(text)
        factor = _unit_m(unit, unit_m)
        if factor is None or not _NUMBERS[self.decimal].fullmatch(digits):
            raise ValueError(f"'{excerpt(text)}' is not a number")
        return float(digits.replace("." if self.decimal == "," else ",", "").replace(self.decimal, ".")) * factor

    def _column_unit_m(self, column: int) -> float:
        return self.unit_m[column] if column < len(self.unit_m) else 1.0


def _parted(text: str) -> tuple[str, str]:
    """The digits of a cell, without blanks or apostrophes between their groups, and the letters after them."""
    digits = text.rstrip(_UNIT_LETTERS)
    return _GROUP.sub("", digits.replace("\u2212", "-")), text[len(digits) :]


def _unit_m(unit: str, column_m: float) -> float | None:
    """Metres in the unit after a number, or in the column's; None if it is not a length."""
    return length_unit(unit) if unit.strip(" .") else column_m


def _units(fields: tuple[str, ...]) -> list[float | None]:
    """The unit of each column, if the row below a header consists of units; else empty."""
    units = [length_unit(field) for field in fields]
    others = [field for field, unit in zip(fields, units, strict=True) if unit is None]
    return units if len(units) - len(others) >= 2 and not any(map(like_a_number, others)) else []


def read_text_table(path: Path) -> TextTable:
    """Read a table; blank lines and comments (``#``, ``//``, ``%``) are skipped.

    Raises SurveyError if the file cannot be opened, is of another format, or has no line.
    """
    return text_table(path, raw_file(path))


def raw_file(path: Path) -> bytes:
    """Read a file; raises SurveyError if it cannot be opened."""
    try:
        return read_bytes(path)
    except OSError as error:
        raise SurveyError(f"{path}: cannot be opened ({error.strerror})") from error


def text_table(path: Path, raw: bytes) -> TextTable:
    """As :func:`read_text_table`, of a file that was read."""
    if is_workbook(raw):
        return _sheet(path)
    refuse_foreign_file(path, raw)
    text, other_line = decoded(raw)
    odd = [] if other_line is None else [other_line]
    findings = [Finding.at_lines("encoding", path.name, [line], NOT_UTF8, Severity.INFO) for line in odd]
    numbered = numbered_lines(text)
    lines = [(number, line) for number, line in numbered if not line.strip().startswith(COMMENTS)]
    if not lines:
        raise SurveyError(f"{path}: contains no rows; expected a table of points")
    separator = _separator([line for _, line in lines[:_LOOKED_AT]])
    rows = tuple((number, _fields(line, separator)) for number, line in lines)
    comments = tuple(
        (number, _fields(line.strip().lstrip("#/% \t"), separator)) for number, line in numbered if number < rows[0][0]
    )
    return TextTable(path.name, rows, separator, decimal_mark(rows), tuple(findings), comments)


def numbered_lines(text: str) -> list[tuple[int, str]]:
    """The lines of a text that are not blank, with their 1-based numbers; a carriage return may end one."""
    return [(number, line) for number, line in enumerate(_LINE_END.split(text), start=1) if line.strip()]


def parsed(
    rows: Iterable[Line], counts: LineCounts, parse: Callable[[int, tuple[str, ...]], Row]
) -> Iterator[tuple[int, Row]]:
    """Yield line and value of each row; one for which ``parse`` raises ValueError or IndexError is counted."""
    for line, fields in rows:
        try:
            row = parse(line, fields)
        except (ValueError, IndexError):
            counts.add("malformed_lines", line)
        else:
            yield line, row


def refuse_longer_rows(table: TextTable, columns: int) -> None:
    """Raise SurveyError for a row that marks within numbers separate into more values than columns."""
    for line, fields in table.rows:
        if table.separator == "," and has_decimal_commas(fields, columns):
            raise SurveyError(
                f"{table.place(line)}: {len(fields)} values under {columns} columns; with decimal commas, separate "
                "the columns by ;"
            )
        if table.separator in ", " and len(fields) > columns and _has_groups(fields[1 : columns + 1]):
            raise SurveyError(
                f"{table.place(line)}: {len(fields)} values under {columns} columns; with commas or blanks between "
                "groups of digits, separate the columns by ;"
            )


def _has_groups(fields: tuple[str, ...]) -> bool:
    pairs = itertools.pairwise(fields)
    return any(_BEGINS_GROUPS.fullmatch(one) and _GOES_ON.fullmatch(other) for one, other in pairs)


def _sheet(path: Path) -> TextTable:
    try:
        lines, guesses = sheet_lines(path)
    except OSError as error:
        raise SurveyError(f"{path}: cannot be opened ({error.strerror})") from error
    if not lines:
        raise SurveyError(f"{path}: contains no rows; expected a table of points")
    findings = [
        Finding(kind="assumed_sheet", file=path.name, count=1, message=each, severity=Severity.INFO) for each in guesses
    ]
    rows = tuple(lines)
    return TextTable(path.name, rows, ";", decimal_mark(rows), tuple(findings))


def _fields(line: str, separator: str) -> tuple[str, ...]:
    if separator == " ":
        return tuple(_with_units(line.replace("\t", " ").split(" ")))
    try:
        fields = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error:
        fields = line.split(separator)
    return tuple(field.strip() for field in fields)


def _with_units(words: Iterable[str]) -> list[str]:
    """Fields between blanks: a unit after a number, or in brackets after a name, is not a field of its own."""
    fields: list[str] = []
    for word in filter(None, map(str.strip, words)):
        before = fields[-1] if fields else ""
        bracketed = _IN_BRACKETS.fullmatch(word) and before and not _IN_BRACKETS.fullmatch(before)
        if bracketed or (length_unit(word) is not None and like_a_number(before)):
            fields[-1] = f"{before} {word}"
        else:
            fields.append(word)
    return fields


def like_a_number(text: str) -> bool:
    """Whether a field is a number with either decimal mark, perhaps with a unit of length."""
    digits, unit = _parted(text)
    return any(shape.fullmatch(digits) for shape in _NUMBERS.values()) and _unit_m(unit, 1.0) is not None


def _separator(lines: list[str]) -> str:
    """The separator by which most lines have a name and two numbers; of several that with most numbers, then fields."""

    def score(separator: str) -> tuple[int, int, int]:
        fields = [_fields(line, separator) for line in lines]
        counts = [sum(map(like_a_number, one[1:])) for one in fields]
        return sum(count >= 2 for count in counts), sum(counts), sum(map(len, fields))

    return max(SEPARATORS, key=score)


def decimal_mark(rows: Iterable[Line]) -> str:
    """The mark that more fields have in a number; a comma within a field is quoted where commas separate fields."""
    cells = [_parted(field)[0] for _, fields in itertools.islice(rows, _LOOKED_AT) for field in fields[1:]]
    points, commas = (
        sum((mark in cell or cell.count(other) > 1) and bool(_NUMBERS[mark].fullmatch(cell)) for cell in cells)
        for mark, other in (".,", ",.")
    )
    return "," if commas > points else "."
