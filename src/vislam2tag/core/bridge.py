"""States between nodes: what the two neighbouring nodes and the drift between them say of a frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.chain import Solution
from vislam2tag.core.drift import transitions
from vislam2tag.core.equations import Weights
from vislam2tag.core.model import LEAST_DRIFT, Model
from vislam2tag.core.noise import Source

KNOT_S = 0.25
"""States are computed this densely, at all nodes and at both ends of every jump and pause; linear between.

A pause is a step that lasts longer: interpolation goes by frame, so that its start must be a knot, too.
"""


@dataclass(frozen=True)
class Knots:
    """States (k, 4) and their covariances (k, 4, 4) at some frames (k,) of the odometry, sorted."""

    at: IntArray
    state: FloatArray
    covariance: FloatArray

    def at_frames(self, values: FloatArray, count: int) -> FloatArray:
        """Interpolate values (k, ...) of the knots linearly to all ``count`` frames."""
        frames = np.arange(count)
        flat = values.reshape(len(values), -1)
        every = np.stack([np.interp(frames, self.at, column) for column in flat.T], axis=1)
        return every.reshape(count, *values.shape[1:])


def bridged(model: Model, weights: Weights, solution: Solution) -> Knots:
    """States between the nodes of a solution (conditional Gaussian between both neighbours)."""
    nodes, at = model.walked.nodes, _knots(model)
    stretch = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, len(nodes) - 2)
    first, last = nodes[stretch], nodes[stretch + 1]
    before = _drift(model, weights, stretch, first, at)
    whole = _drift(model, weights, stretch, first, last) + LEAST_DRIFT
    onward = transitions(model.path, at, last)
    gain = before @ onward.transpose(0, 2, 1) @ np.linalg.inv(whole)
    rest = transitions(model.path, first, at) - gain @ model.carry[stretch]
    state = np.einsum("kij,kj->ki", rest, solution.state[stretch])
    state += np.einsum("kij,kj->ki", gain, solution.state[stretch + 1] + model.drifted(first, last))
    state -= model.drifted(first, at)
    mixed = rest @ solution.next_covariance[stretch] @ gain.transpose(0, 2, 1)
    covariance = (
        rest @ solution.covariance[stretch] @ rest.transpose(0, 2, 1)
        + gain @ (solution.covariance[stretch + 1] - whole) @ gain.transpose(0, 2, 1)
        + mixed
        + mixed.transpose(0, 2, 1)
        + before
    )
    return Knots(at, state, covariance)


def _knots(model: Model) -> IntArray:
    odometry = model.walked.odometry
    wanted = np.zeros(len(odometry.path), dtype=bool)
    wanted[model.walked.nodes] = True
    wanted[np.flatnonzero(np.diff(np.floor(odometry.time_s / KNOT_S)) > 0) + 1] = True
    paused = np.diff(odometry.time_s) > KNOT_S
    apart = np.flatnonzero(paused | (odometry.jump_m2 > 0) | (odometry.jump_rad2 > 0))
    wanted[apart] = wanted[apart + 1] = True
    return np.flatnonzero(wanted)


def _drift(model: Model, weights: Weights, stretch: IntArray, a: IntArray, b: IntArray) -> FloatArray:
    """Covariances (k, 4, 4) of the drift from frames ``a`` to ``b``, both within the given stretches."""
    total = np.zeros((len(a), *LEAST_DRIFT.shape))
    for source in Source:
        level = weights.noise.level(source) ** 2 * weights.stretch[source][stretch]
        total += level[:, None, None] * model.drift(source, a, b)
    return total
