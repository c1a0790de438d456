"""All walks of a survey put together for diagnosis, those of large surveys thinned."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.extras import MissingExtraError
from vislam2tag.pipeline.labels.kept_passes import Places
from vislam2tag.quality.diagnosis.alignment import WalkPasses
from vislam2tag.quality.diagnosis.evidence import Evidence, Mark, PlacedWalk, Table
from vislam2tag.site.model import SessionRef, Site, Survey

if TYPE_CHECKING:
    from vislam2tag.site.walkable.walked import Areas

MOST_WALKS = 40
"""So many walks of a floor are looked at, evenly among all: faults of the survey show in any of them."""


def thinned(refs: Sequence[SessionRef]) -> list[SessionRef]:
    """Of each floor at most :data:`MOST_WALKS` sessions, evenly among them."""
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
    """Calls places as people do: by the floors' tables of rooms and by what their plans say."""

    root: Path
    site: Site
    _areas: dict[int, Areas | None] = field(default_factory=dict)
    """Of the floors that were asked for; none where no room has a name."""

    def __call__(self, floor: int, place: complex) -> str:
        """Room or corridor at a place, complex metres; empty where it has no name."""
        if floor not in self._areas:
            with suppress(SurveyError, MissingExtraError, ModuleNotFoundError):
                self._areas[floor] = self._areas_of(floor)
        areas = self._areas.setdefault(floor, None)
        return "" if areas is None else areas.of_place((place.real, place.imag))

    def _areas_of(self, number: int) -> Areas | None:
        # a sound survey asks for no room, and needs none of these
        from vislam2tag.pipeline.labels.checking.walked_floors import floor_areas
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
    """All walks on the places that the survey, its corrections included, gives their landmarks.

    ``rooms`` calls places, where that was looked up before.
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
