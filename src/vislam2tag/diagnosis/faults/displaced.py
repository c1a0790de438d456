"""One landmark that is not where the table says: mis-surveyed, moved since a date, or two sheets with one id."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from datetime import datetime
from functools import partial
from math import log, pi

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.similarity import as_complex, as_points
from vislam2tag.diagnosis.evidence import Evidence, Mark, Sight
from vislam2tag.diagnosis.hypothesis import Hypothesis, choices
from vislam2tag.diagnosis.record import CorrectionEntry, Fault, FaultKind
from vislam2tag.diagnosis.words import REASON, told_by_passes
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


def propose(evidence: Evidence) -> Iterator[Hypothesis]:
    """Move every suspect to where the walks put it: in all of them, in those since a date, or in some passes."""
    known = len(evidence.table.place)
    for mark in evidence.suspects:
        if mark in evidence.table.place:
            sights = evidence.sights(mark)
            for place in _new_places(sights, evidence.table.place[mark]):
                yield from _hypotheses(evidence, mark, sights, place, choices(known))


def _new_places(sights: Sequence[Sight], own: complex) -> Iterator[tuple[complex, FloatArray]]:
    """Places away from the table's on which most sights agree, and their covariances."""
    away = [sight for sight in sights if abs(sight.place - own) > LEAST_M]
    while away:
        groups = [(one, [other for other in away if _together(one, other)]) for one in away]
        groups = [(one, group) for one, group in groups if len(group) >= FEWEST_SIGHTS]
        if not groups:
            return
        _, group = max(groups, key=lambda agreeing: _sharpness(*agreeing))
        found = _mean(group)
        if abs(found[0] - own) > LEAST_MOVED_M:
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


def _mean(sights: Sequence[Sight]) -> tuple[complex, FloatArray]:
    worth = np.linalg.inv(np.array([sight.covariance + SLACK_M**2 * np.eye(2) for sight in sights]))
    covariance: FloatArray = np.asarray(np.linalg.inv(worth.sum(axis=0)), dtype=np.float64)
    pull = np.einsum("sij,sj->i", worth, as_points(np.array([sight.place for sight in sights])))
    return complex(as_complex(covariance @ pull)), covariance


def _hypotheses(
    evidence: Evidence, mark: Mark, sights: Sequence[Sight], found: tuple[complex, FloatArray], price: float
) -> Iterator[Hypothesis]:
    place, covariance = found
    price += 2 * log(2 * pi * ANYWHERE_M**2 / (2 * pi * np.sqrt(np.linalg.det(covariance))))
    everywhere = [(number, row) for number, walk in enumerate(evidence.walks) for row in walk.rows_of(mark).tolist()]
    yield _moved(evidence, mark, found, everywhere, price, partial(_mis_surveyed, mark, found))
    starts = [session_start(walk.passes.key.session) for walk in evidence.walks]
    dates = sorted({start for number, _ in everywhere if (start := starts[number]) is not None})
    for date in dates[1:]:
        since = [(number, row) for number, row in everywhere if (start := starts[number]) and start >= date]
        yield _moved(
            evidence, mark, found, since, price + choices(len(dates)), partial(_moved_since, mark, found, date)
        )
    own = evidence.table.place[mark]
    there = {(sight.walk, sight.row) for sight in sights if abs(sight.place - place) < abs(sight.place - own)}
    here = {(sight.walk, sight.row) for sight in sights} - there
    if abs(place - own) > LEAST_APART_M and there and here and not _one_after_the_other(evidence, here, there):
        yield _moved(
            evidence, mark, found, sorted(there), price + SECOND_SHEET_PRICE, partial(_two_places, mark, found, there)
        )


def _one_after_the_other(evidence: Evidence, here: set[tuple[int, int]], there: set[tuple[int, int]]) -> bool:
    """Whether all walks that saw a landmark at one place were before those that saw it at the other."""
    first, second = ([evidence.walks[number].passes.key.session for number, _ in rows] for rows in (here, there))
    return max(first) < min(second) or max(second) < min(first)


def _moved(
    evidence: Evidence,
    mark: Mark,
    found: tuple[complex, FloatArray],
    rows: Sequence[tuple[int, int]],
    price: float,
    describe: partial[Fault],
) -> Hypothesis:
    targets: dict[int, ComplexArray] = {}
    for number, row in rows:
        targets.setdefault(number, evidence.walks[number].target.copy())[row] = found[0]
    return Hypothesis(targets, price, describe, key=("displaced", mark))


def _place(found: tuple[complex, FloatArray]) -> tuple[float, float, float]:
    place, covariance = found
    return round(place.real, 2), round(place.imag, 2), round(float(np.sqrt(np.trace(covariance) / 2)), 2)


def _fault(
    kind: FaultKind, mark: Mark, summary: str, corrections: list[CorrectionEntry], evidence: Evidence, gain: float
) -> Fault:
    return Fault(
        kind=kind,
        floor=mark.floor,
        landmarks=[mark.landmark],
        summary=summary,
        evidence=told_by_passes(evidence, [mark]),
        odds=round(gain, 1),
        corrections=corrections,
    )


def _where(mark: Mark, found: tuple[complex, FloatArray], evidence: Evidence) -> str:
    x, y, sigma = _place(found)
    own = evidence.table.place[mark]
    room, own_room = (evidence.table.room_at(mark.floor, at) for at in (found[0], own))
    at = f"at ({x:g}, {y:g}) +- {sigma:g} m, {abs(found[0] - own):.1f} m from where the table has it"
    return (f"in {room}, " if room else "") + at + (f", {own_room}" if own_room not in ("", room) else "")


def _mis_surveyed(mark: Mark, found: tuple[complex, FloatArray], evidence: Evidence, gain: float) -> Fault:
    x, y, _ = _place(found)
    summary = f"landmark {mark.landmark} of floor {mark.floor} is {_where(mark, found, evidence)}"
    values = {"id": mark.landmark, "floor": mark.floor, "x": x, "y": y, "reason": REASON}
    entry = CorrectionEntry(table="move_landmark", values=values)
    return _fault(FaultKind.MIS_SURVEYED, mark, summary, [entry], evidence, gain)


def _moved_since(
    mark: Mark, found: tuple[complex, FloatArray], date: datetime, evidence: Evidence, gain: float
) -> Fault:
    x, y, _ = _place(found)
    summary = (
        f"landmark {mark.landmark} of floor {mark.floor} hangs since {date:%Y-%m-%d %H:%M} or shortly before "
        f"{_where(mark, found, evidence)}"
    )
    values = {"id": mark.landmark, "floor": mark.floor, "x": x, "y": y, "from": date, "reason": REASON}
    entry = CorrectionEntry(table="move_landmark", values=values)
    return _fault(FaultKind.MOVED, mark, summary, [entry], evidence, gain)


def _two_places(
    mark: Mark,
    found: tuple[complex, FloatArray],
    there: set[tuple[int, int]],
    evidence: Evidence,
    gain: float,
) -> Fault:
    summary = (
        f"two sheets of floor {mark.floor} have the id {mark.landmark}: a second one is {_where(mark, found, evidence)}"
    )
    entries = [
        CorrectionEntry(
            table="rename_landmark",
            values={
                "id": mark.landmark,
                "to": f"{mark.landmark} (second)",
                **asdict(evidence.walks[number].passes.key),
                **_span_of(evidence, number, row),
                "reason": REASON,
            },
        )
        for number, row in sorted(there)
    ]
    return _fault(FaultKind.TWO_PLACES, mark, summary, entries, evidence, gain)


def _span_of(evidence: Evidence, number: int, row: int) -> dict[str, float]:
    """From the middle between this pass and the landmark's one before to the middle to the next, seconds."""
    walk = evidence.walks[number]
    rows = walk.rows_of(walk.marks[row]).tolist()
    at, time_s = rows.index(row), walk.passes.time_s
    span = {}
    if at > 0:
        span["from_s"] = round(float(time_s[rows[at - 1]] + time_s[row]) / 2, 1)
    if at + 1 < len(rows):
        span["to_s"] = round(float(time_s[row] + time_s[rows[at + 1]]) / 2, 1)
    return span
