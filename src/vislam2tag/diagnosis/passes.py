"""A walk as diagnosis sees it: where the tracker put each landmark that it passed, and how uncertain that is.

Only the way between passes counts: the frame of the walk may lie anywhere in the building. How far the tracker may have
drifted from pass to pass follows from its usual noise (:mod:`vislam2tag.estimation.noise`) and not from how the walk
was mapped: a wrong landmark would have made that worse.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.core.limits import MAX_DIAGNOSED_PASSES
from vislam2tag.core.similarity import as_points
from vislam2tag.estimation.drift import STATES, transitions
from vislam2tag.estimation.factors import LinearWalk, Model, Weights, sighting_variance
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.noise import SCALE_SIGMA, USUAL
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.intake.shifted_ids import IdShift
from vislam2tag.survey.model import SessionKey


@dataclass(frozen=True)
class WalkPasses:
    """``p`` passes of one walk in the order of time, in the tracker's continuous frame.

    ``landmark`` (p,) ids as logged; ``time_s`` (p,) from the first frame; ``camera`` (p,) complex, metres, where the
    camera was, ``offset`` (p,) complex, metres, from there to the landmark; ``sighting_m2`` (p,) variance per axis of
    each pass; ``drift`` (p - 1, 4, 4) covariances of the drift from pass to pass (states as in
    :mod:`vislam2tag.estimation.drift`); ``id_shift`` is what to add to the ids, None if nothing.
    """

    key: SessionKey
    landmark: tuple[str, ...]
    time_s: FloatArray
    camera: ComplexArray
    offset: ComplexArray
    sighting_m2: FloatArray
    drift: FloatArray
    id_shift: IdShift | None = None

    @classmethod
    def of(cls, key: SessionKey, observations: WalkObservations, id_shift: IdShift | None = None) -> WalkPasses:
        """Reduce what was observed on a walk."""
        observations = observations.first(MAX_DIAGNOSED_PASSES)
        odometry, passes = observations.odometry, observations.passes
        model = Model(observations, odometry.path, np.ones_like(odometry.path), rough=False)
        even = Weights.even(USUAL, len(passes.at), len(observations.ids))
        drift = LinearWalk(model, LandmarkPriors.nothing(len(observations.ids)), even).drift
        return cls(
            key=key,
            landmark=tuple(observations.ids[i] for i in passes.landmark),
            time_s=odometry.time_s[passes.at],
            camera=odometry.path[passes.at],
            offset=passes.offset,
            sighting_m2=sighting_variance(model, USUAL),
            drift=drift.covariance[1:-1] if len(passes.at) else np.empty((0, STATES, STATES)),
            id_shift=id_shift,
        )

    @cached_property
    def landmark_number(self) -> IntArray:
        """(p,) equal for passes of one landmark."""
        return np.unique(np.array(self.landmark, dtype=str), return_inverse=True)[1]

    @cached_property
    def place(self) -> ComplexArray:
        """(p,) complex, metres, where the tracker put each landmark."""
        return np.asarray(self.camera + self.offset)

    @cached_property
    def covariance(self) -> FloatArray:
        """(2p, 2p) of x and y of each :attr:`place`, m^2, from the first pass on."""
        count = len(self.camera)
        state = np.zeros((count, count, STATES, STATES))
        if count:
            state[0, 0, 2, 2] = SCALE_SIGMA**2
        here = np.arange(count)
        carry = transitions(self.camera, here[:-1], here[1:])
        for k in range(1, count):
            state[k, :k] = carry[k - 1] @ state[k - 1, :k]
            state[:k, k] = state[k, :k].transpose(0, 2, 1)
            state[k, k] = carry[k - 1] @ state[k - 1, k - 1] @ carry[k - 1].T + self.drift[k - 1]
        sight = np.zeros((count, 2, STATES))
        sight[:, :, :2] = np.eye(2)
        sight[:, :, 2] = as_points(self.offset)
        sight[:, :, 3] = as_points(1j * self.offset)
        total = np.einsum("pis,prst,rjt->pirj", sight, state, sight).reshape(2 * count, 2 * count)
        return np.asarray(total + np.diag(np.repeat(self.sighting_m2, 2)))
