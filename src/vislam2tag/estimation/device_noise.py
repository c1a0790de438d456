"""How noisy a device's tracker is, as its walks tell one another.

A walk tells its drift by hardly one number, and its sightings by some ten (docs/explanation/smoother.md). Other walks
of the device tell by how much it exceeds the usual noise in all kinds together: of each kind they know too little.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import log, sqrt

import numpy as np

from vislam2tag.core.context import TrackerNoise
from vislam2tag.estimation.noise import ESTIMATED, PRIOR_WEIGHT, USUAL, NoiseLevels

ALIKE_NUMBERS = 10.0
"""However many numbers tell a walk's noise, they tell that of another walk no better than this many of its own would:
walks of a device differ by about a quarter (standard deviation)."""
USUAL_NUMBERS = 3.0
"""That a device is as noisy as usual counts as much as this many numbers."""
GREATEST_TIMES = 4.0
"""A walk counts as no noisier than so many times the usual (standard deviation): beyond, its tracker broke."""
STEP = 2**0.5
"""What is told is rounded to powers of this ..."""
STEP_NUMBERS = 2.0
"""... and to multiples of this many numbers: finer gains nothing, and one more walk would change it more often."""


def told_by_others(walks: Sequence[NoiseLevels]) -> list[TrackerNoise | None]:
    """For each walk of one device what the levels estimated from its others tell; None where they tell next to none."""
    known = np.array([_known(walk) for walk in walks]).reshape(-1, 2)
    return [_told(*np.delete(known, number, axis=0).sum(axis=0).tolist()) for number in range(len(walks))]


def _known(walk: NoiseLevels) -> tuple[float, float]:
    """As how many numbers a walk's drift and sightings count for others, and their squares' sum in usual ones."""
    kinds = [(walk.sighting_numbers, walk.sighting_m / USUAL.sighting_m)]
    kinds += [(walk.drift_numbers[source], walk.level(source) / USUAL.level(source)) for source in ESTIMATED]
    numbers = sum(own for own, _ in kinds)
    if numbers == 0:
        return 0.0, 0.0
    mean_square = sum(own * times**2 for own, times in kinds) / numbers
    worth = _for_others(numbers)
    return worth, worth * min(mean_square, GREATEST_TIMES**2)


def _for_others(numbers: float) -> float:
    """As how many numbers of another walk of the device these count."""
    return ALIKE_NUMBERS * numbers / (ALIKE_NUMBERS + numbers)


def _told(numbers: float, squares: float) -> TrackerNoise | None:
    """What so many numbers with this sum of squares, in units of the usual ones, tell of a further walk, rounded."""
    rounded = STEP_NUMBERS * round((PRIOR_WEIGHT + _for_others(numbers)) / STEP_NUMBERS)
    if not rounded:
        return None
    times = sqrt((USUAL_NUMBERS + squares) / (USUAL_NUMBERS + numbers))
    return TrackerNoise(STEP ** round(log(times) / log(STEP)), rounded)
