"""States of frames between nodes, from the two neighbouring nodes and the drift between them.

A surveyed place that does not fit the walk may be the only wrong one, or a whole part of the survey may be wrong. A
walk cannot distinguish these cases, so labels around such a place may have errors of the same size.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.estimation.factors import LEAST_DRIFT, LinearWalk, Model
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.least_squares import Solution
from vislam2tag.estimation.tracker_errors import DOUBTED, STATES, DriftSource, VarianceFactors, transitions

KNOT_S = 0.25
"""Interval of the computed states, which are also at all nodes and at both ends of every jump, slip and pause; linear
in between.

A pause is a step that lasts longer. Interpolation is by frame, so its start must also be a knot.
"""


@dataclass(frozen=True)
class FrameStates:
    """States (k, 4) at some frames (k,) of the odometry, sorted, and the parts of their covariances.

    Each knot is on a ``stretch`` (k,) between two nodes. Its state is ``rest`` (k, 4, 4) times that of the node before,
    plus ``gain`` (k, 4, 4) times that of the node after. ``drift`` (k, 4, 4) is from the node before to the knot,
    ``whole`` (p + 1, 4, 4) over each stretch.
    """

    at: IntArray
    state: FloatArray
    solution: Solution
    stretch: IntArray
    rest: FloatArray
    gain: FloatArray
    drift: FloatArray
    whole: FloatArray

    def covariance(self, states: int = STATES) -> FloatArray:
        """(k, s, s) covariance of the first ``states`` numbers of :attr:`state`, all 4 or the position's 2."""
        solution, stretch = self.solution, self.stretch
        rest, gain = self.rest[:, :states], self.gain[:, :states]
        gained = gain.transpose(0, 2, 1)
        mixed = rest @ solution.next_covariance[stretch] @ gained
        return np.asarray(
            rest @ solution.covariance[stretch] @ rest.transpose(0, 2, 1)
            + gain @ (solution.covariance[1:] - self.whole)[stretch] @ gained
            + mixed
            + mixed.transpose(0, 2, 1)
            + self.drift[:, :states, :states]
        )

    def at_frames(self, values: FloatArray, count: int) -> FloatArray:
        """Interpolate values (k, ...) of the knots linearly to all ``count`` frames."""
        frames = np.arange(count)
        flat = values.reshape(len(values), -1)
        every = np.stack([np.interp(frames, self.at, column) for column in flat.T], axis=1)
        return every.reshape(count, *values.shape[1:])


def states_between_nodes(walk: LinearWalk, solution: Solution, knot_s: float = KNOT_S) -> FrameStates:
    """States between the nodes of a solution (conditional Gaussian between both neighbours), every ``knot_s``."""
    model = walk.model
    nodes, at = model.observations.nodes, _knots(model, knot_s)
    stretch = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, len(nodes) - 2)
    first, last = nodes[stretch], nodes[stretch + 1]
    drift = _drift_covariance(model, walk.variance_factors, stretch, first, at)
    onward = transitions(model.path, at, last)
    gain = drift @ onward.transpose(0, 2, 1) @ walk.drift_factor.precision[stretch]
    rest = transitions(model.path, first, at) - gain @ walk.drift_factor.transition[stretch]
    after = solution.state[1:] + walk.drift_factor.reference_drift
    state = np.einsum("kij,kj->ki", rest, solution.state[stretch]) - model.reference_drift(first, at)
    state += np.einsum("kij,kj->ki", gain, after[stretch])
    return FrameStates(at, state, solution, stretch, rest, gain, drift, walk.drift_factor.covariance)


def _knots(model: Model, knot_s: float) -> IntArray:
    """Frames (k,) at which states are computed, by index into the odometry's, sorted."""
    odometry = model.observations.odometry
    wanted = np.zeros(len(odometry.path), dtype=bool)
    wanted[model.observations.nodes] = True
    wanted[np.flatnonzero(np.diff(np.floor(odometry.time_s / knot_s)) > 0) + 1] = True
    paused = np.diff(odometry.time_s) > knot_s
    apart = np.flatnonzero(paused | (odometry.jump_m2 > 0) | (odometry.jump_rad2 > 0) | (odometry.doubt != 0))
    wanted[apart] = wanted[apart + 1] = True
    return np.flatnonzero(wanted)


def _drift_covariance(
    model: Model, variance_factors: VarianceFactors, stretch: IntArray, a: IntArray, b: IntArray
) -> FloatArray:
    """Covariances (k, 4, 4) of the drift from frames ``a`` to ``b``, both within the given stretches."""
    total = np.zeros((len(a), *LEAST_DRIFT.shape))
    for source in (source for source in DriftSource if model.sums[source]):
        level = variance_factors.noise.level(source) ** 2 * variance_factors.stretch[source][stretch]
        total += level[:, None, None] * model.drift_covariance(source, a, b)
    return total


@dataclass(frozen=True)
class ExposureInterpolation:
    """For each of ``n`` frames the two frames exposed just before and after its stamp: ``first`` (n,) and the next one,
    and the position between them as ``share`` (n,), 0 to 1.
    """

    first: IntArray
    share: FloatArray

    @classmethod
    def of(cls, time_s: FloatArray, lag_s: float) -> ExposureInterpolation:
        """Compute them for stamps ``time_s`` (n,), increasing, n at least 2, each ``lag_s`` later than the exposure.

        After the last exposure (and before the first) the pose is constant.
        """
        wanted = time_s + lag_s
        first = np.clip(np.searchsorted(time_s, wanted, side="right") - 1, 0, len(time_s) - 2)
        share = (wanted - time_s[first]) / (time_s[first + 1] - time_s[first])
        return cls(first, share.clip(0, 1))

    def blend(self, values: FloatArray) -> FloatArray:
        """Interpolate values (n, ...) of the exposures; if one of them is NaN, the frame keeps its own."""
        share = self.share.reshape(-1, *(1 for _ in values.shape[1:]))
        start = values[self.first]
        blended = start + share * (values[self.first + 1] - start)
        return np.asarray(np.where(np.isnan(blended + values), values, blended))

    def blend_quaternions(self, values: FloatArray) -> FloatArray:
        """Interpolate unit quaternions (n, 4) of neighbouring, hence similar, orientations; ``w >= 0``."""
        start, end = values[self.first], values[self.first + 1]
        end = np.where(np.sum(start * end, axis=1, keepdims=True) < 0, -end, end)
        mixed = start + self.share[:, None] * (end - start)
        mixed /= np.linalg.norm(mixed, axis=1, keepdims=True)
        return np.asarray(np.where(mixed[:, 3:] < 0, -mixed, mixed))


FEWEST_REFUSED = 2
"""A single pass may be a bad sighting."""


def beside_the_survey(walk: LinearWalk, solution: Solution) -> FloatArray:
    """Mean squares (n, 2, 2) of possible label errors near places where the survey is inconsistent, m^2.

    At a pass of a doubtful place it is the unusual part of the walk's misfit; linear between passes.
    """
    passes, priors, variance_factors = walk.model.observations.passes, walk.priors, walk.variance_factors
    sightings = walk.sightings
    miss = sightings.residual - np.einsum("pij,pj->pi", sightings.jacobian, solution.state[1:-1])
    sighted = np.where(
        _refused(priors, variance_factors, passes.landmark)[passes.landmark], variance_factors.sighting, 0
    )
    surveyed = passes.landmark < len(priors.landmarks.position)  # places of the camera are not surveyed
    unusual = 1 - DOUBTED / np.maximum(np.maximum(variance_factors.landmark[passes.landmark], sighted), DOUBTED)
    square = unusual[:, None, None] * miss[:, :, None] * miss[:, None, :]
    frames = np.arange(len(walk.model.path))
    if not surveyed.any():
        return np.zeros((len(frames), 2, 2))
    every = [np.interp(frames, passes.at[surveyed], column[surveyed]) for column in square.reshape(-1, 4).T]
    return np.stack(every, axis=1).reshape(-1, 2, 2)


def _refused(priors: LandmarkPriors, variance_factors: VarianceFactors, landmark: IntArray) -> BoolArray:
    """(m,) surveyed landmarks with most of their passes, of these landmarks (p,), treated as bad."""
    count = np.bincount(landmark, minlength=len(priors.position))
    refused = np.bincount(landmark[variance_factors.sighting > DOUBTED], minlength=len(priors.position))
    return np.asarray(priors.surveyed & (refused >= FEWEST_REFUSED) & (2 * refused > count))
