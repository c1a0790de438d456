"""A landmark table that is turned against its plan, which walks cannot show: they fit it however it is turned.

Landmarks lie outside the plan, or the walks would have led through walls. A tracker puts a way up to some decimetres
off: a wall is crossed only if the way, shifted by as much in any direction, meets one too. Turns that a plan whose
halves are alike cannot distinguish are not named.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from vislam2tag.common.findings import FaultKind, counted
from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, runs_of
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.core.transforms import as_points
from vislam2tag.quality.diagnosis.evidence import Evidence, Table, Way, listed
from vislam2tag.quality.diagnosis.record import Fault, proposed
from vislam2tag.site.model import SessionKey

FEWEST_BESIDE, LEAST_SHARE = 2, 0.15
"""So many landmarks, and this share of them, must lie beside the plan."""


def turned_tables(table: Table) -> list[Fault]:
    """Name the floors whose table fits onto the plan when it is turned by a quarter, and not as it is."""
    found = []
    for floor, (width_m, height_m) in sorted(table.size_m.items()):
        places = np.array([table.place[mark] for mark in table.on(floor)])
        beside, turned = table.beside_plan(floor, places), table.beside_plan(floor, 1j * places + width_m)
        if beside < max(FEWEST_BESIDE, LEAST_SHARE * len(places)) or turned:
            continue
        found.append(
            Fault(
                kind=FaultKind.TURNED,
                floor=floor,
                summary=f"the landmark table of floor {floor} is turned by a quarter against its plan",
                evidence=f"{beside} of {len(places)} landmarks are outside the plan of {width_m:g} x {height_m:g} m, "
                "and none once the table is turned. Check on the plan whether by 90 or 270 degrees (270: turn_deg = "
                f"270.0, shift_m = [0.0, {height_m:g}])",
                corrections=[proposed("turn_landmarks", floor=floor, turn_deg=90.0, shift_m=[width_m, 0.0])],
            )
        )
    return found


STEP_M = 0.1
"""From one place that is looked at to the next."""
FREE_BESIDE_M = 1.0
"""So much of the way before and behind a wall must be free, too, for a shift to explain it."""
SHIFTS_M = np.array([0j, *(at_m * np.exp(0.25j * np.pi * turn) for at_m in (0.25, 0.5, 0.75) for turn in range(8))])
"""A way may be off by so much."""
APART_M = 1.5
"""Crossings closer to each other than this are of one wall: a door drawn shut counts once for all walks."""
Inside: TypeAlias = Callable[[FloatArray], BoolArray]
"""Returns which points (n, 2), BCS metres, can be walked to."""


def walls_crossed(inside: Inside, ways: Iterable[ComplexArray]) -> int:
    """In how many places ways (n,) lead through walls; NaN interrupts a way."""
    places: list[complex] = []
    for way in ways:
        for start, stop in runs_of(np.isfinite(way)):
            for place in _crossings(inside, _even_steps(way[start:stop])):
                if all(abs(place - other) > APART_M for other in places):
                    places.append(place)
    return len(places)


def _even_steps(way: ComplexArray) -> ComplexArray:
    along = arc_lengths(as_points(way))
    return np.asarray(np.interp(np.arange(0.0, along[-1] + STEP_M, STEP_M), along, way))


def _crossings(inside: Inside, way: ComplexArray) -> list[complex]:
    """Middles of the stretches of a way in even steps that lead through walls however it is shifted."""
    beside = round(FREE_BESIDE_M / STEP_M)
    near_wall = np.convolve(~inside(as_points(way)), np.ones(2 * beside + 1), mode="same") > 0
    stretches = [way[start:stop] for start, stop in runs_of(near_wall)]
    return [complex(stretch[len(stretch) // 2]) for stretch in stretches if not _free_if_shifted(inside, stretch)]


def _free_if_shifted(inside: Inside, stretch: ComplexArray) -> bool:
    shifted = stretch + SHIFTS_M[:, None]
    return bool(inside(as_points(shifted.ravel())).reshape(shifted.shape).all(axis=1).any())


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


def with_turns_by_plan(
    faults: Sequence[Fault],
    evidence: Evidence,
    ways: Mapping[SessionKey, Way],
    spaces: Mapping[int, Inside],
) -> list[Fault]:
    """Add the turns that plans show to the faults found; one of a mirrored table is put into that fault's correction.

    ``evidence`` has those faults corrected; ``ways`` are those of the walks; ``spaces`` contain, by floor, where can be
    walked.
    """
    found = list(faults)
    for floor, inside in sorted(spaces.items()):
        told = _turn_by_plan(floor, inside, evidence, ways)
        if told is None:
            continue
        turn, words = told
        mirrored = next((one for one in found if one.kind is FaultKind.MIRRORED and one.floor == floor), None)
        found = [one for one in found if one is not mirrored and (one.kind, one.floor) != (FaultKind.TURNED, floor)]
        found.append(_turned(floor, turn, words) if mirrored is None else _mirrored(mirrored, turn, words))
    return found


def _turn_by_plan(
    floor: int, inside: Inside, evidence: Evidence, ways: Mapping[SessionKey, Way]
) -> tuple[_Turn, str] | None:
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
    words = (
        f"{100 * free[best]:.0f} % of the path of {counted(len(laid), 'walk')} is free of the plan's walls with this "
        f"correction, and {100 * free[0]:.0f} % without it"
    )
    if 0 in walls:
        words = (
            f"the paths of {counted(len(laid), 'walk')} cross {walls[best]} of the plan's walls with this correction, "
            f"and {walls[0]} without it"
        )
    if others := [turns[i] for i in alike if i != best]:
        as_well = listed([f"turn_deg = {one.degrees:g}, shift_m = {_numbers(one.shift)}" for one in others])
        words += f"; {as_well} fits equally well: check it on the plan"
    return turns[best], words


def _free_share(inside: Inside, ways: Sequence[ComplexArray]) -> float:
    """Share of ways that is free of walls, on average."""
    return float(np.mean([inside(as_points(way[np.isfinite(way)])).mean() for way in ways if np.isfinite(way).any()]))


def _clearly_more(walls: int, fewest: int) -> bool:
    return walls >= FEWEST_MORE + TIMES_MORE * fewest


def _numbers(shift: complex) -> list[float]:
    return [round(shift.real, 3), round(shift.imag, 3)]


def _turned(floor: int, turn: _Turn, words: str) -> Fault:
    return Fault(
        kind=FaultKind.TURNED,
        floor=floor,
        summary=f"the landmark table of floor {floor} is turned by {turn.degrees:g} degrees against its plan",
        evidence=words,
        corrections=[proposed("turn_landmarks", floor=floor, turn_deg=turn.degrees, shift_m=_numbers(turn.shift))],
    )


def _mirrored(fault: Fault, turn: _Turn, words: str) -> Fault:
    """A mirrored table whose entry is turned, too: mirrored about another line."""
    *others, entry = fault.corrections
    shift = turn.of(np.array([complex(*entry.values["shift_m"])]))[0]
    values = {**entry.values, "turn_deg": turn.degrees, "shift_m": _numbers(complex(shift))}
    entry = entry.model_copy(update={"values": values})
    told = f"{fault.evidence.partition('; the table is certainly')[0]}; check on the plan about which line: {words}"
    return fault.model_copy(update={"corrections": [*others, entry], "evidence": told})
