"""What must be lost by chance: the covariance that it is drawn from is the smoother's."""

from __future__ import annotations

import numpy as np
import pytest
from chance import DRAWS, drawn, mean_error_m, node_covariance

from tests.drifting import loops
from tests.smoother.test_equations import linearised
from vislam2tag.smoother.chain import solve
from vislam2tag.smoother.equations import Weights, normal_equations
from vislam2tag.smoother.landmark_priors import LandmarkPriors
from vislam2tag.smoother.noise import USUAL


def test_node_covariance_is_the_smoother_s() -> None:
    walk = loops(3, marks=5, laps=1)
    model = linearised(walk)
    priors = LandmarkPriors.of(walk.ids, walk.landmarks())
    weights = Weights.even(USUAL, len(model.observations.passes.at), len(walk.ids))
    equations = normal_equations(model, priors, weights, pinned=False)
    found = node_covariance(equations)
    chain = solve(equations).covariance[:, :2, :2]
    own = [found[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] for i in range(len(chain))]
    assert np.allclose(own, chain, rtol=1e-6)


def test_errors_are_drawn_as_they_covary_and_measured_along_the_walk() -> None:
    shared = np.zeros((6, 6))
    shared[::2, ::2] = 1
    errors = drawn(shared, np.random.default_rng(1))
    assert errors.shape == (DRAWS, 6)
    assert errors[:, 0] == pytest.approx(errors[:, 4])
    assert np.std(errors[:, 0]) == pytest.approx(1, abs=0.1)
    rising = np.array([[0.0, 0.0, 1.0, 0.0]])
    assert mean_error_m(rising, np.array([0.0, 10.0]), np.linspace(0, 10, 11)) == pytest.approx(0.5)
