"""What :mod:`.models.cell_density` learns: a kernel regression onto cells, and one onto storeys."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.altered_scans import altered
from vislam2tag.positioning.density_cells import DensityCells, cells_near
from vislam2tag.positioning.places import Places
from vislam2tag.positioning.representation import Representation, represented
from vislam2tag.positioning.scan_kernel import MOST_CENTRES, NormalEquations, Pair, ScanKernel
from vislam2tag.positioning.scans import RadioScans

STOREY_SHARPNESS, STOREY_RIDGE = 1.0, 1.0
"""Of the kernel that tells storeys; by cross-validation on Tampere's training part, where storeys are hardest."""
_AT_ONCE = 1024
_LEAST = 1e-9
"""What a cell of the storey is worth at least, so that every scan has a place."""
Targets = Callable[[Places], FloatArray]


@dataclass(frozen=True)
class Setup:
    """How to learn."""

    cell_m: float
    width_m: float
    copies: int
    seed: int


@dataclass(frozen=True)
class Shape:
    """How fast a kernel falls, and how much it is smoothed."""

    sharpness: float
    ridge: float


@dataclass(frozen=True)
class CellKernel:
    """Cells, and the functions that tell how likely each cell and each storey is."""

    cells: DensityCells
    density: ScanKernel
    storeys: ScanKernel

    def answer(self, scans: RadioScans) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return storey probabilities (n, s), places (n, 2) on the likeliest storey, and spreads (n,) in metres."""
        parts = [self._answer(_levels(scans[rows])) for rows in _blocks(max(len(scans), 1))]
        probability, xy, spread_m = (np.concatenate(part) for part in zip(*parts, strict=True))
        return probability, xy, spread_m

    def _answer(self, level: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        score = np.maximum(self.storeys(level), 0.0)
        probability = score / np.maximum(score.sum(axis=1, keepdims=True), _LEAST)
        density = np.maximum(self.density(level), _LEAST)
        xy = self.cells.median(density * self.cells.on(probability.argmax(axis=1)))
        return probability, xy, self.cells.spread_m(density, xy)


def learned(scans: RadioScans, places: Places, shape: Shape, setup: Setup) -> CellKernel:
    """Learn cells and storeys."""
    cells = cells_near(places, setup.cell_m)
    (density,) = _solved(
        scans, places, lambda part: cells.blobs(part, setup.width_m), shape.sharpness, [shape.ridge], setup
    )
    one_hot = np.eye(len(places.storeys))
    (storeys,) = _solved(scans, places, lambda part: one_hot[part.storey], STOREY_SHARPNESS, [STOREY_RIDGE], setup)
    return CellKernel(cells, density, storeys)


def errors_on_storey_m(
    learn: tuple[RadioScans, Places],
    held_out: tuple[RadioScans, Places],
    sharpness: float,
    ridges: Sequence[float],
    setup: Setup,
) -> FloatArray:
    """(ridges, n) errors in the plane on held-out scans whose storey is known, for each ridge."""
    scans, places = learn
    cells = cells_near(places, setup.cell_m)
    level, true = _levels(held_out[0]), held_out[1]
    on = np.where(cells.on(true.storey), 1.0, _LEAST)
    functions = _solved(scans, places, lambda part: cells.blobs(part, setup.width_m), sharpness, ridges, setup)
    found = (cells.median(np.maximum(function(level), _LEAST) * on) for function in functions)
    return np.stack([np.hypot(*(xy - true.xy).T) for xy in found])


def _solved(
    scans: RadioScans, places: Places, targets: Targets, sharpness: float, ridges: Sequence[float], setup: Setup
) -> list[ScanKernel]:
    """Regress onto targets of places, from the scans and altered copies of each."""
    rng = np.random.default_rng(setup.seed)
    centres = np.sort(rng.permutation(len(scans))[:MOST_CENTRES])
    mean = targets(places[centres]).mean(axis=0)
    equations = NormalEquations.around(_levels(scans[centres]), sharpness, mean)
    return equations.add(_examples(scans, places, targets, setup.copies, rng)).solved(ridges)


def _examples(
    scans: RadioScans, places: Places, targets: Targets, copies: int, rng: np.random.Generator
) -> Iterator[Pair]:
    for rows in _blocks(len(scans)):
        level, target = _levels(scans[rows]), targets(places[rows])
        yield level, target
        for _ in range(copies):
            yield altered(level, rng), target


def _blocks(count: int) -> Iterator[slice]:
    return (slice(start, start + _AT_ONCE) for start in range(0, count, _AT_ONCE))


def _levels(scans: RadioScans) -> FloatArray:
    return represented(scans, Representation.POSITIVE)
