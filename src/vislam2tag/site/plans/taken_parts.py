"""What each layer, class or category of a plan's file became."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from fnmatch import fnmatch


class Became(StrEnum):
    """What a part of a plan's file stands for."""

    WALLS = "walls"
    DOORS = "doors"
    OPENINGS = "openings"
    WALKABLE = "walkable"
    OBSTACLES = "obstacles"
    OUTLINE = "outline"
    TEXT = "text"
    LEFT_OUT = "left out"


@dataclass(frozen=True)
class TakenPart:
    """A layer, class or category of a plan's file, and what it became."""

    name: str
    became: Became
    count: int
    """Lines, polygons or texts in it."""
    why: str = ""
    """Why it was left out, a clause such as "furniture" or "frozen layer"."""


IGNORED = "ignored as asked"
"""Why a part was left out that the user names."""


def taken_parts(found: Iterable[tuple[str, Became, str]]) -> tuple[TakenPart, ...]:
    """Count the parts of a file by name, what they became and why."""
    return tuple(TakenPart(name, became, count, why) for (name, became, why), count in Counter(found).items())


def matching(names: Collection[str], patterns: Sequence[str], what: str = "class") -> set[str]:
    """Names that one of the patterns matches (``*`` and ``?``, in any case).

    Raises OSError, whose text completes a sentence about the file, for a pattern that matches none.
    """
    found = {each: {name for name in names if fnmatch(name.lower(), each.lower())} for each in patterns}
    for pattern, matched in found.items():
        if not matched:
            raise OSError(f"has no {what} {pattern}; there are: {', '.join(sorted(names))}")
    return set().union(*found.values())
