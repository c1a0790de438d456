"""Faults of ids: walks that logged other ids than the tables have, ids shifted by a constant, planned positions."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace

from vislam2tag.core.tracks import Landmarks
from vislam2tag.diagnosis.passes import WalkPasses
from vislam2tag.diagnosis.record import Fault, FaultKind
from vislam2tag.intake.ids import IdShift
from vislam2tag.sessions.id_findings import SAME_IDS, compared_with_logs
from vislam2tag.survey.landmark_states import LandmarkCounts, names_shown

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
            summary=f"the ids that the phones logged on floor {floor} are not those of its landmark table",
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
                    evidence=f"{LandmarkCounts.of(here)}, by landmark_states.csv; measure them "
                    "(vislam2tag register), or use the plan's places with --use-planned",
                )
            )
    return faults
