"""Names of what was measured against the ids of the floor's landmark table."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.intake.ids import IdComparison, NamedIds, compare_ids

FAR_M = 1.0
"""A landmark farther than this from where the site has it hangs elsewhere."""
MIN_NAMES = 3
MIN_SHARE = 0.8


@dataclass(frozen=True)
class LandmarkTable:
    """What the site has of a floor's landmarks."""

    floor: int
    ids: tuple[str, ...] = ()
    planned: Collection[str] = ()
    """Those whose position was only planned, and which wait for a measurement."""


def id_findings(
    table: LandmarkTable, placed: Mapping[str, complex], ties: Sequence[str], expected: Mapping[str, complex]
) -> list[Finding]:
    """Report measured landmarks (``placed``) whose names are of another kind than the table's, or shifted.

    ``ties`` are the points that were taken for no landmark by their names; they count only if nothing else was placed.
    """
    shift = _shift(placed, expected)
    if shift:
        message = (
            f"the ids seem to be shifted: the landmarks measured lie where the site has those with ids {shift:+d}; "
            "correct the names in the station's file, or the ids in marker_dict.csv"
        )
        return [_finding("shifted_ids", len(placed), message)]
    names = tuple(placed) or tuple(ties)
    if not table.ids or not names:
        return []
    ours = NamedIds(f"the landmark table of floor {table.floor}", table.ids)
    found = compare_ids(ours, NamedIds("what was measured", names))
    if not found.differ or not _concerns_the_table(found, table, placed, expected):
        return []
    waiting = f"; {len(table.planned)} landmarks of the table stay planned and are not used" if table.planned else ""
    message = f"the names do not match: {found.text}{waiting}. {_cure(found)}"
    return [_finding("other_ids", len(found.unknown), message)]


def _finding(kind: FindingKind, count: int, message: str) -> Finding:
    return Finding(kind=kind, file="", count=count, message=message, severity=Severity.ERROR)


def _shift(placed: Mapping[str, complex], expected: Mapping[str, complex]) -> int:
    """The constant that is to be added to names so that they lie where the site has them; 0 if they need none."""
    numbers = {int(name): at for name, at in placed.items() if name.isdecimal()}
    if len(numbers) < MIN_NAMES or _near(numbers, expected, 0) > len(numbers) / 2:
        return 0
    near = {shift: _near(numbers, expected, shift) for shift in (-1, 1)}
    best = max(near, key=near.__getitem__)
    return best if near[best] >= max(MIN_NAMES - 1, MIN_SHARE * (len(numbers) - 1)) else 0


def _near(numbers: Mapping[int, complex], expected: Mapping[str, complex], shift: int) -> int:
    return sum(
        abs(at - expected[str(number + shift)]) < FAR_M
        for number, at in numbers.items()
        if str(number + shift) in expected
    )


def _concerns_the_table(
    found: IdComparison, table: LandmarkTable, placed: Mapping[str, complex], expected: Mapping[str, complex]
) -> bool:
    """Whether the names are those of the table, and not of landmarks that come to it."""
    if table.planned:
        return True
    pairs = [] if found.pattern is None else list(found.pattern.mapping.items())
    known = [(placed[theirs], expected[ours]) for theirs, ours in pairs if theirs in placed and ours in expected]
    if known:
        return sum(abs(one - other) < FAR_M for one, other in known) > len(known) / 2
    return not placed


def _cure(found: IdComparison) -> str:
    """What to do; the option, if a prefix or suffix makes the difference."""
    if found.pattern is not None:
        theirs, ours = next(iter(found.pattern.mapping.items()))
        if ours in theirs:
            return f"Register again with --landmark-names '{theirs.replace(ours, '*', 1)}'"
    return (
        "Give the points the ids of the table, by --landmark-names or in the station's file; if they are further "
        "landmarks, add rows with their ids to marker_dict.csv first"
    )
