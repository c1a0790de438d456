"""Gains of many sessions added up floor by floor, and the places where one more landmark would help most."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.place_names import near_landmarks
from vislam2tag.core.tracks import Landmarks
from vislam2tag.quality.self_check.landmark_gain import CELL_M, Gains
from vislam2tag.quality.self_check.record import FloorCheck, ProposedPlace

BEST = 3
"""So many places are named on each floor ..."""
APART_M = 10.0
"""... at least this far from each other: what is nearer helps the same walks ..."""
BESIDE_M = 3.0
"""... and from landmarks that hang there: who passes one passes the other."""

Cell = tuple[int, int]


@dataclass(frozen=True)
class SessionGains:
    """What one session adds to its floors: ``gains`` of its places, and for each floor the number of its frames and the
    sum of their expected errors, metres.
    """

    gains: Gains
    frames: dict[int, int]
    expected_m: dict[int, float]


@dataclass
class GainMap:
    """Sums over sessions; their size grows with the building, not with the survey."""

    frames: dict[int, int] = field(default_factory=lambda: defaultdict(int))
    expected_m: dict[int, float] = field(default_factory=lambda: defaultdict(float))
    gain_m: dict[int, dict[Cell, float]] = field(default_factory=lambda: defaultdict(lambda: defaultdict(float)))
    """By floor and cell, summed over frames."""

    def add(self, session: SessionGains) -> None:
        """Add a session."""
        for number, frames in session.frames.items():
            self.frames[number] += frames
            self.expected_m[number] += session.expected_m[number]
        found = session.gains
        for floor, cell, gain in zip(found.floor.tolist(), found.cell.tolist(), found.gain_m.tolist(), strict=True):
            self.gain_m[floor][cell[0], cell[1]] += gain

    def floors(self, landmarks: Landmarks) -> list[FloorCheck]:
        """What was found of each floor, by its number; ``landmarks`` are those that hang there."""
        return [
            FloorCheck(
                number=number,
                frames=self.frames[number],
                expected_m=round(self.expected_m[number] / self.frames[number], 4),
                places=self._best(number, landmarks),
            )
            for number in sorted(self.frames)
        ]

    def mean_gain_m(self, number: int) -> dict[Cell, float]:
        """By how much the mean expected error of a floor falls with a landmark in each of its cells."""
        return {cell: gain / self.frames[number] for cell, gain in sorted(self.gain_m[number].items())}

    def _best(self, number: int, landmarks: Landmarks) -> list[ProposedPlace]:
        chosen: list[ProposedPlace] = []
        gains = self.mean_gain_m(number)
        here = landmarks.on_floor(number)
        hanging_m = here.position_bcs[here.surveyed]
        for cell in sorted(gains, key=lambda cell: (-gains[cell], cell)):
            x_m, y_m = ((index + 0.5) * CELL_M for index in cell)
            if (np.linalg.norm(hanging_m - (x_m, y_m), axis=1) < BESIDE_M).any():
                continue
            if all((x_m - other.x_m) ** 2 + (y_m - other.y_m) ** 2 >= APART_M**2 for other in chosen):
                near = near_landmarks(landmarks, number, (x_m, y_m))
                chosen.append(ProposedPlace(x_m=x_m, y_m=y_m, near=near, gain_m=round(gains[cell], 4)))
            if len(chosen) == BEST:
                break
        return chosen


def session_gains(gains: Gains, factor: float, floor: IntArray, expected_m: FloatArray) -> SessionGains:
    """Reduce a session: its gains and the expected errors (n,) of its frames on floors (n,), all times a factor."""
    numbers = sorted(set(floor.tolist()))
    scaled = Gains(gains.cell, gains.floor, gains.gain_m * factor)
    return SessionGains(
        scaled,
        {number: int((floor == number).sum()) for number in numbers},
        {number: float(expected_m[floor == number].sum()) * factor for number in numbers},
    )
