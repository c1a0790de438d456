"""The learned part of :mod:`.models.cell_density`: kernel regressions onto cells and storeys."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.positioning.cell_density.level_field import NOISES_DB, LevelField, learned_fields
from vislam2tag.positioning.cell_density.novelty import ReferenceScans
from vislam2tag.positioning.cell_density.scan_kernels import (
    STOREY_RIDGE,
    DirectionKernel,
    KernelNormalEquations,
    KernelRegression,
    LevelsAndTargets,
    StoreyKernel,
    directions,
    levels,
    mislabelled,
)
from vislam2tag.positioning.places import DensityCells, LabelledScans, ScanPlaces, cells_near
from vislam2tag.positioning.radio_scans import RadioScans, augmented

MOST_CENTRES = 1500
"""Largest number of training scans used as kernel centres, drawn at random if there are more."""
_CELL_SHARE = 0.8
"""Side of a cell as a share of the label width."""
_AT_ONCE = 1024
LEAST_DENSITY = 1e-9
"""Smallest density of a cell on the storey, so that every scan has a place."""
Targets = Callable[[ScanPlaces], FloatArray]
"""From places (n) to the regression's targets there (n, t)."""


@dataclass(frozen=True)
class LearningSetup:
    """Options of learning."""

    copies: int
    """Augmented copies of each scan for the kernels."""
    seed: int


@dataclass(frozen=True)
class DensityShape:
    """Sharpness and smoothness of a density."""

    sharpness: float
    """How fast the kernel decreases."""
    ridge: float
    """Regularisation of the regression."""
    width_m: float
    """Width of a label; one standard deviation."""
    noise_db: float = NOISES_DB[0]
    """Standard deviation of levels at one place, for the field of levels."""

    @property
    def cell_m(self) -> float:
        """Side of cells, metres."""
        return _CELL_SHARE * self.width_m


class DensityAnswer(NamedTuple):
    """Answers for ``n`` scans."""

    storey_probability: FloatArray
    """(n, s)"""
    xy: FloatArray
    """(n, 2) the density's place on the most likely storey, metres."""
    field_xy: FloatArray
    """(n, 2) the place by the field of levels, which extends beyond the surveyed places, metres."""
    spread_m: FloatArray
    """(n,) spread of guesses: geometric mean of the density's mean distance from its place and that of the most similar
    scans' places."""
    novelty: FloatArray
    """(n,) how unlike the training set a scan is."""

    def blended(self, half_novelty: float) -> FloatArray:
        """Return places (n, 2), metres: the density's if nothing is new, midway at ``half_novelty``, the field's far
        beyond.

        With an infinite ``half_novelty`` always the density's, with 0 always the field's.
        """
        if half_novelty == 0:
            return self.field_xy
        share = (self.novelty**2 / (self.novelty**2 + half_novelty**2))[:, None]
        return np.asarray((1 - share) * self.xy + share * self.field_xy)


@dataclass(frozen=True)
class DensityModel:
    """Cells, and functions for the probability of each cell and storey, and for expected levels."""

    cells: DensityCells
    density: KernelRegression[DirectionKernel]
    storeys: KernelRegression[StoreyKernel]
    field: LevelField | None
    """None if only the density is used."""
    references: ReferenceScans
    mislabelled: int = 0
    """Scans that were ignored in training, because the others contradict their storey."""

    def answer(self, scans: RadioScans) -> DensityAnswer:
        """Estimate where scans (n) were taken."""
        blocks = [self._answer(scans[rows]) for rows in _blocks(max(len(scans), 1))]
        return DensityAnswer(*(np.concatenate(block) for block in zip(*blocks, strict=True)))

    def _answer(self, scans: RadioScans) -> DensityAnswer:
        level = levels(scans)
        probability = _shares(self.storeys(level), 0.0)
        density = _shares(self.density(level), LEAST_DENSITY)
        storey = probability.argmax(axis=1)
        xy = self.cells.median(density * self.cells.on(storey))
        field_xy = self.field.place(scans.dense(), storey) if self.field else xy
        dispersal_m, novelty = self.references.compared(directions(level), xy)
        spread_m = np.sqrt(self.cells.spread_m(density, xy) * dispersal_m)
        return DensityAnswer(probability, xy, field_xy, spread_m, novelty)


def learned_model(scans: RadioScans, places: ScanPlaces, shape: DensityShape, setup: LearningSetup) -> DensityModel:
    """Learn cells and storeys from the scans (n) at places (n), except scans with a contradicted storey."""
    doubted = mislabelled(scans, places.storey, _centres(len(scans), setup))
    scans, places = scans[~doubted], places[~doubted]
    cells = cells_near(places, shape.cell_m)
    densities = _learned_densities((scans, places), cells, shape.width_m, shape.sharpness, [shape.ridge], setup)
    centres = _centres(len(scans), setup)
    storeys = learned_storeys(scans, places, centres)
    (field,) = learned_fields(scans[centres].dense(), places[centres], [shape.noise_db])
    references = ReferenceScans.of(densities[0].kernel.centre, places.xy[centres])
    return DensityModel(cells, densities[0], storeys, field, references, int(doubted.sum()))


def errors_on_storey_m(
    learn: LabelledScans, held_out: LabelledScans, shapes: Sequence[DensityShape], setup: LearningSetup
) -> FloatArray:
    """Return errors in the plane (shapes, n) on held-out scans with known storey; shapes differ only in their ridge."""
    first = shapes[0]
    cells = cells_near(learn[1], first.cell_m)
    level, truth = levels(held_out[0]), held_out[1]
    on = np.where(cells.on(truth.storey), 1.0, LEAST_DENSITY)
    ridges = [shape.ridge for shape in shapes]
    functions = _learned_densities(learn, cells, first.width_m, first.sharpness, ridges, setup)
    found = (cells.median(_shares(function(level), LEAST_DENSITY) * on) for function in functions)
    return np.stack([np.hypot(*(xy - truth.xy).T) for xy in found])


def _learned_densities(
    labelled: LabelledScans,
    cells: DensityCells,
    width_m: float,
    sharpness: float,
    ridges: Sequence[float],
    setup: LearningSetup,
) -> list[KernelRegression[DirectionKernel]]:
    """Regress onto the densities of labels, from the scans and augmented copies of each; one function for each
    ridge."""
    scans, places = labelled
    rng = np.random.default_rng(setup.seed)
    centres = _centres(len(scans), setup)

    def targets(some: ScanPlaces) -> FloatArray:
        return cells.label_densities(some, width_m)

    mean = targets(places[centres]).mean(axis=0)
    kernel = DirectionKernel(directions(levels(scans[centres])), sharpness)
    equations = KernelNormalEquations.empty(kernel, mean, len(centres))
    return equations.add(_examples(scans, places, targets, setup.copies, rng)).solved(ridges)


def _examples(
    scans: RadioScans, places: ScanPlaces, targets: Targets, copies: int, rng: np.random.Generator
) -> Iterator[LevelsAndTargets]:
    for rows in _blocks(len(scans)):
        level, target = levels(scans[rows]), targets(places[rows])
        yield level, target
        for _ in range(copies):
            yield augmented(level, rng), target


def learned_storeys(scans: RadioScans, places: ScanPlaces, centres: IntArray) -> KernelRegression[StoreyKernel]:
    """Regress onto storeys, with kernels around scans (m,), by index; without augmented copies, which do not help."""
    one_hot = np.eye(len(places.storeys))
    kernel = StoreyKernel.around(levels(scans[centres]))
    equations = KernelNormalEquations.empty(kernel, one_hot[places.storey[centres]].mean(axis=0), len(centres))
    equations.add((levels(scans[rows]), one_hot[places.storey[rows]]) for rows in _blocks(len(scans)))
    return equations.solved([STOREY_RIDGE])[0]


def _shares(score: FloatArray, least: float) -> FloatArray:
    """Raise scores (n, t) to a minimum and normalise their sums to 1."""
    score = np.maximum(score, least)
    return np.asarray(score / np.maximum(score.sum(axis=1, keepdims=True), LEAST_DENSITY))


def _centres(count: int, setup: LearningSetup) -> IntArray:
    """Draw the scans that are kernel centres: (m,) indices, in order."""
    return np.sort(np.random.default_rng(setup.seed).permutation(count)[:MOST_CENTRES])


def _blocks(count: int) -> Iterator[slice]:
    return (slice(start, start + _AT_ONCE) for start in range(0, count, _AT_ONCE))
