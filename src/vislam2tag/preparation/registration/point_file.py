"""Tables of points by surveyors, whatever their separator, columns and order."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.findings import Finding, FindingKind, Severity
from vislam2tag.intake.cells import has_decimal_commas
from vislam2tag.intake.extents import MAX_GRID_M, refused_positions
from vislam2tag.preparation.registration.network import Measurement
from vislam2tag.site.model import landmark_id
from vislam2tag.site.site_table import NOT_UTF8, XLSX, Line, LineCounts, decoded, sheet_lines

Row = TypeVar("Row")
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
        """Read a number with the file's decimal mark; NaN for no text. Raises ValueError for what is not a number."""
        if not text:
            return math.nan
        shape = _COMMA_NUMBER if self.decimal == "," else _POINT_NUMBER
        if not shape.fullmatch(text):
            raise ValueError(f"'{text}' is not a number")
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
    odd = [] if other_line is None else [other_line]
    findings = [Finding.at_lines("encoding", path.name, [line], NOT_UTF8, Severity.INFO) for line in odd]
    lines = [
        (number, line.strip("\r\n"))
        for number, line in enumerate(text.split("\n"), start=1)
        if line.strip() and not line.strip().startswith(COMMENTS)
    ]
    if not lines:
        raise SurveyError(f"{path}: contains no rows; expected a table of points")
    separator = _separator([line for _, line in lines[:_LOOKED_AT]])
    rows = tuple((number, _fields(line, separator)) for number, line in lines)
    return TextTable(path.name, rows, separator, _decimal(rows), tuple(findings))


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


def refuse_longer_rows(table: TextTable, rows: Iterable[Line], columns: int) -> None:
    """Raise SurveyError for a row that decimal commas separate into more values than columns."""
    for line, fields in rows:
        if table.separator == "," and has_decimal_commas(fields, columns):
            raise SurveyError(
                f"{table.place(line)}: {len(fields)} values under {columns} columns; with decimal commas, separate "
                "the columns by ;"
            )


def _sheet(path: Path) -> TextTable:
    lines, guesses = sheet_lines(path)
    if not lines:
        raise SurveyError(f"{path}: contains no rows; expected a table of points")
    findings = [
        Finding(kind="assumed_sheet", file=path.name, count=1, message=each, severity=Severity.INFO) for each in guesses
    ]
    rows = tuple(lines)
    return TextTable(path.name, rows, ";", _decimal(rows), tuple(findings))


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
        counts = [
            sum(bool(_POINT_NUMBER.fullmatch(field) or _COMMA_NUMBER.fullmatch(field)) for field in one[1:])
            for one in fields
        ]
        return sum(count >= 2 for count in counts), sum(counts), sum(map(len, fields))

    return max(SEPARATORS, key=score)


def _decimal(rows: tuple[tuple[int, tuple[str, ...]], ...]) -> str:
    """The mark that more fields have in a number; a comma within a field is quoted where commas separate fields."""
    numbers = [field for _, fields in rows[:_LOOKED_AT] for field in fields[1:]]
    commas = sum("," in field and bool(_COMMA_NUMBER.fullmatch(field)) for field in numbers)
    points = sum("." in field and bool(_POINT_NUMBER.fullmatch(field)) for field in numbers)
    return "," if commas > points else "."


class PointColumn(StrEnum):
    """The meaning of a column of points."""

    POINT = "point"
    EAST = "E"
    NORTH = "N"
    HEIGHT = "H"
    CODE = "code"
    STATION = "station"
    SIGMA = "sigma"


SKIP = "-"
"""In a list of columns: one that is not used."""
CUSTOMARY = (PointColumn.POINT, PointColumn.EAST, PointColumn.NORTH, PointColumn.HEIGHT, PointColumn.CODE)
"""Of a file without a header."""
_NEEDED = CUSTOMARY[:3]
_NAMES = {
    PointColumn.POINT: "point pointid pointname pointnumber pt ptid ptno ptnr pnt name id no nr number target punkt "
    "punktnr punktnummer punktname pkt pktnr pktnummer pnr nummer zielpunkt ziel landmark marke",
    PointColumn.EAST: "e east easting ost ostwert rechts rechtswert rw r",
    PointColumn.NORTH: "n north northing nord nordwert hoch hochwert hw",
    PointColumn.HEIGHT: "h z height elevation elev hoehe höhe hohe zh orthoheight",
    PointColumn.CODE: "code pointcode featurecode description desc beschreibung punktcode art bemerkung",
    PointColumn.STATION: "station stn setup standpunkt stp standpunktnr stationid",
    PointColumn.SIGMA: "sigma sigmam sd std standardabweichung s",
}
_HEADER_WITHIN = 20
"""Rows in which a header is looked for: instruments write a job's name and date first."""
_COLUMN_OF = {name: column for column, names in _NAMES.items() for name in names.split()}
_UNIT = re.compile(r"[\[(].*?[\])]")
_NO_LETTER = re.compile(r"[^a-zäöü]")


def known_column(text: str) -> PointColumn | None:
    """The column that a header's field names: case, blanks, units in brackets and signs do not matter."""
    return _COLUMN_OF.get(_plain(text))


def _plain(text: str) -> str:
    return _NO_LETTER.sub("", _UNIT.sub("", text.lower()))


def parse_columns(text: str) -> tuple[PointColumn | None, ...]:
    """Read ``point,E,N,H,code`` (``-``: not used); raises UsageError where a name is unknown, double or missing."""
    columns: list[PointColumn | None] = []
    for part in (part.strip() for part in text.split(",")):
        column = None if part == SKIP else known_column(part)
        if part != SKIP and column is None:
            raise UsageError(
                f"--columns {text}: '{part}' is not a column; columns are {', '.join(PointColumn)} and {SKIP}"
            )
        columns.append(column)
    named = [column for column in columns if column is not None]
    if len(set(named)) < len(named):
        raise UsageError(f"--columns {text}: a column appears twice")
    if missing := [column for column in _NEEDED if column not in named]:
        raise UsageError(f"--columns {text}: required columns are missing: {', '.join(missing)}")
    return tuple(columns)


def point_columns(
    table: TextTable, given: Sequence[PointColumn | None] | None
) -> tuple[dict[PointColumn, int], int, list[Finding]]:
    """Index of each column, how many rows come before the first point, and what was assumed.

    ``given`` (of :func:`parse_columns`) outdoes a header. Raises SurveyError where the first row is neither a header
    nor a point.
    """
    row = next((i for i, (_, fields) in enumerate(table.rows[:_HEADER_WITHIN]) if _names_columns(fields)), None)
    first = table.rows[row or 0][1]
    if given is not None:
        return _indexed(given), 0 if row is None and _has_numbers(table, first) else (row or 0) + 1, []
    if row is None and _has_numbers(table, first):
        message = "has no header and was read as point,E,N,H,code: pass --columns if this is wrong"
        finding = Finding.at_lines("assumed_columns", table.file, [table.rows[0][0]], message, Severity.INFO)
        return _indexed(CUSTOMARY), 0, [finding]
    found, findings = _from_header(table, first)
    if missing := [column for column in _NEEDED if column not in found]:
        raise SurveyError(
            f"{table.place(table.rows[row or 0][0])}: the header has no column for {' and '.join(missing)} "
            f"({', '.join(first)}); name the columns with --columns, such as point,E,N,H,code"
        )
    return found, (row or 0) + 1, findings


def _indexed(columns: Sequence[PointColumn | None]) -> dict[PointColumn, int]:
    return {column: index for index, column in enumerate(columns) if column is not None}


def _names_columns(fields: Sequence[str]) -> bool:
    return sum(known_column(field) is not None or _plain(field) in ("x", "y") for field in fields) >= 3


def _has_numbers(table: TextTable, fields: Sequence[str]) -> bool:
    """Return whether there are numbers where a point has its coordinates."""
    try:
        return any(math.isfinite(table.number(field)) for field in fields[1:3])
    except ValueError:
        return False


def _from_header(table: TextTable, fields: Sequence[str]) -> tuple[dict[PointColumn, int], list[Finding]]:
    found: dict[PointColumn, int] = {}
    for index, field in enumerate(fields):
        column = known_column(field)
        if column is not None and column not in found:
            found[column] = index
    named = {_plain(field): index for index, field in enumerate(fields) if _plain(field) in ("x", "y")}
    if len(named) < 2 or PointColumn.EAST in found or PointColumn.NORTH in found:
        return found, []
    # Surveyors' Y is east and their X north; they write Y first. Elsewhere X, first, is to the right.
    geodetic = named["y"] < named["x"]
    east, north = ("y", "x") if geodetic else ("x", "y")
    taken = "Y comes before X and was read as east" if geodetic else "X was read as east (right), Y as north (up)"
    message = f"{taken}: pass --columns if this is wrong"
    finding = Finding.at_lines("assumed_columns", table.file, [table.rows[0][0]], message, Severity.INFO)
    return found | {PointColumn.EAST: named[east], PointColumn.NORTH: named[north]}, [finding]


_MESSAGES: dict[FindingKind, str] = {
    "malformed_lines": (
        "a row needs the name of a point and numbers for E and N (H may be empty, and a sigma must be above 0); "
        "these rows are skipped: correct them"
    ),
    "non_finite_values": f"coordinates must be at most {MAX_GRID_M:g} m; these rows are skipped: correct them",
}


def read_points(
    path: Path, given: Sequence[PointColumn | None] | None = None
) -> tuple[list[Measurement], list[Finding]]:
    """Read a file of points; rows that cannot be used are findings.

    ``given`` names the columns in order where the file's own header does not. A row's ``station`` is empty where there
    is no such column, its sigma NaN. Raises SurveyError where the file is not a table of points, or has no usable
    row.
    """
    table = read_text_table(path)
    columns, header_rows, findings = point_columns(table, given)
    if header_rows:
        refuse_longer_rows(table, table.rows[header_rows:], len(table.rows[header_rows - 1][1]))
    counts = LineCounts(table.file)
    rows: list[Measurement] = []
    for line, row in parsed(table.rows[header_rows:], counts, partial(_point, table, columns)):
        if max(abs(row.place.real), abs(row.place.imag)) > MAX_GRID_M:
            counts.add("non_finite_values", line)
        else:
            rows.append(row)
    if not rows:
        last = table.rows[min(header_rows, len(table.rows) - 1)]
        raise SurveyError(
            f"{path}: no line is a point (the first is line {last[0]}, '{table.separator.join(last[1])}'); expected "
            "point, E, N, H separated by ; , tab or blanks, or name the columns with --columns"
        )
    places = np.array([(one.place.real, one.place.imag) for one in rows])
    if problem := refused_positions([one.point for one in rows], places):
        raise SurveyError(f"{path}: {problem}")
    return rows, [*table.findings, *findings, *counts.findings(_MESSAGES)]


def _point(table: TextTable, columns: dict[PointColumn, int], line: int, fields: tuple[str, ...]) -> Measurement:
    cells = {column: fields[index] for column, index in columns.items() if index < len(fields)}
    east, north, height, sigma = (
        table.number(cells.get(column, ""))
        for column in (PointColumn.EAST, PointColumn.NORTH, PointColumn.HEIGHT, PointColumn.SIGMA)
    )
    name = landmark_id(cells.get(PointColumn.POINT, ""))
    if not name or math.isnan(east) or math.isnan(north) or sigma <= 0:
        raise ValueError(f"line {line} is not a point")
    return Measurement(
        point=name,
        station=cells.get(PointColumn.STATION, ""),
        place=complex(east, north),
        sigma_m=sigma,
        height_m=height,
        code=cells.get(PointColumn.CODE, ""),
        source=table.place(line),
        decimals=max(
            len(cells[column].partition(table.decimal)[2]) for column in (PointColumn.EAST, PointColumn.NORTH)
        ),
    )
