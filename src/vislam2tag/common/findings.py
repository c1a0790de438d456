"""Findings: data problems that are counted and reported instead of raised or dropped."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from typing import Self, TypeAlias

from vislam2tag.common.records import Record

FindingKind: TypeAlias = str
"""A kind of ``finding_kinds.toml``; files of other versions may contain kinds that this one does not know."""

ROWS_NAMED = 5
"""How many line numbers a finding names; the rest is only counted."""


class Severity(StrEnum):
    """How much a finding matters to whoever uses the labels."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


class Finding(Record):
    """One kind of problem in one file of one session (or of the site)."""

    kind: FindingKind
    """Stable code, e.g. ``malformed_lines``; docs/reference/findings.md lists them all."""
    file: str
    """File name inside the session folder, or path relative to the survey; empty for the session as a whole."""
    count: int
    """How many lines, rows, frames or landmarks are concerned."""
    message: str
    """One sentence: what was expected, what was done about it, what to do."""
    severity: Severity = Severity.WARNING
    lines: tuple[int, ...] = ()
    """The first few 1-based line numbers concerned (at most :data:`ROWS_NAMED`)."""

    @classmethod
    def at_lines(
        cls, kind: FindingKind, file: str, lines: list[int], message: str, severity: Severity = Severity.WARNING
    ) -> Self:
        """Make a finding from all the 1-based line numbers it concerns."""
        return cls(
            kind=kind,
            file=file,
            count=len(lines),
            message=message,
            severity=severity,
            lines=tuple(lines[:ROWS_NAMED]),
        )


def finding_if(
    count: int, kind: FindingKind, message: str, file: str = "", severity: Severity = Severity.INFO
) -> tuple[Finding, ...]:
    """Report what was counted, if anything was."""
    return (Finding(kind=kind, file=file, count=count, message=message, severity=severity),) if count else ()


def at_lines_if(
    kind: FindingKind, file: str, lines: list[int], message: str, severity: Severity = Severity.WARNING
) -> list[Finding]:
    """Report the 1-based lines concerned, if there are any."""
    return [Finding.at_lines(kind, file, lines, message, severity)] if lines else []


def count_of(severity: Severity, findings: Iterable[Finding]) -> int:
    """How many findings are of a severity."""
    return sum(finding.severity is severity for finding in findings)


def pooled(findings: Iterable[Finding]) -> list[Finding]:
    """Sum findings of the same kind and message, in the order in which they first came."""
    counts: dict[tuple[FindingKind, str, Severity], int] = {}
    for finding in findings:
        key = (finding.kind, finding.message, finding.severity)
        counts[key] = counts.get(key, 0) + finding.count
    return [
        Finding(kind=kind, file="", count=count, message=message, severity=severity)
        for (kind, message, severity), count in counts.items()
    ]
