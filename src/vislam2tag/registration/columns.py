"""Which column of a surveyor's table is which: by a header in German or English, by the user, or by custom."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from enum import StrEnum

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.registration.text_table import TextTable


class Column(StrEnum):
    """What a column of points holds."""

    POINT = "point"
    EAST = "E"
    NORTH = "N"
    HEIGHT = "H"
    CODE = "code"
    STATION = "station"
    SIGMA = "sigma"


SKIP = "-"
"""In a list of columns: one that is not used."""
CUSTOMARY = (Column.POINT, Column.EAST, Column.NORTH, Column.HEIGHT, Column.CODE)
"""Of a file without a header."""
_NAMES = {
    Column.POINT: "point pointid pointname pointnumber pt ptid ptno ptnr pnt name id no nr number target punkt "
    "punktnr punktnummer punktname pkt pktnr pktnummer pnr nummer zielpunkt ziel landmark marke",
    Column.EAST: "e east easting ost ostwert rechts rechtswert rw r",
    Column.NORTH: "n north northing nord nordwert hoch hochwert hw",
    Column.HEIGHT: "h z height elevation elev hoehe höhe hohe zh orthoheight",
    Column.CODE: "code pointcode featurecode description desc beschreibung punktcode art bemerkung",
    Column.STATION: "station stn setup standpunkt stp standpunktnr stationid",
    Column.SIGMA: "sigma sigmam sd std standardabweichung s",
}
_HEADER_WITHIN = 20
"""Rows in which a header is looked for: instruments write a job's name and date first."""
_COLUMN_OF = {name: column for column, names in _NAMES.items() for name in names.split()}
_UNIT = re.compile(r"[\[(].*?[\])]")
_NO_LETTER = re.compile(r"[^a-zäöü]")


def known_column(text: str) -> Column | None:
    """The column that a header's field names: case, blanks, units in brackets and signs do not matter."""
    return _COLUMN_OF.get(_plain(text))


def _plain(text: str) -> str:
    return _NO_LETTER.sub("", _UNIT.sub("", text.lower()))


def parse_columns(text: str) -> tuple[Column | None, ...]:
    """Read ``point,E,N,H,code`` (``-``: not used); raises UsageError where a name is unknown, double or missing."""
    columns: list[Column | None] = []
    for part in (part.strip() for part in text.split(",")):
        column = None if part == SKIP else known_column(part)
        if part != SKIP and column is None:
            raise UsageError(f"--columns {text}: '{part}' is no column; there are {', '.join(Column)} and {SKIP}")
        columns.append(column)
    named = [column for column in columns if column is not None]
    if len(set(named)) < len(named):
        raise UsageError(f"--columns {text}: a column is named twice")
    if missing := [column for column in (Column.POINT, Column.EAST, Column.NORTH) if column not in named]:
        raise UsageError(f"--columns {text}: {' and '.join(missing)} must be there")
    return tuple(columns)


def columns_of(table: TextTable, given: Sequence[Column | None] | None) -> tuple[dict[Column, int], int, list[Finding]]:
    """Index of each column, how many rows come before the first point, and what was assumed.

    ``given`` (of :func:`parse_columns`) outdoes a header. Raises SurveyError where the first row is neither a header
    nor a point.
    """
    row = next((i for i, (_, fields) in enumerate(table.rows[:_HEADER_WITHIN]) if _names_columns(fields)), None)
    first = table.rows[row or 0][1]
    if given is not None:
        return _indexed(given), 0 if row is None and _has_numbers(table, first) else (row or 0) + 1, []
    if row is None and _has_numbers(table, first):
        message = "has no header and was read as point,E,N,H,code: give --columns where it is otherwise"
        finding = Finding.at_lines("assumed_columns", table.file, [table.rows[0][0]], message, Severity.INFO)
        return _indexed(CUSTOMARY), 0, [finding]
    found, findings = _from_header(table, first)
    missing = [column.value for column in (Column.POINT, Column.EAST, Column.NORTH) if column not in found]
    if missing:
        raise SurveyError(
            f"{table.place(table.rows[row or 0][0])}: the header has no column for {' and '.join(missing)} "
            f"({', '.join(first)}); name the columns by --columns, such as point,E,N,H,code"
        )
    return found, (row or 0) + 1, findings


def _indexed(columns: Sequence[Column | None]) -> dict[Column, int]:
    return {column: index for index, column in enumerate(columns) if column is not None}


def _names_columns(fields: Sequence[str]) -> bool:
    return sum(known_column(field) is not None or _plain(field) in ("x", "y") for field in fields) >= 3


def _has_numbers(table: TextTable, fields: Sequence[str]) -> bool:
    """Tell whether there are numbers where a point has its coordinates."""
    try:
        return any(math.isfinite(table.number(field)) for field in fields[1:3])
    except ValueError:
        return False


def _from_header(table: TextTable, fields: Sequence[str]) -> tuple[dict[Column, int], list[Finding]]:
    found: dict[Column, int] = {}
    for index, field in enumerate(fields):
        column = known_column(field)
        if column is not None and column not in found:
            found[column] = index
    named = {_plain(field): index for index, field in enumerate(fields) if _plain(field) in ("x", "y")}
    if len(named) < 2 or Column.EAST in found or Column.NORTH in found:
        return found, []
    return found | _axes(named), [_axes_finding(table, named)]


def _axes(named: Mapping[str, int]) -> dict[Column, int]:
    """Surveyors' Y is east and their X north; they write Y first. Elsewhere X, first, is to the right."""
    east, north = ("y", "x") if named["y"] < named["x"] else ("x", "y")
    return {Column.EAST: named[east], Column.NORTH: named[north]}


def _axes_finding(table: TextTable, named: Mapping[str, int]) -> Finding:
    geodetic = named["y"] < named["x"]
    taken = "Y stands before X and was taken for east" if geodetic else "X was taken for east (right), Y for north (up)"
    message = f"{taken}: give --columns where it is otherwise"
    return Finding.at_lines("assumed_columns", table.file, [table.rows[0][0]], message, Severity.INFO)
