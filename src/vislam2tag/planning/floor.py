"""A whole plan of one floor: places, demands, the fewest landmarks, their walls, what to expect of them, the tour."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.planning.cover import Cover, cover
from vislam2tag.planning.demands import Demands, Gap, broken, demands_of, walking_m
from vislam2tag.planning.further import Further, further_landmarks
from vislam2tag.planning.places import Places, Stations, find_places, stations_along
from vislam2tag.planning.prediction import Expected, Sheets, expected_on
from vislam2tag.planning.refine import choose_walls, improved, neighbourhoods, width_m
from vislam2tag.planning.settings import PlanSettings
from vislam2tag.planning.sigma_map import (
    DistanceClass,
    SigmaMap,
    distance_classes,
    sigma_map,
)
from vislam2tag.planning.tour import Tour, plan_tour
from vislam2tag.planning.typical_walks import typical_walks
from vislam2tag.planning.walk_costs import StationPasses, gap_costs
from vislam2tag.planning.ways import Ways, ways_of
from vislam2tag.walkable.graph import CorridorGraph
from vislam2tag.walkable.space import WalkableSpace

STEPS = ("places", "demands", "fewest landmarks", "walls", "tour", "prediction", "further landmarks")
FIXED_REACH_M = 5.0
"""A fixed landmark farther off every way than this is passed by nobody."""
OUTSIDE_M = 1.0
"""A fixed landmark farther off the walkable space than this hangs in another building."""
FIXED_PASS_M = 0.6
TRIED = 60
"""Landmarks move to where they help most on so many walks; what is expected is told on others."""


@dataclass(frozen=True)
class Given:
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
    ways: Ways
    stations: Stations
    places: Places
    given: Given
    fixed_station: IntArray
    """(h,) station at which each fixed landmark is passed, -1 where nobody passes it."""
    demands: Demands
    cover: Cover
    place: IntArray
    longest_m: float
    """Longest walk without a landmark that there is, where demands can be met."""
    widths_m: FloatArray
    """(l,) how far each landmark's neighbourhood lies off one line; those at stations, fixed ones last."""
    expected: tuple[Expected, ...]
    sigma: SigmaMap
    classes: tuple[DistanceClass, ...]
    further: tuple[Further, ...]
    tour: Tour

    @property
    def sheets(self) -> Sheets:
        """New landmarks, then the fixed ones that are passed."""
        return sheets_of(self.places, self.stations, self.place, self.given, self.fixed_station)

    @property
    def gaps(self) -> tuple[Gap, ...]:
        """Demands that no wall can fulfil."""
        return self.demands.gaps


def plan_floor(
    space: WalkableSpace,
    graph: CorridorGraph,
    settings: PlanSettings,
    given: Given,
    on_step: Callable[[str], None] = lambda _step: None,
) -> FloorDesign:
    """Plan one floor; ``on_step`` hears the name of each of :data:`STEPS` when it begins.

    Raises SurveyError where the floor has no ways or no wall for a sheet, or a fixed landmark lies outside of it.
    """
    _check_inside(space, given)
    on_step(STEPS[0])
    ways = ways_of(graph, settings.turn_rad, niche_m=settings.niche_m, rooms=settings.rooms)
    if not len(ways.lines):
        raise SurveyError("has no way to walk; check its plan and scale (vislam2tag site show)")
    stations = stations_along(ways, settings.step_m)
    places = find_places(space, ways, stations, settings, given.forbidden)
    fixed_station = _stations_of(space, stations, given.fixed)
    usable, fixed = _marked(places.station, len(stations.way)), _marked(fixed_station, len(stations.way))
    if not (usable | fixed).any():
        raise SurveyError("has no wall for a sheet; allow larger sheets (--sheet A1) or fewer forbidden places")
    on_step(STEPS[1])
    demands = demands_of(ways, stations, usable | fixed, settings.spacing_m, settings.short_m)
    on_step(STEPS[2])
    found = _fewest(ways, stations, usable | fixed, fixed, demands, settings)
    on_step(STEPS[3])
    distance_m = walking_m(ways, stations)
    walks = StationPasses.of(typical_walks(graph, seed=1, fewest=TRIED), stations.point)
    chosen = _improved(ways, stations, usable, fixed, found, demands, distance_m, walks, settings)
    at = np.flatnonzero(chosen & ~fixed)
    held = np.flatnonzero(fixed_station >= 0)
    place = choose_walls(at, places, given.fixed[held], fixed_station[held], distance_m)
    on_step(STEPS[4])
    tour = plan_tour(
        ways,
        stations.way[np.concatenate((at, fixed_station[held]))],
        stations.offset_m[np.concatenate((at, fixed_station[held]))],
    )
    place, at, tour = _in_order(place, at, tour)
    sheets = sheets_of(places, stations, place, given, fixed_station)
    groups = neighbourhoods(np.concatenate((at, fixed_station[held])), distance_m)
    on_step(STEPS[5])
    paths = typical_walks(graph)
    expected = tuple(expected_on(paths, sheets, settings.survey_sigma_m))
    on_step(STEPS[6])
    free = usable[places.station] & ~chosen[places.station]
    further = further_landmarks(paths, sheets, places, stations, free, settings.further, settings.survey_sigma_m)
    return FloorDesign(
        space=space,
        ways=ways,
        stations=stations,
        places=places,
        given=given,
        fixed_station=fixed_station,
        demands=demands,
        cover=found,
        place=place,
        longest_m=longest_free_m(ways, stations, chosen, settings.spacing_m),
        widths_m=np.array([width_m(sheets.position[group]) for group in groups]),
        expected=expected,
        sigma=sigma_map(space, expected),
        classes=tuple(distance_classes(space, sheets.position, expected)),
        further=tuple(further),
        tour=tour,
    )


def sheets_of(places: Places, stations: Stations, place: IntArray, given: Given, fixed_station: IntArray) -> Sheets:
    """Landmarks for the prediction: the new ones at some ``place`` (m,), then those fixed ones that are passed."""
    held = np.flatnonzero(fixed_station >= 0)
    return Sheets(
        np.vstack((places.position[place], given.fixed[held])),
        stations.point[np.concatenate((places.station[place], fixed_station[held]))],
        np.concatenate((places.pass_m[place], np.full(len(held), FIXED_PASS_M))),
    )


def longest_free_m(ways: Ways, stations: Stations, chosen: BoolArray, spacing_m: float) -> float:
    """Length of the longest walk between two landmarks (s,), to the nearest half metre; at most twice the spacing."""
    low, high = 0.0, 2 * spacing_m
    everywhere = np.ones(len(chosen), dtype=np.bool_)
    while high - low > 0.05:
        middle = (low + high) / 2
        low, high = (middle, high) if broken(ways, stations, everywhere, chosen, middle, 1) else (low, middle)
    return round(high, 1)


def _marked(index: IntArray, count: int) -> BoolArray:
    mask = np.zeros(count, dtype=np.bool_)
    mask[index[index >= 0]] = True
    return mask


def _check_inside(space: WalkableSpace, given: Given) -> None:
    """Raise SurveyError for a fixed landmark that hangs nowhere near the walkable space."""
    around = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = np.vstack([r * np.column_stack((np.cos(around), np.sin(around))) for r in (0.0, 0.4, OUTSIDE_M)])
    for name, place in zip(given.names, given.fixed, strict=True):
        if not space.inside(place + ring).any():
            x, y = place.tolist()
            raise SurveyError(
                f"landmark {name} at ({x:.2f}, {y:.2f}) lies more than {OUTSIDE_M:g} m outside the walkable space; "
                "correct its position or the plan, or leave fixed landmarks out (--anew)"
            )


def _stations_of(space: WalkableSpace, stations: Stations, fixed: FloatArray) -> IntArray:
    """Nearest station in view of each fixed landmark, -1 where there is none near enough."""
    found = np.full(len(fixed), -1, dtype=np.int64)
    for i, place in enumerate(fixed):
        away = np.linalg.norm(stations.point - place, axis=1)
        near = np.flatnonzero(away <= FIXED_REACH_M)
        near = near[space.clear_line(stations.point[near], place)] if len(near) else near
        if len(near):
            found[i] = near[int(np.argmin(away[near]))]
    return found


def _fewest(
    ways: Ways, stations: Stations, usable: BoolArray, fixed: BoolArray, demands: Demands, settings: PlanSettings
) -> Cover:
    return cover(
        demands.rows,
        fixed,
        lambda chosen: broken(ways, stations, usable, chosen, settings.spacing_m),
        allowed=usable,
        gap=settings.gap,
        nodes=settings.nodes,
        time_limit_s=settings.time_limit_s,
    )


def _improved(
    ways: Ways,
    stations: Stations,
    usable: BoolArray,
    fixed: BoolArray,
    found: Cover,
    demands: Demands,
    distance_m: FloatArray,
    walks: StationPasses,
    settings: PlanSettings,
) -> BoolArray:
    """Move the landmarks to where they help most; begin again with every row that this breaks."""
    rows = list(demands.rows)
    for _ in range(5):
        costs = gap_costs(settings.survey_sigma_m)
        better = improved(found.chosen, found.chosen & ~fixed, usable & ~fixed, rows, distance_m, walks, costs)
        further = broken(ways, stations, usable | fixed, better, settings.spacing_m)
        if not further:
            return better
        rows += sorted(further, key=sorted)
    return found.chosen


def _in_order(place: IntArray, at: IntArray, tour: Tour) -> tuple[IntArray, IntArray, Tour]:
    """Number the new landmarks in the order in which the tour meets them first; fixed ones keep their numbers."""
    met = list(dict.fromkeys(tour.visit.tolist()))
    order = [i for i in met if i < len(place)] + [i for i in range(len(place)) if i not in met]
    renumber = np.concatenate((np.argsort(order), np.arange(len(place), tour.visit.max(initial=-1) + 1))).astype(int)
    index = np.array(order, dtype=np.int64)
    return place[index], at[index], Tour(tour.line, renumber[tour.visit], tour.visit_m, tour.twice_m)
