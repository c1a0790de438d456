"""Landmarks that contradict the rest: wrongly surveyed, moved since, or hung up with another's id.

The smoother's heavy tails keep such a landmark from bending the walk; here it is named. Each landmark in turn is taken
for unsurveyed, so that the others alone say where it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.faults import Contradiction
from vislam2tag.core.similarity import as_points
from vislam2tag.estimation.chain import solve
from vislam2tag.estimation.equations import normal_equations
from vislam2tag.estimation.noise import DOUBTED
from vislam2tag.estimation.smoothing import Smoothed

CERTAIN_SIGMAS = 5.0
"""A landmark contradicts the rest where they put it this many standard deviations from its surveyed place ..."""
LEAST_M = 0.15
"""... and at least this far."""
FEWEST_OTHERS = 2
"""So many other surveyed landmarks must have been passed to say so."""


def contradictions(smoothed: Smoothed) -> tuple[Contradiction, ...]:
    """Name the landmarks that contradict all others, greatest contradiction first."""
    passed = np.intersect1d(np.flatnonzero(smoothed.priors.surveyed), smoothed.model.observations.passes.landmark)
    if len(passed) <= FEWEST_OTHERS:
        return ()
    doubt = smoothed.weights.landmark.copy()
    np.maximum.at(doubt, smoothed.model.observations.passes.landmark, smoothed.weights.sighting)
    suspects = passed[doubt[passed] > DOUBTED]  # none of the others can contradict the rest
    found = [one for landmark in suspects.tolist() if (one := _contradiction(smoothed, landmark)) is not None]
    return tuple(sorted(found, key=lambda one: -one.size_m))


def predicted(smoothed: Smoothed, landmark: int) -> Smoothed:
    """Solve again with one landmark taken for unsurveyed, its best pass taken for a usual one."""
    own = smoothed.model.observations.passes.landmark == landmark
    sighting = smoothed.weights.sighting.copy()
    sighting[own] /= sighting[own].min()
    priors, weights = smoothed.priors.without(landmark), replace(smoothed.weights, sighting=sighting)
    solution = solve(normal_equations(smoothed.model, priors, weights, pinned=False))
    return Smoothed(smoothed.model, priors, weights, solution)


def discrepancy(smoothed: Smoothed, trial: Smoothed, landmark: int) -> tuple[FloatArray, FloatArray]:
    """Offset (2,) from a landmark's surveyed place to where the trial puts it, metres, and its covariance (2, 2)."""
    priors = smoothed.priors
    offset = as_points(trial.landmark_position[landmark] - priors.position[landmark])
    return offset, trial.landmark_covariance()[landmark] + priors.covariance[landmark]


def _contradiction(smoothed: Smoothed, landmark: int) -> Contradiction | None:
    offset, covariance = discrepancy(smoothed, predicted(smoothed, landmark), landmark)
    size_m = float(np.hypot(*offset))
    sigmas = float(np.sqrt(offset @ np.linalg.solve(covariance, offset)))
    if sigmas < CERTAIN_SIGMAS or size_m < LEAST_M:
        return None
    return Contradiction(
        landmark=smoothed.model.observations.ids[landmark],
        size_m=size_m,
        sigma_m=size_m / sigmas,
        offset_bcs_m=(float(offset[0]), float(offset[1])),
        passes=int(np.sum(smoothed.model.observations.passes.landmark == landmark)),
    )
