"""Small tables of a site (floors, landmarks, control points), row by row with line numbers: CSV, XLSX."""

from __future__ import annotations

import csv
import errno
import math
import re
import stat
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from vislam2tag.common.documentation import page_of
from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.findings import Finding, FindingKind, Severity, at_lines_if
from vislam2tag.intake.cells import has_decimal_commas, without_unit
from vislam2tag.intake.columns import EAST, FLOOR, HEIGHT, NORTH
from vislam2tag.intake.foreign_table import NOT_UTF8, XLSX, Line, decoded, sheet_lines

_NO_LETTER = re.compile(r"[^a-zäöü]")
_COMMA_NUMBER = re.compile(r"[+-]?\d*,\d+")
_POINT_NUMBER = re.compile(r"[+-]?\d*\.\d+")


@dataclass(frozen=True)
class TableColumns:
    """The columns that a table may have, each with other names for it: lower case, letters only."""

    names: Mapping[str, str]
    texts: frozenset[str]
    """Those that contain no lengths: neither units nor decimal marks are changed there."""
    first: tuple[str, ...]
    """Columns that come first in this order, wherever the file has them."""
    needed: tuple[str, ...]

    def of(self, name: str) -> str | None:
        """The column that a name without unit stands for."""
        if name in self.names:
            return name
        plain = _NO_LETTER.sub("", name)
        return next((column for column, others in self.names.items() if plain in (column, *others.split())), None)


_FLOOR = f"level {FLOOR}"
LANDMARKS = TableColumns(
    {
        "id": "name marker markerid landmark landmarkid no nr number nummer punkt punktnr point pointid marke",
        "x": EAST,
        "y": NORTH,
        "z": HEIGHT,
        "floor": _FLOOR,
        "sigma_m": "sigma sd std accuracy genauigkeit",
        "heading_rad": "",
        "heading_sigma_rad": "",
        "sheet": "",
        "width_m": "",
    },
    texts=frozenset({"id", "floor", "heading_rad", "heading_sigma_rad", "sheet"}),
    first=("id",),
    needed=("x", "y"),
)
CONTROL_POINTS = TableColumns(
    {"x": EAST, "y": NORTH, "id": LANDMARKS.names["id"]}, frozenset({"id"}), first=("x", "y"), needed=("x", "y")
)
ROOMS = TableColumns(
    {"id": "name room raum raumnummer zimmer label bezeichnung number no nr nummer", "x": EAST, "y": NORTH},
    frozenset({"id"}),
    first=("id",),
    needed=("x", "y"),
)
FLOORS = TableColumns(
    {
        "id": f"floor number no nr nummer {_FLOOR}",
        "width": "breite x",
        "height": "depth length länge laenge tiefe y",
        "elevation": "z höhe hoehe altitude",
        "name": "label bezeichnung",
    },
    texts=frozenset({"id", "name"}),
    first=(),
    needed=("id", "width", "height"),
)


_Understood = tuple[tuple[str, ...], tuple[int, ...], tuple[float | None, ...], tuple[str, ...]]
"""Of a table's columns in our order: names, where each is in the file, metres a unit of each (None for columns without
numbers); and what was taken for what, in words."""


def _understood(header: Sequence[str], columns: TableColumns) -> _Understood:
    """Say what a header's fields are; one that is not a column keeps its own name, in lower case."""
    found: list[tuple[str, float]] = []
    guesses: list[str] = []
    for written in header:
        name, factor = _column(written, columns)
        if name is None or name in dict(found):
            found.append((written.lower(), 1.0))
            continue
        found.append((name, factor))
        if name != written.lower():
            unit = "" if factor == 1.0 else f" (a unit is {factor:g} m)"
            guesses.append(f"{written} was read as {name}{unit}")
    own = _column(header[0], columns)[0] if header else None
    order = list(range(len(found)))
    if columns.first[:1] == ("id",) and found and (own == "id" or (own is None and "id" not in dict(found))):
        # The first column is the id, whatever its name, where none is called so.
        guesses = [guess for guess in guesses if not guess.startswith(f"{header[0]} was read as")]
    else:
        names = [name for name, _ in found]
        ahead = [names.index(name) for name in columns.first if name in names]
        order = [*ahead, *(i for i in order if i not in ahead)]
    ours = [found[i] for i in order]
    factors = (factor if name in columns.names and name not in columns.texts else None for name, factor in ours)
    return tuple(name for name, _ in ours), tuple(order), tuple(factors), tuple(guesses)


def _column(written: str, columns: TableColumns) -> tuple[str | None, float]:
    """The column that a field of a header names, and metres a unit."""
    text = written.strip().lower()
    if text in columns.names:
        return text, 1.0
    written_name, unit_m = without_unit(text)
    name = columns.of(written_name)
    if unit_m is not None and name is not None and name not in columns.texts:
        return name, unit_m
    return columns.of(text), 1.0


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
    header_lines: tuple[int, ...] = ()
    """1-based line of the header, for a finding; empty where there is none."""

    def cell(self, fields: tuple[str, ...], column: str) -> str:
        """Return the text of a named column in a row; empty where the row or the file has none."""
        if column not in self.header:
            return ""
        index = self.header.index(column)
        return fields[index] if index < len(fields) else ""

    def place(self, line: int) -> str:
        """Name a line of the file, ``floor_1/marker_dict.csv:3``."""
        return f"{self.file}:{line}"

    def missing_columns(self, columns: TableColumns) -> str | None:
        """The error for a header with a missing column; None if it is complete."""
        found = self.header[1:] if columns.first[:1] == ("id",) else self.header
        missing = [name for name in columns.needed if name not in found]
        if not missing:
            return None
        names = list(dict.fromkeys((*columns.first, *columns.needed)))
        if any(map(is_number, self.header)):
            shown = ",".join(self.header)[:_SHOWN]
            return f"there is no header: '{shown}' looks like data; put {','.join(names)} or the like above it"
        optional = [name for name in columns.names if name not in ("id", *columns.needed)]
        return (
            f"the first line must be: {','.join(names)} (then optional columns: {', '.join(optional)}), or such names "
            f"as a spreadsheet has ({page_of('reference/formats')}); it does not contain "
            f"{' and '.join(missing)} and is: {','.join(self.header)[:_SHOWN] or 'empty'}"
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
    (names, order, factors, taken), rows = _understood(first, columns), lines[1:]
    if not has_header and not set(columns.needed) <= set(names):
        (_, order, factors, _), rows = _understood(columns.needed, columns), lines
        names, taken = (), ()
    split = dict.fromkeys(line for line, fields in rows if has_decimal_commas(fields, len(order)))
    ordered = [(line, _reordered(fields, order)) for line, fields in rows if line not in split]
    numbers = [text for _, fields in ordered for text, factor in zip(fields, factors, strict=False) if factor]
    comma = any(map(_COMMA_NUMBER.fullmatch, numbers)) and not any(map(_POINT_NUMBER.fullmatch, numbers))

    def in_metres(place: int, text: str) -> str:
        """A number's text in metres with a decimal point; other text as it is."""
        factor = factors[place] if place < len(factors) else None
        if comma and factor is not None and _COMMA_NUMBER.fullmatch(text):
            text = text.replace(",", ".")
        return repr(float(text) * factor) if factor not in (None, 1.0) and is_number(text) else text

    made = tuple((line, tuple(in_metres(*cell) for cell in enumerate(fields))) for line, fields in ordered)
    guesses = [*taken, *guesses, *(["numbers have a decimal comma"] if comma else [])]
    findings: tuple[Finding, ...] = ()
    if guesses:
        message = f"{'; '.join(guesses)}: correct the file if this is wrong"
        guessed = Finding.at_lines("assumed_columns", name, [head_line], message, Severity.INFO)
        findings = (guessed.model_copy(update={"count": max(1, len(made))}),)
    message = (
        "rows have more values than columns, as if numbers had decimal commas; they are skipped: separate the columns "
        "by ;"
    )
    findings += tuple(at_lines_if("malformed_lines", name, list(split), message))
    return SiteTable(name, names, made, findings, (head_line,) if names else ())


def _reordered(fields: tuple[str, ...], order: Sequence[int]) -> tuple[str, ...]:
    if list(order) == list(range(len(order))):
        return fields
    cells = [fields[i] if i < len(fields) else "" for i in order]
    return (*cells, *fields[len(order) :])


def _text_lines(path: Path) -> tuple[list[Line], list[str]]:
    """Lines of a text file with their fields, and what was guessed of it."""
    raw = read_bytes(path)
    if raw.startswith(b"PK"):
        raise OSError(errno.EINVAL, "it is a spreadsheet (XLSX), not text: save it as CSV", str(path))
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


def site_finding(kind: FindingKind, file: str, message: str, severity: Severity = Severity.WARNING) -> Finding:
    """One problem of one file of a site."""
    return Finding(kind=kind, file=file, count=1, message=message, severity=severity)


def unreadable_file(file: str, error: OSError, consequence: str) -> Finding:
    """Report a site file that is there but cannot be opened."""
    message = (
        f"cannot be opened ({error.strerror}): {consequence}; check its permissions"
        if isinstance(error, PermissionError)
        else f"cannot be read ({error.strerror}): {consequence}"
    )
    return site_finding("unreadable_file", file, message, Severity.ERROR)


def _fields(line: str, separator: str) -> tuple[str, ...]:
    reader = csv.reader([line.rstrip("\r")], delimiter=separator, skipinitialspace=True)
    try:
        return tuple(field.strip() for field in next(reader))
    except (csv.Error, StopIteration):
        return ("",)


def is_number(text: str) -> bool:
    """Whether a text is a finite number."""
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def number_or_none(text: str) -> float | None:
    """Parse an optional number: empty text is None. Raises ValueError for what is not a number."""
    if not text:
        return None
    if "_" in text:
        raise ValueError(f"'{text}' is not a number")
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
    lines: dict[FindingKind, list[int]] = field(default_factory=dict)

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
    """Return whether a file is there; raises OSError where that cannot be known.

    ``Path.is_file`` answers False or raises there, depending on Python's version.
    """
    try:
        return stat.S_ISREG(path.stat().st_mode)
    except OSError as error:
        if error.errno in _ABSENT:
            return False
        raise
