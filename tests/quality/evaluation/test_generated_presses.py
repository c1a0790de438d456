"""Identities and leads on generated walks, whose presses are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.quality.evaluation.maps import floor_with, trajectory_of
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import Trajectory
from vislam2tag.labeling.results import ErrorRecord
from vislam2tag.labeling.settings import TruthSettings
from vislam2tag.quality.evaluation.press_truth import nearest_point_errors, press_errors, press_truth
from vislam2tag.quality.evaluation.reliability import Verdict, reduce_errors, reliability_curve, verdict
from vislam2tag.quality.evaluation.truth import Truth, residuals_at_presses, residuals_at_truth
from vislam2tag.simulation.model import TrueWalk
from vislam2tag.simulation.phones import PressTiming, simulate_presses
from vislam2tag.simulation.scenario import paper_evaluation
from vislam2tag.simulation.survey import walk_and_track

HAND = PressTiming(lead_s=0.3, scatter_s=0.3)


@pytest.fixture(scope="module")
def walk() -> TrueWalk:
    """The walk of fifteen minutes."""
    scenario = paper_evaluation(3)
    return walk_and_track(scenario, scenario.sessions[0])[0]


@pytest.fixture(scope="module")
def points() -> FloatArray:
    return paper_evaluation(3).building.floor(1).control_points


def labels(walk: TrueWalk, shift: tuple[float, float] = (0.0, 0.0)) -> Trajectory:
    return trajectory_of(walk.time_ns[::7], walk.position[::7, :2] + shift)


def test_presses_are_told_from_good_labels(walk: TrueWalk, points: FloatArray) -> None:
    presses_ns = simulate_presses(walk, HAND, np.random.default_rng(1))
    truth = press_truth(labels(walk), presses_ns, floor_with(points))
    assert truth.point.tolist() == walk.pressed_point.tolist()
    assert truth.lead.lead_s == pytest.approx(-HAND.lead_s, abs=4 * truth.lead.sigma_s)
    with_lead = press_errors(labels(walk), truth).error_m
    assert press_errors(labels(walk), truth, without_lead=True).error_m.mean() < with_lead.mean()


@pytest.mark.parametrize("shift", [(4.5, 0.0), (0.0, -4.5), (5.0, 5.0)])
def test_labels_aside_of_the_truth_do_not_deceive(
    walk: TrueWalk, points: FloatArray, shift: tuple[float, float]
) -> None:
    presses_ns = simulate_presses(walk, replace(HAND, lead_s=0.0), np.random.default_rng(2))
    aside = labels(walk, shift)
    truth = press_truth(aside, presses_ns, floor_with(points))
    clear = truth.identified
    assert (truth.point == walk.pressed_point)[clear].all()
    assert clear.mean() > 0.9
    assert press_errors(aside, truth).error_m.mean() == pytest.approx(np.hypot(*shift), abs=0.1)
    assert nearest_point_errors(aside, presses_ns, floor_with(points)).error_m.mean() < 0.97 * np.hypot(*shift)


def labels_as_stated(walk: TrueWalk, sigma_m: float, rng: np.random.Generator) -> Trajectory:
    """Labels whose errors are drawn from just what they state."""
    place = walk.position[::7, :2] + sigma_m * rng.normal(size=(len(walk.position[::7]), 2))
    found = trajectory_of(walk.time_ns[::7], place)
    return replace(found, covariance_bcs=np.broadcast_to(sigma_m**2 * np.eye(2), found.covariance_bcs.shape))


def test_nobody_is_told_a_wrong_verdict_by_presses_of_a_hand(walk: TrueWalk, points: FloatArray) -> None:
    """Presses taken for exact make true uncertainty look too sure; with their own error they say nothing of it."""
    rng = np.random.default_rng(7)
    sure = labels_as_stated(walk, 0.1, rng)
    presses_ns = simulate_presses(walk, HAND, rng)

    def of_many_walks(record: ErrorRecord) -> ErrorRecord:
        return record.model_copy(update={"sources": dict.fromkeys(record.sources, 80)})

    exact = residuals_at_presses(sure, presses_ns, points, TruthSettings(press_sigma_s=0, press_sigma_m=0))
    by_hand = residuals_at_presses(sure, presses_ns, points)
    dense = residuals_at_truth(sure, Truth(walk.time_ns[::7], walk.position[::7, :2]))
    told = [
        of_many_walks(reduce_errors("", one.error_m, one.covariance_m2, one.truth_covariance_m2))
        for one in (exact, by_hand, dense)
    ]
    assert [verdict(record) for record in told] == [Verdict.TOO_SURE, None, Verdict.ABOUT_TRUE]
    assert [reliability_curve(record) is None for record in told] == [False, True, False]
