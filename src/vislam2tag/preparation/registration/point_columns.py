"""The columns of a table of points: by its header, in five languages, by labels before the values, or as given."""

from __future__ import annotations

import math
import re
import unicodedata
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from functools import lru_cache

from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.common.visible_text import excerpt
from vislam2tag.intake.cells import FOOT_M, length_unit, without_unit
from vislam2tag.intake.foreign_table import Line
from vislam2tag.preparation.registration.text_table import TextTable, decimal_mark, like_a_number


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
    PointColumn.POINT: "point pt ptid pnt name id no nr number target punkt pkt nummer ziel landmark marke label bez "
    "bezeichnung num numero matricule nom repere nome nombre punto pto vertice",
    PointColumn.EAST: "e east easting ost ostwert rechts rechtswert rw r est este",
    PointColumn.NORTH: "n north northing nord nordwert hoch hochwert hw norte",
    PointColumn.HEIGHT: "h z height elevation elev hoehe hohe zh orthoheight altitude "
    "alt hauteur quota altezza cota altura elevacion elevazione",
    PointColumn.CODE: "code pointcode featurecode description desc beschreibung punktcode art bemerkung codice codigo "
    "remarque note descrizione descripcion",
    PointColumn.STATION: "station stn setup standpunkt stp standpunktnr stationid stazione estacion",
    PointColumn.SIGMA: "sigma sigmam sd std standardabweichung s",
}
_LONGEST = 60
"""Characters of the name of a column."""
_HEADER_WITHIN = 20
"""Rows in which a header is looked for: instruments write a job's name and date first."""
_COLUMN_OF = {name: column for column, names in _NAMES.items() for name in names.split()}
_POINT_WORDS = re.compile(
    r"(?:point|punto|punkt|pnt|pkt|pto|pt|ziel|landmark|marke?|name|nummer|number|numero|nombre|nome|nom|num|nr|no|n|id"
    r"|del?|di|du)*(?:point|punto|punkt|pnt|pkt|pto|pt)(?:name|nummer|number|numero|nombre|nome|nom|num|nr|no|n|id)*"
)
"""Such as "Pkt-Nr.", "numéro de point" and "Nome punto"."""
_HEIGHT_ABOVE = re.compile(
    r"(?:h|hohe|hoehe|altitude|quota|cota|height|elevation)(?:m?ue?(?:nn|nhn|m)|nn|nhn|slm|snm|ngf)"
)
"""Such as "Höhe ü. NN", "Quota s.l.m." and "H ü. M."."""
_IN_BRACKETS = re.compile(r"[\[(].*?[\])]")
_BESIDE_AXIS = re.compile(r"^[xyz]|[xyz]$")
"""A letter that adds nothing to a word, as in "Hochwert X"; in "X (Hochwert)" the word decides, too."""
_NO_LETTER = re.compile(r"[^a-z]")
_COORDINATE = re.compile(r"(?:koordinate|coordinate|coordonnee|coordenada|coordinata|koord|coord|wert)")


_AXES = (PointColumn.EAST, PointColumn.NORTH, PointColumn.HEIGHT)


def known_column(text: str) -> PointColumn | None:
    """The column that a header's field names: case, accents, blanks, units and signs do not matter."""
    plain = _plain(text)
    if _POINT_WORDS.fullmatch(plain):
        return PointColumn.POINT
    if _HEIGHT_ABOVE.fullmatch(plain):
        return PointColumn.HEIGHT
    inner = _IN_BRACKETS.search(text) if plain in ("x", "y") else None
    word = _plain(inner[0][1:-1]) if inner else _BESIDE_AXIS.sub("", plain)
    column = _COLUMN_OF.get(word) if len(word) > 2 else None
    return column if column in _AXES else _COLUMN_OF.get(plain)


@lru_cache(maxsize=1000)
def _plain(text: str) -> str:
    """The letters of a name, without accents, units, brackets, or a word for a coordinate beside a single letter."""
    name = unicodedata.normalize(
        "NFKD", _IN_BRACKETS.sub("", without_unit(text[:_LONGEST])[0].lower().replace("°", "o"))
    )
    letters = _NO_LETTER.sub("", name)
    axis = _COORDINATE.sub("", letters)
    return axis if len(axis) == 1 else letters


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
) -> tuple[dict[PointColumn, int], TextTable, list[Finding]]:
    """Index of each column, the rows below the header in its units, and what was assumed.

    ``given`` (of :func:`parse_columns`) outdoes a header. Raises SurveyError where the first row is neither a header
    nor a point.
    """
    row = next((i for i, (_, fields) in enumerate(table.rows[:_HEADER_WITHIN]) if _names_columns(fields)), None)
    commented = next((each for each in reversed(table.comments) if _names_columns(each[1])), None)
    if row is not None or not _has_numbers(table, table.rows[0][1]):
        header, first = table.rows[row or 0], (row or 0) + 1
    else:
        header, first = commented or (table.rows[0][0], ()), 0
    header = (header[0], _joined(table, header[1], first))
    below = table.below(header[1], first)
    converted = _converted(table.file, header, below)
    if given is not None:
        return _indexed(given), below, converted
    if not header[1]:
        message = "has no header and was read as point,E,N,H,code: pass --columns if this is wrong"
        return _indexed(CUSTOMARY), below, [_assumed(table.file, header, message)]
    found, findings = _from_header(table.file, header)
    if missing := [column for column in _NEEDED if column not in found]:
        raise SurveyError(
            f"{table.place(header[0])}: the header has no column for {' and '.join(missing)} "
            f"({excerpt(', '.join(header[1]))}); name the columns with --columns, such as point,E,N,H,code"
        )
    return found, below, [*findings, *converted]


def _indexed(columns: Sequence[PointColumn | None]) -> dict[PointColumn, int]:
    return {column: index for index, column in enumerate(columns) if column is not None}


def _assumed(file: str, header: Line, message: str) -> Finding:
    return Finding.at_lines("assumed_columns", file, [header[0]], message, Severity.INFO)


def _converted(file: str, header: Line, below: TextTable) -> list[Finding]:
    """Report the columns whose header or row of units states another unit than metres."""
    named = list(zip(header[1], below.unit_m, strict=False))
    findings = []
    for unit_m in sorted({unit for _, unit in named} - {1.0}):
        names = excerpt(", ".join(name for name, unit in named if unit == unit_m))
        survey = " (for US survey feet, write ftUS)" if unit_m == FOOT_M else ""
        message = (
            f"{names}: converted to metres, one unit is {unit_m:.7g} m{survey}; correct the header if this is wrong"
        )
        findings.append(_assumed(file, header, message))
    return findings


def _names_columns(fields: Sequence[str]) -> bool:
    return sum(known_column(field) is not None or _plain(field) in ("x", "y") for field in fields) >= 3


def _has_numbers(table: TextTable, fields: Sequence[str]) -> bool:
    """Return whether there are numbers where a point has its coordinates."""
    try:
        return any(math.isfinite(table.number(field)) for field in fields[1:3])
    except ValueError:
        return False


def _joined(table: TextTable, header: tuple[str, ...], first: int) -> tuple[str, ...]:
    """A header between blanks, its names of two words put together if the rows have fewer fields."""
    wanted = max((len(fields) for _, fields in table.rows[first:]), default=0)
    names = list(header)
    i = 0
    while table.separator == " " and len(names) > wanted and i + 1 < len(names):
        pair = f"{names[i]} {names[i + 1]}"
        if known_column(pair) is not None:
            names[i : i + 2] = [pair]
        else:
            i += 1
    return tuple(names)


def _from_header(file: str, header: Line) -> tuple[dict[PointColumn, int], list[Finding]]:
    """The columns that a header names; words win over abbreviations such as "N." of two letters."""
    fields = [_plain(field) for field in header[1]]
    found: dict[PointColumn, int] = {}
    for index in sorted(range(len(fields)), key=lambda i: 0 < len(fields[i]) <= 2 and fields[i] != "id"):
        if (column := known_column(header[1][index])) is not None:
            found.setdefault(column, index)
    axes, messages = _axes(fields, found)
    found |= axes
    complete = {PointColumn.EAST, PointColumn.NORTH} <= found.keys()
    if complete and PointColumn.POINT not in found and 0 not in found.values():
        found[PointColumn.POINT] = 0
        messages.append(f"the first column ({excerpt(header[1][0])}) was read as the points' names")
    return found, [_assumed(file, header, f"{each}: pass --columns if this is wrong") for each in messages]


def _axes(fields: Sequence[str], found: dict[PointColumn, int]) -> tuple[dict[PointColumn, int], list[str]]:
    """East and north of a header with X and Y, or with R and H; and how it was understood."""
    east, north = found.get(PointColumn.EAST), found.get(PointColumn.NORTH)
    if east is not None and north is None and fields[east] in ("r", "rw") and "h" in fields:
        heights = [i for i, name in enumerate(fields) if name in ("z", "hoehe", "hohe")]
        axes = {PointColumn.NORTH: fields.index("h"), PointColumn.HEIGHT: (*heights, len(fields))[0]}
        return axes, ["R was read as Rechtswert (east), H as Hochwert (north)"]
    if east is not None or north is not None or not {"x", "y"} <= set(fields):
        return {}, []
    # Surveyors' Y is east and their X north; they write Y first. Elsewhere X, first, is to the right.
    x, y = fields.index("x"), fields.index("y")
    if y < x:
        return {PointColumn.EAST: y, PointColumn.NORTH: x}, ["Y comes before X and was read as east"]
    return {PointColumn.EAST: x, PointColumn.NORTH: y}, ["X was read as east (right), Y as north (up)"]


_BETWEEN = re.compile(r"[ \t;|=:]+|,(?!\d)")
_DIGIT = re.compile(r"\d")


def with_labels_as_columns(table: TextTable) -> TextTable:
    """A table whose header is made of the labels of its values, as in ``A1 E=12.3 N=45.6``; others as they are."""
    first = [_labelled(table.separator.join(fields)) for _, fields in table.rows[:_HEADER_WITHIN]]
    if 2 * sum(map(bool, first)) <= len(first):
        return table
    rows = [(line, _labelled(table.separator.join(fields))) for line, fields in table.rows]
    names = list(dict.fromkeys(name for _, values in rows for name in values))
    cells = tuple((line, tuple(values.get(name, "") for name in names)) for line, values in rows)
    header = (table.rows[0][0], tuple(names))
    return replace(table, rows=(header, *cells), separator=";", decimal=decimal_mark(cells))


def _labelled(line: str) -> dict[str, str]:
    """The values of a line by their labels, with the point's name; empty without two labelled coordinates.

    Without a label, the word before the first label is the name.
    """
    words = deque(filter(None, _BETWEEN.split(line)))
    values, coordinates = {PointColumn.POINT.value: ""}, 0
    while words:
        word = words.popleft()
        plain = "" if _DIGIT.search(word) else _plain(word)
        column = known_column(plain)
        if (column in _AXES or plain in ("x", "y")) and words and like_a_number(words[0]):
            unit = f" {words[1]}" if len(words) > 1 and length_unit(words[1]) is not None else ""
            values[plain] = words.popleft() + unit
            coordinates += 1
        elif column in (PointColumn.POINT, PointColumn.CODE) and words:
            values[column.value] = words.popleft()
        elif not coordinates:
            values[PointColumn.POINT] = word
    return values if coordinates >= 2 else {}
