"""The smoother: one robust least-squares problem over a whole walk (docs/explanation/smoother.md)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, log

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.context import PlaceTies, TrackerNoise
from vislam2tag.core.robust import iterate
from vislam2tag.core.similarity import as_complex, as_points
from vislam2tag.estimation.chain import Solution, solve
from vislam2tag.estimation.factors import Model, Weights, heading_origin, landmark_origin, normal_equations
from vislam2tag.estimation.frame_states import FrameStates, beside_the_survey, states_between_nodes
from vislam2tag.estimation.landmark_priors import LandmarkPriors, ToldPlaces, landmark_shares
from vislam2tag.estimation.noise import NoiseLevels, assumed
from vislam2tag.estimation.observations import Passes, WalkObservations
from vislam2tag.estimation.reweighting import equivalent_variances, expected_squares, reweighted

SETTLED_SIGMAS = 0.1
"""Re-weighting has converged when no node moves any more by this many of its own standard deviations, nor these by this
share. To ask for less changes no mean error, and costs twice the rounds."""
ROUGHLY_SETTLED_SIGMAS = 0.5
"""The first solution is but a start."""
SETTLED_SIGMAS_IN_OWN_FRAME = 0.01
"""Seen from a walk's start sigmas grow with the way, though places near each other are known as well as ever."""
MOST_ROUNDS = 100
"""About one reference path; usual are 3 to 10."""
MOST_RELINEARISATIONS = 10
"""Reference paths; the second usually moves no node by as much, either."""
CAUTION, RELAXATION = 30.0, 0.4
"""The first rough rounds take sightings for this much less certain (variance), then for less so by this factor each:
graduated, so that a bad sighting shows as such before it can bend the walk (Yang et al. 2020)."""
NEIGHBOURING = 4
"""Passes are compared with this many next ones before the first solution ..."""
LEAST_APART_M = 2.0
SCALE_TOLERANCE = 0.2
CLOSE_M = 0.5
"""... that are this far apart: the tracker's distance must be the surveyed one within these."""
DOUBT = 1e4
"""Factor of a pass's variance that agrees with none of its neighbours, to begin with."""
LEAST_BASE_M = 0.5
"""Landmarks that all hang closer together than this do not tell a heading: each is seen to about 0.1 m."""


@dataclass(frozen=True)
class SolvedWalk:
    """A solved walk: everything about it follows from the first four."""

    model: Model
    priors: LandmarkPriors
    weights: Weights
    solution: Solution
    converged: bool = True
    """Whether re-weighting ended because another round would change nothing that matters."""

    @property
    def noise(self) -> NoiseLevels:
        """Estimated noise levels of the session."""
        return self.weights.noise

    def knots(self) -> FrameStates:
        """States between the nodes."""
        return states_between_nodes(self.model, self.weights, self.solution)

    @property
    def landmark_position(self) -> ComplexArray:
        """(m,) most probable positions, complex metres; of a landmark that was never passed its surveyed one."""
        error = self.solution.border[: 2 * len(self.priors.position)]
        return np.asarray(landmark_origin(self.model, self.priors) + error[::2] + 1j * error[1::2])

    @property
    def landmark_heading_rad(self) -> FloatArray:
        """(m,) most probable headings of the sheets."""
        marks = len(self.priors.position)
        return np.asarray(heading_origin(self.model, self.priors) + self.solution.border[2 * marks :])

    def landmark_covariance(self) -> FloatArray:
        """(m, 2, 2) of :attr:`landmark_position`, m^2."""
        column = np.arange(2 * len(self.priors.position)).reshape(-1, 2)
        return np.asarray(self.solution.border_covariance[column[:, :, None], column[:, None, :]])


def solve_walk(
    observations: WalkObservations, priors: LandmarkPriors, told: TrackerNoise | None = None
) -> SolvedWalk | None:
    """Map a walk into the BCS; None where nothing ties it there (see the module's text).

    Its noise is taken for as usual before anything is seen, or for what is ``told`` of the tracker.
    """
    passed = np.intersect1d(np.flatnonzero(priors.surveyed), observations.passes.landmark)
    apart = _extent_m(priors.position[passed]) > LEAST_BASE_M
    model = _roughly_mapped(observations, priors, told) if apart else _headed_by_a_sheet(observations, priors)
    return None if model is None else refined(model, priors, told)


def _extent_m(place: ComplexArray) -> float:
    """Diagonal of the box around some places (k,), complex metres; 0 where there are none."""
    return float(np.hypot(np.ptp(place.real), np.ptp(place.imag))) if place.size else 0.0


def solve_in_own_frame(observations: WalkObservations) -> SolvedWalk:
    """Map a walk and its landmarks in the frame of its first pose, from nothing but the walk itself."""
    path = observations.odometry.path
    model = Model(observations, path, np.ones_like(path), rough=False)
    return refined(model, LandmarkPriors.nothing(len(observations.ids)), pinned=True)


@dataclass(frozen=True)
class _Weighted:
    """A model about one reference path, weights, and the solution with them."""

    model: Model
    weights: Weights
    solution: Solution
    converged: bool = False

    def sigmas_from(self, before: _Weighted) -> float:
        """By how many of its standard deviations the node moved, or they changed, that did most since ``before``."""
        moved, changed = np.abs(self._position - before._position), np.abs(self._sigma_m - before._sigma_m)
        return float((np.maximum(moved, changed) / self._sigma_m).max())

    @property
    def _position(self) -> ComplexArray:
        """(k,) of the nodes, complex metres."""
        state = self.solution.state
        return np.asarray(self.model.path[self.model.observations.nodes] + state[:, 0] + 1j * state[:, 1])

    @property
    def _sigma_m(self) -> FloatArray:
        """(k,) standard deviations per axis of the nodes' positions."""
        return np.asarray(np.sqrt(np.trace(self.solution.covariance[:, :2, :2], axis1=1, axis2=2) / 2))

    def linearised_again(self) -> Model:
        """The model about the path that was found."""
        return _relinearised(self.model, states_between_nodes(self.model, self.weights, self.solution))


def _weighted(
    model: Model,
    priors: LandmarkPriors,
    weights: Weights,
    *,
    pinned: bool = False,
    tolerance: float,
    caution: float = 1.0,
) -> _Weighted:
    """Re-weight about one reference path; the first rounds are cautious (:data:`CAUTION`) by a factor."""

    def solved(weights: Weights, number: int) -> _Weighted:
        cautious = replace(weights, sighting=weights.sighting * max(caution * RELAXATION**number, 1.0))
        return _Weighted(model, cautious, solve(normal_equations(model, priors, cautious, pinned=pinned)))

    def step(before: _Weighted, number: int) -> _Weighted:
        squares = expected_squares(model, priors, before.weights, before.solution)
        return solved(reweighted(model, before.weights, squares), number)

    done = iterate(
        "the weighting of a walk's observations",
        solved(weights, 0),
        step,
        lambda before, after: after.sigmas_from(before),
        tolerance=tolerance,
        most_rounds=MOST_ROUNDS,
        least_rounds=1 + ceil(log(caution) / -log(RELAXATION)),
    )
    return replace(done.state, converged=done.converged)


def refined(
    model: Model, priors: LandmarkPriors, told: TrackerNoise | None = None, *, pinned: bool = False
) -> SolvedWalk:
    """Re-weight, and linearise about the path found, until both settle; ``pinned`` to the walk's first pose."""
    tolerance = SETTLED_SIGMAS_IN_OWN_FRAME if pinned else SETTLED_SIGMAS

    def weighted(model: Model, weights: Weights) -> _Weighted:
        return _weighted(model, priors, weights, pinned=pinned, tolerance=tolerance)

    done = iterate(
        "the path that a walk is linearised about",
        weighted(model, _even(model, priors, told)),
        lambda before, _: weighted(before.linearised_again(), before.weights),
        lambda before, after: after.sigmas_from(before),
        tolerance=tolerance,
        most_rounds=MOST_RELINEARISATIONS,
    )
    model, weights = done.state.model, equivalent_variances(done.state.model, done.state.weights)
    solution = solve(normal_equations(model, priors, weights, pinned=pinned))
    return SolvedWalk(model, priors, weights, solution, done.converged and done.state.converged)


def _even(model: Model, priors: LandmarkPriors, told: TrackerNoise | None) -> Weights:
    return Weights.even(assumed(told)[0], len(model.observations.passes.at), len(priors.position), told)


def _roughly_mapped(observations: WalkObservations, priors: LandmarkPriors, told: TrackerNoise | None) -> Model:
    """Solve with heading and scale free: linear, so that nothing needs to be known before."""
    path = observations.odometry.path
    model = Model(observations, path, np.ones_like(path), rough=True)
    weights = replace(_even(model, priors, told), sighting=np.where(_agreeing(observations, priors), 1.0, DOUBT))
    return _weighted(model, priors, weights, caution=CAUTION, tolerance=ROUGHLY_SETTLED_SIGMAS).linearised_again()


def _agreeing(observations: WalkObservations, priors: LandmarkPriors) -> BoolArray:
    """(p,) passes that lie as far from a neighbouring one as surveyed, or have nothing to be compared with."""
    passes = observations.passes
    seen = observations.odometry.path[passes.at] + passes.offset
    place = priors.position[passes.landmark]
    compared, agreed = np.zeros(len(seen), dtype=np.int64), np.zeros(len(seen), dtype=np.int64)
    for ahead in range(1, NEIGHBOURING + 1):
        true, logged = np.abs(place[ahead:] - place[:-ahead]), np.abs(seen[ahead:] - seen[:-ahead])
        apart = true > LEAST_APART_M
        alike = apart & (np.abs(true - logged) < CLOSE_M + SCALE_TOLERANCE * true)
        for pair in (slice(ahead, None), slice(None, -ahead)):
            compared[pair] += apart
            agreed[pair] += alike
    return np.asarray((agreed > 0) | (compared == 0))


def _headed_by_a_sheet(observations: WalkObservations, priors: LandmarkPriors) -> Model | None:
    """Turn the walk as the sheets say whose heading is surveyed, and move it to a surveyed landmark."""
    passes = observations.passes
    headed = np.flatnonzero((passes.heading != 0) & np.isfinite(priors.heading_rad[passes.landmark]))
    if headed.size == 0:
        return None
    landmark = passes.landmark[headed]
    votes = np.exp(1j * priors.heading_rad[landmark]) * passes.heading[headed].conj()
    turn = np.full(len(observations.odometry.path), votes.sum() / abs(votes.sum()))
    path = observations.odometry.path * turn
    seen = path[passes.at[headed[0]]] + passes.offset[headed[0]] * turn[0]
    return Model(observations, path + (priors.position[landmark[0]] - seen), turn, rough=False)


def _relinearised(model: Model, knots: FrameStates) -> Model:
    """Take the solved headings into the reference path; scale stays with the states."""
    count = len(model.path)
    state = knots.at_frames(knots.state, count)
    factor = (1 + state[:, 2] if model.rough else 1.0) + 1j * state[:, 3]
    turn = factor / np.abs(factor) if model.rough else np.exp(1j * state[:, 3])
    middle = turn[1:] + turn[:-1]
    step = np.diff(model.path) * middle / np.abs(middle)
    start = model.path[0] + complex(state[0, 0], state[0, 1])
    return Model(model.observations, start + np.concatenate(([0], np.cumsum(step))), model.turn * turn, rough=False)


def mapped_path(smoothed: SolvedWalk) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Positions (n, 2) in the BCS, metres, their covariances (n, 2, 2) and ``bcs_R_acs`` (n,) as angles, rad."""
    model, knots = smoothed.model, smoothed.knots()
    count = len(model.path)
    state = knots.at_frames(knots.state, count)
    covariance = knots.at_frames(knots.covariance[:, :2, :2], count)
    covariance += model.observations.odometry.aside_m2[:, None, None] * np.eye(2)
    covariance += beside_the_survey(model, smoothed.priors, smoothed.weights, smoothed.solution)
    position = model.path + state[:, 0] + 1j * state[:, 1]
    turn = model.turn * model.observations.odometry.turn
    return as_points(position), covariance, np.angle(turn) + state[:, 3]


AWAY_S = 0.5
"""A moment farther than this from every frame ties nothing."""


def solve_with_ties(smoothed: SolvedWalk, time_ns: IntArray, ties: PlaceTies) -> SolvedWalk:
    """Solve a walk again, about its path by landmarks alone, with the places that others tell.

    ``time_ns`` (n,) are the times of the odometry's frames.
    """
    at, rows = _frames(time_ns, ties.time_ns)
    if not len(rows):
        return smoothed
    observations = _with_passes(smoothed.model.observations, at)
    priors = _with_places(smoothed.priors, ties, rows)
    return refined(replace(smoothed.model, observations=observations), priors, smoothed.weights.told)


def _frames(time_ns: IntArray, moments_ns: IntArray) -> tuple[IntArray, IntArray]:
    """Frames (k,) nearest to those of the moments (m,) that have one nearby, and which moments (k,) these are."""
    after = np.searchsorted(time_ns, moments_ns).clip(1, len(time_ns) - 1)
    nearer = moments_ns - time_ns[after - 1] < time_ns[after] - moments_ns
    at = (after - nearer).astype(np.int64)
    rows = np.flatnonzero(np.abs(time_ns[at] - moments_ns) < AWAY_S * 1e9)
    return at[rows], rows


def _with_passes(observations: WalkObservations, at: IntArray) -> WalkObservations:
    """Observations with a pass at each of some frames (k,) of a landmark of its own, at the camera."""
    passes, count = observations.passes, len(at)
    zeros = np.zeros(count)
    nowhere = np.zeros(count, dtype=np.complex128)
    order = np.argsort(np.concatenate((passes.at, at)), kind="stable")
    own = len(observations.ids) + np.arange(count)
    merged = Passes(
        at=np.concatenate((passes.at, at))[order],
        landmark=np.concatenate((passes.landmark, own))[order],
        offset=np.concatenate((passes.offset, nowhere))[order],
        heading=np.concatenate((passes.heading, nowhere))[order],
        distance_m=np.concatenate((passes.distance_m, zeros))[order],
        spread_m=np.concatenate((passes.spread_m, zeros))[order],
        count=np.concatenate((passes.count, np.ones(count, dtype=np.int64)))[order],
    )
    return replace(observations, ids=(*observations.ids, *("" for _ in at)), passes=merged)


def _with_places(priors: LandmarkPriors, ties: PlaceTies, rows: IntArray) -> LandmarkPriors:
    """Priors with a place for each of some ties (k,), after the landmarks."""
    column = (2 * rows[:, None] + (0, 1)).ravel()
    position, unknown = as_complex(ties.position_bcs[rows]), np.full(len(rows), np.nan)
    told = ToldPlaces(landmark_shares(priors, position), ties.covariance_m2[np.ix_(column, column)])
    each = np.arange(2 * len(rows)).reshape(-1, 2)
    return LandmarkPriors(
        position=np.concatenate((priors.position, position)),
        covariance=np.concatenate((priors.covariance, told.own[each[:, :, None], each[:, None, :]])),
        heading_rad=np.concatenate((priors.heading_rad, unknown)),
        heading_sigma_rad=np.concatenate((priors.heading_sigma_rad, unknown)),
        joint=priors.joint,
        told=told,
    )
