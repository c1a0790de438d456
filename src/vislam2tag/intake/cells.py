"""Numbers in the cells of text tables: decimal marks, blanks and units, and a report of cells that are not numbers."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Sequence

import polars as pl

from vislam2tag.common.findings import Finding

LEVEL_UNIT = r"(?i)\s*dbm?$"
"""Unit that some loggers write after a level."""
_GROUPED = r"^[+-]?[1-9]\d{0,2}(?:[ \u{a0}\u{202f}'’]\d{3})+(?:[.,]\d+)?$"
"""Groups of three digits, separated by blanks or apostrophes."""
_COMMA_GROUPS = r"^[+-]?[1-9]\d{0,2}(?:,\d{3})+\.\d+$"
_POINT_GROUPS = r"^[+-]?[1-9]\d{0,2}(?:\.\d{3})+,\d+$"
_PERHAPS_GROUPS = r"^[+-]?[1-9]\d{0,2},\d{3}$"
"""1,013 may be 1.013 or 1013: it is read only if another cell of the table shows what its comma means."""
_DECIMAL_COMMA = r"^[+-]?\d*,\d+(?:[eE][+-]?\d+)?$"


FOOT_M = 0.3048
_UNITS = {
    1.0: "m metre metres meter meters mètre mètres metri metros",
    0.1: "dm",
    0.01: "cm centimetre centimetres centimeter centimeters",
    0.001: "mm millimetre millimetres millimeter millimeters",
    1000.0: "km kilometre kilometres kilometer kilometers",
    0.0254: "in inch inches",
    FOOT_M: "ft foot feet intft ftint internationalfoot internationalfeet",
    1200 / 3937: "ftus usft usfoot usfeet surveyfoot surveyfeet ussurveyfoot ussurveyfeet",
}
LENGTHS_M = {word: metres for metres, words in _UNITS.items() for word in words.split()}
"""Metres a unit of length, by its names in lower case without blanks."""
_NO_UNIT = re.compile(r"[\s._()\[\]-]")
_IN_BRACKETS = re.compile(r"([^\[(]*)[\[(]([^\])]*)[\])]\s*")


def length_unit(text: str) -> float | None:
    """Metres in a unit of length by its name, as in ``[ft]`` or ``US survey feet``; None for other text."""
    return LENGTHS_M.get(_NO_UNIT.sub("", text.lower()))


def without_unit(header: str) -> tuple[str, float | None]:
    """The name of a column and metres a unit, as in ``E [m]``, ``E_ft`` or ``Ost in m``; None if it states no unit."""
    bracketed = _IN_BRACKETS.fullmatch(header)
    if bracketed and (metres := length_unit(bracketed[2].removeprefix("in "))) is not None:
        return bracketed[1].strip(" _"), metres
    words = re.split(r"[\s_/,]+", header.strip())
    for first in range(max(1, len(words) - 4), len(words)):
        unit = words[first + 1 :] if words[first] == "in" and first + 1 < len(words) else words[first:]
        if (metres := length_unit("".join(unit))) is not None:
            return " ".join(words[:first]), metres
    return header, None


_DIGITS, _POINT = re.compile(r"[+-]?\d*(?:[eE][+-]?\d+)?"), re.compile(r"[+-]?\d*\.\d+")


def has_decimal_commas(fields: Sequence[str], columns: int) -> bool:
    """Whether a row of a table with commas between fields has more values than columns, because numbers have commas."""
    surplus = fields[columns:]
    return any(surplus) and all(map(_DIGITS.fullmatch, surplus)) and not any(map(_POINT.fullmatch, fields))


def surplus_fields(text: str, separator: str, above: int) -> str | None:
    """Say which line of a table has more fields than its header, and why; None if none has.

    ``above``: number of the file's lines above the table's text.
    """
    rows = csv.reader(text.split("\n"), delimiter=separator)
    try:
        columns = len(next(rows, []))
        fields = next((row for row in rows if len(row) > columns), None)
    except csv.Error:  # a field longer than any text
        return None
    if fields is None:
        return None
    cause = f"quote texts that contain '{separator}'"
    if separator == "," and has_decimal_commas(fields, columns):
        cause = "perhaps decimal commas in a comma-separated file; save it with semicolons or with decimal points"
    return f"line {rows.line_num + above} has {len(fields)} fields, the first line {columns}: {cause}"


def separator_of(header: str) -> str:
    """The mark that separates the fields of a table, by its first line: a semicolon, tab, bar or comma."""
    return max((",", ";", "\t", "|"), key=header.count)


_SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}
_LOOKED_AT = 20
"""Lines in which another separator is looked for."""


def saved_by_spreadsheet(header: bytes, columns: Iterable[str]) -> str | None:
    """Say that a table of commas has another separator, with which its header names all columns; None if not."""
    text = header.decode(errors="replace")
    for mark in (";", "\t"):
        if mark in text and set(columns) <= {name.strip(' "\r') for name in text.split(mark)}:
            return (
                f"fields are separated by {_SEPARATORS[mark]}, so a spreadsheet saved this file, and its times may be "
                "rounded; the file is not used: use the original file"
            )
    return None


def with_separator(
    findings: Iterable[Finding], lines: Sequence[bytes], rows_of: Callable[[bytes], Sequence[int]]
) -> tuple[Finding, ...]:
    """Name the separator of malformed lines in their finding if most are rows with semicolons instead of it.

    ``rows_of`` gives the line numbers of rows in a table of semicolons.
    """
    message = _other_separator(lines[:_LOOKED_AT], rows_of)
    return tuple(
        each.model_copy(update={"message": message}) if message and each.kind == "malformed_lines" else each
        for each in findings
    )


def _other_separator(lines: Sequence[bytes], rows_of: Callable[[bytes], Sequence[int]]) -> str | None:
    for mark in (",", "\t"):
        changed = [line.replace(mark.encode(), b";") for line in lines]
        rows = rows_of(b"\n".join(changed) + b"\n") if changed != lines else ()
        if 2 * len(rows) > len(changed):
            example = changed[rows[0] - 1].decode(errors="replace").strip()
            return (
                f"fields are separated by {_SEPARATORS[mark]}, not by semicolons as in '{example}'; these lines are "
                "skipped: use the original file"
            )
    return None


def with_numbers(rows: pl.DataFrame, columns: Sequence[str], file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """Turn columns into numbers (float64), null if a cell is empty or not a number, and report such cells by column.

    ``rows`` has ``row``, the 1-based line. Blanks around a number are not part of it, "dBm" may follow it, and groups
    of digits and decimal commas are read unless they are ambiguous.
    """
    simple = {name: rows[name].cast(pl.String).str.strip_chars() for name in columns}
    exact = {name: text.cast(pl.Float64, strict=False) for name, text in simple.items()}
    texts = {name: _plain(text) for name, text in simple.items() if (exact[name].is_null() & (text != "")).any()}
    comma = any(map(_shows_decimal_comma, texts.values()))
    numbers = {name: _numbers(text, comma=comma) for name, text in texts.items()}
    odd = [
        finding
        for name, text in texts.items()
        for finding in unreadable_cells(rows, name, numbers[name].is_null() & (text != ""), file)
    ]
    return rows.with_columns((exact | numbers).values()), odd


def unreadable_cells(
    rows: pl.DataFrame, column: str, unreadable: pl.Series, file: str, done: str = "and count as empty"
) -> list[Finding]:
    """Report the cells of a column that are ``unreadable`` (mask, null: no), with the first one and its line.

    ``done`` says what happens to them.
    """
    found = rows.filter(unreadable.fill_null(value=False)).select("row", column)
    if found.is_empty():
        return []
    message = (
        f"column {column}: cells such as '{found[column][0]}' (line {found['row'][0]}) cannot be read {done}. Correct "
        "these cells"
    )
    return [Finding.at_lines("unreadable_cells", file, found["row"].to_list(), message)]


def _plain(cells: pl.Series) -> pl.Series:
    text = cells.str.replace("−", "-", literal=True).str.replace(LEVEL_UNIT, "")
    cell = pl.col(cells.name)
    plain = (
        pl.when(cell.str.contains(_GROUPED))
        .then(cell.str.replace_all(r"[ \u{a0}\u{202f}'’]", ""))
        .when(cell.str.contains(_COMMA_GROUPS))
        .then(cell.str.replace_all(",", "", literal=True))
        .when(cell.str.contains(_POINT_GROUPS))
        .then(cell.str.replace_all(".", "", literal=True))
        .otherwise(cell)
    )
    return text.to_frame().select(plain.alias(cells.name)).to_series()


def _shows_decimal_comma(text: pl.Series) -> bool:
    return bool((text.str.contains(_DECIMAL_COMMA) & ~text.str.contains(_PERHAPS_GROUPS)).any())


def _numbers(text: pl.Series, *, comma: bool) -> pl.Series:
    readable = text if comma else text.set(text.str.contains(_PERHAPS_GROUPS).fill_null(value=False), None)
    return readable.str.replace(",", ".", literal=True).cast(pl.Float64, strict=False)
