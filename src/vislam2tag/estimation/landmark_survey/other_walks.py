"""What the survey and all other walks say of the landmarks that a walk passes.

Mapped with landmarks that it has itself helped to place, a walk would believe its own errors twice. So it is given what
the joint map says without it: a walk's own part of the normal equations is taken out again (in a factor graph, the
message from the landmarks to this walk). Errors that the landmarks share are carried along.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray, joint_columns
from vislam2tag.estimation.landmark_survey.landmark_map import LandmarkMap, linear_maps, survey_equations

GREATEST_SIGMA_M = 5.0
"""A landmark that is not known better than this has no position."""
GREATEST_HEADING_SIGMA_RAD = 0.5


@dataclass(frozen=True)
class ToldPlaces:
    """``k`` landmarks of a joint map: ``landmark`` (k,) index of each; ``position`` (k,) complex, metres in the BCS;
    ``heading_rad`` (k,), NaN where not known; ``covariance`` (3k, 3k) of x, y of each, then of all headings.
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
        """Of each map that is tied: which unknowns it tells of, with which information and right side."""
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
        """(m,) how many maps that are tied, or surveys, tell of each landmark."""
        count = self.joined.priors.surveyed.astype(np.float64)
        for number in self._parts:
            count[self.joined.maps[number].landmark] += 1
        return count

    def told(self, number: int) -> ToldPlaces:
        """What is known of the landmarks without the map of this number; a map that is not tied is told everything."""
        information, right = (part.copy() for part in self._whole)
        tellers = self._tellers.copy()
        if number in self._parts:
            column, part, part_right = self._parts[number]
            information[np.ix_(column, column)] -= part
            right[column] -= part_right
            tellers[self.joined.maps[number].landmark] -= 1
        return self._places(information, right, np.asarray(tellers > 0))

    def seen(self, number: int) -> ToldPlaces:
        """Where the map of this number should see the landmarks: as told, and off by what walks see them off."""
        told = self.told(number)
        places, covariance = np.arange(2 * len(told.landmark)), told.covariance.copy()
        covariance[places, places] += self.joined.doubts.seen_off_m2
        return replace(told, covariance=covariance)

    def _places(self, information: FloatArray, right: FloatArray, known: BoolArray) -> ToldPlaces:
        """Solve for the landmarks that somebody tells of."""
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
