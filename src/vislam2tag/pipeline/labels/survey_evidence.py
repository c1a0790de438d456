"""Evidence of faults of the survey: landmark observations kept with each result, and evidence from them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from vislam2tag.common.errors import MissingExtraError, SessionError, SurveyError
from vislam2tag.core.arrays import ComplexArray
from vislam2tag.core.transforms import as_complex, as_points
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.tracker_errors import STATES
from vislam2tag.labeling.results import PassesRecord
from vislam2tag.quality.diagnosis.alignment import WalkPasses
from vislam2tag.quality.diagnosis.evidence import Evidence, Mark, PlacedWalk, Table
from vislam2tag.quality.diagnosis.id_faults import id_faults
from vislam2tag.quality.diagnosis.record import Fault
from vislam2tag.quality.diagnosis.search import found_faults
from vislam2tag.sessions.prepared import PreparedSession
from vislam2tag.sessions.session_landmarks import walk_id_shift
from vislam2tag.site.model import SessionKey, SessionRef, Site, Survey

if TYPE_CHECKING:
    from vislam2tag.site.walkable.walked import Areas


Places = dict[str, tuple[int, complex]]
"""Floor and position of each surveyed landmark that a session may use, complex metres."""
_DIGITS = 6
"""Decimal places of kept numbers."""


def passes_record(prepared: PreparedSession, range_m: float) -> PassesRecord | None:
    """Reduce a session to its landmark observations within ``range_m``; None if it has too few usable frames."""
    try:
        session = prepared.longest_section().session
    except SessionError:
        return None
    walk = WalkPasses.of(session.key, WalkObservations.of(session.camera, session.landmarks, range_m))
    return PassesRecord(
        landmark=list(walk.landmark),
        time_s=_rounded(walk.time_s.tolist()),
        camera=_points(walk.camera),
        offset=_points(walk.offset),
        sighting_m2=_rounded(walk.sighting_m2.tolist()),
        drift=[_rounded(row) for row in walk.drift.reshape(-1, STATES**2).tolist()],
        places={name: (floor, at.real, at.imag) for name, (floor, at) in places_of(prepared).items()},
        id_shift=walk_id_shift(session.camera, session.landmarks, prepared.landmarks),
    )


def places_of(prepared: PreparedSession) -> Places:
    """Surveyed landmarks that a session may use, except those of floors with other frames."""
    landmarks, own = prepared.landmarks, prepared.session.key.floor
    one_frame, surveyed = not prepared.task.frames, landmarks.surveyed
    return {
        name: (int(landmarks.floor[i]), complex(*landmarks.position_bcs[i]))
        for i, name in enumerate(landmarks.ids)
        if surveyed[i] and (one_frame or int(landmarks.floor[i]) == own)
    }


def kept_walk(key: SessionKey, record: PassesRecord) -> tuple[WalkPasses, Places]:
    """The observations and positions of a session from its kept numbers."""
    walk = WalkPasses(
        key=key,
        landmark=tuple(record.landmark),
        time_s=np.array(record.time_s, dtype=np.float64),
        camera=_complex(record.camera),
        offset=_complex(record.offset),
        sighting_m2=np.array(record.sighting_m2, dtype=np.float64),
        drift=np.array(record.drift, dtype=np.float64).reshape(-1, STATES, STATES),
        id_shift=record.id_shift,
    )
    return walk, {name: (floor, complex(x, y)) for name, (floor, x, y) in record.places.items()}


def _points(values: ComplexArray) -> list[tuple[float, float]]:
    return [(round(x, 4), round(y, 4)) for x, y in as_points(values).tolist()]


def _complex(points: Sequence[tuple[float, float]]) -> ComplexArray:
    return as_complex(np.array(points, dtype=np.float64).reshape(-1, 2))


def _rounded(values: Iterable[float]) -> list[float]:
    return [float(f"{value:.{_DIGITS}g}") for value in values]


MOST_WALKS = 40
"""Maximum number of walks per floor, chosen evenly; faults of the survey show in any of them."""


def thinned(refs: Sequence[SessionRef]) -> list[SessionRef]:
    """At most :data:`MOST_WALKS` sessions of each floor, chosen evenly."""
    floors = defaultdict(list)
    for ref in refs:
        floors[ref.key.floor].append(ref)
    return [ref for own in floors.values() for ref in _evenly(own)]


_Item = TypeVar("_Item")


def _evenly(items: Sequence[_Item]) -> list[_Item]:
    chosen = np.unique(np.linspace(0, len(items) - 1, min(len(items), MOST_WALKS)).round().astype(int))
    return [items[i] for i in chosen.tolist()]


@dataclass(frozen=True)
class RoomsOnPlans:
    """Names places by the floors' tables of rooms and by texts of their plans."""

    root: Path
    site: Site
    _areas: dict[int, Areas | None] = field(default_factory=dict)
    """Names of the requested floors; empty if no room has a name."""

    def __call__(self, floor: int, place: complex) -> str:
        """Room or corridor at a place, complex metres; empty if it has no name."""
        if floor not in self._areas:
            with suppress(SurveyError, MissingExtraError, ModuleNotFoundError):
                self._areas[floor] = self._areas_of(floor)
        areas = self._areas.setdefault(floor, None)
        return "" if areas is None else areas.of_place((place.real, place.imag))

    def _areas_of(self, number: int) -> Areas | None:
        # a survey without faults needs no names of rooms
        from vislam2tag.pipeline.labels.walked_floors import floor_areas
        from vislam2tag.site.floors import names_on_plan, read_room_names
        from vislam2tag.site.plans.load import floor_plan

        floor = next((one for one in self.site.floors if one.number == number and one.plan is not None), None)
        if floor is None:
            return None
        names, _ = read_room_names(self.root, floor.rooms)
        return floor_areas(floor, names) if names or names_on_plan(floor_plan(floor)) else None


def survey_evidence(
    survey: Survey, walks: Iterable[tuple[WalkPasses, Places]], rooms: RoomsOnPlans | None = None
) -> Evidence:
    """All walks on the positions of their landmarks according to the survey and its corrections.

    ``rooms`` names places, if that was looked up before.
    """
    site = survey.site
    marks = site.landmarks
    rows = np.flatnonzero(marks.surveyed).tolist()
    place = {Mark(int(marks.floor[i]), marks.ids[i]): complex(*marks.position_bcs[i]) for i in rows}
    ordered = sorted(walks, key=lambda walk: walk[0].key)
    own = [{Mark(floor, name): at for name, (floor, at) in places.items()} for _, places in ordered]
    for places in own:
        place |= places
    size_m = {
        floor.number: (floor.width_m, floor.height_m)
        for floor in site.floors
        if floor.width_m is not None and floor.height_m is not None
    }
    table = Table(place, size_m, rooms or RoomsOnPlans(survey.root, site))
    return Evidence(
        table,
        tuple(
            PlacedWalk.of(passes, {mark.landmark: mark.floor for mark in places}, replace(table, place=places))
            for (passes, _), places in zip(ordered, own, strict=True)
        ),
    )


def faults_of(
    survey: Survey, walks: Sequence[tuple[WalkPasses, Places]], rooms: RoomsOnPlans | None = None
) -> tuple[list[Fault], Evidence]:
    """Faults of ids and of landmark tables according to walks, and the evidence for them; ``rooms`` names places."""
    of_ids, walks = id_faults(survey.site.landmarks, walks)
    evidence = survey_evidence(survey, walks, rooms)
    return [*of_ids, *found_faults(evidence)[0]], evidence
