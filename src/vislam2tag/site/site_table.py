"""Small tables of a site (floors, landmarks, control points), row by row with line numbers: CSV, XLSX."""

from __future__ import annotations

import csv
import errno
import io
import math
import re
import stat
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

from vislam2tag.common.errors import SurveyError, first_line
from vislam2tag.common.extras import MissingExtraError, import_extra
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.site.table_columns import TableColumns, has_decimal_comma, number_text, understood

XLSX = ".xlsx"
NOT_UTF8 = "is not UTF-8 and was read as Windows-1252: check names with special letters"
Line: TypeAlias = tuple[int, tuple[str, ...]]
"""1-based line, or row of a sheet, and its fields, stripped."""
_SEPARATOR_LINE = re.compile(r"sep=(.)")
_SHOWN = 120
"""Letters of a wrong header that a message repeats."""


@dataclass(frozen=True)
class SiteTable:
    """The rows of one site file; ``rows`` pairs each 1-based line number with its fields, stripped."""

    file: str
    """Path relative to the survey."""
    header: tuple[str, ...]
    """Column names in lower case; empty where the file has no header."""
    rows: tuple[tuple[int, tuple[str, ...]], ...]
    findings: tuple[Finding, ...] = ()
    """What was guessed of it."""
    header_line: int | None = None
    """1-based line of the header; None where there is none."""

    def cell(self, fields: tuple[str, ...], column: str) -> str:
        """Return the text of a named column in a row; empty where the row or the file has none."""
        if column not in self.header:
            return ""
        index = self.header.index(column)
        return fields[index] if index < len(fields) else ""

    def place(self, line: int) -> str:
        """Name a line of the file, ``floor_1/marker_dict.csv:3``."""
        return f"{self.file}:{line}"

    @property
    def header_lines(self) -> tuple[int, ...]:
        """The header's line, for a finding."""
        return () if self.header_line is None else (self.header_line,)

    def missing_columns(self, columns: TableColumns) -> str | None:
        """What to say of a header that lacks a column which is needed; None: nothing lacks."""
        found = self.header[1:] if columns.first[:1] == ("id",) else self.header
        missing = [name for name in columns.needed if name not in found]
        if not missing:
            return None
        if any(map(_is_number, self.header)):
            shown = ",".join(self.header)[:_SHOWN]
            return f"there is no header: '{shown}' looks like data; put id,x,y or the like above it"
        optional = [name for name in columns.names if name not in ("id", *columns.needed)]
        names = list(dict.fromkeys((*columns.first, *columns.needed)))
        return (
            f"the first line must be: {','.join(names)} (then optional columns: {', '.join(optional)}), or such names "
            f"as a spreadsheet has (docs/reference/formats.md); it lacks {' and '.join(missing)} and is: "
            f"{','.join(self.header)[:_SHOWN] or 'empty'}"
        )


def readable_table(
    root: Path, path: Path, expected: str = "", *, has_header: bool = True, columns: TableColumns | None = None
) -> SiteTable:
    """Read a site file as :func:`read_site_table`; raises SurveyError with what was ``expected`` if it cannot."""
    try:
        return read_site_table(root, path, has_header=has_header, columns=columns)
    except OSError as error:
        raise SurveyError(f"{path}: cannot be opened ({error.strerror}){expected}") from error


def read_site_table(
    root: Path, path: Path, *, has_header: bool = True, columns: TableColumns | None = None
) -> SiteTable:
    """Read a site file; blank lines are skipped. Raises OSError where it cannot be opened.

    Separator, encoding and decimal mark are found by looking. With ``columns``, other names, orders and units of these
    are understood too: the table has ours, the numbers are metres, and what was guessed is a finding. ``has_header``
    false: the first row is a header only if it names the columns needed.
    """
    name = path.relative_to(root).as_posix()
    lines, guesses = sheet_lines(path) if path.suffix.lower() == XLSX else _text_lines(path)
    if columns is not None and lines:
        return _in_our_columns(name, lines, guesses, columns, has_header)
    header = tuple(field.lower() for field in lines[0][1]) if has_header and lines else ()
    return SiteTable(name, header, tuple(lines[1:] if has_header else lines))


def _in_our_columns(
    name: str, lines: list[Line], guesses: list[str], columns: TableColumns, has_header: bool
) -> SiteTable:
    head_line, first = lines[0]
    known = understood(first, columns)
    if not has_header and not set(columns.needed) <= set(known.header):
        known = understood(columns.needed, columns)
        known = replace(known, header=(), guesses=())
        rows = lines
    else:
        rows = lines[1:]
    guesses = [*known.guesses, *guesses]
    ordered = [(line, _reordered(fields, known.order)) for line, fields in rows]
    comma = has_decimal_comma([fields for _, fields in ordered], known.numeric)
    if comma:
        guesses.append("numbers have a decimal comma")
    made = tuple(
        (
            line,
            tuple(
                number_text(text, known.factors.get(place, 1.0), decimal_comma=comma)
                if place in known.numeric
                else text
                for place, text in enumerate(fields)
            ),
        )
        for line, fields in ordered
    )
    findings = []
    if guesses:
        message = f"{'; '.join(guesses)}: correct the file where it is otherwise"
        findings = [
            Finding(
                kind="assumed_columns",
                file=name,
                count=max(1, len(made)),
                message=message,
                severity=Severity.INFO,
                lines=(head_line,),
            )
        ]
    return SiteTable(name, known.header, made, tuple(findings), head_line if known.header else None)


def _reordered(fields: tuple[str, ...], order: Sequence[int]) -> tuple[str, ...]:
    if list(order) == list(range(len(order))):
        return fields
    cells = [fields[i] if i < len(fields) else "" for i in order]
    return (*cells, *fields[len(order) :])


def _text_lines(path: Path) -> tuple[list[Line], list[str]]:
    """Lines of a text file with their fields, and what was guessed of it."""
    raw = read_bytes(path)
    if raw.startswith(b"PK"):
        raise OSError(errno.EINVAL, "it is a spreadsheet (XLSX), not text: save it as CSV, or name it .xlsx", str(path))
    text, other_line = decoded(raw)
    guesses = [] if other_line is None else [f"line {other_line} {NOT_UTF8}"]
    numbered = [(number, line) for number, line in enumerate(text.split("\n"), start=1) if line.strip()]
    if not numbered:
        return [], guesses
    told = _SEPARATOR_LINE.fullmatch(numbered[0][1].strip())
    if told:  # Excel's first line, for itself
        separator, numbered = told.group(1), numbered[1:]
    else:
        unquoted = re.sub(r'"[^"]*"', "", numbered[0][1])
        separator = next((mark for mark in (";", "\t") if mark in unquoted), ",")
    if separator != ",":
        guesses.append(f"fields are separated by {'tabs' if separator == chr(9) else separator}")
    return [(number, _fields(line, separator)) for number, line in numbered], guesses


def decoded(raw: bytes) -> tuple[str, int | None]:
    """Text in UTF-8 or UTF-16 (by its byte order mark), else in Windows' code page, and the line that tells."""
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        return raw.decode("utf-16", errors="replace"), None
    try:
        return raw.decode("utf-8-sig"), None
    except UnicodeDecodeError as error:
        return raw.decode("cp1252", errors="replace"), raw[: error.start].count(b"\n") + 1


def sheet_lines(path: Path) -> tuple[list[Line], list[str]]:
    """Rows of the first sheet of an XLSX file that are not blank, and its name where there are more sheets.

    Raises OSError where it cannot be read, MissingExtraError where the package that reads it lacks.
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
        raise OSError(errno.EINVAL, f"no XLSX file that can be read: {first_line(error)}", str(path)) from error
    guesses = (
        [f"of {len(book.worksheets)} sheets the first, {sheet.title}, was read"] if len(book.worksheets) > 1 else []
    )
    return [(number, row) for number, row in enumerate(rows, start=1) if any(row)], guesses


def _cell_text(value: object) -> str:
    if isinstance(value, float) and value.is_integer():
        value = int(value)  # a spreadsheet has no other numbers: an id 7 is 7.0 there
    return "" if value is None else str(value).strip()


def site_finding(kind: FindingKind, file: str, message: str, severity: Severity = Severity.WARNING) -> Finding:
    """One problem of one file of a site."""
    return Finding(kind=kind, file=file, count=1, message=message, severity=severity)


def unreadable_file(file: str, error: OSError, consequence: str) -> Finding:
    """Report a site file that is there but cannot be opened."""
    message = f"cannot be opened ({error.strerror}): {consequence}; check its permissions"
    return site_finding("unreadable_file", file, message, Severity.ERROR)


def _fields(line: str, separator: str) -> tuple[str, ...]:
    reader = csv.reader([line.rstrip("\r")], delimiter=separator, skipinitialspace=True)
    try:
        return tuple(field.strip() for field in next(reader))
    except (csv.Error, StopIteration):
        return ("",)


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def number_or_none(text: str) -> float | None:
    """Parse an optional number: empty text is None. Raises ValueError for what is no number."""
    if not text:
        return None
    if "_" in text:
        raise ValueError(f"'{text}' is no number")
    return float(text)


def finite_or_none(text: str) -> float | None:
    """Parse an optional finite number; raises ValueError for other text."""
    value = number_or_none(text)
    if value is not None and not math.isfinite(value):
        raise ValueError(f"'{text}' is not finite")
    return value


@dataclass
class LineCounts:
    """Collects the lines of one file that share a problem, and turns them into findings."""

    file: str
    lines: dict[FindingKind, list[int]]

    @classmethod
    def of(cls, file: str) -> LineCounts:
        """Start with nothing counted."""
        return cls(file, {})

    def add(self, kind: FindingKind, line: int) -> None:
        """Count one line."""
        self.lines.setdefault(kind, []).append(line)

    def findings(self, messages: dict[FindingKind, str]) -> list[Finding]:
        """One finding for each kind counted, in the order of ``messages``."""
        return [
            Finding.at_lines(kind, self.file, self.lines[kind], message)
            for kind, message in messages.items()
            if kind in self.lines
        ]


_ABSENT = (errno.ENOENT, errno.ENOTDIR, errno.ELOOP)


def is_file(path: Path) -> bool:
    """Tell whether a file is there; raises OSError where that cannot be known.

    ``Path.is_file`` answers False or raises there, depending on Python's version.
    """
    try:
        return stat.S_ISREG(path.stat().st_mode)
    except OSError as error:
        if error.errno in _ABSENT:
            return False
        raise
