"""Small comma-separated site files (floors, landmarks, control points), row by row with line numbers."""

from __future__ import annotations

import csv
import errno
import math
import stat
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.common.plain_files import read_bytes


@dataclass(frozen=True)
class SiteTable:
    """The rows of one site file; ``rows`` pairs each 1-based line number with its fields, stripped."""

    file: str
    """Path relative to the survey."""
    header: tuple[str, ...]
    """Column names in lower case; empty where the file has no header."""
    rows: tuple[tuple[int, tuple[str, ...]], ...]

    def cell(self, fields: tuple[str, ...], column: str) -> str:
        """Return the text of a named column in a row; empty where the row or the file has none."""
        if column not in self.header:
            return ""
        index = self.header.index(column)
        return fields[index] if index < len(fields) else ""

    def place(self, line: int) -> str:
        """Name a line of the file, ``floor_1/marker_dict.csv:3``."""
        return f"{self.file}:{line}"


def read_site_table(root: Path, path: Path, *, has_header: bool = True) -> SiteTable:
    """Read a site file; blank lines are skipped. Raises OSError where it cannot be opened."""
    text = read_bytes(path).decode("utf-8-sig", errors="replace")
    lines = enumerate(text.split("\n"), start=1)
    rows = tuple((number, _fields(line)) for number, line in lines if line.strip())
    header = tuple(name.lower() for name in rows[0][1]) if has_header and rows else ()
    return SiteTable(path.relative_to(root).as_posix(), header, rows[1:] if has_header else rows)


def unreadable_file(file: str, error: OSError, consequence: str) -> Finding:
    """Report a site file that is there but cannot be opened."""
    message = f"cannot be opened ({error.strerror}): {consequence}; check its permissions"
    return Finding(kind="unreadable_file", file=file, count=1, message=message, severity=Severity.ERROR)


def _fields(line: str) -> tuple[str, ...]:
    try:
        return tuple(field.strip() for field in next(csv.reader([line.rstrip("\r")], skipinitialspace=True)))
    except (csv.Error, StopIteration):
        return ("",)


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
    lines: dict[str, list[int]]

    @classmethod
    def of(cls, file: str) -> LineCounts:
        """Start with nothing counted."""
        return cls(file, {})

    def add(self, kind: str, line: int) -> None:
        """Count one line."""
        self.lines.setdefault(kind, []).append(line)

    def findings(self, messages: dict[str, str]) -> list[Finding]:
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
