"""A whole plan of one floor, from places and demands to expected errors and the tour; a plan changed by hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.progress import Progress, silent
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.preparation.planning.corridors import Corridors, Tour, corridors_of, plan_tour, typical_walks
from vislam2tag.preparation.planning.demands import (
    Cover,
    Demands,
    StationSet,
    broken_spacing,
    cover,
    demands_of,
    walking_distances,
)
from vislam2tag.preparation.planning.prediction import (
    ExpectedLabels,
    PassedLandmarks,
    StationPasses,
    expected_along,
    expected_on_walks,
    gap_costs,
    passing,
)
from vislam2tag.preparation.planning.refine import (
    DistanceClass,
    SigmaMap,
    choose_walls,
    distance_classes,
    further_landmarks,
    improve_stations,
    line_deviations_m,
    sigma_map,
)
from vislam2tag.preparation.planning.settings import PlanSettings
from vislam2tag.preparation.planning.sheet_places import SheetPlaces, Stations, find_sheet_places, stations_along
from vislam2tag.site.walkable.graph import CorridorGraph
from vislam2tag.site.walkable.space import WalkableSpace

STEPS = ("places", "demands", "fewest landmarks", "walls", "tour", "prediction", "further landmarks")
FIXED_REACH_M = 5.0
"""A fixed landmark further off every corridor than this is passed by no one."""
OUTSIDE_M = 1.0
"""A fixed landmark further off the walkable space than this hangs in another building."""
FIXED_PASS_M = 0.6
TRIED = 60
"""Landmarks move to where they help most on so many walks; what to expect is estimated on others."""


@dataclass(frozen=True)
class FloorConstraints:
    """What is given of a floor: ``fixed`` (h, 2) landmarks that stay, their ``names`` (h), and rectangles (f, 4), x0,
    y0, x1, y1, in which none may hang; BCS metres.
    """

    fixed: FloatArray
    names: tuple[str, ...]
    forbidden: FloatArray


@dataclass(frozen=True)
class FloorCandidates:
    """Where a floor's landmarks can be."""

    space: WalkableSpace
    corridors: Corridors
    stations: Stations
    places: SheetPlaces
    constraints: FloorConstraints
    fixed_station: IntArray
    """(h,) station at which each fixed landmark is passed, -1 where no walk passes it."""
    settings: PlanSettings

    @cached_property
    def usable(self) -> BoolArray:
        """(s,) stations with places for new landmarks."""
        return _marked(self.places.station, len(self.stations.corridor))

    @cached_property
    def fixed(self) -> BoolArray:
        """(s,) stations with landmarks that stay."""
        return _marked(self.fixed_station, len(self.stations.corridor))

    @cached_property
    def distance_m(self) -> FloatArray:
        """(s, s) walking distances between all stations."""
        return walking_distances(self.corridors, self.stations)

    def broken(self, chosen: BoolArray) -> set[StationSet]:
        """Rows of walks that are longer than the spacing without a ``chosen`` (s,) station."""
        spacing_m = self.settings.spacing_m
        return broken_spacing(self.corridors, self.stations, self.usable | self.fixed, chosen, spacing_m)

    @property
    def passed(self) -> IntArray:
        """(p,) the fixed landmarks that are passed."""
        return np.flatnonzero(self.fixed_station >= 0)

    def station_of(self, place: IntArray) -> IntArray:
        """Stations (m + p,) of landmarks at places (m,), followed by those of the fixed ones that are passed."""
        return np.concatenate((self.places.station[place], self.fixed_station[self.passed]))

    def landmarks_at(self, place: IntArray) -> PassedLandmarks:
        """Landmarks for the prediction: the new ones at some ``place`` (m,), then those fixed ones that are passed."""
        return PassedLandmarks(
            np.vstack((self.places.position[place], self.constraints.fixed[self.passed])),
            self.stations.point[self.station_of(place)],
            np.concatenate((self.places.pass_m[place], np.full(len(self.passed), FIXED_PASS_M))),
        )

    def tour_past(self, place: IntArray) -> Tour:
        """The tour past landmarks at places (m,) and the fixed ones."""
        station = self.station_of(place)
        return plan_tour(self.corridors, self.stations.corridor[station], self.stations.offset_m[station])


@dataclass(frozen=True)
class FloorDesign(FloorCandidates):
    """A plan of one floor. ``place`` (m,) are rows of ``places``: the new landmarks, in the order of the tour."""

    demands: Demands
    cover: Cover
    place: IntArray
    expected: tuple[ExpectedLabels, ...]
    further: tuple[tuple[int, float], ...]
    """As :func:`further_landmarks` proposes them."""
    tour: Tour

    @property
    def landmarks(self) -> PassedLandmarks:
        """New landmarks, then the fixed ones that are passed."""
        return self.landmarks_at(self.place)

    @cached_property
    def longest_m(self) -> float:
        """Longest walk without a landmark that there is, where demands can be met."""
        chosen = _marked(self.station_of(self.place), len(self.stations.corridor))
        return longest_free_m(self.corridors, self.stations, chosen, self.settings.spacing_m)

    @cached_property
    def line_deviations_m(self) -> FloatArray:
        """(l,) how far each landmark's neighbourhood is off one line; those at stations, fixed ones last."""
        distance_m = walking_distances(self.corridors, self.stations)  # not kept: it grows with the square of the floor
        return line_deviations_m(self.landmarks.position, self.station_of(self.place), distance_m)

    @cached_property
    def sigma(self) -> SigmaMap:
        """The expected errors in cells."""
        return sigma_map(self.space, self.expected)

    @cached_property
    def classes(self) -> tuple[DistanceClass, ...]:
        """The expected errors by the distance to the nearest landmark."""
        return tuple(distance_classes(self.space, self.landmarks.position, self.expected))


def plan_floor(
    space: WalkableSpace,
    graph: CorridorGraph,
    settings: PlanSettings,
    constraints: FloorConstraints,
    progress: Progress[str] = silent,
) -> FloorDesign:
    """Plan one floor; ``progress`` hears the name of each of :data:`STEPS` when it begins.

    Raises SurveyError where the floor has no corridor or no wall for a sheet, or a fixed landmark is outside of it.
    """
    _check_inside(space, constraints)
    progress(STEPS[0], len(STEPS))
    candidates = _candidates(space, graph, settings, constraints)
    progress(STEPS[1], len(STEPS))
    corridors, stations, places = candidates.corridors, candidates.stations, candidates.places
    somewhere = candidates.usable | candidates.fixed
    demands = demands_of(corridors, stations, somewhere, settings.spacing_m, settings.short_m)
    progress(STEPS[2], len(STEPS))
    fewest = cover(demands.rows, candidates.fixed, candidates.broken, somewhere, settings.time_limit_s)
    progress(STEPS[3], len(STEPS))
    chosen = _improved(candidates, fewest, demands, typical_walks(graph, seed=1, fewest=TRIED))
    held, held_station = constraints.fixed[candidates.passed], candidates.fixed_station[candidates.passed]
    place = choose_walls(np.flatnonzero(chosen & ~candidates.fixed), places, held, held_station, candidates.distance_m)
    progress(STEPS[4], len(STEPS))
    place, tour = _toured(candidates, place)
    landmarks = candidates.landmarks_at(place)
    progress(STEPS[5], len(STEPS))
    paths = typical_walks(graph)
    expected = tuple(expected_on_walks(paths, landmarks, settings.survey_sigma_m))
    progress(STEPS[6], len(STEPS))
    free = candidates.usable[places.station] & ~chosen[places.station]
    further = further_landmarks(paths, landmarks, places, stations, free, settings.further, settings.survey_sigma_m)
    return FloorDesign(
        **{field.name: getattr(candidates, field.name) for field in fields(candidates)},
        demands=demands,
        cover=fewest,
        place=place,
        expected=expected,
        further=tuple(further),
        tour=tour,
    )


def _candidates(
    space: WalkableSpace, graph: CorridorGraph, settings: PlanSettings, constraints: FloorConstraints
) -> FloorCandidates:
    """Find where landmarks can be; raises SurveyError where they can be nowhere."""
    corridors = _corridors(graph, settings)
    stations = stations_along(corridors, settings.step_m)
    places = find_sheet_places(space, corridors, stations, settings, constraints.forbidden)
    fixed_station = _stations_of(space, stations, constraints.fixed)
    if not len(places.station) and not (fixed_station >= 0).any():
        raise SurveyError("has no wall for a sheet; allow larger sheets (--paper A1) or fewer forbidden places")
    return FloorCandidates(space, corridors, stations, places, constraints, fixed_station, settings)


def _corridors(graph: CorridorGraph, settings: PlanSettings) -> Corridors:
    """A floor's corridors: its rooms and niches where it has no others; raises SurveyError if it has none at all."""
    for rooms, niche_m in ((settings.rooms, settings.niche_m), (True, settings.niche_m), (True, 0.0)):
        corridors = corridors_of(graph, settings.turn_rad, niche_m=niche_m, rooms=rooms)
        if len(corridors.lines):
            return corridors
    raise SurveyError("has no walkable path; check its plan and scale (vislam2tag site show)")


def _toured(candidates: FloorCandidates, place: IntArray) -> tuple[IntArray, Tour]:
    """The new landmarks (m,) in the order in which the tour meets them first, and the tour."""
    tour = candidates.tour_past(place)
    met = list(dict.fromkeys(tour.visit.tolist()))
    order = [i for i in met if i < len(place)] + [i for i in range(len(place)) if i not in met]
    fixed = np.arange(len(place), tour.visit.max(initial=-1) + 1)
    renumber = np.concatenate((np.argsort(order), fixed)).astype(int)
    return place[np.array(order, dtype=np.int64)], replace(tour, visit=renumber[tour.visit])


def longest_free_m(corridors: Corridors, stations: Stations, chosen: BoolArray, spacing_m: float) -> float:
    """Length of the longest walk between two landmarks (s,), to the nearest half metre; at most twice the spacing."""
    low, high = 0.0, 2 * spacing_m
    everywhere = np.ones(len(chosen), dtype=np.bool_)
    while high - low > 0.05:
        middle = (low + high) / 2
        broken = broken_spacing(corridors, stations, everywhere, chosen, middle, 1)
        low, high = (middle, high) if broken else (low, middle)
    return round(high, 1)


def _marked(index: IntArray, count: int) -> BoolArray:
    """Mask (count,) of the indices (k,), negative ones left out."""
    mask = np.zeros(count, dtype=np.bool_)
    mask[index[index >= 0]] = True
    return mask


def _check_inside(space: WalkableSpace, constraints: FloorConstraints) -> None:
    """Raise SurveyError for a fixed landmark that hangs nowhere near the walkable space."""
    around = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = np.vstack([r * np.column_stack((np.cos(around), np.sin(around))) for r in (0.0, 0.4, OUTSIDE_M)])
    for name, place in zip(constraints.names, constraints.fixed, strict=True):
        if not space.inside(place + ring).any():
            x, y = place.tolist()
            raise SurveyError(
                f"landmark {name} at ({x:.2f}, {y:.2f}) is more than {OUTSIDE_M:g} m outside the walkable space; "
                "correct its position or the plan, or ignore existing landmarks with `--ignore-existing`"
            )


def _stations_of(space: WalkableSpace, stations: Stations, fixed: FloatArray) -> IntArray:
    """Nearest station (h,) in view of each fixed landmark (h, 2), -1 where there is none near enough."""
    found = np.full(len(fixed), -1, dtype=np.int64)
    for i, place in enumerate(fixed):
        away = np.linalg.norm(stations.point - place, axis=1)
        near = np.flatnonzero(away <= FIXED_REACH_M)
        near = near[space.clear_line(stations.point[near], place)] if len(near) else near
        if len(near):
            found[i] = near[int(np.argmin(away[near]))]
    return found


def _improved(candidates: FloorCandidates, fewest: Cover, demands: Demands, walks: Sequence[FloatArray]) -> BoolArray:
    """Move the landmarks to stations (s,) where they help most; begin again with every row that this breaks."""
    movable, usable = fewest.chosen & ~candidates.fixed, candidates.usable & ~candidates.fixed
    passes = StationPasses.of(walks, candidates.stations.point)
    costs = gap_costs(candidates.settings.survey_sigma_m)
    rows = list(demands.rows)
    for _ in range(5):  # a limit: where each better choice breaks the spacing again, the fewest ones stay
        better = improve_stations(fewest.chosen, movable, usable, rows, candidates.distance_m, passes, costs)
        broken = candidates.broken(better)
        if not broken:
            return better
        rows += sorted(broken, key=sorted)
    return fewest.chosen


_KEPT = 5000
"""Walks whose labels are kept for landmarks that they pass."""


class ChangedPlan:
    """Other choices of a plan's places. Only walks that pass other landmarks than before are solved again."""

    def __init__(self, design: FloorDesign, graph: CorridorGraph) -> None:
        """``graph`` is the one that the design was made with."""
        self.design = design
        self._paths = typical_walks(graph)
        self._passing = passing(self._paths, design.stations.point)
        self._solved: dict[tuple[int, bytes], ExpectedLabels | None] = {}

    def nearest_place(self, point_m: FloatArray, others: IntArray) -> int:
        """The place nearest to a point (2,) of those at stations without another landmark; places (o,) of others."""
        places = self.design.places
        away = np.linalg.norm(places.position - point_m, axis=1)
        away[np.isin(places.station, places.station[others])] = np.inf
        return int(np.argmin(away))

    def expectation(self, place: IntArray) -> FloorDesign:
        """The plan with landmarks at places (m,) besides the fixed ones, except for tour and further landmarks."""
        landmarks, station = self.design.landmarks_at(place), self.design.station_of(place)
        found = [
            self._labels(number, landmarks.take(np.flatnonzero(passing[station])))
            for number, passing in enumerate(self._passing)
        ]
        return replace(self.design, place=place, expected=tuple(one for one in found if one is not None))

    def further(self, place: IntArray, count: int) -> list[int]:
        """Up to ``count`` further places where landmarks help most beside those at places (m,), the best first."""
        places, stations, sigma_m = self.design.places, self.design.stations, self.design.settings.survey_sigma_m
        free = ~np.isin(places.station, places.station[place])
        landmarks = self.design.landmarks_at(place)
        found = further_landmarks(self._paths, landmarks, places, stations, free, count, sigma_m)
        return [place for place, _ in found]

    def designed(self, place: IntArray) -> FloorDesign:
        """The whole plan with landmarks at places (m,)."""
        return replace(self.expectation(place), further=(), tour=self.design.tour_past(place))

    def _labels(self, number: int, passed: PassedLandmarks) -> ExpectedLabels | None:
        """What is expected along a walk, which depends on the landmarks that it passes only."""
        key = number, passed.position.tobytes()
        if key not in self._solved:
            while len(self._solved) >= _KEPT:
                del self._solved[next(iter(self._solved))]
            self._solved[key] = expected_along(self._paths[number], passed, self.design.settings.survey_sigma_m)
        return self._solved[key]
