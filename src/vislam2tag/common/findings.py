"""What checks report: findings (data problems that are counted and reported, not raised or dropped), and the answer.

A check answers that nothing is wrong, that something is, that it did not look, or that it could not judge; an empty
list of findings is none of these. It keeps its :class:`Judgement` beside its list, in files and in what ``--json``
prints.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from typing import Self, TypeAlias

from vislam2tag.common.records import Record

FindingKind: TypeAlias = str
"""A kind of ``finding_kinds.toml``; files of other versions may contain kinds that this one does not know."""


def described(kind: FindingKind) -> tuple[str, str]:
    """What a kind of finding means, and what to do: sentences of ``finding_kinds.toml``."""
    import tomllib  # few commands need these
    from importlib.resources import files

    entry, *_ = tomllib.loads((files("vislam2tag.common") / "finding_kinds.toml").read_text(encoding="utf-8"))[kind]
    return entry["meaning"], entry["cure"]


ROWS_NAMED = 5
"""How many line numbers a finding names; the rest is only counted."""


class Severity(StrEnum):
    """How much a finding matters to users of the labels."""

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


class FaultKind(StrEnum):
    """What is wrong with a survey."""

    SWAPPED = "swapped"
    """Two sheets are interchanged, or three in a circle."""
    MIS_SURVEYED = "mis_surveyed"
    """A landmark is not where the table says."""
    MOVED = "moved"
    """... since a date."""
    TWO_PLACES = "two_places"
    """Two sheets with one id."""
    TWO_FLOORS = "two_floors"
    """Sheets on two floors with one id, in one walk."""
    OTHER_IDS = "other_ids"
    """Walks logged other ids than the landmark table has."""
    SHIFTED_IDS = "shifted_ids"
    """... that differ by a constant."""
    PLANNED = "planned"
    """Positions of landmarks that were only planned."""
    WRONG_FLOOR = "wrong_floor"
    """A session is in another floor's folder."""
    MIRRORED = "mirrored"
    TURNED = "turned"
    UNITS = "units"
    """A floor's landmark table is mirrored, turned, or in another unit than metres."""
    CLOCK = "clock"
    """A stream of a session runs on another clock than its poses."""
    REPEATED_SCANS = "repeated_scans"
    """A phone delivers old scans as new ones."""
    OTHER_DEVICE = "other_device"
    """A session is in another device's folder."""
    DOUBTFUL_FIX = "doubtful_fix"
    """A known position of a walk without poses that the others contradict."""
    ODD_REFERENCE = "odd_reference"
    """A surveyed place, what a walk or all of a day saw of a landmark, or a device's metre, that all others contradict.

    No correction is known.
    """


class Answer(StrEnum):
    """What a check can say."""

    NOTHING_WRONG = "nothing_wrong"
    WRONG = "wrong"
    NOT_LOOKED_AT = "not_looked_at"
    NOT_JUDGED = "not_judged"


class Judgement(Record):
    """The answer of a check, with what it looked at and why it did not look or could not judge."""

    answer: Answer
    looked_at: str = ""
    """What was judged, and how much: ``8 landmarks in 3 walks``; empty if nothing was."""
    why: str = ""
    """Why all or the rest was not looked at or could not be judged: a clause."""
    warnings: int = 0
    """Findings that are worth a look and make nothing wrong."""

    @classmethod
    def of(cls, wrong: int, judged: int, looked_at: str, why: str, warnings: int = 0) -> Judgement:
        """The answer of a check that found ``wrong`` faults in the ``judged`` things that ``looked_at`` counts.

        ``why`` says what the check needs if ``judged`` is 0, else what it left out; it may then be empty.
        """
        if wrong:
            return cls(answer=Answer.WRONG, looked_at=looked_at if judged else "", why=why, warnings=warnings)
        if not judged:
            return cls(answer=Answer.NOT_JUDGED, why=why, warnings=warnings)
        return cls(answer=Answer.NOTHING_WRONG, looked_at=looked_at, why=why, warnings=warnings)

    @property
    def sentence(self) -> str:
        """The answer in words, without a full stop."""
        beside = f", {counted(self.warnings, 'warning')}" if self.warnings else ""
        looked = f" (looked at: {self.looked_at})" if self.looked_at else ""
        rest = f"; {self.why}" if self.why else ""
        return {
            Answer.NOTHING_WRONG: f"nothing is wrong{beside}{looked}{rest}",
            Answer.WRONG: f"something is wrong{beside}{looked}{rest}",
            Answer.NOT_LOOKED_AT: f"not looked at{beside}: {self.why}",
            Answer.NOT_JUDGED: f"could not be judged{beside}: {self.why}",
        }[self.answer]


NOT_RUN = Judgement(answer=Answer.NOT_LOOKED_AT, why="the check was not run")
"""Of records that were written before checks said what they looked at."""


def counted(number: int, thing: str) -> str:
    """A number with its noun: ``1 walk``, ``2 walks``."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def none_mapped(sessions: int) -> str:
    """Why nothing can be judged if all sessions failed: a clause."""
    return f"{'the session cannot' if sessions == 1 else f'none of {sessions} sessions can'} be read or mapped"
