"""A landmark table that is turned against its plan, told by where the walks would have gone: through walls.

Walks fit a table however it is turned as a whole, and a plan's extent tells a quarter turn only where it is no square.
What a plan whose halves are alike cannot tell is not named.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray
from vislam2tag.core.similarity import as_points
from vislam2tag.diagnosis.evidence import Evidence
from vislam2tag.diagnosis.record import CorrectionEntry, Fault, FaultKind
from vislam2tag.diagnosis.words import REASON, listed
from vislam2tag.survey.model import SessionKey

LEAST_BETTER = 0.1
"""Another turn is believed where this much more of the way is free of walls, as a share ..."""
LEAST_FREE = 0.9
"""... and so much of it at least."""
AS_GOOD = 0.03
"""Turns whose shares differ by less than this cannot be told apart."""
Inside: TypeAlias = Callable[[FloatArray], BoolArray]
"""Tells which points (n, 2), BCS metres, can be walked to."""


@dataclass(frozen=True)
class _Turn:
    degrees: float
    shift: complex

    def of(self, place: ComplexArray) -> ComplexArray:
        return np.asarray(place * np.exp(1j * np.radians(self.degrees)) + self.shift)


def _turns(width_m: float, height_m: float) -> tuple[_Turn, ...]:
    """As it is, and by one, two and three quarters, each brought back onto the plan."""
    shifts = (0j, complex(width_m), complex(width_m, height_m), complex(0.0, height_m))
    return tuple(_Turn(90.0 * number, shift) for number, shift in enumerate(shifts))


def told_by_plan(
    faults: Sequence[Fault],
    evidence: Evidence,
    paths: Mapping[SessionKey, ComplexArray],
    spaces: Mapping[int, Inside],
) -> list[Fault]:
    """Add the turns that plans tell to the faults found; one of a mirrored table is put into that fault's correction.

    ``evidence`` has those faults corrected; ``paths`` are the walks in the frames of their passes, complex metres;
    ``spaces`` tell by floor where can be walked.
    """
    found = list(faults)
    for floor, inside in sorted(spaces.items()):
        told = _told(floor, inside, evidence, paths)
        if told is None:
            continue
        turn, words = told
        mirrored = next((one for one in found if one.kind is FaultKind.MIRRORED and one.floor == floor), None)
        found = [one for one in found if one is not mirrored and (one.kind, one.floor) != (FaultKind.TURNED, floor)]
        found.append(_turned(floor, turn, words) if mirrored is None else _mirrored(mirrored, turn, words))
    return found


def _told(
    floor: int, inside: Inside, evidence: Evidence, paths: Mapping[SessionKey, ComplexArray]
) -> tuple[_Turn, str] | None:
    """The turn by which walks go through fewer walls, and why; None where the table's own is as good."""
    walks = [walk for walk in evidence.walks if walk.passes.key.floor == floor and walk.passes.key in paths]
    ways = [way for walk in walks if (way := walk.on_plan(paths[walk.passes.key])) is not None]
    if floor not in evidence.table.size_m or not ways:
        return None
    turns = _turns(*evidence.table.size_m[floor])
    free = [float(np.mean([inside(as_points(turn.of(way))).mean() for way in ways])) for turn in turns]
    best = int(np.argmax(free))
    if free[best] < LEAST_FREE or free[best] - free[0] < LEAST_BETTER:
        return None
    others = [turns[i] for i in range(1, len(turns)) if i != best and free[best] - free[i] < AS_GOOD]
    words = (
        f"{100 * free[best]:.0f} % of the way of {len(ways)} walks is free of the plan's walls then, and "
        f"{100 * free[0]:.0f} % as the table is"
    )
    if others:
        alike = listed([f"turn_deg = {one.degrees:g}, shift_m = {_numbers(one.shift)}" for one in others])
        words += f"; as well with {alike}: look at the plan"
    return turns[best], words


def _numbers(shift: complex) -> list[float]:
    return [round(shift.real, 3), round(shift.imag, 3)]


def _turned(floor: int, turn: _Turn, words: str) -> Fault:
    values = {"floor": floor, "turn_deg": turn.degrees, "shift_m": _numbers(turn.shift), "reason": REASON}
    return Fault(
        kind=FaultKind.TURNED,
        floor=floor,
        summary=f"the landmark table of floor {floor} is turned by {turn.degrees:g} degrees against its plan",
        evidence=words,
        corrections=[CorrectionEntry(table="turn_landmarks", values=values)],
    )


def _mirrored(fault: Fault, turn: _Turn, words: str) -> Fault:
    """A mirrored table whose entry is turned, too: mirrored about another line."""
    *others, entry = fault.corrections
    shift = turn.of(np.array([complex(*entry.values["shift_m"])]))[0]
    values = {**entry.values, "turn_deg": turn.degrees, "shift_m": _numbers(complex(shift))}
    entry = entry.model_copy(update={"values": values})
    told = f"{fault.evidence.partition('; that the table')[0]}; about which line the plan tells: {words}"
    return fault.model_copy(update={"corrections": [*others, entry], "evidence": told})
