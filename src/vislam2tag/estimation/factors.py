"""The factors of a walk's least-squares problem about a reference path; :mod:`~vislam2tag.estimation.smoother` defines
the state and the residuals.

=============== ============================= ======================================================
factor          ties                          where
=============== ============================= ======================================================
start           the first state               :func:`start_precision`
drift           neighbouring states           :class:`DriftFactor`
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
from vislam2tag.core.context import TrackerNoise
from vislam2tag.core.orientation import wrapped
from vislam2tag.estimation.chain import NormalEquations, Solution
from vislam2tag.estimation.drift import STATES, Drift, DriftKind, transitions
from vislam2tag.estimation.landmark_priors import FREE_M, FREE_RAD, LandmarkPriors, survey_precisions
from vislam2tag.estimation.noise import SCALE_SIGMA, DriftSource, NoiseLevels
from vislam2tag.estimation.observations import WalkObservations

FREE_SCALE = 30.0
"""Standard deviation of a scale that is not known at all."""
PINNED_M, PINNED_RAD = 1e-4, 1e-5
"""The start of a map in its own frame: small beside what a pass shows, great beside what numbers lose."""
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


@dataclass(frozen=True)
class Model:
    """A walk linearised about ``path`` (n,), complex metres in the BCS; ``turn`` (n,) is ``bcs_R_continuous``.

    ``rough``: the heading is not known even roughly, so that heading and scale are free and linear.
    """

    observations: WalkObservations
    path: ComplexArray
    turn: ComplexArray
    rough: bool

    @cached_property
    def sums(self) -> dict[DriftSource, tuple[Drift, ...]]:
        """Running sums of each source's drift along the reference path."""
        kinds = ROUGH_KINDS if self.rough else KINDS
        variance = self.observations.step_variance
        sums: dict[DriftSource, tuple[Drift, ...]] = {
            source: tuple(Drift.along(kind, self.path, steps) for kind in kinds[source])
            for source, steps in variance.items()
        }
        return {**sums, DriftSource.DOUBT: (self._doubt,)}

    @property
    def _doubt(self) -> Drift:
        """Where steps may have slipped to; which way that is in the building a rough model does not know yet."""
        doubt = self.observations.odometry.doubt
        if self.rough:
            return Drift.along(DriftKind.POSITION, self.path, np.abs(doubt) ** 2)
        return Drift.directed(self.path, doubt * self.turn[:-1])

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


@dataclass(frozen=True)
class Weights:
    """What the observations are worth: the noise, and by which factor each one's variance exceeds it (Student's t).

    ``stretch`` (p + 1,) for each source, ``sighting`` (p,), ``sheet`` (p,), ``landmark`` (m,).
    """

    noise: NoiseLevels
    stretch: dict[DriftSource, FloatArray]
    sighting: FloatArray
    sheet: FloatArray
    landmark: FloatArray
    told: TrackerNoise | None = None
    """How noisy the tracker is by other walks of its device, before anything of this one is known."""

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

    @property
    def stretch_scale(self) -> FloatArray:
        """(s, p + 1) by how much the variance of each source's drift over each stretch exceeds that at unit level."""
        return np.stack([self.noise.level(source) ** 2 * self.stretch[source] for source in DriftSource])


@dataclass(frozen=True)
class DriftFactor:
    """Ties each node to the next one: ``x[k + 1] - carry[k] x[k] + drifted[k]`` is 0 within a covariance.

    ``carry`` (p + 1, 4, 4); ``drifted`` (p + 1, 4), the drift that the reference path already has; ``covariance``
    (p + 1, 4, 4).
    """

    carry: FloatArray
    drifted: FloatArray
    covariance: FloatArray

    @cached_property
    def precision(self) -> FloatArray:
        """(p + 1, 4, 4) inverse of :attr:`covariance`."""
        return np.asarray(np.linalg.inv(self.covariance))

    def residual(self, state: FloatArray) -> FloatArray:
        """(p + 1, 4) by how much each stretch led elsewhere, by states (p + 2, 4)."""
        return np.asarray(state[1:] - np.einsum("kij,kj->ki", self.carry, state[:-1]) + self.drifted)


@dataclass(frozen=True)
class LandmarkFactor:
    """Ties the state at a pass to ``r`` unknowns of its landmark: ``residual - design x + unknown`` is 0 but for noise.

    ``residual`` (p, r); ``design`` (p, r, 4); ``column`` (p, r) of the unknowns in the border; ``worth`` (p,), inverse
    variances of each of the r numbers, 0 where nothing was observed.
    """

    residual: FloatArray
    design: FloatArray
    column: IntArray
    worth: FloatArray

    def missed(self, solution: Solution) -> FloatArray:
        """(p,) squares of the residuals at a solution, summed over r."""
        by_state = np.einsum("pij,pj->pi", self.design, solution.state[1:-1])
        return np.asarray(np.sum((self.residual - by_state + solution.border[self.column]) ** 2, axis=1))

    def spread(self, solution: Solution) -> FloatArray:
        """(p,) how far the residuals may be from those at a solution: variances, summed over r."""
        by_state = np.einsum("pij,pjk,pik->p", self.design, solution.covariance[1:-1], self.design)
        own = solution.border_covariance.diagonal()[self.column].sum(axis=1)
        shared = np.take_along_axis(solution.cross[1:-1], self.column[:, None, :], axis=2)
        return np.asarray(by_state + own - 2 * np.einsum("pij,pji->p", self.design, shared))


@dataclass(frozen=True)
class LinearWalk:
    """A walk's whole least-squares problem about its reference path; ``pinned`` to the walk's first pose or not.

    The unknowns are the states of all nodes and, as the border, the errors of ``m`` landmarks: x, y of each, metres,
    then the headings of all sheets, rad.
    """

    model: Model
    priors: LandmarkPriors
    weights: Weights
    pinned: bool = False

    @cached_property
    def drift(self) -> DriftFactor:
        """The tracker's drift between neighbouring nodes."""
        covariance = np.einsum("sk,skij->kij", self.weights.stretch_scale, self.model.units) + LEAST_DRIFT
        return DriftFactor(self.model.carry, self.model.stretches_drifted, np.asarray(covariance))

    @cached_property
    def sightings(self) -> LandmarkFactor:
        """Where each pass saw its landmark."""
        landmark = self.model.observations.passes.landmark
        miss = landmark_origin(self.model, self.priors)[landmark] - self.model.seen_at
        return LandmarkFactor(
            residual=np.column_stack((miss.real, miss.imag)),
            design=self.model.sight,
            column=np.stack((2 * landmark, 2 * landmark + 1), axis=1),
            worth=1 / (sighting_variance(self.model, self.weights.noise) * self.weights.sighting),
        )

    @cached_property
    def sheet_headings(self) -> LandmarkFactor:
        """How each pass saw its landmark's sheet turned, where that is logged."""
        landmark, headed = self.model.observations.passes.landmark, self.model.headed
        miss = heading_origin(self.model, self.priors)[landmark] - self.model.heading_rad
        return LandmarkFactor(
            residual=np.where(headed, wrapped(miss), 0.0)[:, None],
            design=np.tile(np.eye(STATES)[3], (len(landmark), 1, 1)),
            column=2 * len(self.priors.position) + landmark[:, None],
            worth=np.where(headed, 1 / (self.weights.noise.sheet_rad**2 * self.weights.sheet), 0.0),
        )

    def normal_equations(self) -> NormalEquations:
        """Add up all factors."""
        count, unknowns = len(self.model.observations.nodes), 3 * len(self.priors.position)
        diagonal, right = np.zeros((count, STATES, STATES)), np.zeros((count, STATES))
        border = np.zeros((count, STATES, unknowns))
        corner, corner_right = np.zeros((unknowns, unknowns)), np.zeros(unknowns)
        diagonal[0] = start_precision(self.model, pinned=self.pinned)
        drift = self.drift
        pull = drift.carry.transpose(0, 2, 1) @ drift.precision
        diagonal[:-1] += pull @ drift.carry
        diagonal[1:] += drift.precision
        had = np.einsum("kij,kj->ki", drift.precision, drift.drifted)
        right[1:] -= had
        right[:-1] += np.einsum("kji,kj->ki", drift.carry, had)
        node = np.arange(1, count - 1)
        for factor in (self.sightings, self.sheet_headings):
            squared = factor.design.transpose(0, 2, 1) @ factor.design
            diagonal[node] += squared * factor.worth[:, None, None]
            right[node] += np.einsum("pij,pi,p->pj", factor.design, factor.residual, factor.worth)
            for axis, column in enumerate(factor.column.T):
                border[node, :, column] -= factor.design[:, axis] * factor.worth[:, None]
                np.add.at(corner, (column, column), factor.worth)
                np.add.at(corner_right, column, -factor.residual[:, axis] * factor.worth)
        for precision in survey_precisions(self.priors, self.weights.landmark):
            corner += precision
        return NormalEquations(diagonal, -pull, border, corner, right, corner_right)


def sighting_variance(model: Model, noise: NoiseLevels) -> FloatArray:
    """Usual variances (p,) per axis of where a pass puts its landmark, m^2: they grow with distance and scatter."""
    passes = model.observations.passes
    aside_m2 = model.observations.odometry.aside_m2[passes.at]
    return noise.sighting_m**2 * (1 + passes.distance_m**2) / 2 + passes.spread_m**2 + aside_m2


def start_precision(model: Model, *, pinned: bool) -> FloatArray:
    """Precision (4, 4) of the first state: free, or ``pinned`` to the reference for a map in its own frame."""
    metres, rad = (PINNED_M, PINNED_RAD) if pinned else (FREE_M, FREE_RAD)
    scale, turn = (FREE_SCALE, FREE_SCALE) if model.rough else (SCALE_SIGMA, rad)
    return np.diag([metres**-2, metres**-2, scale**-2, turn**-2])


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
