"""Walls of a plan: how far places are beyond where people walk, and what that does to a walk between them.

Walks that help each other: drawn sideways onto the ways of others, never along.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.estimation.dead_reckoning.walks import corners, walked
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.context import FixLog, InertialLog, WalkedWays
from vislam2tag.estimation.dead_reckoning.gait import speed_model
from vislam2tag.estimation.dead_reckoning.maps import SIGMA_M, SharedLines, Walls
from vislam2tag.estimation.dead_reckoning.walk import ReckonedWalk, SensedWalk
from vislam2tag.estimation.settings import DeadReckoningSettings

SETTINGS = DeadReckoningSettings()
ROUND = corners((40, 0), (0, 30), (-40, 0), (0, -30))


def ring(at: tuple[float, float] = (0.0, 0.0)) -> WalkableArea:
    """Corridors three metres wide along :data:`ROUND`."""
    mask = np.zeros((72, 92), dtype=bool)
    mask[3:69, 3:89] = True
    mask[9:63, 9:83] = False
    return WalkableArea(mask, (at[0] - 1.5 - 1.5, at[1] - 1.5 - 1.5), 0.5)


def test_depth_is_told_from_the_walls_with_its_slope() -> None:
    mask = np.zeros((40, 40), dtype=bool)
    mask[:, 10:20] = True
    walls = Walls(WalkableArea(mask, (0.0, 0.0), 0.5), 0.5)
    # The corridor is from x = 5 to 10 m; people walk from 5.5 to 9.5 m.
    beyond, slope = walls.beyond(np.array((7 + 9j, 9.25 + 9j, 12 + 9j, 3 + 9j)))
    assert beyond == pytest.approx((0, 0, 2.5, 2.5), abs=0.3)
    assert slope[2:] == pytest.approx(np.array(((1, 0), (-1, 0))), abs=1e-6)


def test_fixes_scatter_less_between_walls_than_where_there_is_room() -> None:
    mask = np.zeros((40, 80), dtype=bool)
    mask[:, 10:14], mask[:, 30:70] = True, True
    walls = Walls(WalkableArea(mask, (0.0, 0.0), 0.5), 0.5)
    # A corridor from x = 5 to 7 m and a hall from 15 to 35 m.
    narrow, hall = walls.scatter(np.array((6 + 10j, 25 + 10j))).tolist()
    assert narrow < 1 < hall


def path(log: InertialLog, fixes: FixLog, area: WalkableArea | None, settings: DeadReckoningSettings) -> ReckonedWalk:
    sensed = SensedWalk.of(log)
    assert sensed is not None
    ends = FixLog(fixes.time_ns[[0, -1]], fixes.position_bcs[[0, -1]], ("start", "end"))
    return sensed.path(ends, speed_model(), settings, area)


def errors_m(walk: ReckonedWalk, fixes: FixLog) -> FloatArray:
    at_s = np.asarray((fixes.time_ns - walk.sensed.signals.start_ns) * 1e-9, dtype=np.float64)
    return np.asarray(np.linalg.norm(walk.at(at_s)[0] - fixes.position_bcs, axis=1))


@pytest.fixture(scope="module")
def round_walk() -> tuple[InertialLog, FixLog]:
    """A way round a block whose compass is 15 degrees off."""
    log, fixes = walked(ROUND)
    off = Rotation.from_rotvec((0, 0, np.radians(15)))
    return replace(log, orientation=(off * Rotation.from_quat(log.orientation)).as_quat()), fixes


def test_walls_turn_a_walk_that_the_compass_turned_away(round_walk: tuple[InertialLog, FixLog]) -> None:
    log, fixes = round_walk
    without, within = (errors_m(path(log, fixes, area, SETTINGS), fixes).max() for area in (None, ring()))
    assert without > 3
    assert within < 0.6 * without


def test_a_plan_that_lies_elsewhere_or_is_not_wanted_changes_nothing(round_walk: tuple[InertialLog, FixLog]) -> None:
    log, fixes = round_walk
    plain = path(log, fixes, None, SETTINGS).positions
    assert (path(log, fixes, ring((60.0, 0.0)), SETTINGS).positions == plain).all()
    unwanted = SETTINGS.model_copy(update={"plan_prior": False})
    assert (path(log, fixes, ring(), unwanted).positions == plain).all()


WAY = corners((30, 0), (0, 25), (-30, 0))


def along(walk: int, aside_m: float = 0.0, turn_rad: float = 0.0) -> WalkedWays:
    """Somebody walks along the x axis, so far to the left of it."""
    x = np.arange(0.0, 20.0, 0.6)
    way = np.column_stack((x, np.full_like(x, aside_m)))
    return WalkedWays(way, np.full(len(x), turn_rad), np.full(len(x), walk))


def together(*ways: WalkedWays) -> WalkedWays:
    return WalkedWays(
        np.concatenate([way.position_bcs for way in ways]),
        np.concatenate([way.course_rad for way in ways]),
        np.concatenate([way.walk for way in ways]),
    )


def test_lines_lie_between_the_ways_of_others_whichever_way_they_went() -> None:
    ways = together(along(0, 0.5), along(1, 1.5, np.pi), along(2, 0.3, np.pi / 2), along(3, 9.0))
    lines = SharedLines.of(ways, np.array((10 + 0j, 10 + 0j, 10 - 5j)), np.array((1 + 0j, 0j, 1 + 0j)))
    assert lines.place[0] == pytest.approx(10 + 1j)
    assert lines.precision[0] == pytest.approx(1 / (1.5 * SIGMA_M**2))
    assert lines.precision[1:].tolist() == [0, 0]
    assert lines.distance_m(np.array((12 + 3j, 0j, 0j)))[0] == pytest.approx(2)


def walk_of(log: InertialLog, fixes: FixLog, ways: WalkedWays | None = None) -> ReckonedWalk:
    sensed = SensedWalk.of(log)
    assert sensed is not None
    ends = FixLog(fixes.time_ns[[0, -1]], fixes.position_bcs[[0, -1]], ("start", "end"))
    return sensed.path(ends, speed_model(), SETTINGS, ways=ways)


def test_a_walk_whose_compass_is_off_is_drawn_onto_the_ways_of_others() -> None:
    log, fixes = walked(WAY)
    off = Rotation.from_rotvec((0, 0, np.radians(6)))
    turned = replace(log, orientation=(off * Rotation.from_quat(log.orientation)).as_quat())
    others = [walk_of(log, fixes).way() for _ in range(3)]
    ways = together(*(replace(way, walk=way.walk + number) for number, way in enumerate(others)))
    alone, helped = walk_of(turned, fixes), walk_of(turned, fixes, ways)
    inner = slice(1, 3)
    assert errors_m(helped, fixes)[inner].mean() < 0.95 * errors_m(alone, fixes)[inner].mean()
    assert (
        np.trace(helped.path.covariance[:, :2, :2], axis1=1, axis2=2).mean()
        < np.trace(alone.path.covariance[:, :2, :2], axis1=1, axis2=2).mean()
    )
    nowhere = replace(ways, position_bcs=ways.position_bcs + 500)
    assert walk_of(turned, fixes, nowhere).positions == pytest.approx(alone.positions, abs=0.02)
