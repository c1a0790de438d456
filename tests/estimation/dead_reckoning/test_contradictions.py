"""Fixes that cannot be right together contradict each other; true ones never do, however few."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.estimation.dead_reckoning.walks import simulated, true_fixes
from vislam2tag.core.context import FixLog, InertialLog
from vislam2tag.estimation.dead_reckoning.gait import speed_model
from vislam2tag.estimation.dead_reckoning.walk import SensedWalk, contradictions_m
from vislam2tag.estimation.settings import DeadReckoningSettings


def contradicting_m(log: InertialLog, fixes: FixLog) -> float:
    sensed = SensedWalk.of(log)
    assert sensed is not None
    return float(contradictions_m(sensed.path(fixes, speed_model(), DeadReckoningSettings())).max())


@pytest.mark.parametrize("count", [2, 3, 5, 9])
@pytest.mark.parametrize("seed", range(3))
def test_true_fixes_agree(seed: int, count: int) -> None:
    log, time_ns, place = simulated(seed, 120.0)
    assert contradicting_m(log, true_fixes(time_ns, place, count)) == 0


def test_fixes_in_the_wrong_order_contradict_each_other() -> None:
    log, time_ns, place = simulated(1, 120.0)
    fixes = true_fixes(time_ns, place, 7)
    assert contradicting_m(log, replace(fixes, position_bcs=fixes.position_bcs[[3, 0, 5, 1, 6, 2, 4]])) > 5


def test_two_fixes_farther_apart_than_the_steps_lead_contradict_each_other() -> None:
    log, time_ns, place = simulated(1, 120.0)
    fixes = true_fixes(time_ns, place, 2)
    far = fixes.position_bcs + np.array(((0.0, 0.0), (400.0, 0.0)))
    assert contradicting_m(log, replace(fixes, position_bcs=far)) > 50
