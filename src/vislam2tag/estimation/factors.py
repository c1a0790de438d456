"""The factors of a walk's least-squares problem about a reference path; :mod:`~vislam2tag.estimation.smoother` defines
the state and the residuals.

=============== ============================= ======================================================
factor          connects                      defined by
=============== ============================= ======================================================
start           the first state               :func:`start_precision`
drift           neighbouring states           :attr:`LinearWalk.drift_factor`
sighting        a state and a landmark's place :attr:`LinearWalk.sightings`
sheet heading   a state and a sheet's heading :attr:`LinearWalk.sheet_headings`
survey          landmarks                     :func:`~vislam2tag.estimation.landmark_priors.survey_precisions`
=============== ============================= ======================================================
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.transforms import wrapped
from vislam2tag.estimation.landmark_priors import FREE_M, FREE_RAD, LandmarkPriors, survey_precisions
from vislam2tag.estimation.least_squares import NormalEquations, Solution
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.tracker_errors import (
    SCALE_SIGMA,
    STATES,
    DriftAlong,
    DriftKind,
    DriftSource,
    NoiseLevels,
    PathDriftSums,
    VarianceFactors,
    transitions,
)

FREE_SCALE = 30.0
"""Standard deviation of an unknown scale."""
PINNED_M, PINNED_RAD = 1e-4, 1e-5
"""Precision of the start of a map in its own frame: small compared with a pass, large compared with rounding."""
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
"""If the heading is not even roughly known, heading and scale drift alike, which makes the model linear in both."""
LEAST_DRIFT = np.diag([1e-6, 1e-6, 1e-10, 1e-10])
"""Smallest drift of a stretch; 1 mm and 0.01 mrad keep the equations regular."""
NEGLIGIBLE = 1e-6
"""An eigenvalue below this share of the trace counts as zero: there is no drift in its direction."""


@dataclass(frozen=True)
class Model:
    """A walk linearised about ``path`` (n,), complex metres in the BCS; ``turn`` (n,) is ``bcs_R_continuous``.

    ``rough``: the heading is not even roughly known, so heading and scale are free and linear.
    """

    observations: WalkObservations
    path: ComplexArray
    turn: ComplexArray
    rough: bool

    @cached_property
    def _drift_along(self) -> DriftAlong:
        return DriftAlong(self.path)

    @property
    def centred(self) -> ComplexArray:
        """(n,) the path relative to its middle, so that products of its coordinates keep their digits."""
        return self._drift_along.centred

    @cached_property
    def sums(self) -> dict[DriftSource, tuple[PathDriftSums, ...]]:
        """Running sums of each source's drift along the reference path; none of a source without any."""
        kinds = ROUGH_KINDS if self.rough else KINDS
        variance = self.observations.step_variance
        along = self._drift_along
        sums: dict[DriftSource, tuple[PathDriftSums, ...]] = {
            source: tuple(along.sums(kind, steps) for kind in kinds[source]) if steps.any() else ()
            for source, steps in variance.items()
        }
        return {**sums, DriftSource.DOUBT: (self._doubt,) if self.observations.odometry.doubt.any() else ()}

    @property
    def _doubt(self) -> PathDriftSums:
        """Possible slips of steps; a rough model does not know their direction in the building."""
        doubt = self.observations.odometry.doubt
        if self.rough:
            return self._drift_along.sums(DriftKind.POSITION, np.abs(doubt) ** 2)
        return self._drift_along.slips(doubt * self.turn[:-1])

    def drift_covariance(self, source: DriftSource, a: IntArray, b: IntArray) -> FloatArray:
        """(k, 4, 4) covariances at unit level of one source's drift from frames ``a`` to ``b`` (k,)."""
        total = np.zeros((len(a), STATES, STATES))
        for part in self.sums[source]:
            total += part.between(a, b)
        return total

    @cached_property
    def stretches(self) -> dict[DriftSource, FloatArray]:
        """Covariances (p + 1, 4, 4) at unit level of the drift between neighbouring nodes."""
        nodes = self.observations.nodes
        return {source: self.drift_covariance(source, nodes[:-1], nodes[1:]) for source in DriftSource}

    @cached_property
    def unit_covariances(self) -> FloatArray:
        """(s, p + 1, 4, 4) :attr:`stretches` of all sources."""
        return np.stack(list(self.stretches.values()))

    @cached_property
    def ranks(self) -> dict[DriftSource, IntArray]:
        """Ranks (p + 1,) of :attr:`stretches`: the number of dimensions in which each source drifts."""
        return {source: _ranks(covariance) for source, covariance in self.stretches.items()}

    @cached_property
    def reference_drift_sums(self) -> FloatArray:
        """(n, 3) sums of the heading drift that the reference already contains, times 1, x and y of the path."""
        step = np.diff(np.unwrap(np.angle(self.turn)))
        terms = np.stack((step, step * self.centred.real[1:], step * self.centred.imag[1:]), axis=1)
        return np.concatenate((np.zeros((1, 3)), np.cumsum(terms, axis=0)))

    def reference_drift(self, a: IntArray, b: IntArray) -> FloatArray:
        """(k, 4) the drift from frames ``a`` to ``b`` that the reference already contains."""
        total, sx, sy = (self.reference_drift_sums[b] - self.reference_drift_sums[a]).T
        x, y = self.centred[b].real * total - sx, self.centred[b].imag * total - sy
        return np.stack((-y, x, np.zeros_like(x), total), axis=1)

    @cached_property
    def stretch_reference_drift(self) -> FloatArray:
        """(p + 1, 4) the drift between neighbouring nodes that the reference already contains."""
        return self.reference_drift(self.observations.nodes[:-1], self.observations.nodes[1:])

    @cached_property
    def transition(self) -> FloatArray:
        """(p + 1, 4, 4) matrices from each node's state to the next one's without drift."""
        return transitions(self.path, self.observations.nodes[:-1], self.observations.nodes[1:])

    @cached_property
    def offset(self) -> ComplexArray:
        """(p,) from the camera to the landmark at each pass, complex metres in the BCS."""
        return np.asarray(self.observations.passes.offset * self.turn[self.observations.passes.at])

    @cached_property
    def seen_at(self) -> ComplexArray:
        """(p,) place of each pass's landmark by the reference path, complex metres in the BCS."""
        return np.asarray(self.path[self.observations.passes.at] + self.offset)

    @cached_property
    def sighting_jacobian(self) -> FloatArray:
        """(p, 2, 4) derivatives of the landmark's place at each pass with respect to the state there."""
        jacobian = np.zeros((len(self.offset), 2, STATES))
        jacobian[:, 0, 0] = jacobian[:, 1, 1] = 1
        jacobian[:, 0, 2], jacobian[:, 1, 2] = self.offset.real, self.offset.imag
        jacobian[:, 0, 3], jacobian[:, 1, 3] = -self.offset.imag, self.offset.real
        return jacobian

    @cached_property
    def heading_jacobian(self) -> FloatArray:
        """(p, 1, 4) derivatives of the sheet's heading at each pass with respect to the state there."""
        return np.tile(np.eye(STATES)[3], (len(self.offset), 1, 1))

    @cached_property
    def first_seen(self) -> tuple[IntArray, IntArray]:
        """Landmarks that were passed (l,), and the first pass (l,) of each."""
        landmark, first = np.unique(self.observations.passes.landmark, return_index=True)
        return landmark, first

    @cached_property
    def first_headed(self) -> tuple[IntArray, IntArray]:
        """Landmarks with a logged sheet heading (l,), and the first pass (l,) of each with a heading."""
        headed = np.flatnonzero(self.headed)
        landmark, first = np.unique(self.observations.passes.landmark[headed], return_index=True)
        return landmark, headed[first]

    @cached_property
    def headed(self) -> BoolArray:
        """(p,) passes with a logged sheet heading; none while the heading is not roughly known."""
        return np.asarray((self.observations.passes.heading != 0) & (not self.rough))

    @cached_property
    def heading_rad(self) -> FloatArray:
        """(p,) headings of the sheets in the BCS by the reference, rad; 0 if none is logged."""
        heading = self.observations.passes.heading * self.turn[self.observations.passes.at]
        return np.where(self.headed, np.angle(heading), 0.0)


def _ranks(covariance: FloatArray) -> IntArray:
    """Ranks (k,) of covariances (k, 4, 4)."""
    trace = np.trace(covariance, axis1=1, axis2=2)
    values = np.linalg.eigvalsh(covariance)
    return np.asarray(np.sum(values > NEGLIGIBLE * np.maximum(trace, 1e-12)[:, None], axis=1))


@dataclass(frozen=True)
class DriftFactor:
    """Connects each node to the next: ``x[k + 1] - transition[k] x[k] + reference_drift[k]`` is 0 within
    ``covariance[k]``.

    ``transition`` (p + 1, 4, 4); ``reference_drift`` (p + 1, 4), the drift that the reference path already contains;
    ``covariance`` (p + 1, 4, 4).
    """

    transition: FloatArray
    reference_drift: FloatArray
    covariance: FloatArray

    @cached_property
    def precision(self) -> FloatArray:
        """(p + 1, 4, 4) inverse of :attr:`covariance`."""
        return np.asarray(np.linalg.inv(self.covariance))

    def residual(self, state: FloatArray) -> FloatArray:
        """(p + 1, 4) of states (p + 2, 4): the drift over each stretch."""
        return np.asarray(state[1:] - np.einsum("kij,kj->ki", self.transition, state[:-1]) + self.reference_drift)


@dataclass(frozen=True)
class LandmarkFactor:
    """Connects the state x at a pass to ``r`` unknowns of its landmark by ``residual - jacobian x + unknown`` = 0.

    ``residual`` (p, r) is that at the reference, and ``jacobian`` (p, r, 4) its derivative by the state. ``column`` (p,
    r) are those of the unknowns in the border. ``precision`` (p,) is the inverse variance of each of the r numbers, 0
    without an observation.
    """

    residual: FloatArray
    jacobian: FloatArray
    column: IntArray
    precision: FloatArray

    def squared_residual(self, solution: Solution) -> FloatArray:
        """(p,) squares of the residuals at a solution, summed over r."""
        by_state = np.einsum("pij,pj->pi", self.jacobian, solution.state[1:-1])
        return np.asarray(np.sum((self.residual - by_state + solution.border[self.column]) ** 2, axis=1))

    def residual_variance(self, solution: Solution) -> FloatArray:
        """(p,) variances of the residuals about those at a solution, summed over r."""
        by_state = np.einsum("pij,pjk,pik->p", self.jacobian, solution.covariance[1:-1], self.jacobian)
        own = solution.border_covariance.diagonal()[self.column].sum(axis=1)
        shared = np.take_along_axis(solution.cross[1:-1], self.column[:, None, :], axis=2)
        return np.asarray(by_state + own - 2 * np.einsum("pij,pji->p", self.jacobian, shared))


@dataclass(frozen=True)
class LinearWalk:
    """A walk's whole least-squares problem about its reference path; ``pinned`` to the walk's first pose or not.

    The unknowns are the states of all nodes and, as the border, the errors of ``m`` landmarks: x, y of each, metres,
    then the headings of all sheets, rad.
    """

    model: Model
    priors: LandmarkPriors
    variance_factors: VarianceFactors
    pinned: bool = False

    @cached_property
    def drift_factor(self) -> DriftFactor:
        """The tracker's drift between neighbouring nodes."""
        covariance = (
            np.einsum("sk,skij->kij", self.variance_factors.stretch_scale, self.model.unit_covariances) + LEAST_DRIFT
        )
        return DriftFactor(self.model.transition, self.model.stretch_reference_drift, np.asarray(covariance))

    @cached_property
    def sightings(self) -> LandmarkFactor:
        """Observed place of each pass's landmark."""
        landmark = self.model.observations.passes.landmark
        miss = landmark_origin(self.model, self.priors)[landmark] - self.model.seen_at
        return LandmarkFactor(
            residual=np.column_stack((miss.real, miss.imag)),
            jacobian=self.model.sighting_jacobian,
            column=np.stack((2 * landmark, 2 * landmark + 1), axis=1),
            precision=1 / (sighting_variance(self.model, self.variance_factors.noise) * self.variance_factors.sighting),
        )

    @cached_property
    def sheet_headings(self) -> LandmarkFactor:
        """Observed heading of each pass's sheet, if it is logged."""
        landmark, headed = self.model.observations.passes.landmark, self.model.headed
        miss = heading_origin(self.model, self.priors)[landmark] - self.model.heading_rad
        return LandmarkFactor(
            residual=np.where(headed, wrapped(miss), 0.0)[:, None],
            jacobian=self.model.heading_jacobian,
            column=2 * len(self.priors.position) + landmark[:, None],
            precision=np.where(
                headed, 1 / (self.variance_factors.noise.sheet_rad**2 * self.variance_factors.sheet), 0.0
            ),
        )

    def normal_equations(self) -> NormalEquations:
        """Add up all factors.

        A factor whose residual is ``r + A x``, with precision P, adds ``A^T P A`` to the matrix and ``-A^T P r`` to
        the right side.
        """
        count, unknowns = len(self.model.observations.nodes), 3 * len(self.priors.position)
        equations = NormalEquations(
            diagonal=np.zeros((count, STATES, STATES)),
            upper=np.zeros((count - 1, STATES, STATES)),
            border=np.zeros((count, STATES, unknowns)),
            corner=np.zeros((unknowns, unknowns)),
            right=np.zeros((count, STATES)),
            corner_right=np.zeros(unknowns),
        )
        equations.diagonal[0] = start_precision(self.model, pinned=self.pinned)
        _add_drift(equations, self.drift_factor)
        _add_landmark_factor(equations, self.sightings)
        _add_landmark_factor(equations, self.sheet_headings)
        for precision in survey_precisions(self.priors, self.variance_factors.landmark):
            equations.corner[:] += precision
        return equations


def _add_drift(equations: NormalEquations, drift: DriftFactor) -> None:
    """Add the residual ``x[k + 1] - F[k] x[k] + d[k]`` of each stretch (F: transition, d: reference drift)."""
    weighted_transition = drift.transition.transpose(0, 2, 1) @ drift.precision
    weighted_drift = np.einsum("kij,kj->ki", drift.precision, drift.reference_drift)
    equations.diagonal[:-1] += weighted_transition @ drift.transition
    equations.diagonal[1:] += drift.precision
    equations.upper[:] = -weighted_transition
    equations.right[1:] -= weighted_drift
    equations.right[:-1] += np.einsum("kji,kj->ki", drift.transition, weighted_drift)


def _add_landmark_factor(equations: NormalEquations, factor: LandmarkFactor) -> None:
    """Add the residual ``r[p] - J[p] x[p] + e`` of each pass: x is the state there, e its landmark's errors."""
    squared = factor.jacobian.transpose(0, 2, 1) @ factor.jacobian
    equations.diagonal[1:-1] += squared * factor.precision[:, None, None]
    equations.right[1:-1] += np.einsum("pij,pi,p->pj", factor.jacobian, factor.residual, factor.precision)
    node = np.arange(1, len(equations.diagonal) - 1)
    for axis, column in enumerate(factor.column.T):
        equations.border[node, :, column] -= factor.jacobian[:, axis] * factor.precision[:, None]
        np.add.at(equations.corner, (column, column), factor.precision)
        np.add.at(equations.corner_right, column, -factor.residual[:, axis] * factor.precision)


def sighting_variance(model: Model, noise: NoiseLevels) -> FloatArray:
    """Usual variances (p,) per axis of a landmark's place by a pass, m^2; they grow with distance and scatter."""
    passes = model.observations.passes
    aside_m2 = model.observations.odometry.aside_m2[passes.at]
    return noise.sighting_m**2 * (1 + passes.distance_m**2) / 2 + passes.spread_m**2 + aside_m2


def start_precision(model: Model, *, pinned: bool) -> FloatArray:
    """Precision (4, 4) of the first state: place and heading are free, scale is 1 within 2 %.

    A map in its own frame is ``pinned`` to the reference; in a rough model scale is free, too.
    """
    metres, rad = (PINNED_M, PINNED_RAD) if pinned else (FREE_M, FREE_RAD)
    scale, turn = (FREE_SCALE, FREE_SCALE) if model.rough else (SCALE_SIGMA, rad)
    return np.diag([metres**-2, metres**-2, scale**-2, turn**-2])


def landmark_origin(model: Model, priors: LandmarkPriors) -> ComplexArray:
    """(m,) complex positions from which the landmarks' errors are counted: surveyed, or of the first sighting."""
    landmark, first = model.first_seen
    seen = np.zeros(len(priors.position), dtype=np.complex128)
    seen[landmark] = model.seen_at[first]
    return np.asarray(np.where(priors.surveyed, priors.position, seen))


def heading_origin(model: Model, priors: LandmarkPriors) -> FloatArray:
    """(m,) headings from which the sheets' errors are counted, rad: surveyed, or of the first logged heading."""
    landmark, first = model.first_headed
    seen = np.zeros(len(priors.position))
    seen[landmark] = model.heading_rad[first]
    return np.where(np.isfinite(priors.heading_rad), priors.heading_rad, seen)
