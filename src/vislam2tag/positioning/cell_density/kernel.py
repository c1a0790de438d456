"""What :mod:`.models.cell_density` learns: kernel regressions onto cells and storeys, and networks beside them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vislam2tag.common.extras import import_extra
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.positioning.cell_density.contradicted import contradicted
from vislam2tag.positioning.cell_density.dense_layers import DenseLayers
from vislam2tag.positioning.cell_density.density_cells import DensityCells, cells_near
from vislam2tag.positioning.cell_density.field import NOISES_DB, LevelField, learned_fields
from vislam2tag.positioning.cell_density.novelty import AlikeScans
from vislam2tag.positioning.cell_density.scan_kernel import (
    MOST_CENTRES,
    DirectionLikeness,
    NormalEquations,
    Pair,
    ScanKernel,
    directions,
    levels,
)
from vislam2tag.positioning.cell_density.storeys import STOREY_RIDGE, StoreyLikeness
from vislam2tag.positioning.places import Places
from vislam2tag.positioning.scans.radio_scans import RadioScans
from vislam2tag.positioning.scans.representation import altered

_CELL_SHARE = 0.8
"""Side of a cell as a share of how far a label reaches."""
_SEED_STEP = 1000
"""Between the seeds of two networks."""
_AT_ONCE = 1024
NETWORKS_WEIGHT = 2.0
"""Of what the networks say on average, however many there are; the kernel's weight is 1."""
LEAST = 1e-9
"""What a cell of the storey is worth at least, so that every scan has a place."""
Targets = Callable[[Places], FloatArray]


@dataclass(frozen=True)
class Setup:
    """How to learn."""

    copies: int
    """Altered copies of each scan for the kernels."""
    networks: Sequence[float]
    """A network is trained for each of these exponents of levels."""
    seed: int


@dataclass(frozen=True)
class Shape:
    """How fast the kernel falls, how much it is smoothed, how far a label reaches; how levels of a place differ."""

    sharpness: float
    ridge: float
    width_m: float
    noise_db: float = NOISES_DB[0]

    @property
    def cell_m(self) -> float:
        """Side of cells."""
        return _CELL_SHARE * self.width_m


class CellAnswer(NamedTuple):
    """What is said of ``n`` scans."""

    storey_probability: FloatArray
    """(n, s)"""
    xy: FloatArray
    """(n, 2) the density's place on the likeliest storey, metres."""
    field_xy: FloatArray
    """(n, 2) the place by the field of levels, which reaches where nobody was."""
    spread_m: FloatArray
    """(n,) how far guesses lie apart: geometric mean of the density's mean distance from its place and that of the
    most alike scans' places."""
    novelty: FloatArray
    """(n,) how unlike a scan is to all that was learned."""

    def between(self, half: float) -> FloatArray:
        """Return places (n, 2): the density's where nothing is new, midway at this novelty, the field's far beyond.

        With an infinite ``half`` the density's everywhere, with 0 the field's.
        """
        if half == 0:
            return self.field_xy
        share = (self.novelty**2 / (self.novelty**2 + half**2))[:, None]
        return np.asarray((1 - share) * self.xy + share * self.field_xy)


@dataclass(frozen=True)
class CellKernel:
    """Cells, and the functions that tell how likely each cell and each storey is, and what is heard where."""

    cells: DensityCells
    density: ScanKernel[DirectionLikeness]
    storeys: ScanKernel[StoreyLikeness]
    field: LevelField | None
    """None where the density alone is asked."""
    alike: AlikeScans
    networks: tuple[DenseLayers, ...] = ()
    contradicted: int = 0
    """Scans that were not learned from, as the others contradict their storey."""

    def answer(self, scans: RadioScans) -> CellAnswer:
        """Say where scans (n) were taken."""
        parts = [self._answer(scans[rows]) for rows in _blocks(max(len(scans), 1))]
        return CellAnswer(*(np.concatenate(part) for part in zip(*parts, strict=True)))

    def _answer(self, scans: RadioScans) -> CellAnswer:
        level = levels(scans)
        probability = _shares(self.storeys(level), 0.0)
        density = _shares(self.density(level), LEAST)
        if self.networks:
            density += NETWORKS_WEIGHT * np.mean([network(level) for network in self.networks], axis=0)
        storey = probability.argmax(axis=1)
        xy = self.cells.median(density * self.cells.on(storey))
        field_xy = self.field.place(scans.dense(), storey) if self.field else xy
        dispersal_m, novelty = self.alike.compared(directions(level), xy)
        spread_m = np.sqrt(self.cells.spread_m(density, xy) * dispersal_m)
        return CellAnswer(probability, xy, field_xy, spread_m, novelty)


def learned(scans: RadioScans, places: Places, shape: Shape, setup: Setup) -> CellKernel:
    """Learn cells and storeys from the scans whose storey the others do not contradict."""
    doubted = contradicted(scans, places.storey, _centres(len(scans), setup))
    scans, places = scans[~doubted], places[~doubted]
    cells = cells_near(places, shape.cell_m)
    examples = scans, places
    (density,) = _solved(examples, lambda p: cells.blobs(p, shape.width_m), shape.sharpness, [shape.ridge], setup)
    centres = _centres(len(scans), setup)
    storeys = _storeys(scans, places, centres)
    (field,) = learned_fields(scans[centres].dense(), places[centres], [shape.noise_db])
    alike = AlikeScans.of(density.like.centre, places.xy[centres])
    networks = _networks(scans, places, cells, shape, setup)
    return CellKernel(cells, density, storeys, field, alike, networks, int(doubted.sum()))


def _storeys(scans: RadioScans, places: Places, centres: IntArray) -> ScanKernel[StoreyLikeness]:
    """Regress onto storeys; altered copies made this worse."""
    one_hot = np.eye(len(places.storeys))
    like = StoreyLikeness.around(levels(scans[centres]))
    equations = NormalEquations.empty(like, one_hot[places.storey[centres]].mean(axis=0), len(centres))
    equations.add((levels(scans[rows]), one_hot[places.storey[rows]]) for rows in _blocks(len(scans)))
    return equations.solved([STOREY_RIDGE])[0]


def _networks(
    scans: RadioScans, places: Places, cells: DensityCells, shape: Shape, setup: Setup
) -> tuple[DenseLayers, ...]:
    if not len(setup.networks):
        return ()
    training = import_extra("vislam2tag.positioning.cell_density.network")
    level = levels(scans)
    return tuple(
        training.trained(
            level,
            lambda rows: cells.blobs(places[rows], shape.width_m),
            exponent,
            training.Training(),
            setup.seed + _SEED_STEP * number,
        )
        for number, exponent in enumerate(setup.networks)
    )


def _shares(score: FloatArray, least: float) -> FloatArray:
    """Cut scores (n, t) off below and make them sum to 1."""
    score = np.maximum(score, least)
    return np.asarray(score / np.maximum(score.sum(axis=1, keepdims=True), LEAST))


def errors_on_storey_m(
    learn: tuple[RadioScans, Places], held_out: tuple[RadioScans, Places], shapes: Sequence[Shape], setup: Setup
) -> FloatArray:
    """Return errors in the plane (shapes, n) on held-out scans whose storey is known; shapes differ in ridge alone."""
    first = shapes[0]
    cells = cells_near(learn[1], first.cell_m)
    level, true = levels(held_out[0]), held_out[1]
    on = np.where(cells.on(true.storey), 1.0, LEAST)
    ridges = [shape.ridge for shape in shapes]
    functions = _solved(learn, lambda part: cells.blobs(part, first.width_m), first.sharpness, ridges, setup)
    found = (cells.median(_shares(function(level), LEAST) * on) for function in functions)
    return np.stack([np.hypot(*(xy - true.xy).T) for xy in found])


def _solved(
    examples: tuple[RadioScans, Places], targets: Targets, sharpness: float, ridges: Sequence[float], setup: Setup
) -> list[ScanKernel[DirectionLikeness]]:
    """Regress onto targets of places, from the scans and altered copies of each."""
    scans, places = examples
    rng = np.random.default_rng(setup.seed)
    centres = _centres(len(scans), setup)
    mean = targets(places[centres]).mean(axis=0)
    like = DirectionLikeness(directions(levels(scans[centres])), sharpness)
    equations = NormalEquations.empty(like, mean, len(centres))
    return equations.add(_examples(scans, places, targets, setup.copies, rng)).solved(ridges)


def _centres(count: int, setup: Setup) -> IntArray:
    """Draw which of so many scans kernels lie around."""
    return np.sort(np.random.default_rng(setup.seed).permutation(count)[:MOST_CENTRES])


def _examples(
    scans: RadioScans, places: Places, targets: Targets, copies: int, rng: np.random.Generator
) -> Iterator[Pair]:
    for rows in _blocks(len(scans)):
        level, target = levels(scans[rows]), targets(places[rows])
        yield level, target
        for _ in range(copies):
            yield altered(level, rng), target


def _blocks(count: int) -> Iterator[slice]:
    return (slice(start, start + _AT_ONCE) for start in range(0, count, _AT_ONCE))
