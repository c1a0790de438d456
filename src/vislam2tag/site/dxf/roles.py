"""What each line of a DXF drawing becomes: wall, door, or nothing, by its layer, its blocks and its shape."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatch

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.site.dxf.entities import Drawn, DrawnLine
from vislam2tag.site.dxf.layers import BUILT, Kind, kind_of
from vislam2tag.site.plans.source import PlanSource
from vislam2tag.site.plans.taken_parts import Became

_THICKEST_M = 1.5
"""A filled shape that is thicker is no wall."""
_NEAR = 0.15
"""How far a door's leaf may be from the centre and the end of its swing, by its radius."""
_LEAF_POINTS = 6
_SWING_DEG = (50.0, 130.0)
_HANDLE = 0.2
"""An arc smaller than this, by the widest swing, is not a swing of a door."""


@dataclass(frozen=True)
class Role:
    """What a line becomes, and why it is left out."""

    became: Became
    why: str = ""


_WALLS, _DOORS = Role(Became.WALLS), Role(Became.DOORS)


def roles_of(drawn: Drawn, source: PlanSource, unit_m: float | None) -> list[Role]:
    """Return what each line becomes.

    Raises OSError, whose text completes a sentence about the file, for layers that are not there or that are named
    as two things, and without walls.
    """
    layers = sorted({line.layer for line in drawn.lines})
    for pattern in (*source.layers, *source.doors, *source.ignore):
        if not any(_matches(layer, [pattern]) for layer in (*layers, *(layer for layer, _ in drawn.texts))):
            raise OSError(_no_layer(pattern, layers, drawn))
    asked = {layer: _asked(layer, source) for layer in layers}
    kinds = [_kind(line) for line in drawn.lines]
    guess = guesses_walls(drawn, source)
    roles = [
        _chosen(line, kind, asked[line.layer], walls_given=bool(source.layers)) or _by_name(line, kind, guess)
        for line, kind in zip(drawn.lines, kinds, strict=True)
    ]
    if unit_m is not None:
        floors = [line.thickness * unit_m > _THICKEST_M for line in drawn.lines]
        roles = [
            Role(Became.LEFT_OUT, "filled areas") if floor and role == _WALLS else role
            for floor, role in zip(floors, roles, strict=True)
        ]
    walls = [number for number, role in enumerate(roles) if role == _WALLS]
    if not walls:
        raise OSError(f"has no layers whose names suggest walls; specify layers, from: {', '.join(layers)}")
    for number in _drawn_doors(drawn.lines, walls):
        roles[number] = _DOORS
    return roles


def guesses_walls(drawn: Drawn, source: PlanSource) -> bool:
    """Whether no layer or block is called after walls, so that lines with any other name are taken for walls."""
    named = (line for line in drawn.lines if line.printed and not _matches(line.layer, source.ignore))
    return not source.layers and not any(_kind(line) is Kind.WALL for line in named)


def _matches(layer: str, patterns: Sequence[str]) -> bool:
    return any(fnmatch(layer.casefold(), pattern.casefold()) for pattern in patterns)


def _no_layer(pattern: str, layers: Sequence[str], drawn: Drawn) -> str:
    for layer, why in drawn.hidden:
        if _matches(layer, [pattern]):
            return f"shows nothing on layer {layer} ({why}); make it visible in the drawing, and save that again"
    return f"has no layer {pattern}; there are: {', '.join(layers)}"


def _kind(line: DrawnLine) -> Kind:
    """What the names around a line stand for; a layer of a block's own counts more than what the block is."""
    layer = kind_of(line.layer)
    if line.block is Kind.DOOR:
        return Kind.DOOR
    if line.block in (Kind.UNKNOWN, Kind.WALL, Kind.PART):
        return line.block if layer is Kind.UNKNOWN else layer
    return layer if line.own and layer in BUILT else line.block


def _asked(layer: str, source: PlanSource) -> list[str]:
    """Options that choose a layer, of which the first counts: those that name it, else those with ``*`` or ``?``."""
    ways = {"--ignore": source.ignore, "--doors": source.doors, "--walls": source.layers}
    named = [way for way, names in ways.items() if layer.casefold() in map(str.casefold, names)]
    if len(named) > 1:
        raise OSError(f"has one layer {layer}, which {' and '.join(named)} both name: keep one of them")
    return named or [way for way, patterns in ways.items() if _matches(layer, patterns)]


def _chosen(line: DrawnLine, kind: Kind, asked: Sequence[str], *, walls_given: bool) -> Role | None:
    """The role by what the user chose."""
    if asked[:1] == ["--ignore"]:
        return Role(Became.LEFT_OUT, "as chosen")
    if line.block is Kind.DOOR or asked[:1] == ["--doors"]:
        return Role(Became.DOORS, "--doors counts before --walls") if len(asked) > 1 else _DOORS
    if not walls_given:
        return None
    if not asked:
        return _DOORS if kind is Kind.DOOR else Role(Became.LEFT_OUT, "not among the layers of walls")
    return _WALLS if line.own or line.block in (Kind.UNKNOWN, *BUILT) else Role(Became.LEFT_OUT, line.block.value)


def _by_name(line: DrawnLine, kind: Kind, guess: bool) -> Role:
    if not line.printed:
        return Role(Became.LEFT_OUT, "layer that is not printed")
    if kind is Kind.DOOR:
        return _DOORS
    is_wall = kind in (Kind.WALL, Kind.PART) or (guess and kind is Kind.UNKNOWN)
    return _WALLS if is_wall else Role(Became.LEFT_OUT, kind.value)


def _drawn_doors(lines: Sequence[DrawnLine], walls: Sequence[int]) -> set[int]:
    """Which lines among walls are the swing (an arc) or the leaf of a door, from the centre to an end of the swing."""
    swings = {number: swing for number in walls if (swing := _swing(lines[number])) is not None}
    if not swings:
        return set()
    leaves = [number for number in walls if number not in swings and len(lines[number].points) <= _LEAF_POINTS]
    boxes = np.array([_box(lines[number].points) for number in leaves]).reshape(-1, 2, 2)
    found = set()
    for number, (centre, radius, ends) in swings.items():
        near = np.flatnonzero((np.abs(boxes - centre) <= (1 + _NEAR) * radius).all(axis=(1, 2)))
        of_swing = {leaves[each] for each in near if _is_leaf(lines[leaves[each]].points, centre, radius, ends)}
        found |= {number, *of_swing} if of_swing else set()
    return found


def _box(points: FloatArray) -> FloatArray:
    return np.stack((points.min(axis=0), points.max(axis=0)))


def _is_leaf(points: FloatArray, centre: FloatArray, radius: float, ends: FloatArray) -> bool:
    """Whether points (k, 2) reach from the centre of a swing to one of its ends (2, 2), and are nowhere else."""
    hinge, free = points - centre, points[:, None] - ends
    at_hinge = np.linalg.norm(hinge, axis=1) <= _NEAR * radius
    at_end = (np.linalg.norm(free, axis=2) <= _NEAR * radius).any(axis=1)
    return bool(at_hinge.any() and at_end.any() and (at_hinge | at_end).all())


def _swing(line: DrawnLine) -> tuple[FloatArray, float, FloatArray] | None:
    """Centre, radius and ends (2, 2) of an arc that opens as doors do; None if it is another line."""
    if not line.is_arc or len(line.points) < 3:
        return None
    start, middle, end = line.points[[0, len(line.points) // 2, -1]]
    sides = 2 * np.stack((middle - start, end - start))
    if abs(np.linalg.det(sides)) < 1e-12 * np.abs(sides).max() ** 2:
        return None
    squares = (line.points[[0, len(line.points) // 2, -1]] ** 2).sum(axis=1)
    centre = np.linalg.solve(sides, squares[1:] - squares[0])
    radius = float(np.linalg.norm(start - centre))
    length = float(np.linalg.norm(np.diff(line.points, axis=0), axis=1).sum())
    is_swing = _SWING_DEG[0] <= np.degrees(length / radius) <= _SWING_DEG[1]
    return (centre, radius, np.stack((start, end))) if is_swing else None


def usual_swing(lines: Sequence[DrawnLine], roles: Sequence[Role]) -> float | None:
    """Radius of the usual door swing, units of the file, without handles and hinges; None if no swing is drawn."""
    swings = [_swing(line) for line, role in zip(lines, roles, strict=True) if role.became is Became.DOORS]
    radii = np.array([swing[1] for swing in swings if swing is not None])
    return float(np.median(radii[radii >= _HANDLE * radii.max()])) if len(radii) else None
