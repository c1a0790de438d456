"""One id on two floors of a walk: which of the sheets each pass is of, told by the walk's other landmarks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import groupby

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.similarity import as_points
from vislam2tag.quality.diagnosis.alignment import align
from vislam2tag.quality.diagnosis.evidence import MIN_OTHERS
from vislam2tag.quality.diagnosis.faults.displaced import SLACK_M, TOGETHER
from vislam2tag.quality.diagnosis.passes import WalkPasses
from vislam2tag.quality.diagnosis.record import CorrectionEntry, Fault, FaultKind
from vislam2tag.quality.diagnosis.search import LEAST_GAIN
from vislam2tag.quality.diagnosis.words import REASON, listed


def told_floors(
    walk: WalkPasses, places: Mapping[str, complex], sheets: Mapping[str, Mapping[int, complex]]
) -> list[Fault]:
    """Say of which floor the sheets were that a walk passed, for ids that several floors have.

    ``places`` has the landmarks of which there is one, ``sheets`` the others by id and floor; complex metres.
    None where some pass cannot be told: then nothing would be mended.
    """
    target = np.array([places.get(name, np.nan) for name in walk.landmark], dtype=np.complex128)
    found = align(walk, target, anyhow=True)
    if len(np.unique(walk.landmark_number[found.fits])) < MIN_OTHERS:
        return []
    faults = []
    for name, of_floors in sorted(sheets.items()):
        rows = np.flatnonzero([own == name for own in walk.landmark])
        if not len(rows):
            return []
        told = [_floor_of(*found.predicted(rows[i : i + 1]), of_floors) for i in range(len(rows))]
        floors = [floor for floor, gain in told if gain >= LEAST_GAIN]
        if len(floors) < len(told):
            return []
        faults.append(_fault(walk, name, walk.time_s[rows], floors, sum(gain for _, gain in told)))
    return faults


def _floor_of(place: ComplexArray, covariance: FloatArray, of_floors: Mapping[int, complex]) -> tuple[int, float]:
    """The floor whose sheet hangs nearest to where a pass was, and by how much it fits better than the next, or than
    one that hangs elsewhere: squared distances in variances.
    """
    spread = covariance[0] + SLACK_M**2 * np.eye(2)
    off = {floor: as_points(np.array(place[0] - at)) for floor, at in of_floors.items()}
    squares = {floor: float(apart @ np.linalg.solve(spread, apart)) for floor, apart in off.items()}
    nearest, next_one = sorted(squares, key=squares.__getitem__)[:2]
    return nearest, squares[next_one] - squares[nearest] if squares[nearest] < TOGETHER else 0.0


def _fault(walk: WalkPasses, name: str, time_s: FloatArray, floors: Sequence[int], gain: float) -> Fault:
    visited = sorted(set(floors))
    entries = []
    for floor, run in groupby(range(len(floors)), key=floors.__getitem__):
        rows = list(run)
        if floor != walk.key.floor or len(visited) == 1:
            span = {}
            if rows[0] > 0:
                span["from_s"] = round(float(time_s[rows[0] - 1] + time_s[rows[0]]) / 2, 1)
            if rows[-1] + 1 < len(floors):
                span["to_s"] = round(float(time_s[rows[-1]] + time_s[rows[-1] + 1]) / 2, 1)
            values = {"id": name, "to": floor, **asdict(walk.key), **span, "reason": REASON}
            entries.append(CorrectionEntry(table="set_landmark_floor", values=values))
    passes = [f"{floors.count(floor)} on floor {floor}" for floor in visited]
    return Fault(
        kind=FaultKind.TWO_FLOORS,
        floor=walk.key.floor,
        landmarks=[name],
        sessions=[str(walk.key)],
        summary=f"session {walk.key} passed the landmark {name} of floor {listed([str(floor) for floor in visited])}, "
        "and another floor has one with this id",
        evidence=f"the walk's other landmarks put its passes of this id: {listed(passes)}",
        odds=round(gain, 1),
        corrections=entries,
    )
