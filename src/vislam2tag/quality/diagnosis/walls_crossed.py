"""Where ways on a plan lead through walls.

A tracker puts a way up to some decimetres off: a wall is crossed only where the way, shifted by as much in any
direction, meets one too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeAlias

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, runs_of
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.core.similarity import as_points

STEP_M = 0.1
"""From one place that is looked at to the next."""
BESIDE_M = 1.0
"""So much of the way before and behind a wall must be free, too, for a shift to explain it."""
SHIFTS_M = np.array([0j, *(at_m * np.exp(0.25j * np.pi * turn) for at_m in (0.25, 0.5, 0.75) for turn in range(8))])
"""A way may be off by so much."""
APART_M = 1.5
"""Crossings nearer to each other than this are of one wall: a door drawn shut counts once, whoever goes through."""
Inside: TypeAlias = Callable[[FloatArray], BoolArray]
"""Tells which points (n, 2), BCS metres, can be walked to."""


def walls_crossed(inside: Inside, ways: Iterable[ComplexArray]) -> int:
    """In how many places ways (n,) lead through walls; NaN interrupts a way."""
    places: list[complex] = []
    for way in ways:
        for start, stop in runs_of(np.isfinite(way)):
            for place in _crossings(inside, _even_steps(way[start:stop])):
                if all(abs(place - other) > APART_M for other in places):
                    places.append(place)
    return len(places)


def _even_steps(way: ComplexArray) -> ComplexArray:
    along = arc_lengths(as_points(way))
    return np.asarray(np.interp(np.arange(0.0, along[-1] + STEP_M, STEP_M), along, way))


def _crossings(inside: Inside, way: ComplexArray) -> list[complex]:
    """Middles of the stretches of a way in even steps that lead through walls however it is shifted."""
    beside = round(BESIDE_M / STEP_M)
    near_wall = np.convolve(~inside(as_points(way)), np.ones(2 * beside + 1), mode="same") > 0
    stretches = [way[start:stop] for start, stop in runs_of(near_wall)]
    return [complex(stretch[len(stretch) // 2]) for stretch in stretches if not _free_if_shifted(inside, stretch)]


def _free_if_shifted(inside: Inside, stretch: ComplexArray) -> bool:
    shifted = stretch + SHIFTS_M[:, None]
    return bool(inside(as_points(shifted.ravel())).reshape(shifted.shape).all(axis=1).any())
