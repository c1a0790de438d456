"""Phones carried otherwise: what the sensors read is what such a phone would read."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from training import IN_POCKET_DEG, carried_walks, held, on_thigh, sampled, swung

from tests.estimation.dead_reckoning.walks import corners, walked
from vislam2tag.estimation.dead_reckoning.gait import speed_model
from vislam2tag.estimation.dead_reckoning.walk import SensedWalk

LOG, FIXES = walked(corners((20, 0), (0, 15), (-10, 0)))


def test_a_turned_phone_feels_the_same_force_in_the_building() -> None:
    turned = held(LOG, (100, 20, 75))
    before, after = (Rotation.from_quat(each.orientation).apply(each.force) for each in (LOG, turned))
    assert after == pytest.approx(before, abs=1e-9)
    assert np.abs(turned.force - LOG.force).max() > 5


def test_a_swinging_phone_turns_as_its_gyroscope_tells() -> None:
    swinging = swung(LOG)
    turns = Rotation.from_quat(LOG.orientation).inv() * Rotation.from_quat(swinging.orientation)
    step_s = np.diff(LOG.rate_ns) * 1e-9
    told = (swinging.rate - turns.inv().apply(LOG.rate))[:-1, 0] * step_s
    felt = turns.as_rotvec()[:, 0]
    assert np.cumsum(told) == pytest.approx(felt[1:] - felt[0], abs=0.08)
    assert felt.max() == pytest.approx(np.radians(25), abs=0.01)


def test_a_phone_on_a_thigh_swings_once_in_two_steps_as_its_gyroscope_tells() -> None:
    turned, swinging = held(LOG, IN_POCKET_DEG), on_thigh(LOG)
    axis = Rotation.from_euler("zyx", IN_POCKET_DEG, degrees=True).inv().apply((1.0, 0.0, 0.0))
    felt = (Rotation.from_quat(turned.orientation).inv() * Rotation.from_quat(swinging.orientation)).as_rotvec() @ axis
    assert np.radians(20) < np.ptp(felt[200:-200]) / 2 < np.radians(30)
    spectrum = np.abs(np.fft.rfft(felt[200:-200] - felt[200:-200].mean()))
    strongest_hz = spectrum.argmax() / (len(felt[200:-200]) / 50)
    assert strongest_hz == pytest.approx(1.8 / 2, abs=0.05)
    told = np.cumsum((swinging.rate - turned.rate) @ axis) / 50
    assert np.corrcoef(np.diff(told), np.diff(felt))[0, 1] > 0.9


def test_speed_is_told_alike_in_a_quiet_and_a_swinging_hand_at_any_rate() -> None:
    speeds = []
    for log in (LOG, swung(LOG), sampled(LOG, 3, 0.1)):
        sensed = SensedWalk.of(log)
        assert sensed is not None
        speeds.append(np.median(speed_model().speed_m_s(sensed.features, sensed.signals.time_s)))
    assert np.ptp(speeds) < 0.25


def test_walks_to_learn_from_are_doubled_and_those_without_taps_left_out() -> None:
    none = FIXES.__class__(FIXES.time_ns[:1], FIXES.position_bcs[:1], FIXES.name[:1])
    assert len(carried_walks([(LOG, FIXES), (LOG, none)])) == 2
