"""What a surveyed point is, by its name: a landmark (its centre, left or right edge), a control point, or a tie."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from vislam2tag.common.errors import UsageError
from vislam2tag.site.names import landmark_id

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
                raise UsageError(f"--{option} '{pattern}': one * must stand for the id, such as LM*")

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
