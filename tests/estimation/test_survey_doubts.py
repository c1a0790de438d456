"""Labels beside a survey that the walk does not fit are known less well, by as much as it is missed by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.drifting import loops
from tests.estimation.test_smoothing import TYPICAL, solved
from vislam2tag.core.arrays import FloatArray
from vislam2tag.estimation.equations import position_residual
from vislam2tag.estimation.smoothing import Smoothed
from vislam2tag.estimation.survey_doubts import beside_the_survey

LANDMARK = 3


def walked(laps: int) -> Smoothed:
    """A walk that passes each landmark once a lap, all observations taken for usual."""
    smoothed = solved(loops(3, TYPICAL, marks=8, laps=laps, survey_m=0.02))
    even = (np.ones_like(part) for part in (smoothed.weights.sighting, smoothed.weights.landmark))
    return replace(smoothed, weights=replace(smoothed.weights, sighting=next(even), landmark=next(even)))


def beside(smoothed: Smoothed) -> FloatArray:
    """(k, 2, 2) at the passes of the landmark, m^2."""
    whole = beside_the_survey(smoothed.model, smoothed.priors, smoothed.weights, smoothed.solution)
    passes = smoothed.model.observations.passes
    return np.asarray(whole[passes.at[passes.landmark == LANDMARK]])


@pytest.mark.parametrize(
    ("passes", "refused", "doubtful"), [(1, 1, False), (2, 1, False), (2, 2, True), (4, 2, False), (4, 3, True)]
)
def test_two_refused_passes_and_most_of_all_make_a_place_doubtful(passes: int, refused: int, doubtful: bool) -> None:
    smoothed = walked(passes)
    own = np.flatnonzero(smoothed.model.observations.passes.landmark == LANDMARK)
    assert len(own) == passes
    smoothed.weights.sighting[own[:refused]] = 10.0
    wider = np.trace(beside(smoothed), axis1=1, axis2=2) > 0
    assert wider.tolist() == [doubtful] * refused + [False] * (passes - refused)


@pytest.mark.parametrize(("less_certain", "share"), [(1.9, 0.0), (4.0, 0.5), (20.0, 0.9)])
def test_what_a_doubtful_place_is_missed_by_counts_as_far_as_that_is_unusual(less_certain: float, share: float) -> None:
    smoothed = walked(1)
    smoothed.weights.landmark[LANDMARK] = less_certain
    (at,) = np.flatnonzero(smoothed.model.observations.passes.landmark == LANDMARK)
    model, state = smoothed.model, smoothed.solution.state[1:-1]
    miss = position_residual(model, smoothed.priors)[at] - model.sight[at] @ state[at]
    assert np.hypot(*miss) > 0.001
    np.testing.assert_allclose(beside(smoothed), share * np.outer(miss, miss)[None], atol=1e-12)
