"""Compares the survey of a landmark, or the sights of walks, with what all others say about that landmark.

A walk that is mapped with landmarks which it has helped to place would count its own errors twice. It therefore gets
the joint map without itself: its own part is removed from the normal equations (in a factor graph, the message from the
landmarks to this walk). Errors that the landmarks share are kept.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray, joint_columns
from vislam2tag.core.transforms import as_points
from vislam2tag.estimation.landmark_survey.landmark_map import (
    LandmarkMap,
    apart,
    linear_maps,
    predicted,
    survey_equations,
)

GREATEST_SIGMA_M = 5.0
"""A landmark with a larger standard deviation has no position."""
GREATEST_HEADING_SIGMA_RAD = 0.5


@dataclass(frozen=True)
class ToldPlaces:
    """``k`` landmarks of a joint map, with the index ``landmark`` (k,) of each.

    ``position`` (k,) is complex, metres in the BCS; ``heading_rad`` (k,) is NaN if unknown. ``covariance`` (3k, 3k) is
    of x, y of each, then of all headings.
    """

    landmark: IntArray
    position: ComplexArray
    heading_rad: FloatArray
    covariance: FloatArray


@dataclass(frozen=True)
class OtherWalks:
    """A joint map from which each walk's own part can be taken out."""

    joined: LandmarkMap

    @cached_property
    def _parts(self) -> dict[int, tuple[IntArray, FloatArray, FloatArray]]:
        """For each connected map: its unknowns, their information and right side."""
        return {number: (one.column, *one.equations()) for number, one in linear_maps(self.joined).items()}

    @cached_property
    def _whole(self) -> tuple[FloatArray, FloatArray]:
        information, right = survey_equations(self.joined)
        for column, part, part_right in self._parts.values():
            information[np.ix_(column, column)] += part
            right[column] += part_right
        return information, right

    @cached_property
    def _tellers(self) -> FloatArray:
        """(m,) number of connected maps, or surveys, with each landmark."""
        count = self.joined.priors.surveyed.astype(np.float64)
        for number in self._parts:
            count[self.joined.maps[number].landmark] += 1
        return count

    def told(self, number: int) -> ToldPlaces:
        """Return the landmarks without the map of this number; a map that is not connected gets all of them."""
        information, right = (part.copy() for part in self._whole)
        tellers = self._tellers.copy()
        if number in self._parts:
            column, part, part_right = self._parts[number]
            information[np.ix_(column, column)] -= part
            right[column] -= part_right
            tellers[self.joined.maps[number].landmark] -= 1
        return self._places(information, right, np.asarray(tellers > 0))

    def seen(self, number: int) -> ToldPlaces:
        """Return where the map of this number should see the landmarks, including the usual offset of sights."""
        told = self.told(number)
        places, covariance = np.arange(2 * len(told.landmark)), told.covariance.copy()
        covariance[places, places] += self.joined.doubts.seen_off_m2
        return replace(told, covariance=covariance)

    def _places(self, information: FloatArray, right: FloatArray, known: BoolArray) -> ToldPlaces:
        """Solve for the landmarks that any map or survey contains."""
        joined, rows = self.joined, np.flatnonzero(known)
        column = joint_columns(rows, len(known))
        covariance = np.linalg.inv(information[np.ix_(column, column)])
        covariance = (covariance + covariance.T) / 2
        step, k = covariance @ right[column], len(rows)
        position = joined.position[rows] + step[: 2 * k : 2] + 1j * step[1 : 2 * k : 2]
        heading_sigma = np.sqrt(np.diag(covariance)[2 * k :])
        heading = np.where(heading_sigma < GREATEST_HEADING_SIGMA_RAD, joined.heading_rad[rows] + step[2 * k :], np.nan)
        variance = np.diag(covariance)[: 2 * k].reshape(-1, 2).mean(axis=1) + joined.doubts.seen_off_m2
        placed = np.flatnonzero(variance < GREATEST_SIGMA_M**2)
        kept = joint_columns(placed, k)
        return ToldPlaces(rows[placed], position[placed], heading[placed], covariance[np.ix_(kept, kept)])


USUAL_SIGMAS, SIGHT_SIGMAS = 4.0, 4.5
"""A survey, a day or a walk's sight contradicts the others if its offset is this many standard deviations. Of 20
surveys and 80 sights with normal errors, 2 % would have one beyond 3.7 and 4.1; real ones have heavier tails ..."""
LEAST_M = 0.15
"""... and at least this far."""


class Verdict(Enum):
    """Result of a comparison."""

    AGREES = "agrees"
    CONTRADICTS = "contradicts"
    NOTHING = "nothing to compare"


@dataclass(frozen=True)
class Comparison:
    """A survey of a landmark, or the sights of one walk or of all walks of a day, compared with all others.

    For a survey ``walk`` and ``day`` are None. ``offset`` is from the place by the others, complex metres in the BCS.
    ``sigma_m`` is its usual size (one standard deviation per axis), and ``sigmas`` the offset in this unit; NaN if
    there is nothing to compare.
    """

    landmark: int
    walk: int | None
    offset: complex = complex(np.nan, np.nan)
    sigma_m: float = np.nan
    sigmas: float = np.nan
    day: str | None = None

    @property
    def of_survey(self) -> bool:
        """Whether it is a survey."""
        return self.walk is None and self.day is None

    @property
    def size_m(self) -> float:
        """Size of the offset."""
        return abs(self.offset)

    @property
    def excess(self) -> float:
        """Ratio of ``sigmas`` to the limit."""
        return self.sigmas / (USUAL_SIGMAS if self.walk is None else SIGHT_SIGMAS)

    @property
    def verdict(self) -> Verdict:
        """Whether it fits the others."""
        if not self.sigma_m <= GREATEST_SIGMA_M:
            return Verdict.NOTHING
        return Verdict.CONTRADICTS if self.excess > 1 and self.size_m > LEAST_M else Verdict.AGREES

    @classmethod
    def of(cls, landmark: int, walk: int | None, offset: FloatArray, covariance: FloatArray) -> Comparison:
        """Compare by an offset (2,), metres, and its covariance (2, 2)."""
        sigmas = max(float(offset @ np.linalg.solve(covariance, offset)), 0.0) ** 0.5
        sigma_m = float(np.sqrt(np.trace(covariance) / 2))
        return cls(landmark, walk, complex(*offset), sigma_m, sigmas)

    def in_units_of(self, scale: float) -> Comparison:
        """The same if offsets are usually this many times as large as stated."""
        return replace(self, sigma_m=self.sigma_m * scale, sigmas=self.sigmas / scale)


SUSPECT_SIGMAS = 2.5
"""A day is tested if its sights, taken as independent, put a landmark this far away."""
FEWEST_SIGHTS = 2
"""A day needs more than one walk ..."""
FEWEST_OTHERS = 2
"""... and must contradict at least as many others: the survey, and walks of other days."""


def seen_apart(split: LandmarkMap, landmark: int) -> Comparison:
    """Compare a landmark's place by all others with that by the walks that are ``apart``, the last of the map."""
    new = len(split.position) - 1
    offset = split.position[new] - split.position[landmark]
    columns = (2 * np.array([[landmark], [new]]) + (0, 1)).ravel()
    difference = np.hstack((-np.eye(2), np.eye(2)))
    covariance = difference @ split.covariance[np.ix_(columns, columns)] @ difference.T
    return Comparison.of(landmark, None, np.array([offset.real, offset.imag]), covariance)


def survey_left_out(joined: LandmarkMap, landmark: int) -> Comparison:
    """Compare a landmark's place by all others with its surveyed place, with weights estimated again."""
    trial, priors = predicted(joined, landmark), joined.priors
    offset = priors.position[landmark] - trial.position[landmark]
    covariance = trial.position_covariance[landmark] + priors.covariance[landmark]
    return Comparison.of(landmark, None, np.array([offset.real, offset.imag]), covariance)


def days_compared(joined: LandmarkMap, sights: Sequence[Comparison], days: Sequence[str | None]) -> list[Comparison]:
    """Compare the sights of a landmark by the walks of each day if they seem to have an offset; ``days`` (b,).

    Days are skipped if one of their walks alone, or the landmark's survey, explains the offset.
    """
    seen: dict[int, dict[str | None, list[Comparison]]] = defaultdict(lambda: defaultdict(list))
    for one in sights:
        if one.walk is not None and np.isfinite(one.sigmas):
            seen[one.landmark][days[one.walk]].append(one)
    found = []
    for landmark, by_day in seen.items():
        others = int(joined.priors.surveyed[landmark]) + sum(map(len, by_day.values()))
        for day, own in by_day.items():
            if day is not None and len(own) >= FEWEST_SIGHTS and others - len(own) >= FEWEST_OTHERS and _suspect(own):
                walks = [one.walk for one in own if one.walk is not None]
                split = apart(joined, landmark, walks)
                compared = seen_apart(split, landmark)
                alone = (seen_apart(apart(joined, landmark, [walk]), landmark).sigmas for walk in walks)
                if all(one <= compared.sigmas for one in alone) and _survey_agrees(split, landmark):
                    found.append(replace(compared, day=day))
    return found


def _survey_agrees(split: LandmarkMap, landmark: int) -> bool:
    """Whether other days put a landmark closer to its survey than to its place by the day, which is the last one."""
    if not split.priors.surveyed[landmark]:
        return True
    others = predicted(split, landmark)
    worth = np.linalg.inv(others.position_covariance[landmark])
    off = np.array([split.priors.position[landmark], others.position[-1]]) - others.position[landmark]
    to_survey, to_day = np.einsum("ni,ij,nj->n", as_points(off), worth, as_points(off))
    return bool(to_survey < to_day)


def _suspect(sights: Sequence[Comparison]) -> bool:
    worth = np.array([one.sigma_m**-2 for one in sights])
    return bool(abs(worth @ [one.offset for one in sights]) > SUSPECT_SIGMAS * worth.sum() ** 0.5)
