"""The smoother's least-squares problem row by row from its definition (docs/explanation/smoother.md, "The model").

Drift is added up step by step and nothing of the code under test is called but the reference path and what was seen
along it: no running sums, no normal equations, no elimination.
"""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.estimation.factors import FREE_SCALE, LEAST_DRIFT, Model
from vislam2tag.estimation.landmark_priors import FREE_M, FREE_RAD, LandmarkPriors
from vislam2tag.estimation.least_squares import NormalEquations
from vislam2tag.estimation.tracker_errors import SCALE_SIGMA, DriftSource, VarianceFactors

STATES = 4
X_AND_Y = np.eye(STATES)[:, :2]


def moves_by(way: complex) -> FloatArray:
    """(2, 2) how a relative scale error and a heading error (rad) move the end of a way, metres."""
    return np.array([[way.real, -way.imag], [way.imag, way.real]])


def spread_by(way: complex) -> FloatArray:
    """(4, 2) what drifts of scale and of heading make of the state at the end of a way."""
    return np.vstack((moves_by(way), np.eye(2)))


def stretch_row(model: Model, variance_factors: VarianceFactors, k: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Carry (4, 4) of the state over a stretch, drift (4,) that the reference has there, covariance (4, 4) of all."""
    first, last = model.observations.nodes[k : k + 2]
    transition, had, covariance = np.eye(STATES), np.zeros(STATES), LEAST_DRIFT.copy()
    transition[:2, 2:] = moves_by(model.path[last] - model.path[first])
    factor = {
        source: variance_factors.noise.level(source) ** 2 * variance_factors.stretch[source][k]
        for source in DriftSource
    }
    for step in range(first, last):
        rest = spread_by(model.path[last] - model.path[step + 1])
        had += rest[:, 1] * np.angle(model.turn[step + 1] / model.turn[step])
        variance = {source: factor[source] * each[step] for source, each in model.observations.step_variance.items()}
        covariance += (variance[DriftSource.POSITION] + variance[DriftSource.JUMP]) * X_AND_Y @ X_AND_Y.T
        turned = variance[DriftSource.HEADING] + variance[DriftSource.JUMP_TURN]
        scaled = turned if model.rough else variance[DriftSource.SCALE]
        covariance += rest * (scaled, turned) @ rest.T
        doubt = model.observations.odometry.doubt[step] * model.turn[step]
        along = np.array([doubt.real, doubt.imag, 0, 0])
        anyhow = abs(doubt) ** 2 * X_AND_Y @ X_AND_Y.T
        covariance += factor[DriftSource.DOUBT] * (anyhow if model.rough else np.outer(along, along))
    return transition, had, covariance


def whitened_rows(
    model: Model, priors: LandmarkPriors, variance_factors: VarianceFactors
) -> tuple[FloatArray, FloatArray]:
    """Rows (r, u) of unit variance and their values (r,) for all states, then the landmarks' x, y, then headings."""
    nodes, marks, passes = len(model.observations.nodes), len(priors.position), model.observations.passes
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

    free = (FREE_M, FREE_M, *((FREE_SCALE, FREE_SCALE) if model.rough else (SCALE_SIGMA, FREE_RAD)))
    add({0: np.eye(STATES)}, np.zeros(STATES), np.diag(np.square(free)))
    for k in range(nodes - 1):
        transition, had, covariance = stretch_row(model, variance_factors, k)
        add({STATES * k: -transition, STATES * (k + 1): np.eye(STATES)}, -had, covariance)
    origin, sheet = dict(enumerate(priors.position)), dict(enumerate(priors.heading_rad))
    for p, (at, j) in enumerate(zip(passes.at, passes.landmark, strict=True)):
        offset = passes.offset[p] * model.turn[at]
        if np.isnan(origin[j]):
            origin[j] = model.path[at] + offset  # an unsurveyed landmark counts from where it was first seen
        miss = origin[j] - (model.path[at] + offset)
        aside_m2 = model.observations.odometry.aside_m2[at]
        variance = variance_factors.noise.sighting_m**2 * (1 + passes.distance_m[p] ** 2) / 2 + passes.spread_m[p] ** 2
        state, place = STATES * (p + 1), STATES * nodes + 2 * j
        seen = {state: np.hstack((np.eye(2), moves_by(offset))), place: -np.eye(2)}
        add(seen, np.array([miss.real, miss.imag]), (variance + aside_m2) * variance_factors.sighting[p] * np.eye(2))
        if passes.heading[p] != 0 and not model.rough:
            heading = passes.heading[p] * model.turn[at]
            if np.isnan(sheet[j]):
                sheet[j] = np.angle(heading)
            turned = {state + 3: np.eye(1), STATES * nodes + 2 * marks + j: -np.eye(1)}
            miss = np.angle(np.exp(1j * sheet[j]) / heading)
            add(turned, np.array([miss]), variance_factors.noise.sheet_rad**2 * variance_factors.sheet[p] * np.eye(1))
    for j in range(marks):
        surveyed = np.isfinite(priors.position[j])
        covariance = priors.covariance[j] * variance_factors.landmark[j] if surveyed else FREE_M**2 * np.eye(2)
        add({STATES * nodes + 2 * j: np.eye(2)}, np.zeros(2), covariance)
        sigma = priors.heading_sigma_rad[j] if np.isfinite(priors.heading_sigma_rad[j]) else FREE_RAD
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
