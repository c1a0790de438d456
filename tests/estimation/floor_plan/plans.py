"""Small plans made of rectangles, exact walks on them, and walks of the simulator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from tests.drifting import camera_track
from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.context import PlanOfFloor
from vislam2tag.core.tracks import CameraTrack, Landmarks, Trajectory
from vislam2tag.core.transforms import as_complex
from vislam2tag.core.wall_costs import FINE_M, WallCosts
from vislam2tag.estimation.odometry import Odometry
from vislam2tag.simulation.building import make_building
from vislam2tag.simulation.model import SimulatedFloor, TrackerLog, position_at
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import BuildingSettings
from vislam2tag.simulation.survey import walk_and_track
from vislam2tag.site.plans.source import FloorPlan
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.space import free_cells

Box = tuple[float, float, float, float]
"""Left, lower, right and upper edge, metres."""
RATE_HZ = 10.0

OFFICE: tuple[Box, ...] = (
    (1, 6, 23, 8),  # a corridor, and one that leaves it downwards
    (19, 1, 21, 6),
    *((1, 8.3, 6, 13), (3, 8, 3.9, 8.3)),  # rooms, each with its door
    *((9, 8.3, 15, 13), (13, 8, 13.9, 8.3)),
    *((3, 1, 9, 5.7), (7, 5.7, 7.9, 6)),
)
OFFICE_SIZE = (24.0, 14.0)
OFFICE_ROUTE: tuple[complex, ...] = (
    *(2 + 11j, 3.45 + 10j, 3.45 + 7j, 13.45 + 7j, 13.45 + 10j, 10 + 12j, 13.45 + 10j, 13.45 + 7j),
    *(20 + 7j, 20 + 2j, 20 + 7j, 7.45 + 7j, 7.45 + 4j, 4 + 2j),
)
"""Through three rooms and both corridors."""


def area_of(rooms: Sequence[Box], size_m: tuple[float, float], origin_m: tuple[float, float] = (0, 0)) -> WalkableArea:
    """Rooms in a solid block that begins at an origin."""
    free = np.zeros((round(size_m[1] / FINE_M), round(size_m[0] / FINE_M)), dtype=np.bool_)
    for room in rooms:
        left, low, right, high = (round(edge / FINE_M) for edge in room)
        free[low:high, left:right] = True
    return WalkableArea(free, origin_m, FINE_M)


@cache
def office() -> WallCosts:
    """A plan with corners and doors that no turn or mirror image maps to itself."""
    return WallCosts.of(area_of(OFFICE, OFFICE_SIZE))


@cache
def twins() -> WallCosts:
    """Two copies of the same office, 30 m apart."""
    shifted = tuple((left + 30, low, right + 30, high) for left, low, right, high in OFFICE)
    return WallCosts.of(area_of((*OFFICE, *shifted), (54, 14)))


TWIN = 30.0
"""From one copy to the other, metres."""


def along(corners: Sequence[complex], speed_m_s: float = 1.0) -> ComplexArray:
    """A path (n,) along straight lines between corners, complex metres, ten frames a second."""
    route = np.array(corners)
    arc = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(route)))))
    at = np.arange(0, arc[-1] + 1e-9, speed_m_s / RATE_HZ)
    return np.asarray(np.interp(at, arc, route))


def odometry_of(path: ComplexArray, time_s: FloatArray | None = None) -> Odometry:
    """The odometry of a perfect tracker whose frame is that of the path (n,)."""
    count = len(path)
    nothing, never = np.zeros(count - 1), np.zeros(count - 1, dtype=np.bool_)
    return Odometry(
        frame=np.arange(count),
        time_s=np.arange(count) / RATE_HZ if time_s is None else time_s,
        path=path,
        turn=np.ones(count, dtype=np.complex128),
        step_length_m=np.abs(np.diff(path)),
        turned_rad=nothing,
        jump_m2=nothing.copy(),
        jump_rad2=nothing.copy(),
        doubt=np.zeros(count - 1, dtype=np.complex128),
        rewritten=np.zeros(count, dtype=np.bool_),
        aside_m2=np.zeros(count),
        jumped=never.copy(),
        blind=never.copy(),
        events=(),
    )


def with_gap(odometry: Odometry, step: int, sigma_m: float, sigma_rad: float = 0.0) -> Odometry:
    """Make a step uncertain by these standard deviations."""
    jump_m2, jump_rad2, jumped = odometry.jump_m2.copy(), odometry.jump_rad2.copy(), odometry.jumped.copy()
    jump_m2[step], jump_rad2[step], jumped[step] = sigma_m**2, sigma_rad**2, True
    return replace(odometry, jump_m2=jump_m2, jump_rad2=jump_rad2, jumped=jumped)


def in_own_frame(truth: ComplexArray, yaw_rad: float) -> ComplexArray:
    """A path (n,) as a tracker reports it that began at its first place and ``bcs_R_acs`` of ``yaw_rad``."""
    return np.asarray((truth - truth[0]) * np.exp(-1j * yaw_rad))


def plans_with(costs: WallCosts | None, number: int = 0) -> tuple[PlanOfFloor, ...]:
    """The plan of one floor."""
    return (PlanOfFloor(number, lambda: costs),)


def camera_with(path: ComplexArray, costs: WallCosts) -> CameraTrack:
    """A perfect tracker on a path (n,), on a floor with a plan."""
    return replace(camera_track(path, np.arange(len(path)) / RATE_HZ), plans=plans_with(costs))


@dataclass(frozen=True)
class SimulatedWalk:
    """A walk of the simulator with its floor's plan; ``truth`` (n,) complex, metres, at the frames of ``log``."""

    floor: SimulatedFloor
    log: TrackerLog
    truth: ComplexArray
    free: BoolArray

    @property
    def costs(self) -> WallCosts:
        """Costs of the plan."""
        return WallCosts.of(WalkableArea(self.free, (0.0, 0.0), FINE_M))

    @property
    def mirrored_costs(self) -> WallCosts:
        """Costs of the plan with left and right exchanged."""
        return WallCosts.of(WalkableArea(self.free[:, ::-1], (0.0, 0.0), FINE_M))

    def camera(self, plans: tuple[PlanOfFloor, ...] | None = None, seconds: float = np.inf) -> CameraTrack:
        """The first seconds of the walk, by default on its own floor's plan."""
        log = self.log
        kept = (log.time_ns - log.time_ns[0]) * 1e-9 <= seconds
        status = np.zeros(int(kept.sum()), dtype=np.int8)
        own = plans_with(self.costs) if plans is None else plans
        return CameraTrack(log.time_ns[kept], log.position_acs[kept], log.orientation_acs[kept], status, plans=own)

    def landmarks(self, count: int) -> Landmarks:
        """The survey of the first landmarks that the walk passes, at their true places."""
        seen = [self.log.landmarks.ids[i] for i in dict.fromkeys(self.log.landmarks.landmark.tolist())]
        rows = [self.floor.landmark_ids.index(name) for name in seen[:count]]
        unknown = np.full(len(rows), np.nan)
        return Landmarks(
            ids=tuple(seen[:count]),
            floor=np.zeros(len(rows), dtype=np.int64),
            position_bcs=self.floor.landmark_position[rows, :2],
            covariance_bcs=np.tile(np.eye(2) * 0.02**2, (len(rows), 1, 1)),
            z_m=unknown,
            heading_rad=unknown,
            heading_sigma_rad=unknown,
        )

    def errors_m(self, trajectory: Trajectory) -> FloatArray:
        """Distance (k,) of each frame's position from the truth, NaN without a position."""
        found = as_complex(trajectory.position_bcs[:, :2])
        return np.asarray(np.abs(found - self.truth[: len(found)]))


@cache
def simulated(seed: int, severity: str = "default", seconds: float = 180.0) -> SimulatedWalk:
    """A walk of this many seconds in a generated building of 60 x 32 m."""
    scenario = regular_survey(seed, severity, (0,), ("LG",), 1, seconds)
    walk, log = walk_and_track(scenario, scenario.sessions[0])
    floor = scenario.building.floors[0]
    truth = as_complex(position_at(walk, log.exposure_ns)[:, :2])
    return SimulatedWalk(floor, log, truth, free_of(floor))


def free_of(floor: SimulatedFloor) -> BoolArray:
    """Cells of a generated floor that can be walked."""
    image = np.full((4, 4, 3), 255, dtype=np.uint8)
    plan = FloorPlan((0, floor.width_m, 0, floor.height_m), image, walls=floor.walls)
    return free_cells(plan, WalkableSettings(cell_m=FINE_M))[0]


@cache
def another_floor(seed: int) -> WallCosts:
    """The plan of another generated building."""
    floor = make_building(BuildingSettings(), seed).floors[0]
    return WallCosts.of(WalkableArea(free_of(floor), (0.0, 0.0), FINE_M))
