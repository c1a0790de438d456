"""A floor: corridors of a bent grid, and landmarks on their walls."""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import minimum_spanning_tree

from second_generator.habits import Sheets
from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray

LOOPS_KEPT = 0.65


@dataclass(frozen=True)
class Floor:
    """Corridors between crossings, and the sheets on their walls; BCS metres."""

    crossings: ComplexArray
    """(c,)"""
    corridors: IntArray
    """(e, 2) crossings at both ends."""

    @property
    def length_m(self) -> FloatArray:
        """Length of each corridor (e,)."""
        return np.abs(np.diff(self.crossings[self.corridors], axis=1)[:, 0])

    @cached_property
    def next_to(self) -> tuple[tuple[int, ...], ...]:
        """Crossings that a corridor joins to each crossing."""
        both_ways = np.vstack((self.corridors, self.corridors[:, ::-1]))
        return tuple(tuple(both_ways[both_ways[:, 0] == here, 1].tolist()) for here in range(len(self.crossings)))


@dataclass(frozen=True)
class HungSheets:
    """Where ``m`` sheets hang."""

    place: ComplexArray
    """(m,) BCS metres."""
    along_wall: ComplexArray
    """(m,) direction of the sheet's X axis: to the right of who looks at it."""


def bent_grid(spacing_m: float, rng: np.random.Generator) -> Floor:
    """Draw a floor: a grid, now and then a row, with some of its corridors missing; all crossings can be reached."""
    columns, rows = int(rng.integers(2, 6)), int(rng.integers(2, 4))
    if rng.random() < 0.15:
        columns, rows = int(rng.integers(3, 7)), 1
    side_m = max(6.0, spacing_m * rng.uniform(0.6, 1.4))
    x = np.cumsum(rng.uniform(0.6, 1.4, columns)) * side_m
    y = np.cumsum(rng.uniform(0.6, 1.4, rows)) * side_m
    crossings = np.add.outer(x, 1j * y).ravel() + rng.normal(0, 0.4, columns * rows)
    slant = cmath.exp(1j * rng.uniform(-0.5, 0.5)) if rng.random() < 0.3 else 1.0
    number = np.arange(columns * rows).reshape(columns, rows)
    across = np.column_stack((number[:-1].ravel(), number[1:].ravel()))
    up = np.column_stack((number[:, :-1].ravel(), number[:, 1:].ravel()))
    return Floor(crossings * slant + 5 + 5j, _thinned(np.vstack((across, up)), len(crossings), rng))


def _thinned(corridors: IntArray, crossings: int, rng: np.random.Generator) -> IntArray:
    """Keep a random tree of the corridors (e, 2) and most of the rest."""
    weight = rng.uniform(1, 2, len(corridors))
    graph = coo_array((weight, corridors.T), shape=(crossings, crossings))
    tree = minimum_spanning_tree(graph.tocsr()).tocoo()
    in_tree = np.isin(weight, tree.data)
    return corridors[in_tree | (rng.random(len(corridors)) < LOOPS_KEPT)]


def hang_sheets(floor: Floor, habits: Sheets, rng: np.random.Generator) -> HungSheets:
    """Draw sheets nearly evenly along all corridors, on either wall; one to 2.5 m of corridor at most."""
    ends, length = floor.crossings[floor.corridors], floor.length_m
    count = min(habits.count, max(3, int(length.sum() / 2.5)))
    at = (np.arange(count) + rng.uniform(0.05, 0.95, count)) / count * length.sum()
    starts = np.concatenate(([0.0], np.cumsum(length)))
    corridor = np.searchsorted(starts, at, side="right") - 1
    along = (ends[corridor, 1] - ends[corridor, 0]) / length[corridor]
    left = rng.choice((-1, 1), count)
    aside = left * rng.uniform(*habits.aside_m, count)
    return HungSheets(ends[corridor, 0] + along * (at - starts[corridor] + 1j * aside), along * left)
