"""From model, survey and weights to normal equations."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray, joint_columns
from vislam2tag.core.context import TrackerNoise
from vislam2tag.core.orientation import wrapped
from vislam2tag.estimation.chain import NormalEquations
from vislam2tag.estimation.drift import STATES
from vislam2tag.estimation.landmark_priors import LandmarkPriors, ToldPlaces
from vislam2tag.estimation.model import LEAST_DRIFT, Model
from vislam2tag.estimation.noise import SCALE_SIGMA, DriftSource, NoiseLevels

FREE_M, FREE_RAD, FREE_SCALE = 1e5, 10.0, 30.0
"""Standard deviations of what is not known at all."""
PINNED_M, PINNED_RAD = 1e-4, 1e-5
"""The start of a map in its own frame: small beside what a pass tells, great beside what numbers lose."""


@dataclass(frozen=True, eq=False)
class Weights:
    """What the observations are worth: the noise, and by which factor each one's variance exceeds it (Student's t).

    Compared by identity.

    ``stretch`` (p + 1,) for each source, ``sighting`` (p,), ``sheet`` (p,), ``landmark`` (m,).
    """

    noise: NoiseLevels
    stretch: dict[DriftSource, FloatArray]
    sighting: FloatArray
    sheet: FloatArray
    landmark: FloatArray
    told: TrackerNoise | None = None
    """How noisy the tracker is before anything is seen of the walk, as others tell."""

    @classmethod
    def even(cls, noise: NoiseLevels, passes: int, landmarks: int, told: TrackerNoise | None = None) -> Weights:
        """Trust everything alike."""
        return cls(
            noise,
            {source: np.ones(passes + 1) for source in DriftSource},
            np.ones(passes),
            np.ones(passes),
            np.ones(landmarks),
            told,
        )


def stretch_scale(weights: Weights) -> FloatArray:
    """(s, p + 1) by how much the variance of each source's drift over each stretch exceeds that at unit level."""
    return np.stack([weights.noise.level(source) ** 2 * weights.stretch[source] for source in DriftSource])


@lru_cache(maxsize=1)
def stretch_drift(model: Model, weights: Weights) -> FloatArray:
    """Covariances (p + 1, 4, 4) of all drift between neighbouring nodes; the latest weights' are kept."""
    return np.asarray(np.einsum("sk,skij->kij", stretch_scale(weights), model.units) + LEAST_DRIFT)


@lru_cache(maxsize=1)
def stretch_precision(model: Model, weights: Weights) -> FloatArray:
    """Precisions (p + 1, 4, 4) of :func:`stretch_drift`; the latest weights' are kept."""
    return np.asarray(np.linalg.inv(stretch_drift(model, weights)))


def sighting_variance(model: Model, noise: NoiseLevels) -> FloatArray:
    """Usual variances (p,) per axis of where a pass puts its landmark, m^2: they grow with distance and scatter."""
    passes = model.observations.passes
    aside_m2 = model.observations.odometry.aside_m2[passes.at]
    return noise.sighting_m**2 * (1 + passes.distance_m**2) / 2 + passes.spread_m**2 + aside_m2


def start_precision(model: Model, *, pinned: bool) -> FloatArray:
    """Precision (4, 4) of the first state: free, or ``pinned`` to the reference for a map in its own frame."""
    metres, rad = (PINNED_M, PINNED_RAD) if pinned else (FREE_M, FREE_RAD)
    if model.rough:
        return np.diag([metres**-2, metres**-2, FREE_SCALE**-2, FREE_SCALE**-2])
    return np.diag([metres**-2, metres**-2, SCALE_SIGMA**-2, rad**-2])


def landmark_precision(priors: LandmarkPriors, weights: Weights) -> FloatArray:
    """Precisions (m, 2, 2) of the surveyed positions; next to nothing for the others."""
    precision = np.tile(np.eye(2) * FREE_M**-2, (len(priors.position), 1, 1))
    surveyed = priors.surveyed
    precision[surveyed] = np.linalg.inv(priors.covariance[surveyed] * weights.landmark[surveyed, None, None])
    return precision


def position_residual(model: Model, priors: LandmarkPriors) -> FloatArray:
    """(p, 2) from where the reference puts each pass's landmark to its surveyed (or first seen) position, metres."""
    landmark = model.observations.passes.landmark
    miss = landmark_origin(model, priors)[landmark] - model.seen_at
    return np.column_stack((miss.real, miss.imag))


def landmark_origin(model: Model, priors: LandmarkPriors) -> ComplexArray:
    """(m,) complex positions that the landmarks' errors are counted from: surveyed, or where first seen."""
    landmark, first = model.first_seen
    seen = np.zeros(len(priors.position), dtype=np.complex128)
    seen[landmark] = model.seen_at[first]
    return np.asarray(np.where(priors.surveyed, priors.position, seen))


def heading_origin(model: Model, priors: LandmarkPriors) -> FloatArray:
    """(m,) headings that the sheets' errors are counted from, rad: surveyed, or by the reference where first logged."""
    landmark, first = model.first_headed
    seen = np.zeros(len(priors.position))
    seen[landmark] = model.heading_rad[first]
    return np.where(np.isfinite(priors.heading_rad), priors.heading_rad, seen)


def heading_residual(model: Model, priors: LandmarkPriors) -> FloatArray:
    """(p,) from each logged heading to the landmark's, rad, wrapped; 0 where none is logged."""
    miss = heading_origin(model, priors)[model.observations.passes.landmark] - model.heading_rad
    return np.where(model.headed, wrapped(miss), 0.0)


def normal_equations(model: Model, priors: LandmarkPriors, weights: Weights, *, pinned: bool) -> NormalEquations:
    """Add up drift, sightings, sheet headings and survey.

    The border holds the landmarks' errors: x, y of each, then their headings.
    """
    drift = stretch_precision(model, weights)
    count, marks = len(model.observations.nodes), len(priors.position)
    diagonal = np.zeros((count, STATES, STATES))
    diagonal[0] = start_precision(model, pinned=pinned)
    pull = model.carry.transpose(0, 2, 1) @ drift
    diagonal[:-1] += pull @ model.carry
    diagonal[1:] += drift
    border, corner = np.zeros((count, STATES, 3 * marks)), np.zeros((3 * marks, 3 * marks))
    right, corner_right = np.zeros((count, STATES)), np.zeros(3 * marks)
    had = np.einsum("kij,kj->ki", drift, model.stretches_drifted)
    right[1:] -= had
    right[:-1] += np.einsum("kji,kj->ki", model.carry, had)
    node, landmark = np.arange(1, count - 1), model.observations.passes.landmark
    worth = 1 / (sighting_variance(model, weights.noise) * weights.sighting)
    miss = position_residual(model, priors)
    diagonal[node] += model.sight.transpose(0, 2, 1) @ model.sight * worth[:, None, None]
    right[node] += np.einsum("pij,pi,p->pj", model.sight, miss, worth)
    for axis in (0, 1):
        column = 2 * landmark + axis
        border[node, :, column] -= model.sight[:, axis] * worth[:, None]
        np.add.at(corner, (column, column), worth)
        np.add.at(corner_right, column, -miss[:, axis] * worth)
    worth = np.where(model.headed, 1 / (weights.noise.sheet_rad**2 * weights.sheet), 0.0)
    turn = heading_residual(model, priors)
    column = 2 * marks + landmark
    diagonal[node, 3, 3] += worth
    right[node, 3] += turn * worth
    border[node, 3, column] -= worth
    np.add.at(corner, (column, column), worth)
    np.add.at(corner_right, column, -turn * worth)
    _add_survey(corner, priors, weights)
    return NormalEquations(diagonal, -pull, border, corner, right, corner_right)


def _add_survey(corner: FloatArray, priors: LandmarkPriors, weights: Weights) -> None:
    """Add to the corner (3m, 3m) what the survey, and other walks, say of places and headings."""
    marks = len(priors.position)
    if priors.told is not None:
        _add_told(corner, priors, priors.told, weights)
        return
    if priors.joint is not None:
        corner += _joint_precision(priors.joint, priors, weights)
        return
    x = 2 * np.arange(marks)
    precision = landmark_precision(priors, weights)
    for i in (0, 1):
        for j in (0, 1):
            corner[x + i, x + j] += precision[:, i, j]
    sigma = np.where(np.isfinite(priors.heading_sigma_rad), priors.heading_sigma_rad, FREE_RAD)
    heading = 2 * marks + np.arange(marks)
    corner[heading, heading] += sigma**-2


def _add_told(corner: FloatArray, priors: LandmarkPriors, told: ToldPlaces, weights: Weights) -> None:
    """Add what the survey says of landmarks, and what others say of places that hang on these.

    A place is doubted for its own errors alone.
    """
    survey, marks = priors.landmarks, len(priors.position)
    of_landmarks, of_places = np.split(weights.landmark, [len(survey.position)])
    column = joint_columns(np.arange(len(survey.position)), marks)
    part = np.zeros((len(column), len(column)))
    _add_survey(part, survey, replace(weights, landmark=of_landmarks))
    corner[np.ix_(column, column)] += part
    doubt = np.sqrt(np.repeat(of_places, 2))
    places = np.arange(2 * marks)
    errors = told.own_errors(marks)[-len(doubt) :]
    corner[np.ix_(places, places)] += errors.T @ np.linalg.inv(told.own * np.outer(doubt, doubt)) @ errors
    heading = 2 * marks + np.arange(len(survey.position), marks)
    corner[heading, heading] += FREE_RAD**-2


def _joint_precision(joint: FloatArray, priors: LandmarkPriors, weights: Weights) -> FloatArray:
    """(3m, 3m) of a survey whose landmarks share errors (their covariance ``joint`` (3m, 3m)); nearly 0 elsewhere.

    A landmark that is doubted is so with all that it shares.
    """
    marks = len(priors.position)
    known = np.concatenate((np.repeat(priors.surveyed, 2), np.isfinite(priors.heading_rad)))
    doubt = np.sqrt(np.concatenate((np.repeat(weights.landmark, 2), np.ones(marks))))[known]
    precision = np.diag(np.concatenate((np.full(2 * marks, FREE_M), np.full(marks, FREE_RAD))) ** -2.0)
    rows = np.flatnonzero(known)
    precision[np.ix_(rows, rows)] = np.linalg.inv(joint[np.ix_(rows, rows)] * np.outer(doubt, doubt))
    return precision
