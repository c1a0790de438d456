"""Faults of ids: ids that no table has, ids shifted by a constant, planned positions, one id on two floors."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from itertools import groupby

import numpy as np

from vislam2tag.common.findings import FaultKind
from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.tracks import Landmarks
from vislam2tag.core.transforms import as_points
from vislam2tag.intake.ids import IdShift
from vislam2tag.quality.diagnosis.alignment import WalkPasses, align
from vislam2tag.quality.diagnosis.evidence import MIN_OTHERS, listed, span_between
from vislam2tag.quality.diagnosis.record import Fault, proposed
from vislam2tag.quality.diagnosis.search import LEAST_GAIN
from vislam2tag.quality.diagnosis.table_faults import SLACK_M, TOGETHER
from vislam2tag.sessions.session_landmarks import SAME_IDS, compared_with_logs
from vislam2tag.site.landmark_states import LandmarkCounts, names_shown

Walk = tuple[WalkPasses, dict[str, tuple[int, complex]]]
"""The passes of a walk, and floor and place of each surveyed landmark that it may use."""


def id_faults(landmarks: Landmarks, walks: Sequence[Walk]) -> tuple[list[Fault], list[Walk]]:
    """Name what is wrong with the ids of all walks, and give the walks with shifted ids put right."""
    shifts: dict[tuple[int, int], list[tuple[WalkPasses, IdShift]]] = defaultdict(list)
    put_right: list[Walk] = []
    for passes, places in walks:
        found = passes.id_shift
        if found is not None:
            shifts[passes.key.floor, found.shift].append((passes, found))
            passes = _renamed(passes, found.shift)
        put_right.append((passes, places))
    logged: dict[int, set[str]] = defaultdict(set)
    for passes, _ in put_right:
        logged[passes.key.floor] |= set(passes.landmark)
    faults = [_shifted(floor, shift, of) for (floor, shift), of in sorted(shifts.items())]
    faults += [
        Fault(
            kind=FaultKind.OTHER_IDS,
            floor=floor,
            landmarks=list(one.unknown),
            summary=f"the ids that the phones logged on floor {floor} differ from those of its landmark table",
            evidence=f"{one.text}; {SAME_IDS}",
        )
        for floor, one in compared_with_logs(landmarks, logged).items()
    ]
    return [*faults, *_planned(landmarks, logged)], put_right


def _renamed(passes: WalkPasses, shift: int) -> WalkPasses:
    names = tuple(str(int(name) + shift) if name.isdecimal() else name for name in passes.landmark)
    return replace(passes, landmark=names)


def _shifted(floor: int, shift: int, of: Sequence[tuple[WalkPasses, IdShift]]) -> Fault:
    ids = sorted((name for name in {name for passes, _ in of for name in passes.landmark} if name.isdecimal()), key=int)
    walks = "1 walk" if len(of) == 1 else f"{len(of)} walks"
    return Fault(
        kind=FaultKind.SHIFTED_IDS,
        floor=floor,
        landmarks=ids,
        sessions=[str(passes.key) for passes, _ in of],
        summary=f"the ids that {walks} of floor {floor} logged are all shifted: "
        f"{ids[0]} there is {int(ids[0]) + shift} in the landmark table",
        evidence=f"{'; '.join(found.text for _, found in of[:3])}; {SAME_IDS}",
    )


def _planned(landmarks: Landmarks, logged: Mapping[int, set[str]]) -> list[Fault]:
    """Landmarks that walks saw and whose positions were only planned, and are not used."""
    faults = []
    for floor, names in sorted(logged.items()):
        here = landmarks.on_floor(floor)
        seen = [name for name in here.planned_ids if name in names and name not in here.surveyed_ids]
        if seen:
            faults.append(
                Fault(
                    kind=FaultKind.PLANNED,
                    floor=floor,
                    landmarks=seen,
                    summary=f"the positions of landmarks {names_shown(seen)} of floor {floor} are only planned, "
                    "and not used",
                    evidence=f"{LandmarkCounts.of(here)}, by landmark_states.csv; measure them (vislam2tag register), "
                    "or use the planned positions with --use-planned",
                )
            )
    return faults


def floors_of_passes(
    walk: WalkPasses, places: Mapping[str, complex], sheets: Mapping[str, Mapping[int, complex]]
) -> list[Fault]:
    """Find the floors of the sheets that a walk passed, for ids that several floors have.

    ``places`` has the landmarks of which there is one, ``sheets`` the others by id and floor; complex metres.
    None where some pass cannot be determined: then nothing would be mended.
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
        faults.append(_two_floors(walk, name, walk.time_s[rows], floors, sum(gain for _, gain in told)))
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


def _two_floors(walk: WalkPasses, name: str, time_s: FloatArray, floors: Sequence[int], gain: float) -> Fault:
    visited = sorted(set(floors))
    entries = []
    for floor, run in groupby(range(len(floors)), key=floors.__getitem__):
        rows = list(run)
        if floor != walk.key.floor or len(visited) == 1:
            span = span_between(time_s, rows[0], rows[-1])
            entries.append(proposed("set_landmark_floor", id=name, to=floor, **asdict(walk.key), **span))
    passes = [f"{floors.count(floor)} on floor {floor}" for floor in visited]
    return Fault(
        kind=FaultKind.TWO_FLOORS,
        floor=walk.key.floor,
        landmarks=[name],
        sessions=[str(walk.key)],
        summary=f"session {walk.key} passed the landmark {name} of floor {listed([str(floor) for floor in visited])}, "
        "but another floor has one with this id",
        evidence=f"according to the walk's other landmarks, it observed this id: {listed(passes)}",
        odds=round(gain, 1),
        corrections=entries,
    )
