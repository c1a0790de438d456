"""A whole plan of one floor, from places and demands to expected errors and the tour; a plan changed by hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.progress import Progress, silent
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.preparation.planning.corridors import Corridors, corridors_of, typical_walks
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
    passes_near,
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
from vislam2tag.preparation.planning.tour import Tour, plan_tour
from vislam2tag.site.walkable.graph import CorridorGraph
from vislam2tag.site.walkable.space import WalkableSpace

STEPS = ("places", "demands", "fewest landmarks", "walls", "tour", "prediction", "further landmarks")
FIXED_REACH_M = 5.0
"""A fixed landmark farther off every corridor than this is passed by nobody."""
OUTSIDE_M = 1.0
"""A fixed landmark farther off the walkable space than this hangs in another building."""
FIXED_PASS_M = 0.6
BRANCHES = 2000
"""The search ends after so many branches; unlike a time limit this ends it at the same place on every machine."""
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
class FloorDesign:
    """A plan of one floor. ``place`` (m,) are rows of ``places``: the new landmarks, in the order of the tour."""

    space: WalkableSpace
    corridors: Corridors
    stations: Stations
    places: SheetPlaces
    constraints: FloorConstraints
    fixed_station: IntArray
    """(h,) station at which each fixed landmark is passed, -1 where nobody passes it."""
    demands: Demands
    cover: Cover
    place: IntArray
    longest_m: float
    """Longest walk without a landmark that there is, where demands can be met."""
    line_deviations_m: FloatArray
    """(l,) how far each landmark's neighbourhood lies off one line; those at stations, fixed ones last."""
    expected: tuple[ExpectedLabels, ...]
    sigma: SigmaMap
    classes: tuple[DistanceClass, ...]
    further: tuple[tuple[int, float], ...]
    """As :func:`further_landmarks` proposes them."""
    tour: Tour

    @property
    def landmarks(self) -> PassedLandmarks:
        """New landmarks, then the fixed ones that are passed."""
        return passed_landmarks(self.places, self.stations, self.place, self.constraints, self.fixed_station)


def plan_floor(
    space: WalkableSpace,
    graph: CorridorGraph,
    settings: PlanSettings,
    constraints: FloorConstraints,
    progress: Progress[str] = silent,
) -> FloorDesign:
    """Plan one floor; ``progress`` hears the name of each of :data:`STEPS` when it begins.

    Raises SurveyError where the floor has no corridor or no wall for a sheet, or a fixed landmark lies outside of it.
    """
    _check_inside(space, constraints)
    progress(STEPS[0], len(STEPS))
    candidates = _Candidates.of(space, graph, settings, constraints)
    progress(STEPS[1], len(STEPS))
    corridors, stations, places = candidates.corridors, candidates.stations, candidates.places
    demands = demands_of(corridors, stations, candidates.all, settings.spacing_m, settings.short_m)
    progress(STEPS[2], len(STEPS))
    fewest = _fewest(candidates, demands, settings)
    progress(STEPS[3], len(STEPS))
    distance_m = walking_distances(corridors, stations)
    chosen = _improved(candidates, fewest, demands, distance_m, typical_walks(graph, seed=1, fewest=TRIED), settings)
    place = candidates.walls(np.flatnonzero(chosen & ~candidates.fixed), distance_m)
    progress(STEPS[4], len(STEPS))
    place, tour = candidates.toured(place)
    landmarks = passed_landmarks(places, stations, place, constraints, candidates.fixed_station)
    progress(STEPS[5], len(STEPS))
    paths = typical_walks(graph)
    expected = tuple(expected_on_walks(paths, landmarks, settings.survey_sigma_m))
    progress(STEPS[6], len(STEPS))
    free = candidates.usable[places.station] & ~chosen[places.station]
    further = further_landmarks(paths, landmarks, places, stations, free, settings.further, settings.survey_sigma_m)
    return FloorDesign(
        space=space,
        corridors=corridors,
        stations=stations,
        places=places,
        constraints=constraints,
        fixed_station=candidates.fixed_station,
        demands=demands,
        cover=fewest,
        place=place,
        longest_m=longest_free_m(corridors, stations, chosen, settings.spacing_m),
        line_deviations_m=line_deviations_m(
            landmarks.position, candidates.with_fixed(places.station[place]), distance_m
        ),
        expected=expected,
        sigma=sigma_map(space, expected),
        classes=tuple(distance_classes(space, landmarks.position, expected)),
        further=tuple(further),
        tour=tour,
    )


@dataclass(frozen=True)
class _Candidates:
    """Where a floor's landmarks can be: ``usable`` (s,) stations with places for new ones, ``fixed`` (s,) stations with
    landmarks that stay; ``fixed_station`` (h,) is that of each fixed landmark, -1 where nobody passes it.
    """

    corridors: Corridors
    stations: Stations
    places: SheetPlaces
    constraints: FloorConstraints
    fixed_station: IntArray
    usable: BoolArray
    fixed: BoolArray

    @classmethod
    def of(
        cls, space: WalkableSpace, graph: CorridorGraph, settings: PlanSettings, constraints: FloorConstraints
    ) -> _Candidates:
        """Find them; raises SurveyError where there are none."""
        corridors = corridors_of(graph, settings.turn_rad, niche_m=settings.niche_m, rooms=settings.rooms)
        if not len(corridors.lines):
            raise SurveyError("has no way to walk; check its plan and scale (vislam2tag site show)")
        stations = stations_along(corridors, settings.step_m)
        places = find_sheet_places(space, corridors, stations, settings, constraints.forbidden)
        fixed_station = _stations_of(space, stations, constraints.fixed)
        count = len(stations.corridor)
        usable, fixed = marked(places.station, count), marked(fixed_station, count)
        if not (usable | fixed).any():
            raise SurveyError("has no wall for a sheet; allow larger sheets (--paper A1) or fewer forbidden places")
        return cls(corridors, stations, places, constraints, fixed_station, usable, fixed)

    @property
    def all(self) -> BoolArray:
        """(s,) stations with a new landmark possible or a fixed one."""
        return self.usable | self.fixed

    def broken(self, chosen: BoolArray, spacing_m: float) -> set[StationSet]:
        """Rows of walks that are longer than the spacing without a ``chosen`` (s,) station."""
        return broken_spacing(self.corridors, self.stations, self.all, chosen, spacing_m)

    @property
    def passed(self) -> IntArray:
        """(p,) the fixed landmarks that are passed."""
        return np.flatnonzero(self.fixed_station >= 0)

    def with_fixed(self, station: IntArray) -> IntArray:
        """Stations (m,) of new landmarks, followed by those of the fixed ones: (m + p,)."""
        return np.concatenate((station, self.fixed_station[self.passed]))

    def walls(self, station: IntArray, distance_m: FloatArray) -> IntArray:
        """A place (m,) for each station (m,)."""
        held = self.constraints.fixed[self.passed]
        return choose_walls(station, self.places, held, self.fixed_station[self.passed], distance_m)

    def toured(self, place: IntArray) -> tuple[IntArray, Tour]:
        """The new landmarks (m,) in the order in which the tour meets them first, and the tour."""
        station = self.with_fixed(self.places.station[place])
        tour = plan_tour(self.corridors, self.stations.corridor[station], self.stations.offset_m[station])
        met = list(dict.fromkeys(tour.visit.tolist()))
        order = [i for i in met if i < len(place)] + [i for i in range(len(place)) if i not in met]
        fixed = np.arange(len(place), tour.visit.max(initial=-1) + 1)
        renumber = np.concatenate((np.argsort(order), fixed)).astype(int)
        return place[np.array(order, dtype=np.int64)], Tour(tour.line, renumber[tour.visit], tour.visit_m, tour.twice_m)


def passed_landmarks(
    places: SheetPlaces, stations: Stations, place: IntArray, constraints: FloorConstraints, fixed_station: IntArray
) -> PassedLandmarks:
    """Landmarks for the prediction: the new ones at some ``place`` (m,), then those fixed ones that are passed."""
    held = np.flatnonzero(fixed_station >= 0)
    return PassedLandmarks(
        np.vstack((places.position[place], constraints.fixed[held])),
        stations.point[np.concatenate((places.station[place], fixed_station[held]))],
        np.concatenate((places.pass_m[place], np.full(len(held), FIXED_PASS_M))),
    )


def longest_free_m(corridors: Corridors, stations: Stations, chosen: BoolArray, spacing_m: float) -> float:
    """Length of the longest walk between two landmarks (s,), to the nearest half metre; at most twice the spacing."""
    low, high = 0.0, 2 * spacing_m
    everywhere = np.ones(len(chosen), dtype=np.bool_)
    while high - low > 0.05:
        middle = (low + high) / 2
        broken = broken_spacing(corridors, stations, everywhere, chosen, middle, 1)
        low, high = (middle, high) if broken else (low, middle)
    return round(high, 1)


def marked(index: IntArray, count: int) -> BoolArray:
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
                f"landmark {name} at ({x:.2f}, {y:.2f}) lies more than {OUTSIDE_M:g} m outside the walkable space; "
                "correct its position or the plan, or leave fixed landmarks out (--anew)"
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


def _fewest(candidates: _Candidates, demands: Demands, settings: PlanSettings) -> Cover:
    """The fewest stations that fulfil all demands."""
    return cover(
        demands.rows,
        candidates.fixed,
        lambda chosen: candidates.broken(chosen, settings.spacing_m),
        allowed=candidates.all,
        gap=0.0,
        nodes=BRANCHES,
        time_limit_s=settings.time_limit_s,
    )


def _improved(
    candidates: _Candidates,
    fewest: Cover,
    demands: Demands,
    distance_m: FloatArray,
    walks: Sequence[FloatArray],
    settings: PlanSettings,
) -> BoolArray:
    """Move the landmarks to stations (s,) where they help most; begin again with every row that this breaks."""
    fixed, usable = candidates.fixed, candidates.usable & ~candidates.fixed
    passes = StationPasses.of(walks, candidates.stations.point)
    costs = gap_costs(settings.survey_sigma_m)
    rows = list(demands.rows)
    for _ in range(5):  # a limit: where each better choice breaks the spacing again, the fewest ones stay
        better = improve_stations(fewest.chosen, fewest.chosen & ~fixed, usable, rows, distance_m, passes, costs)
        broken = candidates.broken(better, settings.spacing_m)
        if not broken:
            return better
        rows += sorted(broken, key=sorted)
    return fewest.chosen


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
        return [place for place, _ in found]

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
