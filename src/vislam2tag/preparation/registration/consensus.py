"""Rough frames of all stations in the building, whatever gross errors the points have.

Two common points at a time say how one frame lies in another; what most other common points agree with is taken
(exhaustive consensus, after Fischler and Bolles 1981). Frames are joined in the order of their agreement, so a station
without a known point of its own follows through the points that it shares with others.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import ComplexArray, IntArray
from vislam2tag.core.transforms import Similarity2
from vislam2tag.preparation.registration.names import PlaceByPoint, point_label

BUILDING = "the building"
"""Name of the frame of the known points."""
MOST_PAIRS = 3000
"""Pairs of common points tried, the farthest apart first."""
MOST_INTERCHANGED = 12
"""Common points among which interchanged names are tried; of more, the others are enough."""
LEAST_APART_M = 0.3
"""Two points nearer than this are no base for a direction."""


@dataclass(frozen=True)
class Agreement:
    """How one frame lies in another by two common points, and how many agree."""

    map: Similarity2
    agreeing: int
    common: int
    missed: float
    """Sum over common points of the squared distance, in units of the tolerance, at most 1 each."""


@dataclass(frozen=True)
class _Frame:
    names: tuple[str, ...]
    points: dict[str, complex]
    maps: dict[str, Similarity2]


def rough_frames(
    known: PlaceByPoint, stations: Mapping[str, PlaceByPoint], tolerance_m: float
) -> dict[str, Similarity2]:
    """For each station a map to the frame of the known points, good to the tolerance or so.

    Raises SurveyError, naming stations and points, where a station cannot be placed.
    """
    frames = [_Frame((BUILDING,), dict(known), {})]
    frames += [_Frame((name,), dict(points), {name: Similarity2.identity()}) for name, points in stations.items()]
    while len(frames) > 1:
        joins = _joins(frames, tolerance_m)
        if not joins:
            raise SurveyError(_why_no_join(frames, tolerance_m))
        agreement, onto, moved = max(joins, key=lambda join: (join[0].agreeing, -join[0].missed))
        _refuse_mirrored(frames[onto], frames[moved], agreement, tolerance_m)
        joined = _joined(frames[onto], frames[moved], agreement.map)
        frames = [joined if i == onto else one for i, one in enumerate(frames) if i != moved]
    return frames[0].maps


def _joins(frames: Sequence[_Frame], tolerance_m: float) -> list[tuple[Agreement, int, int]]:
    """How pairs of frames agree, each with the numbers of the one that stays and the one that is moved onto it."""
    pairs = itertools.combinations(range(len(frames)), 2)
    found = ((agree(frames[moved].points, frames[onto].points, tolerance_m), onto, moved) for onto, moved in pairs)
    return [(agreement, onto, moved) for agreement, onto, moved in found if agreement is not None]


def agree(
    source: PlaceByPoint, target: PlaceByPoint, tolerance_m: float, *, mirrored: bool = False
) -> Agreement | None:
    """The turn and shift from ``source`` to ``target`` with which most common points agree; None where no two do.

    Among few points it may take two interchanged names: of three points of which two are interchanged, only those two
    would agree, in a frame turned around.
    """
    common = [name for name in source if name in target]
    if len(common) < 2:
        return None
    p = np.array([source[name] for name in common])
    p, q = p.conj() if mirrored else p, np.array([target[name] for name in common])
    best = _best_agreement(p, q, tolerance_m)
    if len(common) > MOST_INTERCHANGED or (best is not None and best.agreeing == len(common)):
        return best
    for i, j in itertools.combinations(range(len(common)), 2):
        interchanged = q.copy()
        interchanged[[i, j]] = q[[j, i]]
        other = _best_agreement(p, interchanged, tolerance_m)
        if other is not None and other.agreeing >= 3 and (best is None or other.agreeing > best.agreeing):
            best = other
    return best


def _pairs(p: ComplexArray) -> tuple[IntArray, IntArray]:
    """Pairs (j,), (j,) of points (k,), the farthest apart first where there are many."""
    first, second = np.triu_indices(len(p), 1)
    if len(first) > MOST_PAIRS:
        far = np.argsort(-np.abs(p[second] - p[first]), kind="stable")[:MOST_PAIRS]
        first, second = first[far], second[far]
    return first, second


def _best_agreement(p: ComplexArray, q: ComplexArray, tolerance_m: float) -> Agreement | None:
    """Of all frames by two points of (k,) the one with least missed; ties go to the first."""
    first, second = _pairs(p)
    dp, dq = p[second] - p[first], q[second] - q[first]
    fits = np.minimum(np.abs(dp), np.abs(dq)) > LEAST_APART_M
    fits &= np.abs(np.abs(dp) - np.abs(dq)) < tolerance_m
    if not fits.any():
        return None
    turn = dq[fits] / dp[fits]
    turn /= np.abs(turn)
    shift = (q[first] + q[second])[fits] / 2 - turn * (p[first] + p[second])[fits] / 2
    square = np.abs(turn[:, None] * p + shift[:, None] - q) ** 2 / tolerance_m**2
    missed = np.minimum(square, 1).sum(axis=1)
    one = int(missed.argmin())
    agreeing = int((square[one] < 1).sum())
    return Agreement(Similarity2(complex(turn[one]), complex(shift[one])), agreeing, len(p), float(missed[one]))


def _joined(onto: _Frame, moved: _Frame, onto_T_moved: Similarity2) -> _Frame:
    points = dict(onto.points)
    for name, place in moved.points.items():
        points.setdefault(name, onto_T_moved.a * place + onto_T_moved.b)
    maps = onto.maps | {name: onto_T_moved.compose(one) for name, one in moved.maps.items()}
    return _Frame(onto.names + moved.names, points, maps)


def _refuse_mirrored(onto: _Frame, moved: _Frame, direct: Agreement, tolerance_m: float) -> None:
    """Raise SurveyError where points fit a mirrored frame much better: east and north were exchanged."""
    mirrored = agree(moved.points, onto.points, tolerance_m, mirrored=True)
    if mirrored is not None and mirrored.agreeing >= 3 and mirrored.agreeing > direct.agreeing:
        raise SurveyError(
            f"station {' and '.join(moved.names)} fits {' and '.join(onto.names)} only mirrored "
            f"({mirrored.agreeing} of {mirrored.common} points, as it is {direct.agreeing}): its columns are N, E "
            "rather than E, N; name them by --columns, such as point,N,E,H"
        )


def _why_no_join(frames: Sequence[_Frame], tolerance_m: float) -> str:
    """Say why no further frame can be joined."""
    onto, moved = max(
        ((a, b) for i, a in enumerate(frames) for b in frames[i + 1 :]),
        key=lambda pair: len(pair[0].points.keys() & pair[1].points.keys()),
    )
    common = [name for name in moved.points if name in onto.points]
    there = " and ".join(onto.names)
    who = f"station {' and '.join(moved.names)}"
    if len(common) < 2:
        shares = f"only point {point_label(common[0])}" if common else "no point"
        return f"{who} shares {shares} with {there}, but its frame needs two: shoot more known or common points"
    names = ", ".join(map(point_label, common))
    places = [np.array([frame.points[name] for name in common]) for frame in (moved, onto)]
    first, second = np.triu_indices(len(common), 1)
    apart = [np.abs(one[second] - one[first]) for one in places]
    if min(one.max() for one in apart) < LEAST_APART_M:
        return (
            f"{who} shares the points {names} with {there}, but they lie at one place: its frame needs two points well "
            "apart"
        )
    ratio = float(np.median(apart[1] / np.maximum(apart[0], 1e-9)))
    return (
        f"{who} shares the points {names} with {there}, but no two of them are equally far apart in both (to "
        f"{tolerance_m:.2f} m; there the distances are {ratio:.3f} times as long): are the names right, is one in "
        "feet, are coordinates mistyped?"
    )
