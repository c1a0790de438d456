"""A landmark table that is turned against its plan, told by where the walks would have gone: through walls.

Walks fit a table however it is turned as a whole, and a plan's extent tells a quarter turn only where it is no square.
What a plan whose halves are alike cannot tell is not named.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import ComplexArray
from vislam2tag.core.similarity import as_points
from vislam2tag.diagnosis.evidence import Evidence
from vislam2tag.diagnosis.laid_way import Way
from vislam2tag.diagnosis.record import CorrectionEntry, Fault, FaultKind
from vislam2tag.diagnosis.walls_crossed import Inside, walls_crossed
from vislam2tag.diagnosis.words import REASON, listed
from vislam2tag.site.model import SessionKey

LEAST_BETTER = 0.1
"""Another turn is believed where this much more of the way is free of walls, as a share, ..."""
LEAST_FREE = 0.9
"""... if so much of it is at least ..."""
FEWEST_MORE, TIMES_MORE = 3, 3
"""... or where the table's own turn crosses so many times as many walls, and so many more than that."""


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
    ways: Mapping[SessionKey, Way],
    spaces: Mapping[int, Inside],
) -> list[Fault]:
    """Add the turns that plans tell to the faults found; one of a mirrored table is put into that fault's correction.

    ``evidence`` has those faults corrected; ``ways`` are those of the walks; ``spaces`` tell by floor where can be
    walked.
    """
    found = list(faults)
    for floor, inside in sorted(spaces.items()):
        told = _told(floor, inside, evidence, ways)
        if told is None:
            continue
        turn, words = told
        mirrored = next((one for one in found if one.kind is FaultKind.MIRRORED and one.floor == floor), None)
        found = [one for one in found if one is not mirrored and (one.kind, one.floor) != (FaultKind.TURNED, floor)]
        found.append(_turned(floor, turn, words) if mirrored is None else _mirrored(mirrored, turn, words))
    return found


def _told(floor: int, inside: Inside, evidence: Evidence, ways: Mapping[SessionKey, Way]) -> tuple[_Turn, str] | None:
    """The turn by which walks cross fewer walls, and why; None where the table's own is as good."""
    walks = [walk for walk in evidence.walks if walk.passes.key.floor == floor and walk.passes.key in ways]
    laid = [way for walk in walks if (way := walk.on_plan(ways[walk.passes.key])) is not None]
    if floor not in evidence.table.size_m or not laid:
        return None
    turns = _turns(*evidence.table.size_m[floor])
    free = [_free_share(inside, [turn.of(way) for way in laid]) for turn in turns]
    walls = {i: walls_crossed(inside, [turns[i].of(way) for way in laid]) for i in range(4) if free[i] >= LEAST_FREE}
    if not walls:
        return None
    best = min(walls, key=lambda i: (walls[i], -free[i]))
    alike = [i for i in walls if not _clearly_more(walls[i], walls[best])]
    if 0 in alike or (0 not in walls and free[best] - free[0] < LEAST_BETTER):
        return None
    words = f"{100 * free[best]:.0f} % of the way of {len(laid)} walks is free of the plan's walls then, "
    words += f"and {100 * free[0]:.0f} % as the table is"
    if 0 in walls:
        words = f"the ways of {len(laid)} walks cross {walls[best]} of the plan's walls then, and {walls[0]} as it is"
    if others := [turns[i] for i in alike if i != best]:
        as_well = listed([f"turn_deg = {one.degrees:g}, shift_m = {_numbers(one.shift)}" for one in others])
        words += f"; as well with {as_well}: look at the plan"
    return turns[best], words


def _free_share(inside: Inside, ways: Sequence[ComplexArray]) -> float:
    """Share of ways that is free of walls, on average."""
    return float(np.mean([inside(as_points(way[np.isfinite(way)])).mean() for way in ways if np.isfinite(way).any()]))


def _clearly_more(walls: int, fewest: int) -> bool:
    return walls >= FEWEST_MORE + TIMES_MORE * fewest


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
