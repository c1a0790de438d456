"""The linear model of a walk about a reference path (docs/explanation/smoother.md, "The model").

At each node (the first frame, one frame of each pass, the last frame) the unknowns are what the reference path lacks
there: position error (x, y) in metres, relative scale error, heading error in rad. Neighbouring nodes are tied by the
tracker's drift between them; a pass ties its node to a landmark, whose own error is unknown too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.estimation.drift import STATES, DirectedDrift, Drift, DriftKind, transitions
from vislam2tag.estimation.noise import DriftSource
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
