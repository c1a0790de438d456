"""All walks of a survey on the places that the survey gives, and a hypothesis: a fault that would explain misfits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from math import log
from typing import NamedTuple, TypeAlias

import numpy as np

from vislam2tag.common.findings import counted
from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.core.transforms import Similarity2, as_points
from vislam2tag.quality.diagnosis.alignment import Alignment, WalkPasses, align
from vislam2tag.quality.diagnosis.record import Fault


class Way(NamedTuple):
    """Where a walk went: ``time_s`` (n,) increasing, from its first frame; ``place`` (n,) complex, metres, in the frame
    of its passes.
    """

    time_s: FloatArray
    place: ComplexArray


def laid_way(found: Alignment, way: Way) -> ComplexArray:
    """A way (n,) on the plan, complex metres; NaN from cut to cut where less than two landmarks say how it is.

    Between passes it is shifted by what theirs are off, in proportion to the time from either.
    """
    walk = found.walk
    laid = np.full(len(way.place), np.nan + 0j)
    for first, end in pairwise((0, *sorted(found.cuts), len(walk.camera))):
        rows = first + np.flatnonzero(found.fits[first:end])
        if len(np.unique(walk.landmark_number[rows])) < min(2, len(found.cuts) + 1):
            continue
        turn, origin = _rigid(walk.place[rows], found.target[rows]) if found.cuts else (found.turn, found.origin)
        off = found.target[rows] - (origin + turn * walk.place[rows])
        after = first == 0 or way.time_s >= walk.time_s[first]
        before = end == len(walk.camera) or way.time_s <= walk.time_s[end - 1]
        own = np.broadcast_to(after & before, laid.shape)
        laid[own] = origin + turn * way.place[own] + np.interp(way.time_s[own], walk.time_s[rows], off)
    return laid


def _rigid(place: ComplexArray, target: ComplexArray) -> tuple[complex, complex]:
    """Turn and origin that bring places (k,) onto their targets, by least squares."""
    fitted = Similarity2.fit(as_points(place), as_points(target)).a
    turn = fitted / abs(fitted)
    return turn, complex(target.mean() - turn * place.mean())


WELL_ALIGNED = 0.6
"""Of a walk of which less of its passes fits, no landmark is above suspicion."""
FAR_M = 4.0
"""What a walk puts further from a place than this does not hang there."""
MIN_OTHERS = 2
"""So many other passes must fit to say where a landmark is."""


BESIDE_M = 1.0
"""A landmark further outside the plan than this does not hang on its outer wall."""


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
    """What people call the room or corridor at a place of a floor; empty where no one says."""

    @cached_property
    def floors(self) -> frozenset[int]:
        """Floors that have landmarks."""
        return frozenset(mark.floor for mark in self.place)

    def on(self, floor: int) -> list[Mark]:
        """Landmarks of one floor."""
        return [mark for mark in self.place if mark.floor == floor]

    def beside_plan(self, floor: int, places: ComplexArray) -> int:
        """How many places (n,) are outside the plan of a floor; 0 if its size is not known."""
        if floor not in self.size_m:
            return 0
        (width_m, height_m), x, y = self.size_m[floor], places.real, places.imag
        outside = (x < -BESIDE_M) | (x > width_m + BESIDE_M) | (y < -BESIDE_M) | (y > height_m + BESIDE_M)
        return int(outside.sum())


@dataclass(frozen=True)
class PlacedWalk:
    """A walk whose ``p`` passes are those of ``marks`` (floor -1: of an unknown landmark), at ``target`` (p,) complex,
    metres, NaN where no one knows.
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

    def with_targets(
        self, targets: Mapping[int, ComplexArray], place: Mapping[Mark, complex] | None = None
    ) -> Evidence:
        """The same with other targets for some walks, by their number, and other places of some landmarks."""
        walks = [replace(walk, target=targets[i]) if i in targets else walk for i, walk in enumerate(self.walks)]
        return Evidence(replace(self.table, place={**self.table.place, **(place or {})}), tuple(walks))

    def moved(self, places: Mapping[tuple[int, int], complex]) -> dict[int, ComplexArray]:
        """Targets, by number of the walk, of walks of which some passes (walk, row) are of other places."""
        targets: dict[int, ComplexArray] = {}
        for (number, row), place in places.items():
            if number not in targets:
                targets[number] = self.walks[number].target.copy()
            targets[number][row] = place
        return targets

    def rows_of(self, mark: Mark) -> list[tuple[int, int]]:
        """Passes of one landmark: number of the walk, and row in it."""
        return [(number, row) for number, walk in enumerate(self.walks) for row in walk.rows_of(mark).tolist()]

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


@dataclass(frozen=True)
class Hypothesis:
    """``targets`` by number of the walk, in place of those it changes; ``price``: twice the logarithm of how many
    others like it there are, plus what its own freedom is worth (as in Schwarz's criterion).
    """

    targets: Mapping[int, ComplexArray]
    price: float
    describe: Callable[[Evidence], Fault]
    """Names the fault, given the evidence as it is with it."""
    place: Mapping[Mark, complex] = field(default_factory=dict)
    """Places of the table that the fault changes for all."""
    key: tuple[object, ...] = ()
    """Distinguishes hypotheses; a fault that is corrected is not proposed again."""


Propose: TypeAlias = Callable[[Evidence], Iterable[Hypothesis]]


def choices(count: int) -> float:
    """Price of choosing one among so many."""
    return 2 * log(max(count, 1))


def span_between(time_s: FloatArray, first: int, last: int) -> dict[str, float]:
    """From the middle between an item of times (k,) and the one before to the middle between another and the next, s.

    Open at either end of the times.
    """
    span = {}
    if first > 0:
        span["from_s"] = round(float(time_s[first - 1] + time_s[first]) / 2, 1)
    if last + 1 < len(time_s):
        span["to_s"] = round(float(time_s[last] + time_s[last + 1]) / 2, 1)
    return span


def listed(names: Sequence[str]) -> str:
    """Names as a sentence has them: a, b and c."""
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def misfit_of_passes(evidence: Evidence, marks: Sequence[Mark]) -> str:
    """How the walks' other passes speak for the new places of some landmarks, and against those of the table."""
    from_table, from_new, walks = [], [], set()
    for mark in marks:
        for sight in evidence.sights(mark):
            target = evidence.walks[sight.walk].target[sight.row]
            if target != evidence.table.place[mark]:
                from_table.append(abs(sight.place - evidence.table.place[mark]))
                from_new.append(abs(sight.place - target))
                walks.add(sight.walk)
    if not from_table:
        return "no other landmark of these walks fits without the correction"
    return (
        f"{counted(len(from_table), 'observation')} in {counted(len(walks), 'walk')}: in the median "
        f"{np.median(from_new):.1f} m from the corrected position, and {np.median(from_table):.1f} m from that in the "
        "table"
    )
