"""Faults of a landmark table: of the whole table, of a session on it, of exchanged sheets, of one landmark's place.

A landmark that is not where the table says is mis-surveyed, moved since a date, or one of two sheets with one id.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from functools import partial
from itertools import combinations, permutations
from math import comb, log, pi
from typing import TypeAlias

import numpy as np

from vislam2tag.common.findings import FaultKind
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.transforms import as_complex, as_points
from vislam2tag.quality.diagnosis.evidence import (
    Evidence,
    Hypothesis,
    Mark,
    Sight,
    Table,
    choices,
    listed,
    misfit_of_passes,
    span_between,
)
from vislam2tag.quality.diagnosis.record import CorrectionEntry, Fault, PlaceByWalks, proposed
from vislam2tag.site.corrections.file import UNITS_M, session_start

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
        exchanged = _exchanged_on_plan(floor, evidence.table)
        for change in CHANGES:
            places = {
                (number, row): _changed(complex(walk.target[row]), change, width_m)
                for number, walk in enumerate(evidence.walks)
                for row, mark in enumerate(walk.marks)
                if mark.floor == floor and mark in evidence.table.place
            }
            table = {mark: _changed(evidence.table.place[mark], change, width_m) for mark in evidence.table.on(floor)}
            describe = partial(_table_fault, floor, change, None if exchanged else width_m)
            yield Hypothesis(evidence.moved(places), choices(len(CHANGES)), describe, table, ("frame", floor))


def _table_fault(floor: int, change: _Change, width_m: float | None, evidence: Evidence) -> Fault:
    """Name a change of a table; no ``width_m``: x and y are exchanged if it is mirrored."""
    unit, mirrored = change
    fits = sum(int(walk.alignment.fits.sum()) for walk in evidence.walks if walk.passes.key.floor == floor)
    told = f"{fits} observations of landmarks fit with this correction, but hardly any without it"
    entries = []
    parts = []
    if unit:
        parts.append(f"in {unit}, not in metres")
        entries.append(proposed("landmark_units", floor=floor, unit=unit))
    if mirrored and width_m is None:
        parts.append("mirrored: x and y are exchanged")
        told += "; all landmarks are on the plan if x and y are exchanged, and not as they are"
        entries.append(proposed("turn_landmarks", floor=floor, mirrored=True, turn_deg=-90.0))
    elif mirrored and width_m is not None:
        parts.append("mirrored")
        told += "; the table is certainly mirrored, but the axis is uncertain: check it on the plan"
        entries.append(proposed("turn_landmarks", floor=floor, mirrored=True, shift_m=[width_m, 0.0]))
    return Fault(
        kind=FaultKind.UNITS if unit else FaultKind.MIRRORED,
        floor=floor,
        summary=f"the landmark table of floor {floor} is {' and '.join(parts)}",
        evidence=told,
        corrections=entries,
    )


def _exchanged_on_plan(floor: int, table: Table) -> bool:
    """Whether the landmarks of a floor are on its plan only with x and y exchanged; walks show no axis of a mirror."""
    places = np.array([table.place[mark] for mark in table.on(floor)])
    return table.beside_plan(floor, places) > 0 and table.beside_plan(floor, 1j * places.conj()) == 0


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
        evidence=f"{fits} of {known} observations fit the landmarks of floor {floor}, but hardly any fit those of "
        f"floor {key.floor}",
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
        summary = f"landmarks {ids[0]} and {ids[1]} of floor {floor} are interchanged"
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


TOGETHER = 16.0
"""Two sights are of one place where their squared distance is less than this many variances ..."""
SLACK_M = 0.15
"""... to each of which this is added."""
FEWEST_SIGHTS = 3
"""At least this many passes must show a new place."""
LEAST_M = 0.5
"""What is closer to the table's place than this is not distinguished from it."""
LEAST_MOVED_M = 0.7
"""... nor is a landmark's own place, by all passes there, when it is closer than this."""
LEAST_APART_M = 2.0
"""Two sheets of one id that hang closer to each other are one, seen badly."""
SECOND_SHEET_PRICE = 3.0
"""Two sheets with one id are rarer than one that was moved."""
ANYWHERE_M = 20.0
"""A wrong place may be this far off, or further."""


@dataclass(frozen=True)
class _NewPlace:
    """Where walks put a landmark, away from the table's place: complex metres and covariance (2, 2), m^2."""

    mark: Mark
    place: complex
    covariance: FloatArray

    def hypothesis(
        self, evidence: Evidence, rows: Iterable[tuple[int, int]], price: float, describe: Callable[[Evidence], Fault]
    ) -> Hypothesis:
        """That it hangs there in some passes (walk, row)."""
        return Hypothesis(
            evidence.moved(dict.fromkeys(rows, self.place)), price, describe, key=("displaced", self.mark)
        )

    @property
    def by_walks(self) -> PlaceByWalks:
        """The place, as faults and corrections have it."""
        return PlaceByWalks.at(self.place, float(np.sqrt(np.trace(self.covariance) / 2)))

    def where(self, evidence: Evidence) -> str:
        """The place in words."""
        own = evidence.table.place[self.mark]
        room, own_room = (evidence.table.room_at(self.mark.floor, at) for at in (self.place, own))
        at = f"at ({self.place.real:.2f}, {self.place.imag:.2f}) ± {self.by_walks.sigma_m:.2f} m, "
        at += f"{abs(self.place - own):.1f} m from its position in the table"
        return (f"in {room}, " if room else "") + at + (f", {own_room}" if own_room not in ("", room) else "")

    def fault(self, kind: FaultKind, summary: str, corrections: list[CorrectionEntry], evidence: Evidence) -> Fault:
        """The fault of this kind that would explain it."""
        return Fault(
            kind=kind,
            floor=self.mark.floor,
            landmarks=[self.mark.landmark],
            summary=summary,
            evidence=misfit_of_passes(evidence, [self.mark]),
            corrections=corrections,
            by_walks=self.by_walks,
        )

    def correction(self, **since: datetime) -> CorrectionEntry:
        """The entry that moves it there."""
        place = self.by_walks.correction
        return proposed("move_landmark", id=self.mark.landmark, floor=self.mark.floor, **place, **since)


def displaced_landmarks(evidence: Evidence) -> Iterator[Hypothesis]:
    """Move every suspect to where the walks put it: in all of them, in those since a date, or in some passes."""
    known = len(evidence.table.place)
    for mark in evidence.suspects:
        if mark in evidence.table.place:
            sights = evidence.sights(mark)
            for new in _new_places(mark, sights, evidence.table.place[mark]):
                yield from _hypotheses(evidence, new, sights, choices(known))


def _new_places(mark: Mark, sights: Sequence[Sight], own: complex) -> Iterator[_NewPlace]:
    """Places away from the table's on which most sights agree."""
    away = [sight for sight in sights if abs(sight.place - own) > LEAST_M]
    while away:
        groups = [(one, [other for other in away if _together(one, other)]) for one in away]
        groups = [(one, group) for one, group in groups if len(group) >= FEWEST_SIGHTS]
        if not groups:
            return
        _, group = max(groups, key=lambda agreeing: _sharpness(*agreeing))
        found = _mean(mark, group)
        if abs(found.place - own) > LEAST_MOVED_M:
            yield found
        away = [sight for sight in away if all(sight is not one for one in group)]


def _spread(one: Sight, other: Sight) -> FloatArray:
    """Covariance (2, 2) of how far apart two sights of one place are, m^2."""
    return np.asarray(one.covariance + other.covariance + 2 * SLACK_M**2 * np.eye(2))


def _together(one: Sight, other: Sight) -> bool:
    apart = as_points(np.array(one.place - other.place))
    return bool(apart @ np.linalg.solve(_spread(one, other), apart) < TOGETHER)


def _sharpness(one: Sight, group: Sequence[Sight]) -> float:
    """How sharply a group agrees with one of it: what is put nowhere in particular agrees with everything."""
    return float(sum(1 / np.trace(_spread(one, other)) for other in group))


def _mean(mark: Mark, sights: Sequence[Sight]) -> _NewPlace:
    worth = np.linalg.inv(np.array([sight.covariance + SLACK_M**2 * np.eye(2) for sight in sights]))
    covariance: FloatArray = np.asarray(np.linalg.inv(worth.sum(axis=0)), dtype=np.float64)
    pull = np.einsum("sij,sj->i", worth, as_points(np.array([sight.place for sight in sights])))
    return _NewPlace(mark, complex(as_complex(covariance @ pull)), covariance)


def _hypotheses(evidence: Evidence, new: _NewPlace, sights: Sequence[Sight], price: float) -> Iterator[Hypothesis]:
    price += 2 * log(2 * pi * ANYWHERE_M**2 / (2 * pi * np.sqrt(np.linalg.det(new.covariance))))
    everywhere = evidence.rows_of(new.mark)
    yield new.hypothesis(evidence, everywhere, price, partial(_mis_surveyed, new))
    starts = [session_start(walk.passes.key.session) for walk in evidence.walks]
    dates = sorted({start for number, _ in everywhere if (start := starts[number]) is not None})
    for date in dates[1:]:
        since = [(number, row) for number, row in everywhere if (start := starts[number]) and start >= date]
        yield new.hypothesis(evidence, since, price + choices(len(dates)), partial(_moved_since, new, date))
    own = evidence.table.place[new.mark]
    there = {(sight.walk, sight.row) for sight in sights if abs(sight.place - new.place) < abs(sight.place - own)}
    here = {(sight.walk, sight.row) for sight in sights} - there
    if abs(new.place - own) > LEAST_APART_M and there and here and not _one_after_the_other(evidence, here, there):
        rows = sorted(there)
        yield new.hypothesis(evidence, rows, price + SECOND_SHEET_PRICE, partial(_two_places, new, rows))


def _one_after_the_other(evidence: Evidence, here: set[tuple[int, int]], there: set[tuple[int, int]]) -> bool:
    """Whether all walks that saw a landmark at one place were before those that saw it at the other."""
    first, second = ([evidence.walks[number].passes.key.session for number, _ in rows] for rows in (here, there))
    return max(first) < min(second) or max(second) < min(first)


def _mis_surveyed(new: _NewPlace, evidence: Evidence) -> Fault:
    summary = f"landmark {new.mark.landmark} of floor {new.mark.floor} is {new.where(evidence)}"
    return new.fault(FaultKind.MIS_SURVEYED, summary, [new.correction()], evidence)


def _moved_since(new: _NewPlace, date: datetime, evidence: Evidence) -> Fault:
    summary = (
        f"since {date:%Y-%m-%d %H:%M} or shortly before, landmark {new.mark.landmark} of floor {new.mark.floor} has "
        f"been {new.where(evidence)}"
    )
    return new.fault(FaultKind.MOVED, summary, [new.correction(**{"from": date})], evidence)


def _two_places(new: _NewPlace, rows: Sequence[tuple[int, int]], evidence: Evidence) -> Fault:
    name = new.mark.landmark
    summary = f"two sheets of floor {new.mark.floor} have the id {name}: a second one is {new.where(evidence)}"
    entries = []
    for number, row in rows:
        walk = evidence.walks[number]
        own = walk.rows_of(new.mark)
        span = span_between(walk.passes.time_s[own], *[own.tolist().index(row)] * 2)
        entries.append(proposed("rename_landmark", id=name, to=f"{name} (second)", **asdict(walk.passes.key), **span))
    return new.fault(FaultKind.TWO_PLACES, summary, entries, evidence)
