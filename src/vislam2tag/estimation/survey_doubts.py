"""Labels beside a survey that the walk does not fit.

A surveyed place that does not fit may be wrong alone, or with all that was surveyed near it, where parts of a survey do
not fit together. A walk cannot tell, so that labels around it may be as far off as it is.
"""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.estimation.chain import Solution
from vislam2tag.estimation.equations import Weights, position_residual
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.model import Model
from vislam2tag.estimation.noise import DOUBTED

FEWEST_REFUSED = 2
"""One pass alone may be a bad sighting."""


def beside_the_survey(model: Model, priors: LandmarkPriors, weights: Weights, solution: Solution) -> FloatArray:
    """Mean squares (n, 2, 2) of how far labels may lie beside what was surveyed around them, m^2.

    At a pass of a doubtful place what the walk misses it by, as far as that is unusual; linear between passes.
    """
    passes = model.observations.passes
    miss = position_residual(model, priors) - np.einsum("pij,pj->pi", model.sight, solution.state[1:-1])
    sighted = np.where(_refused(priors, weights, passes.landmark)[passes.landmark], weights.sighting, 0)
    surveyed = passes.landmark < len(priors.landmarks.position)  # others' tales of the camera are no survey
    unusual = 1 - DOUBTED / np.maximum(np.maximum(weights.landmark[passes.landmark], sighted), DOUBTED)
    square = unusual[:, None, None] * miss[:, :, None] * miss[:, None, :]
    frames = np.arange(len(model.path))
    if not surveyed.any():
        return np.zeros((len(frames), 2, 2))
    every = [np.interp(frames, passes.at[surveyed], column[surveyed]) for column in square.reshape(-1, 4).T]
    return np.stack(every, axis=1).reshape(-1, 2, 2)


def _refused(priors: LandmarkPriors, weights: Weights, landmark: IntArray) -> BoolArray:
    """(m,) surveyed landmarks most of whose passes, of these landmarks (p,), are taken for bad."""
    count = np.bincount(landmark, minlength=len(priors.position))
    refused = np.bincount(landmark[weights.sighting > DOUBTED], minlength=len(priors.position))
    return np.asarray(priors.surveyed & (refused >= FEWEST_REFUSED) & (2 * refused > count))
