"""The smoother's least-squares problem written out row by row, without normal equations or elimination."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.smoother.chain import NormalEquations
from vislam2tag.smoother.drift import STATES
from vislam2tag.smoother.equations import (
    Weights,
    heading_residual,
    landmark_precision,
    position_residual,
    sighting_variance,
    start_precision,
    stretch_drift,
)
from vislam2tag.smoother.landmark_priors import KnownLandmarks
from vislam2tag.smoother.model import Model


def whitened_rows(model: Model, known: KnownLandmarks, weights: Weights) -> tuple[FloatArray, FloatArray]:
    """Rows (r, u) of unit variance and their values (r,) for all states, then the landmarks' x, y, then headings."""
    nodes, marks, passes = len(model.walked.nodes), len(known.position), model.walked.passes
    unknowns = STATES * nodes + 3 * marks
    rows: list[FloatArray] = []
    values: list[float] = []

    def add(parts: dict[int, FloatArray], value: FloatArray, covariance: FloatArray) -> None:
        block = np.zeros((len(value), unknowns))
        for column, part in parts.items():
            block[:, column : column + part.shape[1]] = part
        root = np.linalg.inv(np.linalg.cholesky(covariance))
        rows.extend(root @ block)
        values.extend(root @ value)

    add({0: np.eye(STATES)}, np.zeros(STATES), np.asarray(np.linalg.inv(start_precision(model, pinned=False))))
    drift = stretch_drift(model, weights)
    for k in range(nodes - 1):
        parts = {STATES * k: -model.carry[k], STATES * (k + 1): np.eye(STATES)}
        had = model.drifted(model.walked.nodes[k : k + 1], model.walked.nodes[k + 1 : k + 2])[0]
        add(parts, -had, drift[k])
    variance = sighting_variance(model, weights.noise) * weights.sighting
    miss, turn = position_residual(model, known), heading_residual(model, known)
    for p, landmark in enumerate(passes.landmark.tolist()):
        at, place = STATES * (p + 1), STATES * nodes + 2 * landmark
        add({at: model.sight[p], place: -np.eye(2)}, miss[p], variance[p] * np.eye(2))
        if model.headed[p]:
            sheet = STATES * nodes + 2 * marks + landmark
            sigma = weights.noise.sheet_rad**2 * weights.sheet[p] * np.eye(1)
            add({at + 3: np.eye(1), sheet: -np.eye(1)}, turn[p : p + 1], sigma)
    for j, precision in enumerate(landmark_precision(known, weights)):
        add({STATES * nodes + 2 * j: np.eye(2)}, np.zeros(2), np.linalg.inv(precision))
        sigma = known.heading_sigma_rad[j] if np.isfinite(known.heading_sigma_rad[j]) else 10.0
        add({STATES * nodes + 2 * marks + j: np.eye(1)}, np.zeros(1), sigma**2 * np.eye(1))
    return np.array(rows), np.array(values)


def as_matrix(equations: NormalEquations) -> tuple[FloatArray, FloatArray]:
    """Normal equations as one matrix (u, u) and one right side (u,)."""
    states, size, border = equations.border.shape
    rest = states * size
    matrix = np.zeros((rest + border, rest + border))
    for k in range(states):
        a = slice(k * size, (k + 1) * size)
        matrix[a, a] = equations.diagonal[k]
        matrix[a, rest:] = equations.border[k]
        matrix[rest:, a] = equations.border[k].T
        if k + 1 < states:
            b = slice((k + 1) * size, (k + 2) * size)
            matrix[a, b], matrix[b, a] = equations.upper[k], equations.upper[k].T
    matrix[rest:, rest:] = equations.corner
    return matrix, np.concatenate((equations.right.ravel(), equations.corner_right))
