"""A plan that is changed by hand: landmarks moved, added or taken away, and what is to be expected then."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.preparation.planning.corridors import typical_walks
from vislam2tag.preparation.planning.demands import walking_distances
from vislam2tag.preparation.planning.floor import FloorDesign, longest_free_m, marked
from vislam2tag.preparation.planning.prediction import ExpectedLabels, PassedLandmarks, expected_along, passes_near
from vislam2tag.preparation.planning.refine import (
    SigmaMap,
    distance_classes,
    further_landmarks,
    line_deviations_m,
    sigma_map,
)
from vislam2tag.preparation.planning.settings import PlanSettings
from vislam2tag.preparation.planning.tour import plan_tour
from vislam2tag.site.walkable.graph import CorridorGraph

_KEPT = 5000
"""Walks whose labels are kept for landmarks that they pass."""


@dataclass(frozen=True)
class Expectation:
    """What is to be expected with some landmarks: ``longest_m`` is the longest walk without one."""

    expected: tuple[ExpectedLabels, ...]
    sigma: SigmaMap
    longest_m: float


class ChangedPlan:
    """Other choices of a plan's places. Only walks that pass other landmarks than before are solved anew."""

    def __init__(self, design: FloorDesign, graph: CorridorGraph, settings: PlanSettings) -> None:
        """``graph`` and ``settings`` are those that the design was made with."""
        self.design, self._settings = design, settings
        self._paths = typical_walks(graph)
        self._passing: dict[tuple[int, bytes], bool] = {}
        self._solved: dict[tuple[int, bytes], ExpectedLabels | None] = {}

    def nearest_place(self, point_m: FloatArray, others: IntArray) -> int:
        """The place nearest to a point (2,) of those at stations without another landmark; places (o,) of others."""
        places = self.design.places
        away = np.linalg.norm(places.position - point_m, axis=1)
        away[np.isin(places.station, places.station[others])] = np.inf
        return int(np.argmin(away))

    def expectation(self, place: IntArray) -> Expectation:
        """What is to be expected with landmarks at places (m,) besides the fixed ones."""
        design = self.design
        landmarks = replace(self.design, place=place).landmarks
        found = (self._labels(number, path, landmarks) for number, path in enumerate(self._paths))
        expected = tuple(one for one in found if one is not None)
        stations = np.concatenate((design.places.station[place], design.fixed_station))
        chosen = marked(stations, len(design.stations.corridor))
        longest_m = longest_free_m(design.corridors, design.stations, chosen, self._settings.spacing_m)
        return Expectation(expected, sigma_map(design.space, expected), longest_m)

    def further(self, place: IntArray, count: int) -> list[int]:
        """Up to ``count`` further places where landmarks help most beside those at places (m,), the best first."""
        places, stations = self.design.places, self.design.stations
        free = ~np.isin(places.station, places.station[place])
        found = further_landmarks(
            self._paths,
            replace(self.design, place=place).landmarks,
            places,
            stations,
            free,
            count,
            self._settings.survey_sigma_m,
        )
        return [one.place for one in found]

    def designed(self, place: IntArray) -> FloorDesign:
        """The whole plan with landmarks at places (m,)."""
        design, found = self.design, self.expectation(place)
        landmarks = replace(self.design, place=place).landmarks
        station = np.concatenate((design.places.station[place], design.fixed_station[design.fixed_station >= 0]))
        distance_m = walking_distances(design.corridors, design.stations)
        return replace(
            design,
            place=place,
            longest_m=found.longest_m,
            line_deviations_m=line_deviations_m(landmarks.position, station, distance_m),
            expected=found.expected,
            sigma=found.sigma,
            classes=tuple(distance_classes(design.space, landmarks.position, found.expected)),
            further=(),
            tour=plan_tour(design.corridors, design.stations.corridor[station], design.stations.offset_m[station]),
        )

    def _labels(self, number: int, path: FloatArray, landmarks: PassedLandmarks) -> ExpectedLabels | None:
        """What is expected along a walk (n, 2), which depends on the landmarks that it passes only."""
        rows = [row for row, foot in enumerate(landmarks.foot) if self._passes(number, path, foot)]
        passed = PassedLandmarks(landmarks.position[rows], landmarks.foot[rows], landmarks.pass_m[rows])
        key = number, passed.position.tobytes()
        if key not in self._solved:
            while len(self._solved) >= _KEPT:
                del self._solved[next(iter(self._solved))]
            self._solved[key] = expected_along(path, passed, self._settings.survey_sigma_m)
        return self._solved[key]

    def _passes(self, number: int, path: FloatArray, foot: FloatArray) -> bool:
        key = number, foot.tobytes()
        if key not in self._passing:
            self._passing[key] = passes_near(path, foot)
        return self._passing[key]
