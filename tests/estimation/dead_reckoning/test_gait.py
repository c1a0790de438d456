"""Which way somebody walks against where the phone points, by the gait."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from training import on_thigh

from tests.estimation.dead_reckoning.walks import corners, walked
from vislam2tag.core.context import FixLog, InertialLog
from vislam2tag.estimation.dead_reckoning.gait import speed_model, turned_by_gait
from vislam2tag.estimation.dead_reckoning.walk import SensedWalk
from vislam2tag.estimation.settings import DeadReckoningSettings

ROUND = corners((20, 0), (0, 15), (-20, 0), (0, -15))
SETTINGS = DeadReckoningSettings()


def aside(degrees: float) -> Rotation:
    """A phone that stands upright and was turned about the vertical."""
    return Rotation.from_euler("z", degrees, degrees=True) * Rotation.from_euler("x", 80, degrees=True)


def turned_by(log: InertialLog) -> float:
    walk = SensedWalk.of(log)
    assert walk is not None
    return turned_by_gait(walk.signals, walk.headings.up, walk.features)


@pytest.mark.parametrize("aside_deg", [-150, -90, 90, 120, 180])
def test_gait_tells_how_a_phone_is_turned_in_a_pocket(aside_deg: float) -> None:
    log, _ = walked(ROUND, noise=0.05, hold=aside(aside_deg))
    off = np.angle(np.exp(1j * (turned_by(log) + np.radians(aside_deg))))
    assert abs(off) < np.radians(30)


@pytest.mark.parametrize("hold", ["flat", "upright"])
def test_a_phone_in_the_hand_is_not_turned(hold: str) -> None:
    body = Rotation.from_euler("x", 80 if hold == "upright" else 10, degrees=True)
    assert turned_by(walked(ROUND, noise=0.05, hold=body)[0]) == 0


def test_the_swing_of_a_leg_tells_ahead() -> None:
    """Beside the same walk with the phone in the hand, which points ahead."""
    log, _ = walked(ROUND, noise=0.05)
    hand, thigh = SensedWalk.of(log), SensedWalk.of(on_thigh(log))
    assert hand is not None
    assert thigh is not None
    off = np.exp(1j * (thigh.headings.drift_rad + thigh.headings.turned_rad))
    off *= np.exp(-1j * (hand.headings.drift_rad + hand.headings.turned_rad))
    assert abs(np.angle(off.mean())) < np.radians(15)


def test_nothing_is_told_by_few_steps_or_none() -> None:
    log, _ = walked(corners((8, 0)), hold=aside(90))
    assert turned_by(log) == 0
    rng = np.random.default_rng(0)
    log, _ = walked(ROUND)
    assert turned_by(replace(log, force=rng.normal((0, 0, 9.81), 0.02, log.force.shape))) == 0


def test_a_round_walk_with_a_phone_in_a_pocket_is_not_turned_away() -> None:
    log, fixes = walked(ROUND, hold=aside(110), noise=0.05)
    walk = SensedWalk.of(log)
    assert walk is not None
    ends = FixLog(fixes.time_ns[[0, -1]], fixes.position_bcs[[0, -1]], ("start", "end"))
    path = walk.path(ends, speed_model(), SETTINGS)
    at_s = np.asarray((fixes.time_ns - walk.signals.start_ns) * 1e-9, dtype=np.float64)
    turned_away_m = 2 * np.hypot(20, 15) * np.sin(np.radians(110 / 2))
    assert np.linalg.norm(path.at(at_s)[0] - fixes.position_bcs, axis=1).max() < turned_away_m / 3
