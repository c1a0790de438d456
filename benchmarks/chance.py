"""What walks that are told more must be expected to lose by chance, were all that is stated true (Hausman 1978).

The error of the best estimate from all that is known does not correlate with what an estimate from a part of it lacks:
``alone = together + difference``, with covariances that add up. So some walks are luckier alone, whoever estimates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from data_sets import Walk

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import Landmarks
from vislam2tag.dead_reckoning.bridging import bridged_observations
from vislam2tag.smoother.chain import NormalEquations
from vislam2tag.smoother.equations import normal_equations
from vislam2tag.smoother.landmark_priors import LandmarkPriors
from vislam2tag.smoother.smoothing import smooth

DRAWS = 500
FRAMES = 200
"""Of a walk, evenly spread in time; errors between nodes are taken as on the line between these."""


def losses(walk: Walk, alone: Landmarks, told: Landmarks, range_m: float, draw: np.random.Generator) -> FloatArray:
    """(:data:`DRAWS`,) metres by which the walk's mean error grows if it is ``told`` more than ``alone``; drawn.

    Noise is the one found together. Raises ValueError for a walk that what it is told does not tie to the building.
    """
    observations = bridged_observations(walk.camera, walk.log, range_m)
    priors = [LandmarkPriors.of(walk.log.ids, known) for known in (told, alone)]
    smoothed = smooth(observations, priors[0])
    if smoothed is None:
        raise ValueError("nothing ties the walk to the building")
    weights = smoothed.weights
    even = replace(weights, landmark=np.ones_like(weights.landmark))
    best, part = (
        node_covariance(normal_equations(smoothed.model, known, trust, pinned=False))
        for known, trust in zip(priors, (weights, even), strict=True)
    )
    error = drawn(best, draw)
    time_s = observations.odometry.time_s
    at_s, nodes_s = np.linspace(0, time_s[-1], FRAMES), time_s[observations.nodes]
    together_m, alone_m = (mean_error_m(one, nodes_s, at_s) for one in (error, error + drawn(part - best, draw)))
    return together_m - alone_m


def node_covariance(equations: NormalEquations) -> FloatArray:
    """(2k, 2k) of x and y of all nodes, m^2, by inverting all of the equations at once."""
    count, size, border = equations.border.shape
    whole = np.zeros((count * size + border,) * 2)
    chain = np.arange(count * size).reshape(count, size)
    whole[chain[:-1, :, None], chain[1:, None, :]] = equations.upper
    whole[: count * size, count * size :] = equations.border.reshape(-1, border)
    whole += whole.T
    whole[chain[:, :, None], chain[:, None, :]] = equations.diagonal
    whole[count * size :, count * size :] = equations.corner
    places = chain[:, :2].ravel()
    return np.asarray(np.linalg.inv(whole)[np.ix_(places, places)])


def drawn(covariance: FloatArray, draw: np.random.Generator) -> FloatArray:
    """(:data:`DRAWS`, 2k) normal errors; directions that vary by less than nothing do not vary."""
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    return np.asarray(draw.normal(size=(DRAWS, len(values))) * np.sqrt(np.maximum(values, 0)) @ vectors.T)


def mean_error_m(error: FloatArray, nodes_s: FloatArray, at_s: FloatArray) -> FloatArray:
    """(d,) mean error over times (t,) of errors (d, 2k) at the nodes' times (k,), metres and seconds."""
    place = error[:, ::2] + 1j * error[:, 1::2]
    return np.array([np.abs(np.interp(at_s, nodes_s, one)).mean() for one in place])


def greatest(found: Sequence[FloatArray]) -> str:
    """The greatest loss among walks, metres: on average over the draws of each (d,), and what 95 % stay below."""
    most = np.max(found, axis=0)
    return f"{most.mean():.3f} ({np.quantile(most, 0.95):.3f}) m"
