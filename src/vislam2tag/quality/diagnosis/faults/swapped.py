"""Sheets that hang in each other's place: two, or three in a circle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import combinations, permutations
from math import comb

from vislam2tag.quality.diagnosis.evidence import Evidence, Mark
from vislam2tag.quality.diagnosis.hypothesis import Hypothesis, choices
from vislam2tag.quality.diagnosis.record import CorrectionEntry, Fault, FaultKind
from vislam2tag.quality.diagnosis.words import REASON, listed, told_by_passes

NEAR_M = 2.5
"""A walk that puts a landmark within this of another's place says that it hangs there."""


def propose(evidence: Evidence) -> Iterator[Hypothesis]:
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
    targets = {}
    for number, walk in enumerate(evidence.walks):
        if any(mark in following for mark in walk.marks):
            target = walk.target.copy()
            for mark, other in following.items():
                target[walk.rows_of(mark)] = evidence.table.place[other]
            targets[number] = target
    return Hypothesis(targets, price, partial(_fault, circle), key=("swapped", *circle))


def _fault(circle: Sequence[Mark], evidence: Evidence, gain: float) -> Fault:
    ids = [mark.landmark for mark in circle]
    floor = circle[0].floor
    if len(ids) == 2:
        summary = f"landmarks {ids[0]} and {ids[1]} of floor {floor} hang in each other's place"
        summary += _rooms(circle, evidence)
    else:
        way = ", ".join(f"{one} where {other} should" for one, other in zip(ids, [*ids[1:], ids[0]], strict=True))
        summary = f"landmarks {listed(ids)} of floor {floor} are mixed up: {way}"
    # An exchange of ids in the logs: whoever is logged as the first hangs where the second should.
    swaps = [[ids[i], ids[i + 1]] for i in reversed(range(len(ids) - 1))]
    entries = [
        CorrectionEntry(table="swap_landmarks", values={"ids": swap, "floor": floor, "reason": REASON})
        for swap in swaps
    ]
    return Fault(
        kind=FaultKind.SWAPPED,
        floor=floor,
        landmarks=ids,
        summary=summary,
        evidence=told_by_passes(evidence, circle),
        odds=round(gain, 1),
        corrections=entries,
    )


def _rooms(pair: Sequence[Mark], evidence: Evidence) -> str:
    """In brackets where each of two hangs, for those that hang where people have a name for it."""
    rooms = [evidence.table.room_at(mark.floor, evidence.table.place[mark]) for mark in reversed(pair)]
    told = [f"{mark.landmark} in {room}" for mark, room in zip(pair, rooms, strict=True) if room]
    return f" ({listed(told)})" if told else ""
