"""A floor's whole landmark table in other units, or mirrored: every walk there contradicts it alike."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

from vislam2tag.diagnosis.evidence import Evidence
from vislam2tag.diagnosis.hypothesis import Hypothesis, choices
from vislam2tag.diagnosis.record import CorrectionEntry, Fault, FaultKind
from vislam2tag.diagnosis.words import REASON
from vislam2tag.site.corrections.file import UNITS_M


@dataclass(frozen=True)
class _Change:
    """``unit`` of the coordinates ('' metres), and whether x runs the other way."""

    unit: str
    mirrored: bool

    def of(self, place: complex, width_m: float) -> complex:
        """A place of the table where this change puts it."""
        scaled = place * UNITS_M.get(self.unit, 1.0)
        return complex(width_m - scaled.real, scaled.imag) if self.mirrored else scaled


CHANGES = [_Change(unit, mirrored) for unit in ("", *UNITS_M) for mirrored in (False, True)][1:]


def propose(evidence: Evidence) -> Iterator[Hypothesis]:
    """Change the table of every floor on which there are suspects."""
    for floor in sorted({mark.floor for mark in evidence.suspects} & set(evidence.floors)):
        width_m = evidence.table.size_m.get(floor, (0.0, 0.0))[0]
        for change in CHANGES:
            targets = {}
            for number, walk in enumerate(evidence.walks):
                rows = [i for i, mark in enumerate(walk.marks) if mark.floor == floor and mark in evidence.table.place]
                if rows:
                    target = walk.target.copy()
                    target[rows] = [change.of(complex(target[i]), width_m) for i in rows]
                    targets[number] = target
            place = {mark: change.of(evidence.table.place[mark], width_m) for mark in evidence.table.on(floor)}
            describe = partial(_fault, floor, change, width_m)
            yield Hypothesis(targets, choices(len(CHANGES)), describe, place, ("frame", floor))


def _fault(floor: int, change: _Change, width_m: float, evidence: Evidence, gain: float) -> Fault:
    fits = sum(int(walk.alignment.fits.sum()) for walk in evidence.walks if walk.passes.key.floor == floor)
    told = f"{fits} passes of landmarks fit then, and else hardly any"
    entries = []
    parts = []
    if change.unit:
        parts.append(f"in {change.unit}, not in metres")
        entries.append(
            CorrectionEntry(table="landmark_units", values={"floor": floor, "unit": change.unit, "reason": REASON})
        )
    if change.mirrored:
        parts.append("mirrored")
        told += "; that the table is mirrored is sure, that it is so from left to right is not: look at the plan"
        values = {"floor": floor, "mirrored": True, "shift_m": [width_m, 0.0], "reason": REASON}
        entries.append(CorrectionEntry(table="turn_landmarks", values=values))
    return Fault(
        kind=FaultKind.UNITS if change.unit else FaultKind.MIRRORED,
        floor=floor,
        summary=f"the landmark table of floor {floor} is {' and '.join(parts)}",
        evidence=told,
        odds=round(gain, 1),
        corrections=entries,
    )
