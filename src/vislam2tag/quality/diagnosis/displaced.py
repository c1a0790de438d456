"""One landmark that is not where the table says: mis-surveyed, moved since a date, or two sheets with one id."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from functools import partial
from math import log, pi

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.transforms import as_complex, as_points
from vislam2tag.quality.diagnosis.evidence import (
    Evidence,
    Hypothesis,
    Mark,
    Sight,
    choices,
    misfit_of_passes,
    span_between,
)
from vislam2tag.quality.diagnosis.record import CorrectionEntry, Fault, FaultKind, proposed
from vislam2tag.site.corrections.file import session_start

TOGETHER = 16.0
"""Two sights are of one place where their squared distance is less than this many variances ..."""
SLACK_M = 0.15
"""... to each of which this is added."""
FEWEST_SIGHTS = 3
"""So many passes must tell a new place."""
LEAST_M = 0.5
"""What is nearer to the table's place than this is not told from it."""
LEAST_MOVED_M = 0.7
"""... nor is a landmark's own place, by all passes there, when it is nearer than this."""
LEAST_APART_M = 2.0
"""Two sheets of one id that hang nearer to each other are one, seen badly."""
SECOND_SHEET_PRICE = 3.0
"""Two sheets with one id are rarer than one that was moved."""
ANYWHERE_M = 20.0
"""A wrong place may be this far off, or farther."""


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

    def where(self, evidence: Evidence) -> str:
        """The place in words."""
        sigma_m = float(np.sqrt(np.trace(self.covariance) / 2))
        own = evidence.table.place[self.mark]
        room, own_room = (evidence.table.room_at(self.mark.floor, at) for at in (self.place, own))
        at = f"at ({round(self.place.real, 2):g}, {round(self.place.imag, 2):g}) +- {round(sigma_m, 2):g} m, "
        at += f"{abs(self.place - own):.1f} m from where the table has it"
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
        )

    def correction(self, **since: datetime) -> CorrectionEntry:
        """The entry that moves it there."""
        x, y = round(self.place.real, 2), round(self.place.imag, 2)
        return proposed("move_landmark", id=self.mark.landmark, floor=self.mark.floor, x=x, y=y, **since)


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
        f"landmark {new.mark.landmark} of floor {new.mark.floor} hangs since {date:%Y-%m-%d %H:%M} or shortly before "
        f"{new.where(evidence)}"
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
