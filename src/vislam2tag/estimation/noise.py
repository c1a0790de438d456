"""How noisy a tracker is: what is estimated for each session, what is assumed before, and how heavy the tails are."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum
from math import inf

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
