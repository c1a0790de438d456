"""Names of points and landmarks, and findings about ids that do not match."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from vislam2tag.common.errors import UsageError
from vislam2tag.common.findings import Finding, FindingKind, Severity
from vislam2tag.intake.ids import IdComparison, compare_ids
from vislam2tag.site.model import landmark_id

PlaceByPoint = Mapping[str, complex]
"""Where points are by name, x + iy, metres."""


class Role(StrEnum):
    """What a point is registered as."""

    LANDMARK = "landmark"
    LEFT = "left edge"
    RIGHT = "right edge"
    CONTROL = "control point"
    TIE = "tie"
    """Ties stations together, and is nothing in the site."""


_EDGES = {"_L": Role.LEFT, "_R": Role.RIGHT}
"""Endings of shots of a sheet's left and right edge, as one looks at it."""
_CONTROL, _TIE = "control point ", "tie "
"""How the keys of such points begin."""


@dataclass(frozen=True)
class NameRules:
    """Patterns with one ``*``, which stands for the id; ties and control points come before landmarks."""

    landmarks: str = "*"
    control_points: str = "CP*"
    ties: str = "TP*"

    def __post_init__(self) -> None:
        for option, pattern in (
            ("landmark-names", self.landmarks),
            ("control-points", self.control_points),
            ("ties", self.ties),
        ):
            if pattern.count("*") != 1:
                raise UsageError(
                    f"--{option} '{pattern}': the pattern must contain one * in place of the id, such as LM*"
                )

    def key(self, name: str) -> str:
        """The one name of a point however a file spells it: ``7``, ``7_L``, ``control point 3``, ``tie TP1``.

        What matches no pattern is a tie.
        """
        if _matched(self.ties, name) is not None:
            return _TIE + name
        number = _matched(self.control_points, name)
        if number is not None and re.fullmatch(r"\d{1,6}", number):
            return control_key(str(int(number)))
        landmark = _matched(self.landmarks, name)
        if landmark is None:
            return _TIE + name
        ending = landmark[-2:].upper()
        if ending in _EDGES and len(landmark) > len(ending):
            return landmark_id(landmark[:-2]) + ending
        return landmark_id(landmark)


def control_key(number: str) -> str:
    """Key of a control point by its number."""
    return _CONTROL + number


def point_label(key: str) -> str:
    """How messages call a point: a tie by its name alone."""
    return key.removeprefix(_TIE)


def role_of(key: str) -> tuple[Role, str]:
    """Role and id of a point by its key."""
    if key.startswith(_TIE):
        return Role.TIE, key.removeprefix(_TIE)
    if key.startswith(_CONTROL):
        return Role.CONTROL, key.removeprefix(_CONTROL)
    role = _EDGES.get(key[-2:])
    return (Role.LANDMARK, key) if role is None else (role, key[:-2])


def _matched(pattern: str, name: str) -> str | None:
    """What stands for the ``*``; None where the name does not match. Case does not matter."""
    before, _, after = pattern.partition("*")
    match = re.fullmatch(f"{re.escape(before)}(.+){re.escape(after)}", name, re.IGNORECASE)
    return match.group(1) if match else None


FAR_M = 1.0
"""A landmark further than this from where the site has it hangs elsewhere."""
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
            f"the ids seem to be shifted: each measured landmark is where the site has the one with the "
            f"next {'higher' if shift > 0 else 'lower'} id; "
            "correct the names in the station's file, or the ids in marker_dict.csv"
        )
        return [_finding("shifted_ids", len(placed), message)]
    names = tuple(placed) or tuple(ties)
    if not table.ids or not names:
        return []
    found = compare_ids(table.ids, names, (f"the landmark table of floor {table.floor}", "the measurement"))
    if not found.differ or not _concerns_the_table(found, table, placed, expected):
        return []
    waiting = (
        f"; landmarks of the table that stay planned and are not used: {len(table.planned)}" if table.planned else ""
    )
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
        "Use the ids of the table, with --landmark-names or in the station's file; if these are additional "
        "landmarks, first add rows with their ids to marker_dict.csv"
    )
