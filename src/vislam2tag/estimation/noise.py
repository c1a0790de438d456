"""How noisy a tracker is: what is estimated for each session, what is assumed before, and how heavy the tails are.

A walk shows its drift by hardly one number, and its sightings by some ten (docs/explanation/smoother.md). Other walks
of the device show by how much it exceeds the usual noise in all kinds together: of each kind they know too little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from math import inf, log, sqrt

import numpy as np

from vislam2tag.core.context import TrackerNoise


class DriftSource(Enum):
    """Where the drift of a stretch comes from."""

    POSITION = "position"
    HEADING = "heading"
    SCALE = "scale"
    JUMP = "jump"
    """Steps that are no motion: what is not known of where they led."""
    JUMP_TURN = "jump_turn"
    """... and of how they turned."""
    DOUBT = "doubt"
    """Steps that may have slipped, along what they exceed plausible ones by."""


ESTIMATED = (DriftSource.POSITION, DriftSource.HEADING, DriftSource.SCALE)
"""Sources whose level is estimated; that of jumps and doubts is given with each of them."""


@dataclass(frozen=True)
class NoiseLevels:
    """Standard deviations of one session.

    ``position_m``, ``heading_rad`` and ``scale`` are random walks per square root of a metre walked; ``sighting_m`` is
    the error per axis that one pass of a landmark has at 1 m distance, ``sheet_rad`` that of its logged heading.
    """

    position_m: float = 0.016
    heading_rad: float = 0.0015
    scale: float = 0.0008
    sighting_m: float = 0.14
    sheet_rad: float = 0.03
    sighting_numbers: float = inf
    """How many observed numbers the level of sightings follows from; infinite where it is given."""
    drift_numbers: dict[DriftSource, float] = field(default_factory=dict)
    """... and that of each drift; those that are missing are given."""

    def level(self, source: DriftSource) -> float:
        """Standard deviation that scales the drift of this source."""
        if source is DriftSource.POSITION:
            return self.position_m
        if source is DriftSource.HEADING:
            return self.heading_rad
        return self.scale if source is DriftSource.SCALE else 1.0

    def times(self, factor: float) -> NoiseLevels:
        """Levels of a tracker that drifts, and errs in sightings, so many times as much; sheets stay."""
        return replace(
            self,
            position_m=self.position_m * factor,
            heading_rad=self.heading_rad * factor,
            scale=self.scale * factor,
            sighting_m=self.sighting_m * factor,
        )


USUAL = NoiseLevels()
"""What is assumed before anything is seen: typical of phones (docs/explanation/smoother.md)."""
PRIOR_WEIGHT = 0.5
"""The usual noise counts as much as this many observed numbers (docs/explanation/smoother.md)."""
SCALE_SIGMA = 0.02
"""A tracker's metre is a metre within this share."""


def assumed(told: TrackerNoise | None) -> tuple[NoiseLevels, float]:
    """What is assumed of a walk's noise before anything is seen, and as how many observed numbers that counts."""
    return (USUAL, PRIOR_WEIGHT) if told is None else (USUAL.times(told.times_usual), told.numbers)


TAIL = {
    DriftSource.POSITION: 2.0,
    DriftSource.HEADING: 4.0,
    DriftSource.SCALE: 20.0,
    DriftSource.JUMP: 2.0,
    DriftSource.JUMP_TURN: 2.0,
    DriftSource.DOUBT: 2.0,
}
"""Degrees of freedom of Student's t for the drift of a stretch: the fewer, the more often far worse than usual."""
SIGHTING_TAIL = 3.0
SHEET_TAIL = 3.0
LANDMARK_TAIL = 2.0
"""... and for a pass, for the heading of a sheet, and for the survey of a landmark."""
DOUBTED = 2.0
"""A surveyed place or a pass is doubtful where re-weighting takes it for so much less certain (variance) than usual."""


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
