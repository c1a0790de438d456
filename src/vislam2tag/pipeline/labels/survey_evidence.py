"""All walks of a survey put together for diagnosis, those of large surveys thinned."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from vislam2tag.diagnosis.evidence import Evidence, Mark, PlacedWalk, Table
from vislam2tag.diagnosis.passes import WalkPasses
from vislam2tag.pipeline.labels.kept_passes import Places
from vislam2tag.survey.model import SessionRef, Site

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


def survey_evidence(site: Site, walks: Iterable[tuple[WalkPasses, Places]]) -> Evidence:
    """All walks on the places that the survey, its corrections included, gives their landmarks."""
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
    table = Table(place, size_m)
    return Evidence(
        table,
        tuple(
            PlacedWalk.of(passes, {mark.landmark: mark.floor for mark in places}, replace(table, place=places))
            for (passes, _), places in zip(ordered, own, strict=True)
        ),
    )
