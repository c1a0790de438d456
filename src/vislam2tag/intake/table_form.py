"""Find the form of a table from its first lines: separator, lines above it, header rows, a column of row numbers."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from vislam2tag.intake.cells import length_unit
from vislam2tag.intake.columns import is_known
from vislam2tag.intake.readings import is_address

_SEPARATORS = (";", "\t", "|", ",")
BLANKS = " "
LOOKED_AT = 50
"""Lines from which the form of a table is found."""
_SEPARATOR_LINE = re.compile(r'"?sep=(.)"?')
_NUMBER = re.compile(
    r"[+\-−]?(?:\d[\d '’]*(?:[.,]\d*)*|[.,]\d+)(?:[eE][+-]?\d+)?\s*(?:dBm?)?|nan|[+-]?inf", re.IGNORECASE
)
_MOMENT = re.compile(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}.*|\d{1,2}:\d{2}(?::\d{2}.*)?")
_EMPTY = frozenset({"", "-", "na", "n/a", "none", "null"})
_UNITS = re.compile(r"s|ms|us|ns|sec|dbm?|deg|rad|°|mhz|hz|m/s\^?2?|rad/s|ut|µt|hpa|-|1", re.IGNORECASE)
UNNAMED = re.compile(r"|unnamed: ?\d+(?:_level_\d+)?|__index_level_\d+__", re.IGNORECASE)
_MOST_HEADER_ROWS = 3
_FIRST_TIME = 1e9
"""Whole numbers from here on are times, not row numbers."""


@dataclass(frozen=True)
class Form:
    """How a table is written."""

    separator: str
    names: tuple[str, ...]
    first_row: int
    """Place of the first row of values among the lines."""
    has_header: bool
    notes: tuple[str, ...]


def form_of(texts: Sequence[str], separator: str | None) -> Form:
    """Find separator, header and first row of values from the first lines that are not blank."""
    stated = _SEPARATOR_LINE.fullmatch(texts[0].strip())
    above = 1 if stated else 0
    plain = [place for place in range(above, len(texts)) if not texts[place].lstrip().startswith("#")]
    table_lines = [texts[place] for place in plain] or [text.lstrip("# ") for text in texts[above:]]
    mark = stated[1] if stated else separator or _separator(table_lines)
    widths = [len(fields_of(line, mark)) for line in table_lines]
    # A header that is no comment may be narrower than the rows: then the rows are wrong.
    width = Counter(widths).most_common(1)[0][0] if widths else 1
    rows = {place: fields_of(texts[place], mark) for place in plain}
    first = next(place for place in plain if len(rows[place]) == width) if plain else len(texts)
    values = [rows[place] for place in plain if place > first]
    header_like = plain and _is_header(rows[first], values)
    comment = first - 1 if plain and first - 1 not in rows and first > above else None
    if not plain:
        comment = len(texts) - 1
    said = fields_of(texts[comment].lstrip("# "), mark) if comment is not None else ()
    notes = [f"fields are separated by {_NAMES[mark]}"] if mark in _NAMES else []
    if (
        said
        and len(said) == (width if plain else len(said))
        and (len(said) > 1 or any(map(is_known, said)))
        and not header_like
    ):
        notes += _skipped(first - 1 if plain else len(texts) - 1)
        return Form(mark, said, first if plain else len(texts), True, tuple(notes))
    if not header_like and plain and first != plain[0] and _is_header(rows[plain[0]], []):
        first = plain[0]
        header_like = True
        values = [rows[place] for place in plain if place > first]
    notes += _skipped(first)
    if not header_like:
        return Form(mark, tuple("" for _ in range(width)), first, False, tuple(notes))
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
    return Form(mark, names, next_row, True, tuple(notes))


_NAMES = {"\t": "tabs", ";": "semicolons", "|": "bars", BLANKS: "blanks"}


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
        width, count = Counter(len(fields_of(line, mark)) for line in lines).most_common(1)[0]
        if width > 1 and (count / len(lines), width) > best:
            best, mark_found = (count / len(lines), width), mark
    if best[0] == 0.0:
        widths = {len(line.split()) for line in lines}
        if len(lines) > 1 and len(widths) == 1 and widths != {1}:
            return BLANKS
        return max((",", ";", "\t", "|"), key=lines[0].count)
    return mark_found


def _is_header(row: Sequence[str], below: Sequence[Sequence[str]]) -> bool:
    """Whether a row contains names: known ones, mostly addresses, no value at all, or text above numbers."""
    if any(map(is_known, row)) or sum(map(is_address, row)) > max(1, len(row) // 2):
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


def unique_names(names: Sequence[str]) -> list[str]:
    """The names, with a number behind one that came before."""
    found: dict[str, int] = {}
    result = []
    for name in names:
        found[name] = found.get(name, 0) + 1
        result.append(name if found[name] == 1 else f"{name} ({found[name]})")
    return result


def are_row_numbers(cells: Sequence[object]) -> bool:
    """Whether the cells of a column are whole numbers too small for times."""
    texts = [str(cell) for cell in cells if cell not in (None, "")]
    return bool(texts) and all(re.fullmatch(r"\d+", text) and int(text) < _FIRST_TIME for text in texts)


def fields_of(line: str, separator: str) -> tuple[str, ...]:
    """The fields of a line without quotes and blanks around them; one empty field if the line is damaged."""
    if separator == BLANKS:
        return tuple(line.split())
    reader = csv.reader([line], delimiter=separator, skipinitialspace=True)
    try:
        return tuple(name.strip() for name in next(reader))
    except (csv.Error, StopIteration):
        return ("",)
