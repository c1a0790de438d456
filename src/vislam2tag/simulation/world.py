"""From a planned session to its true walk and what the tracker logs of it."""

from __future__ import annotations

from vislam2tag.simulation.model import SimulatedFloor, TrackerLog, TrueWalk
from vislam2tag.simulation.scenario import PlannedSession, Scenario
from vislam2tag.simulation.settings import stream
from vislam2tag.simulation.tracking.tracker import track
from vislam2tag.simulation.walking.tour import seen_from_first, tour_from
from vislam2tag.simulation.walking.walk import make_walk


def simulated_floor(scenario: Scenario, number: int) -> SimulatedFloor:
    """Return the floor with this number; raises KeyError where the building has none."""
    for floor in scenario.building.floors:
        if floor.number == number:
            return floor
    raise KeyError(number)


def walk_and_track(scenario: Scenario, planned: PlannedSession) -> tuple[TrueWalk, TrackerLog]:
    """Simulate one session's walk and tracker, from random numbers of its own."""
    number = planned.key.floor
    tour = None if planned.climb is None else tour_from(scenario.building, number, planned.climb)
    floor = simulated_floor(scenario, number) if tour is None else seen_from_first(tour)
    walk = make_walk(
        floor,
        planned.duration_s,
        planned.walk,
        stream(scenario.seed, "walk", planned.key),
        planned.start_ns,
        tour,
    )
    log = track(walk, floor, planned.tracker, stream(scenario.seed, "tracker", planned.key), planned.fault_quantile)
    return walk, log
