"""Where somebody walks on a floor."""

from __future__ import annotations

from collections import Counter

import numpy as np
from scipy.ndimage import gaussian_filter1d

from second_generator.floor import Floor
from vislam2tag.core.arrays import ComplexArray

STEP_M = 0.05
"""Between points of a route."""


def draw_route(floor: Floor, length_m: float, rng: np.random.Generator) -> ComplexArray:
    """Draw a route (r,) along middle lines, a point every STEP_M, with its corners rounded; BCS metres."""
    corners = floor.crossings[_crossings_met(floor, length_m, rng)]
    walked = np.concatenate(([0.0], np.cumsum(abs(np.diff(corners)))))
    at = np.arange(0, length_m, STEP_M)
    path = np.interp(at, walked, corners.real) + 1j * np.interp(at, walked, corners.imag)
    return np.asarray(gaussian_filter1d(path, rng.uniform(0.25, 0.7) / STEP_M, mode="nearest"))


def _crossings_met(floor: Floor, length_m: float, rng: np.random.Generator) -> list[int]:
    """Draw crossings one after the other: rather by corridors little used, seldom back unless there is no other way."""
    here, before, walked = int(rng.integers(len(floor.crossings))), -1, 0.0
    used: Counter[frozenset[int]] = Counter()
    met = [here]
    while walked < length_m:
        options = floor.next_to[here]
        weight = np.array([(0.05 if to == before else 1.0) / (1 + 2 * used[frozenset((here, to))]) for to in options])
        to = int(rng.choice(options, p=weight / weight.sum()))
        used[frozenset((here, to))] += 1
        walked += float(abs(floor.crossings[to] - floor.crossings[here]))
        before, here = here, to
        met.append(here)
    return met
