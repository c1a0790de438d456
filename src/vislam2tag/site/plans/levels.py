"""Levels of a file that shows several floors: what its features say about them, and which one is meant."""

from __future__ import annotations

import re
from collections.abc import Sequence

_RANGE = re.compile(r"(-?\d+)\s*-\s*(-?\d+)")
_MOST_FLOORS = 200
"""No building has more: such a range is a name."""


def levels_of(value: object) -> frozenset[str]:
    """Return the levels of a tag such as ``0``, ``0;1``, ``0-3``, ``-2--1`` or ``EG``, or of a list of them.

    Numbers are written in one form, so that ``0.0`` is ``0``.
    """
    parts = value if isinstance(value, list) else str("" if value is None else value).split(";")
    return frozenset(level for part in parts for level in _listed(str(part).strip()))


def in_order(levels: frozenset[str]) -> list[str]:
    """Sort levels: numbers upwards, then names."""
    return sorted(levels, key=lambda level: (_number(level) is None, _number(level) or 0.0, level))


def chosen_level(levels: Sequence[Sequence[str]], wanted: str | None) -> int:
    """Return which level has the name ``wanted``: the first for an empty text, the only one if None is wanted.

    Each level has one or more names, the best to read last and one that no other has first. Raises OSError, whose text
    completes a sentence about the file, if none or several are meant.
    """
    shown = [names[-1] for names in levels]
    there = ", ".join(name if shown.count(name) == 1 else names[0] for name, names in zip(shown, levels, strict=True))
    if not levels:
        raise OSError("has no levels: leave out --level")
    if wanted is None and len(levels) > 1:
        raise OSError(f"has the levels {there}: choose one with --level (level in site.toml)")
    if not wanted:
        return 0
    meant = _listed(wanted.strip()) or [wanted]
    alike = [{name.casefold() for name in (*names, *_listed(names[-1]))} for names in levels]
    best = [number for number, names in enumerate(levels) if wanted == names[-1]]
    found = best or [number for number, names in enumerate(alike) if {meant[0].casefold(), wanted.casefold()} & names]
    if len(found) != 1:
        raise OSError(f"has {len(found) or 'no'} level{'s' * (len(found) > 1)} {wanted}; there are: {there}")
    return found[0]


def _listed(text: str) -> list[str]:
    """The levels of one value: a number, a range of whole numbers, or a name."""
    number, span = _number(text), _RANGE.fullmatch(text)
    if number is not None:
        return [f"{number + 0.0:g}"]
    if span is not None and abs(int(span[2]) - int(span[1])) < _MOST_FLOORS:
        first, last = sorted((int(span[1]), int(span[2])))
        return [str(level) for level in range(first, last + 1)]
    return [text] if text else []


def _number(text: str) -> float | None:
    return float(text) if re.fullmatch(r"[-+]?\d{1,6}(\.\d+)?", text) else None
