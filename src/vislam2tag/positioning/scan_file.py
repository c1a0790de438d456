"""Reads scans to locate from CSV or JSON lines block by block, because files may be larger than memory.

There is one reading in each line: ``scan_id``, ``bssid``, ``rssi_dbm``, and, if known, the scan's ``session`` and
``time_ns``. The readings of a scan are on successive lines (docs/how-to/locate.md).
"""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.given_files import plain
from vislam2tag.common.findings import ROWS_NAMED, Finding, FindingKind
from vislam2tag.intake.columns import TIME, find_columns
from vislam2tag.intake.fillers import Filler, Judgement, filler_found, filler_of
from vislam2tag.intake.foreign_table import UTF16_MARKS
from vislam2tag.intake.level_scales import SIGNAL_STRENGTH, OtherLevels, in_range, may_be_other, other_levels
from vislam2tag.intake.readings import address_fault, is_masked, level_of, masked_addresses, normal_address
from vislam2tag.positioning.radio_scans import RadioScans, TextArray, scans_from_readings

COLUMNS = ("scan_id", "bssid", "rssi_dbm")
_ROLES = {"scan_id": "scan", "bssid": "address", "rssi_dbm": "level"}
WALK_COLUMNS = ("session", "time_ns")
"""Optional columns: walk and time of the scan, from its first line."""
JSON_SUFFIXES = (".jsonl", ".ndjson", ".json")
SCANS_AT_ONCE = 4096
_WHOLE_NUMBER = re.compile(r"-?[0-9]{1,18}")
MALFORMED: FindingKind = "malformed_lines"
ABSURD: FindingKind = "absurd_levels"
UNTIMED: FindingKind = "untimed_scans"
MASKED: FindingKind = "masked_addresses"
NOT_DBM: FindingKind = "levels_not_dbm"
FILLER: FindingKind = "unstated_filler"
_OPTIONAL = (*WALK_COLUMNS, "ssid")
Fields = tuple[str, str, str, str, str, str]
"""Scan, access point, level, session, time and name of the network as text; empty if missing."""
_ODD_KEPT = 100_000
_LONGEST_HEADER = 10_000
_LEFT_OUT = "these lines are skipped"
_MESSAGES: dict[FindingKind, str] = {
    MALFORMED: f"expected {', '.join(COLUMNS)}, with a number as level; {_LEFT_OUT}",
    UNTIMED: "time_ns is not a whole number; these scans are located one by one, without their session",
}


@dataclass(frozen=True)
class ScanBlock:
    """Some scans of a file, in file order."""

    ids: TextArray
    scans: RadioScans


@dataclass
class BadLines:
    """Counts unusable lines while a file is read."""

    file: str
    counts: dict[FindingKind, int] = field(default_factory=dict)
    first: dict[FindingKind, list[int]] = field(default_factory=dict)
    levels: int = 0
    """Number of lines with a numeric level."""
    masked: set[str] = field(default_factory=set)
    """Placeholders for unknown addresses in the file."""
    filler: Filler | None = None
    """The level that means "not heard"."""
    odd: list[float] = field(default_factory=list)
    """The first levels that may be in another form than dBm."""

    def add(self, kind: FindingKind, line: int) -> None:
        """Count a line (1-based)."""
        self.counts[kind] = self.counts.get(kind, 0) + 1
        named = self.first.setdefault(kind, [])
        if len(named) < ROWS_NAMED:
            named.append(line)

    def findings(self) -> tuple[Finding, ...]:
        """Report what was counted, in order of kind."""
        if NOT_DBM in self.counts and self._form() is None:
            self._join(NOT_DBM, ABSURD)
        return tuple(
            self._finding(kind).model_copy(update={"count": count, "lines": tuple(self.first[kind])})
            for kind, count in sorted(self.counts.items())
        )

    def _form(self) -> OtherLevels | None:
        """The form of most levels, if it is not dBm."""
        return other_levels(pl.Series(self.odd), self.levels * len(self.odd) // self.counts[NOT_DBM])

    def _finding(self, kind: FindingKind) -> Finding:
        count, lines = self.counts[kind], self.first[kind]
        if kind == MASKED:
            return masked_addresses(self.file, lines, list(self.masked))
        if kind == NOT_DBM and (form := self._form()) is not None:
            return form.finding(self.file, count, lines, _LEFT_OUT)
        if kind == ABSURD:
            return SIGNAL_STRENGTH.outside(self.file, lines, _LEFT_OUT)[0]
        if kind == FILLER and self.filler is not None:
            return filler_found(self.file, replace(self.filler, share=count / self.levels), count, None)
        return Finding.at_lines(kind, self.file, lines, _MESSAGES[kind])

    def _join(self, kind: FindingKind, into: FindingKind) -> None:
        """Count the lines of one kind as another kind."""
        self.counts[into] = self.counts.get(into, 0) + self.counts.pop(kind)
        self.first[into] = sorted([*self.first.get(into, []), *self.first.pop(kind)])[:ROWS_NAMED]


@dataclass
class _Gathered:
    """The readings of the scans that become one block."""

    ids: dict[str, int] = field(default_factory=dict)
    rows: list[int] = field(default_factory=list)
    bssids: list[str] = field(default_factory=list)
    levels: list[float] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    ssids: list[str] = field(default_factory=list)
    sessions: list[str] = field(default_factory=list)
    times_ns: list[int] = field(default_factory=list)

    def full(self, session: str) -> bool:
        """Whether a scan of this session belongs to the next block, because walks are not split."""
        return len(self.ids) >= SCANS_AT_ONCE and not (session and session == self.sessions[-1])

    def begin(self, scan_id: str, session: str, time_ns: int) -> None:
        """Begin the next scan, without readings."""
        self.ids[scan_id] = len(self.ids)
        self.sessions.append(session)
        self.times_ns.append(time_ns)

    def filler(self) -> Filler | None:
        """The level that means "not heard" in these scans; None if there is none."""
        heard = pl.DataFrame(
            {"bssid": self.bssids, "rssi_dbm": self.levels}, {"bssid": pl.String, "rssi_dbm": pl.Float64}
        )
        points = heard["bssid"].n_unique()
        found = filler_of(heard, points, len(self.ids) * points - heard.height, SIGNAL_STRENGTH)
        return found if found.judgement is Judgement.FOUND else None

    def leave_out(self, filler: float, bad: BadLines) -> None:
        """Drop the readings with a level that means "not heard"."""
        kept = [number for number, level in enumerate(self.levels) if level != filler]
        for line, level in zip(self.lines, self.levels, strict=True):
            if level == filler:
                bad.add(FILLER, line)
        self.rows = [self.rows[number] for number in kept]
        self.bssids = [self.bssids[number] for number in kept]
        self.levels = [self.levels[number] for number in kept]

    def block(self) -> ScanBlock:
        scans = scans_from_readings(
            np.array(self.rows, dtype=np.int64),
            np.array(self.bssids, dtype=np.str_),
            np.array(self.levels, dtype=np.float64),
            len(self.ids),
            session=np.array(self.sessions, dtype=np.str_),
            time_ns=np.array(self.times_ns, dtype=np.int64),
        )
        return ScanBlock(np.array(list(self.ids), dtype=np.str_), scans)


def is_scan_file(path: Path) -> bool:
    """Whether a file is JSON lines, or a table that names ``scan_id`` in its first line; False if it is unreadable.

    A table without times may have other known names of scans, addresses and levels, such as ``scan,MAC,rss``.
    """
    if path.suffix.lower() in JSON_SUFFIXES:
        return True
    try:
        with _opened(path) as text:
            first = re.split("[,;\t]", text.readline(_LONGEST_HEADER))
            names = [name.strip(' "\r\n') for name in first]
    except OSError:
        return False
    return COLUMNS[0] in names or find_columns(names, (*_ROLES.values(), TIME)).keys() == set(_ROLES.values())


def _opened(path: Path) -> TextIO:
    """Open a file in UTF-8, or in UTF-16 if it starts with that byte order mark; raises OSError if it is unreadable."""
    with plain(path).open("rb") as file:
        utf16 = file.read(2) in UTF16_MARKS
    return path.open(encoding="utf-16" if utf16 else "utf-8-sig", errors="replace", newline="")


def _with_our_names(header: list[str]) -> list[str]:
    """A header with the names of :data:`COLUMNS` instead of others of the same meaning."""
    found = find_columns(header, _ROLES.values())
    renamed = {found[role].name: name for name, role in _ROLES.items() if name not in header and role in found}
    return [renamed.get(name, name) for name in header]


def scan_blocks(
    path: Path, bad: BadLines, name: Callable[[str], str], known: Sequence[str] = ()
) -> Iterator[ScanBlock]:
    """Read some thousand scans at a time, without splitting walks; ``name`` makes the model's name from a ``bssid``.

    ``known`` are the model's names. A scan without a usable line is included, without readings. Raises DatasetError if
    the file cannot be read, a column is missing or is another one, or the readings of a scan are not together.
    """
    for number, gathered in enumerate(_gathered(path, bad, name)):
        if number == 0:
            if (fault := address_fault(gathered.bssids, gathered.ssids, known)) is not None:
                raise DatasetError(f"{path}, line 1: {fault}")
            bad.filler = gathered.filler()
        if bad.filler is not None:
            gathered.leave_out(bad.filler.level, bad)
        yield gathered.block()


def _gathered(path: Path, bad: BadLines, name: Callable[[str], str]) -> Iterator[_Gathered]:
    gathered, last = _Gathered(), None
    for line, fields in _lines(path, bad):
        scan_id = fields[0]
        if scan_id != last:
            if scan_id in gathered.ids:
                raise DatasetError(
                    f"{path}, line {line}: scan {scan_id} appears again after another scan; the readings of a scan "
                    "must be on successive lines: sort the file by scan_id"
                )
            session, time_ns = _walk(fields, line, bad)
            if gathered.full(session):
                yield gathered
                gathered = _Gathered()
            gathered.begin(scan_id, session, time_ns)
            last = scan_id
        level = _level_dbm(fields, line, bad)
        if level is not None:
            gathered.rows.append(gathered.ids[scan_id])
            gathered.bssids.append(name(fields[1]))
            gathered.levels.append(level)
            gathered.lines.append(line)
            gathered.ssids.append(fields[5])
    if gathered.ids:
        yield gathered


def _walk(fields: Fields, line: int, bad: BadLines) -> tuple[str, int]:
    """Return session and time of a scan; neither if one of them is missing."""
    session, time_ns = fields[3:5]
    if not (session and time_ns):
        return "", 0
    if _WHOLE_NUMBER.fullmatch(time_ns) is None:
        bad.add(UNTIMED, line)
        return "", 0
    return session, int(time_ns)


def _level_dbm(fields: Fields, line: int, bad: BadLines) -> float | None:
    level = level_of(fields[2])
    if not math.isfinite(level):
        bad.add(MALFORMED, line)
        return None
    bad.levels += 1
    if is_masked(fields[1]):
        bad.add(MASKED, line)
        bad.masked.add(normal_address(fields[1]))
    elif in_range(level):
        return level
    elif may_be_other(level):
        bad.add(NOT_DBM, line)
        bad.odd += [level] if len(bad.odd) < _ODD_KEPT else []
    else:
        bad.add(ABSURD, line)
    return None


def _lines(path: Path, bad: BadLines) -> Iterator[tuple[int, Fields]]:
    """Yield each line's number, and its scan (never empty), access point and level as text."""
    read = _json_lines if path.suffix.lower() in JSON_SUFFIXES else _csv_lines
    try:
        with _opened(path) as text:
            for line, fields in read(path, text):
                if fields is None or not fields[0]:
                    bad.add(MALFORMED, line)
                else:
                    yield line, fields
    except OSError as error:
        raise DatasetError(
            f"{path}: cannot be read ({error.strerror}); pass a CSV file, JSON lines or a data set"
        ) from error


def _csv_lines(path: Path, text: TextIO) -> Iterator[tuple[int, Fields | None]]:
    rows = csv.reader(text)
    try:
        header = _with_our_names([name.strip() for name in next(rows, [])])
    except csv.Error:  # a field longer than any name
        header = []
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        apart = " and separate fields by commas, not semicolons" if any(";" in name for name in header) else ""
        raise DatasetError(
            f"{path}, line 1: no column {missing[0]}; the first line must name {', '.join(COLUMNS)}{apart}"
        )
    places = [header.index(name) if name in header else None for name in (*COLUMNS, *_OPTIONAL)]
    while True:
        try:
            row = next(rows)
        except StopIteration:
            return
        except csv.Error:
            yield rows.line_num, None
            continue
        if row:
            yield rows.line_num, _texts(row, places) if len(row) == len(header) else None


def _texts(row: Sequence[str], places: Sequence[int | None]) -> Fields:
    scan_id, bssid, level, session, time_ns, ssid = ("" if place is None else row[place].strip() for place in places)
    return scan_id, bssid, level, session, time_ns, ssid


def _json_lines(path: Path, text: TextIO) -> Iterator[tuple[int, Fields | None]]:
    del path
    for line, row in enumerate(text, start=1):
        if not row.strip():
            continue
        try:
            fields = json.loads(row)
        except (ValueError, RecursionError):
            fields = None
        yield line, _fields(fields) if isinstance(fields, dict) else None


def _fields(values: Mapping[str, Any]) -> Fields:
    scan_id, bssid, session, time_ns, ssid = (_text(values.get(name)) for name in ("scan_id", "bssid", *_OPTIONAL))
    level = values.get("rssi_dbm")
    known = isinstance(level, int | float) and not isinstance(level, bool)
    return scan_id, bssid, repr(level) if known else _text(level), session, time_ns, ssid


def _text(value: object) -> str:
    return str(value).strip() if isinstance(value, str | int) and not isinstance(value, bool) else ""
