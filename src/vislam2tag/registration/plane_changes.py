"""Interchanged names and typing errors that shots and known points may have."""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from vislam2tag.registration.gross_errors import Change, mistyped, whitened
from vislam2tag.registration.names import called
from vislam2tag.registration.network import PlaneFit


def plane_changes(fit: PlaneFit, suspects: Sequence[int]) -> list[Change]:
    """What could explain the suspects (indices of measurements), each with what would then have been measured."""
    return [*_swapped_shots(fit, suspects), *_swapped_known(fit, suspects), *_mistyped(fit, suspects)]


def _swapped_shots(fit: PlaneFit, suspects: Sequence[int]) -> list[Change]:
    """Two points of one station whose names were interchanged, one of them suspect."""
    rows_of: dict[str, dict[str, list[int]]] = defaultdict(lambda: defaultdict(list))
    for i, shot in enumerate(fit.shots):
        rows_of[shot.station][shot.point].append(i)
    suspect = {(fit.shots[i].station, fit.shots[i].point) for i in suspects if i < len(fit.shots)}
    pairs = sorted(
        {
            (station, min(point, other), max(point, other))
            for station, point in suspect
            for other in rows_of[station]
            if other != point
        }
    )
    found = []
    for station, one, other in pairs:
        places = {name: np.mean([fit.shots[i].place for i in rows_of[station][name]]) for name in (one, other)}
        way = complex(places[other] - places[one])
        members = [(i, way) for i in rows_of[station][one]] + [(i, -way) for i in rows_of[station][other]]
        text = f"{called(one)} and {called(other)} look interchanged in the shots from {station}"
        found.append(_change(fit, members, text, len(pairs)))
    return found


def _swapped_known(fit: PlaneFit, suspects: Sequence[int]) -> list[Change]:
    first = len(fit.shots)
    points = {fit.measurements[i].point for i in suspects}
    pairs = [
        (i, j)
        for i, j in itertools.combinations(range(len(fit.known)), 2)
        if points & {fit.known[i].point, fit.known[j].point}
    ]
    found = []
    for i, j in pairs:
        way = fit.known[j].place - fit.known[i].place
        text = f"the known points {called(fit.known[i].point)} and {called(fit.known[j].point)} look interchanged"
        found.append(_change(fit, [(first + i, way), (first + j, -way)], text, len(pairs)))
    return found


def _mistyped(fit: PlaneFit, suspects: Sequence[int]) -> list[Change]:
    found: list[Change] = []
    for i in suspects:
        one = fit.measurements[i]
        east, north = one.place.real, one.place.imag
        variants = [(complex(value, north), f"E ({text})") for value, text in mistyped(east, one.decimals)]
        variants += [(complex(east, value), f"N ({text})") for value, text in mistyped(north, one.decimals)]
        variants.append((complex(north, east), "E and N (exchanged)"))
        for place, what in variants:
            text = (
                f"{one.label} looks mistyped in {what}: {place.real:.{one.decimals}f}, {place.imag:.{one.decimals}f} "
                "would fit"
            )
            found.append(_change(fit, [(i, place - one.place)], text, len(variants) * len(fit.measurements)))
    return found


def _change(fit: PlaneFit, members: Sequence[tuple[int, complex]], text: str, choices: int) -> Change:
    """A hypothesis that these measurements should have been otherwise, each by so much in its own frame."""
    moved = [-(fit.maps[fit.shots[i].station].a if i < len(fit.shots) else 1) * by for i, by in members]
    rows = np.concatenate([fit.groups[i] for i, _ in members])
    sigma_m = [fit.measurements[i].sigma_m for i, _ in members]
    return Change(text, tuple(i for i, _ in members), rows, whitened(moved, sigma_m), choices)
