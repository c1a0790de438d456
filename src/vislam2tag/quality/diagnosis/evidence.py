"""All walks of a survey on the places that the survey, and what is taken for wrong in it so far, says."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.quality.diagnosis.alignment import Alignment, align
from vislam2tag.quality.diagnosis.laid_way import Way, laid_way
from vislam2tag.quality.diagnosis.passes import WalkPasses

WELL_ALIGNED = 0.6
"""Of a walk of which less of its passes fits, no landmark is above suspicion."""
FAR_M = 4.0
"""What a walk puts farther from a place than this does not hang there."""
MIN_OTHERS = 2
"""So many other passes must fit to say where a landmark is."""


class Mark(NamedTuple):
    """A landmark by floor and id."""

    floor: int
    landmark: str


def _nameless(floor: int, place: complex) -> str:
    del floor, place
    return ""


@dataclass(frozen=True)
class Table:
    """Where the survey has its landmarks: complex metres by floor and id, and the extents of the floors' plans."""

    place: Mapping[Mark, complex]
    size_m: Mapping[int, tuple[float, float]]
    """Width and height of the plans that have them."""
    room_at: Callable[[int, complex], str] = _nameless
    """What people call the room or corridor at a place of a floor; empty where nobody says."""

    @cached_property
    def floors(self) -> frozenset[int]:
        """Floors that have landmarks."""
        return frozenset(mark.floor for mark in self.place)

    def on(self, floor: int) -> list[Mark]:
        """Landmarks of one floor."""
        return [mark for mark in self.place if mark.floor == floor]


@dataclass(frozen=True)
class PlacedWalk:
    """A walk whose ``p`` passes are those of ``marks`` (floor -1: of an unknown landmark), at ``target`` (p,) complex,
    metres, NaN where nobody knows.
    """

    passes: WalkPasses
    marks: tuple[Mark, ...]
    target: ComplexArray

    @classmethod
    def of(cls, passes: WalkPasses, floors: Mapping[str, int], table: Table) -> PlacedWalk:
        """Look the landmarks of a walk up, which went to the floors that ``floors`` gives by landmark."""
        marks = tuple(Mark(floors.get(name, -1), name) for name in passes.landmark)
        return cls(passes, marks, np.array([table.place.get(mark, np.nan) for mark in marks], dtype=np.complex128))

    @cached_property
    def alignment(self) -> Alignment:
        """The walk laid onto its targets."""
        return align(self.passes, self.target)

    @property
    def well_aligned(self) -> bool:
        """Whether most of its passes fit."""
        return bool(self.alignment.fits.sum() >= WELL_ALIGNED * np.isfinite(self.target).sum())

    def on_plan(self, way: Way) -> ComplexArray | None:
        """A way (n,) laid onto the plan, metres, NaN where that cannot be; None where the walk does not fit."""
        fits = self.well_aligned and self.alignment.fits.any()
        return laid_way(self.alignment, way) if fits else None

    def without(self, rows: IntArray) -> Alignment:
        """The walk laid onto its targets but those of some passes."""
        target = self.target.copy()
        target[rows] = np.nan
        return align(self.passes, target, anyhow=True)

    def rows_of(self, mark: Mark) -> IntArray:
        """Passes of one landmark."""
        return np.flatnonzero([own == mark for own in self.marks])


class Sight(NamedTuple):
    """Where a walk's other passes put one pass: complex metres, covariance (2, 2), m^2."""

    walk: int
    row: int
    place: complex
    covariance: FloatArray


@dataclass(frozen=True)
class Evidence:
    """The survey's table and all walks, in the order of their keys."""

    table: Table
    walks: tuple[PlacedWalk, ...]

    @property
    def cost(self) -> float:
        """What all walks together are off by."""
        return sum(walk.alignment.cost for walk in self.walks)

    def with_targets(
        self, targets: Mapping[int, ComplexArray], place: Mapping[Mark, complex] | None = None
    ) -> Evidence:
        """The same with other targets for some walks, by their number, and other places of some landmarks."""
        return replace(
            self,
            table=replace(self.table, place={**self.table.place, **(place or {})}),
            walks=tuple(
                replace(walk, target=targets[i]) if i in targets else walk for i, walk in enumerate(self.walks)
            ),
        )

    def passed(self, floor: int) -> list[Mark]:
        """Landmarks of a floor that walks passed."""
        return sorted({mark for walk in self.walks for mark in walk.marks if mark.floor == floor})

    @property
    def floors(self) -> list[int]:
        """Floors whose landmarks walks passed."""
        return sorted({mark.floor for walk in self.walks for mark in walk.marks if mark.floor in self.table.floors})

    def may_be_at(self, mark: Mark, place: complex) -> bool:
        """Whether no walk that fits well otherwise speaks against a landmark's hanging at a place."""
        sights = [sight for sight in self.sights(mark) if self.walks[sight.walk].well_aligned]
        return not sights or any(abs(sight.place - place) < FAR_M for sight in sights)

    @cached_property
    def _sights(self) -> dict[Mark, list[Sight]]:
        return {}

    def sights(self, mark: Mark) -> list[Sight]:
        """Where all walks put a landmark, its own passes taken out of each."""
        if mark not in self._sights:
            self._sights[mark] = self._found_sights(mark)
        return self._sights[mark]

    @cached_property
    def suspects(self) -> list[Mark]:
        """Landmarks with a pass that does not fit, or of a walk of which hardly any does."""
        found: set[Mark] = set()
        for walk in self.walks:
            known, fits = np.isfinite(walk.target), walk.alignment.fits
            found |= {walk.marks[i] for i in np.flatnonzero(known & ~fits if walk.well_aligned else known)}
            found |= {walk.marks[i] for cut in walk.alignment.cuts for i in range(cut, len(known)) if known[i]}
        return sorted(found)

    def _found_sights(self, mark: Mark) -> list[Sight]:
        found: list[Sight] = []
        for number, walk in enumerate(self.walks):
            rows = walk.rows_of(mark)
            if rows.size == 0:
                continue
            alignment = walk.alignment if walk.well_aligned else walk.without(rows)
            others = alignment.fits.copy()
            others[rows] = False
            if len({walk.marks[i] for i in np.flatnonzero(others)}) >= MIN_OTHERS:
                place, covariance = alignment.predicted(rows)
                found += [Sight(number, row, place[i], covariance[i]) for i, row in enumerate(rows.tolist())]
        return found
