"""The factors of a walk's least-squares problem, linearised about a reference path (docs/explanation/smoother.md)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray, joint_columns
from vislam2tag.core.context import TrackerNoise
from vislam2tag.core.orientation import wrapped
from vislam2tag.estimation.chain import NormalEquations
from vislam2tag.estimation.drift import STATES, DirectedDrift, Drift, DriftKind, transitions
from vislam2tag.estimation.landmark_priors import LandmarkPriors, ToldPlaces
from vislam2tag.estimation.noise import SCALE_SIGMA, DriftSource, NoiseLevels
from vislam2tag.estimation.observations import WalkObservations

KINDS = {
    DriftSource.POSITION: (DriftKind.POSITION,),
    DriftSource.HEADING: (DriftKind.HEADING,),
    DriftSource.SCALE: (DriftKind.SCALE,),
    DriftSource.JUMP: (DriftKind.POSITION,),
    DriftSource.JUMP_TURN: (DriftKind.HEADING,),
}
ROUGH_KINDS = {
    DriftSource.POSITION: (DriftKind.POSITION,),
    DriftSource.HEADING: (DriftKind.HEADING, DriftKind.SCALE),
    DriftSource.SCALE: (),
    DriftSource.JUMP: (DriftKind.POSITION,),
    DriftSource.JUMP_TURN: (DriftKind.HEADING, DriftKind.SCALE),
}
"""Where the heading is not known even roughly, heading and scale drift alike: then the model is linear in both."""
LEAST_DRIFT = np.diag([1e-6, 1e-6, 1e-10, 1e-10])
"""No stretch is exact: 1 mm and 0.01 mrad keep the equations regular."""
NEGLIGIBLE = 1e-6
"""An eigenvalue below this share of the trace is none: its direction does not drift."""


@dataclass(frozen=True, eq=False)
class Model:
    """A walk linearised about ``path`` (n,), complex metres in the BCS; ``turn`` (n,) is ``bcs_R_continuous``.

    Compared by identity.
    """

    observations: WalkObservations
    path: ComplexArray
    turn: ComplexArray
    rough: bool

    @cached_property
    def sums(self) -> dict[DriftSource, tuple[Drift | DirectedDrift, ...]]:
        """Running sums of each source's drift along the reference path."""
        kinds = ROUGH_KINDS if self.rough else KINDS
        variance = self.observations.step_variance
        sums: dict[DriftSource, tuple[Drift | DirectedDrift, ...]] = {
            source: tuple(Drift.along(kind, self.path, steps) for kind in kinds[source])
            for source, steps in variance.items()
        }
        return {**sums, DriftSource.DOUBT: (self._doubt,)}

    @property
    def _doubt(self) -> Drift | DirectedDrift:
        """Where steps may have slipped to; which way that is in the building a rough model does not know yet."""
        doubt = self.observations.odometry.doubt
        if self.rough:
            return Drift.along(DriftKind.POSITION, self.path, np.abs(doubt) ** 2)
        return DirectedDrift.along(doubt * self.turn[:-1])

    def drift(self, source: DriftSource, a: IntArray, b: IntArray) -> FloatArray:
        """Covariances (k, 4, 4) at unit level of one source's drift from frames ``a`` to ``b`` (k,)."""
        total = np.zeros((len(a), STATES, STATES))
        for part in self.sums[source]:
            total += part.between(a, b)
        return total

    @cached_property
    def stretches(self) -> dict[DriftSource, FloatArray]:
        """Covariances (p + 1, 4, 4) at unit level of the drift between neighbouring nodes."""
        nodes = self.observations.nodes
        return {source: self.drift(source, nodes[:-1], nodes[1:]) for source in DriftSource}

    @cached_property
    def units(self) -> FloatArray:
        """(s, p + 1, 4, 4) :attr:`stretches` of all sources."""
        return np.stack(list(self.stretches.values()))

    @cached_property
    def ranks(self) -> dict[DriftSource, IntArray]:
        """Ranks (p + 1,) of :attr:`stretches`: how many numbers each source's drift consists of."""
        return {source: _ranks(covariance) for source, covariance in self.stretches.items()}

    @cached_property
    def centred(self) -> ComplexArray:
        """(n,) the path about its middle, so that products of its coordinates keep their digits."""
        return np.asarray(self.path - self.path.mean())

    @cached_property
    def drifted_sums(self) -> FloatArray:
        """(n, 3) sums of the heading drift that the reference already has, times 1, x and y of the path."""
        step = np.diff(np.unwrap(np.angle(self.turn)))
        terms = np.stack((step, step * self.centred.real[1:], step * self.centred.imag[1:]), axis=1)
        return np.concatenate((np.zeros((1, 3)), np.cumsum(terms, axis=0)))

    def drifted(self, a: IntArray, b: IntArray) -> FloatArray:
        """(k, 4) the drift from frames ``a`` to ``b`` that the reference already has."""
        total, sx, sy = (self.drifted_sums[b] - self.drifted_sums[a]).T
        x, y = self.centred[b].real * total - sx, self.centred[b].imag * total - sy
        return np.stack((-y, x, np.zeros_like(x), total), axis=1)

    @cached_property
    def stretches_drifted(self) -> FloatArray:
        """(p + 1, 4) the drift between neighbouring nodes that the reference already has."""
        return self.drifted(self.observations.nodes[:-1], self.observations.nodes[1:])

    @cached_property
    def carry(self) -> FloatArray:
        """(p + 1, 4, 4) what becomes of a state from node to node without drift."""
        return transitions(self.path, self.observations.nodes[:-1], self.observations.nodes[1:])

    @cached_property
    def offset(self) -> ComplexArray:
        """(p,) from the camera to the landmark at each pass, complex metres in the BCS."""
        return np.asarray(self.observations.passes.offset * self.turn[self.observations.passes.at])

    @cached_property
    def seen_at(self) -> ComplexArray:
        """(p,) where the reference path puts the landmark of each pass, complex metres in the BCS."""
        return np.asarray(self.path[self.observations.passes.at] + self.offset)

    @cached_property
    def sight(self) -> FloatArray:
        """(p, 2, 4) by how much the states move where a pass puts its landmark."""
        matrix = np.zeros((len(self.offset), 2, STATES))
        matrix[:, 0, 0] = matrix[:, 1, 1] = 1
        matrix[:, 0, 2], matrix[:, 1, 2] = self.offset.real, self.offset.imag
        matrix[:, 0, 3], matrix[:, 1, 3] = -self.offset.imag, self.offset.real
        return matrix

    @cached_property
    def first_seen(self) -> tuple[IntArray, IntArray]:
        """Landmarks that were passed (l,), and the first pass (l,) of each."""
        landmark, first = np.unique(self.observations.passes.landmark, return_index=True)
        return landmark, first

    @cached_property
    def first_headed(self) -> tuple[IntArray, IntArray]:
        """Landmarks whose sheet's heading is logged (l,), and the first pass (l,) of each with a heading."""
        headed = np.flatnonzero(self.headed)
        landmark, first = np.unique(self.observations.passes.landmark[headed], return_index=True)
        return landmark, headed[first]

    @cached_property
    def headed(self) -> BoolArray:
        """(p,) passes whose sheet's heading is logged; none while the heading is not known roughly."""
        return np.asarray((self.observations.passes.heading != 0) & (not self.rough))

    @cached_property
    def heading_rad(self) -> FloatArray:
        """(p,) the sheets' headings in the BCS by the reference, rad; 0 where none is logged."""
        heading = self.observations.passes.heading * self.turn[self.observations.passes.at]
        return np.where(self.headed, np.angle(heading), 0.0)


def _ranks(covariance: FloatArray) -> IntArray:
    """Ranks (k,) of covariances (k, 4, 4)."""
    trace = np.trace(covariance, axis1=1, axis2=2)
    values = np.linalg.eigvalsh(covariance)
    return np.asarray(np.sum(values > NEGLIGIBLE * np.maximum(trace, 1e-12)[:, None], axis=1))


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
