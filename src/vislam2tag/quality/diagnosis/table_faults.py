"""Faults of a whole landmark table, a whole session, or of sheets that hang in each other's place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from functools import partial
from itertools import combinations, permutations
from math import comb
from typing import TypeAlias

import numpy as np

from vislam2tag.quality.diagnosis.evidence import Evidence, Hypothesis, Mark, choices, listed, misfit_of_passes
from vislam2tag.quality.diagnosis.record import Fault, FaultKind, proposed
from vislam2tag.site.corrections.file import UNITS_M

_Change: TypeAlias = tuple[str, bool]
"""Unit of the coordinates ('' metres), and whether x runs the other way."""
CHANGES: list[_Change] = [(unit, mirrored) for unit in ("", *UNITS_M) for mirrored in (False, True)][1:]


def _changed(place: complex, change: _Change, width_m: float) -> complex:
    """A place of the table where this change puts it."""
    unit, mirrored = change
    scaled = place * UNITS_M.get(unit, 1.0)
    return complex(width_m - scaled.real, scaled.imag) if mirrored else scaled


def changed_tables(evidence: Evidence) -> Iterator[Hypothesis]:
    """Change the table of every floor on which there are suspects."""
    for floor in sorted({mark.floor for mark in evidence.suspects} & set(evidence.floors)):
        width_m = evidence.table.size_m.get(floor, (0.0, 0.0))[0]
        for change in CHANGES:
            places = {
                (number, row): _changed(complex(walk.target[row]), change, width_m)
                for number, walk in enumerate(evidence.walks)
                for row, mark in enumerate(walk.marks)
                if mark.floor == floor and mark in evidence.table.place
            }
            table = {mark: _changed(evidence.table.place[mark], change, width_m) for mark in evidence.table.on(floor)}
            describe = partial(_table_fault, floor, change, width_m)
            yield Hypothesis(evidence.moved(places), choices(len(CHANGES)), describe, table, ("frame", floor))


def _table_fault(floor: int, change: _Change, width_m: float, evidence: Evidence) -> Fault:
    unit, mirrored = change
    fits = sum(int(walk.alignment.fits.sum()) for walk in evidence.walks if walk.passes.key.floor == floor)
    told = f"{fits} passes of landmarks fit then, and else hardly any"
    entries = []
    parts = []
    if unit:
        parts.append(f"in {unit}, not in metres")
        entries.append(proposed("landmark_units", floor=floor, unit=unit))
    if mirrored:
        parts.append("mirrored")
        told += "; that the table is mirrored is sure, that it is so from left to right is not: look at the plan"
        entries.append(proposed("turn_landmarks", floor=floor, mirrored=True, shift_m=[width_m, 0.0]))
    return Fault(
        kind=FaultKind.UNITS if unit else FaultKind.MIRRORED,
        floor=floor,
        summary=f"the landmark table of floor {floor} is {' and '.join(parts)}",
        evidence=told,
        corrections=entries,
    )


def walks_on_other_floors(evidence: Evidence) -> Iterator[Hypothesis]:
    """Put every walk that fits badly onto every other floor."""
    floors = sorted(evidence.table.floors)
    for number, walk in enumerate(evidence.walks):
        known = np.isfinite(walk.target)
        if known.all() and walk.alignment.fits.sum() == known.sum():
            continue
        for floor in floors:
            there = [evidence.table.place.get(Mark(floor, mark.landmark), np.nan) for mark in walk.marks]
            target = np.array(there, dtype=np.complex128)
            if floor != walk.passes.key.floor and np.isfinite(target).sum() >= known.sum():
                price = choices(len(evidence.walks) * (len(floors) - 1))
                yield Hypothesis({number: target}, price, partial(_floor_fault, number, floor), key=("floor", number))


def _floor_fault(number: int, floor: int, evidence: Evidence) -> Fault:
    walk = evidence.walks[number]
    key = walk.passes.key
    fits, known = int(walk.alignment.fits.sum()), int(np.isfinite(walk.target).sum())
    return Fault(
        kind=FaultKind.WRONG_FLOOR,
        floor=key.floor,
        sessions=[str(key)],
        summary=f"session {key} was walked on floor {floor}",
        evidence=f"{fits} of {known} passes fit the landmarks of floor {floor}, and hardly any those of its own",
        corrections=[proposed("set_floor", **asdict(key), to=floor)],
    )


NEAR_M = 2.5
"""A walk that puts a landmark within this of another's place says that it hangs there."""


def exchanged_sheets(evidence: Evidence) -> Iterator[Hypothesis]:
    """Exchange every two suspects of a floor, and every three."""
    for floor in evidence.floors:
        suspects = [mark for mark in evidence.suspects if mark.floor == floor]
        there = len(evidence.passed(floor))
        may = {
            (one, other)
            for one, other in permutations(suspects, 2)
            if evidence.may_be_at(one, evidence.table.place[other])
        }
        for one, other in combinations(suspects, 2):
            if {(one, other), (other, one)} & may:  # in a walk of few landmarks each bends where it puts the other
                yield _exchanged(evidence, (one, other), choices(comb(there, 2)))
        for circle in sorted(_circles(evidence, suspects)):
            yield _exchanged(evidence, circle, choices(2 * comb(there, 3)))


def _circles(evidence: Evidence, suspects: Sequence[Mark]) -> set[tuple[Mark, Mark, Mark]]:
    """Circles of three, the least id first, of which some walks put two landmarks at the next one's place."""
    said = {
        (one, other)
        for one, other in permutations(suspects, 2)
        if any(abs(sight.place - evidence.table.place[other]) < NEAR_M for sight in evidence.sights(one))
    }
    circles = set()
    for first, second in said:
        for third in suspects:
            links = {(first, second), (second, third), (third, first)}
            if third not in (first, second) and len(links & said) > 1:
                circle = (first, second, third)
                start = circle.index(min(circle))
                circles.add((circle[start], circle[(start + 1) % 3], circle[(start + 2) % 3]))
    return circles


def _exchanged(evidence: Evidence, circle: Sequence[Mark], price: float) -> Hypothesis:
    """Each landmark of a circle hangs where the next one should."""
    following = dict(zip(circle, (*circle[1:], circle[0]), strict=True))
    places = {
        (number, row): evidence.table.place[following[mark]]
        for number, walk in enumerate(evidence.walks)
        for row, mark in enumerate(walk.marks)
        if mark in following
    }
    return Hypothesis(evidence.moved(places), price, partial(_exchange_fault, circle), key=("swapped", *circle))


def _exchange_fault(circle: Sequence[Mark], evidence: Evidence) -> Fault:
    ids = [mark.landmark for mark in circle]
    floor = circle[0].floor
    if len(ids) == 2:
        summary = f"landmarks {ids[0]} and {ids[1]} of floor {floor} hang in each other's place"
        summary += _rooms(circle, evidence)
    else:
        way = ", ".join(f"{one} where {other} should" for one, other in zip(ids, [*ids[1:], ids[0]], strict=True))
        summary = f"landmarks {listed(ids)} of floor {floor} are mixed up: {way}"
    # An exchange of ids in the logs: the one logged as the first hangs where the second should.
    swaps = [[ids[i], ids[i + 1]] for i in reversed(range(len(ids) - 1))]
    return Fault(
        kind=FaultKind.SWAPPED,
        floor=floor,
        landmarks=ids,
        summary=summary,
        evidence=misfit_of_passes(evidence, circle),
        corrections=[proposed("swap_landmarks", ids=swap, floor=floor) for swap in swaps],
    )


def _rooms(pair: Sequence[Mark], evidence: Evidence) -> str:
    """In brackets where each of two hangs, for those that hang where people have a name for it."""
    rooms = [evidence.table.room_at(mark.floor, evidence.table.place[mark]) for mark in reversed(pair)]
    told = [f"{mark.landmark} in {room}" for mark, room in zip(pair, rooms, strict=True) if room]
    return f" ({listed(told)})" if told else ""
