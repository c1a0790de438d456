"""Walks that help each other: drawn sideways onto the ways of others, never along."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.estimation.dead_reckoning.walks import corners, walked
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import FixLog, InertialLog, WalkedWays
from vislam2tag.estimation.dead_reckoning.gait import speed_model
from vislam2tag.estimation.dead_reckoning.maps import SIGMA_M, SharedLines
from vislam2tag.estimation.dead_reckoning.walk import ReckonedWalk, SensedWalk
from vislam2tag.estimation.settings import DeadReckoningSettings

SETTINGS = DeadReckoningSettings()
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


def errors_m(walk: ReckonedWalk, fixes: FixLog) -> FloatArray:
    at_s = np.asarray((fixes.time_ns - walk.sensed.signals.start_ns) * 1e-9, dtype=np.float64)
    return np.asarray(np.linalg.norm(walk.at(at_s)[0] - fixes.position_bcs, axis=1))


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
