"""Tables of text as instruments and spreadsheets write them: encoding, separator and decimal mark found by looking."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.site.site_table import NOT_UTF8, XLSX, decoded, sheet_lines

SEPARATORS = (";", "\t", ",", " ")
"""In the order in which ties are decided."""
COMMENTS = ("#", "//", "%")
_LOOKED_AT = 200
"""Lines that decide on separator and decimal mark."""
_POINT_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_COMMA_NUMBER = re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?")


@dataclass(frozen=True)
class TextTable:
    """Rows of one file: each 1-based line number with its fields, stripped."""

    file: str
    rows: tuple[tuple[int, tuple[str, ...]], ...]
    separator: str
    decimal: str
    """``,`` or ``.``."""
    findings: tuple[Finding, ...] = ()

    def number(self, text: str) -> float:
        """Read a number with the file's decimal mark; NaN for no text. Raises ValueError for what is no number."""
        if not text:
            return math.nan
        shape = _COMMA_NUMBER if self.decimal == "," else _POINT_NUMBER
        if not shape.fullmatch(text):
            raise ValueError(f"'{text}' is no number")
        return float(text.replace(",", "."))

    def place(self, line: int) -> str:
        """Name a line, ``shots.csv:3``."""
        return f"{self.file}:{line}"


def read_text_table(path: Path) -> TextTable:
    """Read a table; blank lines and comments (``#``, ``//``, ``%``) are skipped.

    Raises SurveyError where the file cannot be opened or has no line.
    """
    try:
        if path.suffix.lower() == XLSX:
            return _sheet(path)
        raw = read_bytes(path)
    except OSError as error:
        raise SurveyError(f"{path}: cannot be opened ({error.strerror})") from error
    text, other_line = decoded(raw)
    findings = []
    if other_line is not None:
        findings = [Finding.at_lines("encoding", path.name, [other_line], NOT_UTF8, Severity.INFO)]
    lines = [
        (number, line.strip("\r\n"))
        for number, line in enumerate(text.split("\n"), start=1)
        if line.strip() and not line.strip().startswith(COMMENTS)
    ]
    if not lines:
        raise SurveyError(f"{path}: is empty; expected a table of points")
    separator = _separator([line for _, line in lines[:_LOOKED_AT]])
    rows = tuple((number, _fields(line, separator)) for number, line in lines)
    return TextTable(path.name, rows, separator, _decimal(rows, separator), tuple(findings))


def _sheet(path: Path) -> TextTable:
    lines, guesses = sheet_lines(path)
    if not lines:
        raise SurveyError(f"{path}: is empty; expected a table of points")
    findings = [
        Finding(kind="assumed_sheet", file=path.name, count=1, message=each, severity=Severity.INFO) for each in guesses
    ]
    rows = tuple(lines)
    return TextTable(path.name, rows, ";", _decimal(rows, ";"), tuple(findings))


def _fields(line: str, separator: str) -> tuple[str, ...]:
    if separator == " ":
        return tuple(line.split())
    try:
        fields = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error:
        fields = line.split(separator)
    return tuple(field.strip() for field in fields)


def _separator(lines: list[str]) -> str:
    """The separator by which most lines have a name and two numbers; of several that with most numbers, then fields."""

    def score(separator: str) -> tuple[int, int, int]:
        fields = [_fields(line, separator) for line in lines]
        counts = [_numbers(one[1:]) for one in fields]
        return sum(count >= 2 for count in counts), sum(counts), sum(map(len, fields))

    return max(SEPARATORS, key=score)


def _numbers(fields: tuple[str, ...]) -> int:
    return sum(bool(_POINT_NUMBER.fullmatch(field) or _COMMA_NUMBER.fullmatch(field)) for field in fields)


def _decimal(rows: tuple[tuple[int, tuple[str, ...]], ...], separator: str) -> str:
    """The mark that more fields have in a number; a comma that separates is none."""
    if separator == ",":
        return "."
    numbers = [field for _, fields in rows[:_LOOKED_AT] for field in fields[1:]]
    commas = sum("," in field and bool(_COMMA_NUMBER.fullmatch(field)) for field in numbers)
    points = sum("." in field and bool(_POINT_NUMBER.fullmatch(field)) for field in numbers)
    return "," if commas > points else "."
