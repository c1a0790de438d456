"""The smoother: one robust least-squares problem over a whole walk (docs/explanation/smoother.md).

The tracker's path, made continuous (``odometry``), is put into the building as a reference path with positions ``c``
and headings ``R``. The unknowns are its errors at each node ``k`` (the first frame, one frame of each pass of a
landmark, the last frame), and the survey errors of each landmark ``l``:

    x_k = (dx, dy, ds, dt)   position error, metres; relative scale error; heading error, rad
    e_l = (dx, dy), h_l      error of the surveyed place, metres, and of the sheet's heading, rad

Residuals, each with its expected covariance:

    start:    x_0                                 dx, dy, dt free and ds 0.02, or pinned to the walk's first pose
    drift:    x_(k+1) - F_k x_k + d_k              sum over sources of level^2 Q_k, Q_k from sums along the path
    sighting: (L_l + e_l) - (c_p + R_p o_p) - H_p x_p    sighting_m^2 (1 + distance^2) / 2 + scatter^2 + aside_p
    heading:  (A_l + h_l) - arg(R_p u_p) - dt_p    sheet_rad^2
    survey:   e_l, h_l                            covariance of the survey, and of places by other sessions

``F_k`` propagates an error from node to node, and ``d_k`` is the drift that the reference already contains. At pass
``p`` the tracker saw the landmark at ``o_p`` from the camera, with its sheet turned to ``u_p``. ``L_l`` and ``A_l`` are
the landmark's surveyed place and heading. ``H_p x_p`` is the effect of the errors on a place at ``R_p o_p``.
``aside_p`` (``aside_m2`` of the odometry) is the lateral variance of the camera while the tracker had jumped away, 0 at
other frames. All residuals are linear, so the problem is one chain with a border (``least_squares``); ``factors`` makes
its matrices.

Two loops solve it. The inner one (:func:`reweight_until_converged`) keeps the reference path. It multiplies variances
by factors for Student's t and estimates the noise levels, both from the last solution (``reweighting``). The outer one
(:func:`relinearise_until_converged`) uses the estimated path as the next reference. Covariances are then computed once
more, with the normal distribution equivalent to each Student's t.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.core.context import PlaceTies, TrackerNoise
from vislam2tag.core.robust import Caution, StoppingRule, iterate
from vislam2tag.core.transforms import as_complex, as_points
from vislam2tag.estimation.factors import LinearWalk, Model, heading_origin, landmark_origin
from vislam2tag.estimation.frame_states import beside_the_survey, states_between_nodes
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.least_squares import Solution, solve
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.reweighting import equivalent_variances, expected_squares, reweighted
from vislam2tag.estimation.tracker_errors import NoiseLevels, VarianceFactors, assumed

CONVERGED_SIGMAS = 0.03
"""Re-weighting has converged when no node is farther than this from the limit, in its standard deviations, and these
are known to this share."""
ROUGHLY_CONVERGED_SIGMAS = 20.0
"""The first solution is only a start."""
CONVERGED_SIGMAS_IN_OWN_FRAME = 0.01
"""Relative to the walk's start sigmas grow along the path, although places close together are known equally well."""
LEAST_RATE, FIRST_RATE = 0.9, 0.95
"""A slow change of the noise levels may follow fast changes of weights, and shows only when these have ended."""
RATE_OF_PATHS = 0.55
"""Each path is much closer than the one before (Gauss-Newton: about ten times)."""
REFERENCE_KNOT_S = 1.0
"""Interval of the states that make the next reference path, which need not be exact."""
LONGER = 1.4
"""Each step of re-weighting is made longer by this factor (over-relaxation), which saves a sixth of the rounds."""
MOST_ROUNDS = 300
"""Limit for one reference path; usually 10 to 20."""
MOST_RELINEARISATIONS = 10
"""Limit of reference paths; the second usually moves no node by as much."""
ROUGH_CAUTION, NO_CAUTION = Caution(30.0, 0.4), Caution()
"""Weights of sightings in the first solution, and in all later ones."""
LEAST_BASE_M = 0.5
"""Landmarks that are all closer together do not show a heading, because each is seen to about 0.1 m."""
AWAY_S = 0.5
"""Places at a larger distance in time from every frame are ignored."""


def solve_walk(
    observations: WalkObservations, priors: LandmarkPriors, prior_noise: TrackerNoise | None = None
) -> SolvedWalk | None:
    """Map a walk into the BCS; None if it has no connection to it.

    The heading in the building must be roughly known before scale and heading errors can be small. Two surveyed
    landmarks apart give it by a first solution with free heading and scale; otherwise a sheet with a surveyed heading
    does. At first the tracker's noise is assumed to be usual, or as other walks of the survey show it
    (``prior_noise``).
    """
    start = first_problem(observations, priors, prior_noise)
    return None if start is None else relinearise_until_converged(start)


def first_problem(
    observations: WalkObservations, priors: LandmarkPriors, prior_noise: TrackerNoise | None = None
) -> LinearWalk | None:
    """Place a walk roughly in the BCS; None if it has no connection to it."""
    passed = np.intersect1d(np.flatnonzero(priors.surveyed), observations.passes.landmark)
    apart = _extent_m(priors.position[passed]) > LEAST_BASE_M
    start = _with_free_heading(observations, priors, prior_noise) if apart else _headed_by_a_sheet(observations, priors)
    return None if start is None else initial_problem(start, priors, prior_noise)


def relinearise_until_converged(walk: LinearWalk) -> SolvedWalk:
    """Use the estimated path as the next reference until no node moves, then compute the covariances."""
    tolerance = CONVERGED_SIGMAS_IN_OWN_FRAME if walk.pinned else CONVERGED_SIGMAS

    def about_path_found(before: SolvedWalk, _: int) -> SolvedWalk:
        return reweight_until_converged(replace(before.linear, model=_relinearised(before)), tolerance, start=before)

    done = iterate(
        "the linearisation of a walk's path",
        reweight_until_converged(walk, tolerance),
        about_path_found,
        _sigmas_between,
        StoppingRule(tolerance=tolerance, most_rounds=MOST_RELINEARISATIONS, first_rate=RATE_OF_PATHS),
    )
    linear = done.state.linear
    stated = equivalent_variances(linear.model, linear.variance_factors)
    unreached = max(done.unreached, done.state.unreached_sigmas)
    return replace(SolvedWalk.of(replace(linear, variance_factors=stated)), unreached_sigmas=unreached)


def reweight_until_converged(
    walk: LinearWalk, tolerance: float, caution: Caution = NO_CAUTION, start: SolvedWalk | None = None
) -> SolvedWalk:
    """Solve about one reference path, with levels and factors from the last solution, until no node moves.

    The first of these solutions is ``start``, about another path, or else that with the walk's own factors.
    """

    def solve_with(factors: VarianceFactors, number: int) -> SolvedWalk:
        cautious = replace(factors, sighting=factors.sighting * caution.at(number))
        return SolvedWalk.of(replace(walk, variance_factors=cautious))

    def step(before: SolvedWalk, number: int, times: float = 1.0) -> SolvedWalk:
        factors, squares = before.variance_factors, expected_squares(before.linear, before.solution)
        return solve_with(factors.beyond(reweighted(walk.model, factors, squares), LONGER * times), number)

    done = iterate(
        "the reweighting of a walk's observations",
        start or solve_with(walk.variance_factors, 0),
        step,
        _sigmas_between,
        StoppingRule(
            tolerance=tolerance,
            most_rounds=MOST_ROUNDS,
            least_rounds=caution.rounds,
            least_rate=LEAST_RATE,
            first_rate=FIRST_RATE,
        ),
        long_step=step,
    )
    return replace(done.state, unreached_sigmas=done.unreached)


def _sigmas_between(before: SolvedWalk, after: SolvedWalk) -> ComplexArray:
    """(2k,) movements of the nodes, complex, and changes of their sigmas, in standard deviations."""
    sigma_m = after.node_sigma_m
    return np.concatenate(((after.node_position - before.node_position) / sigma_m, 1 - before.node_sigma_m / sigma_m))


def _relinearised(walk: SolvedWalk) -> Model:
    """The model about the estimated path: solved headings become those of the reference; scale stays with the
    states."""
    model, count = walk.model, len(walk.model.path)
    knots = states_between_nodes(walk.linear, walk.solution, REFERENCE_KNOT_S)
    state = knots.at_frames(knots.state, count)
    factor = (1 + state[:, 2] if model.rough else 1.0) + 1j * state[:, 3]
    turn = factor / np.abs(factor) if model.rough else np.exp(1j * state[:, 3])
    middle = turn[1:] + turn[:-1]
    step = np.diff(model.path) * middle / np.abs(middle)
    start = model.path[0] + complex(state[0, 0], state[0, 1])
    return Model(model.observations, start + np.concatenate(([0], np.cumsum(step))), model.turn * turn, rough=False)


def initial_problem(model: Model, priors: LandmarkPriors, prior_noise: TrackerNoise | None = None) -> LinearWalk:
    """The linear problem about a first reference path: assumed noise levels, equal weights."""
    passes, marks = len(model.observations.passes.at), len(priors.position)
    return LinearWalk(model, priors, VarianceFactors.even(assumed(prior_noise)[0], passes, marks, prior_noise))


def _with_free_heading(
    observations: WalkObservations, priors: LandmarkPriors, prior_noise: TrackerNoise | None
) -> Model:
    """Solve with free heading and scale, which is linear and needs no prior knowledge."""
    path = observations.odometry.path
    start = initial_problem(Model(observations, path, np.ones_like(path), rough=True), priors, prior_noise)
    return _relinearised(reweight_until_converged(start, ROUGHLY_CONVERGED_SIGMAS, ROUGH_CAUTION))


def _headed_by_a_sheet(observations: WalkObservations, priors: LandmarkPriors) -> Model | None:
    """Turn the walk by the sheets with a surveyed heading, and move it to a surveyed landmark."""
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


def _extent_m(place: ComplexArray) -> float:
    """Diagonal of the box around some places (k,), complex metres; 0 if there are none."""
    return float(np.hypot(np.ptp(place.real), np.ptp(place.imag))) if place.size else 0.0


@dataclass(frozen=True)
class SolvedWalk:
    """A walk's linear problem and its solution, from which all results follow."""

    linear: LinearWalk
    solution: Solution
    unreached_sigmas: float = 0.0
    """Estimated distance from the limit, in standard deviations; 0 if it is below :data:`CONVERGED_SIGMAS`."""

    @classmethod
    def of(cls, linear: LinearWalk) -> SolvedWalk:
        """Solve a linear problem with its present variances."""
        return cls(linear, solve(linear.normal_equations()))

    @property
    def model(self) -> Model:
        """The reference path and the observations along it."""
        return self.linear.model

    @property
    def priors(self) -> LandmarkPriors:
        """The survey of the landmarks."""
        return self.linear.priors

    @property
    def variance_factors(self) -> VarianceFactors:
        """Noise levels and factors of the observations' variances."""
        return self.linear.variance_factors

    @property
    def noise(self) -> NoiseLevels:
        """Estimated noise levels of the session."""
        return self.variance_factors.noise

    @property
    def node_position(self) -> ComplexArray:
        """(k,) positions of the nodes, complex metres."""
        state = self.solution.state
        return np.asarray(self.model.path[self.model.observations.nodes] + state[:, 0] + 1j * state[:, 1])

    @property
    def node_sigma_m(self) -> FloatArray:
        """(k,) standard deviations per axis of the nodes' positions."""
        return np.asarray(np.sqrt(np.trace(self.solution.covariance[:, :2, :2], axis1=1, axis2=2) / 2))

    @property
    def drift_residual(self) -> FloatArray:
        """(p + 1, 4) the drift over each stretch between nodes: x, y, metres in the BCS, scale and heading."""
        return self.linear.drift_factor.residual(self.solution.state)

    @property
    def landmark_position(self) -> ComplexArray:
        """(m,) most probable positions, complex metres; the surveyed one for landmarks that were never passed."""
        error = self.solution.border[: 2 * len(self.priors.position)]
        return np.asarray(landmark_origin(self.model, self.priors) + error[::2] + 1j * error[1::2])

    @property
    def landmark_heading_rad(self) -> FloatArray:
        """(m,) most probable headings of the sheets."""
        marks = len(self.priors.position)
        return np.asarray(heading_origin(self.model, self.priors) + self.solution.border[2 * marks :])

    def mean_scale(self) -> tuple[float, float]:
        """Length of the walk in the building relative to the tracker's, and its standard deviation."""
        sigma = np.sqrt(self.solution.covariance[:, 2, 2])
        return 1 + float(self.solution.state[:, 2].mean()), float(sigma.mean())

    def landmark_covariance(self) -> FloatArray:
        """(m, 2, 2) covariance of :attr:`landmark_position`, m^2."""
        column = np.arange(2 * len(self.priors.position)).reshape(-1, 2)
        return np.asarray(self.solution.border_covariance[column[:, :, None], column[:, None, :]])


def solve_in_own_frame(observations: WalkObservations) -> SolvedWalk:
    """Map a walk and its landmarks in the frame of its first pose, from the walk alone."""
    path = observations.odometry.path
    model = Model(observations, path, np.ones_like(path), rough=False)
    nothing = LandmarkPriors.nothing(len(observations.ids))
    return relinearise_until_converged(replace(initial_problem(model, nothing), pinned=True))


def solve_with_ties(smoothed: SolvedWalk, time_ns: IntArray, ties: PlaceTies) -> SolvedWalk:
    """Solve a walk again, about its path by landmarks alone, with places from other sessions.

    Each such moment is treated as a pass of a landmark at the camera. Like any surveyed place it may be wrong
    (Student's t). ``time_ns`` (n,) are the times of the odometry's frames.
    """
    at, rows = _frames(time_ns, ties.time_ns)
    if not len(rows):
        return smoothed
    column = (2 * rows[:, None] + (0, 1)).ravel()
    priors = smoothed.priors.with_places(
        as_complex(ties.position_bcs[rows]), ties.covariance_m2[np.ix_(column, column)]
    )
    model = replace(smoothed.model, observations=smoothed.model.observations.with_places(at))
    return relinearise_until_converged(initial_problem(model, priors, smoothed.variance_factors.prior_noise))


def solve_about_places(
    observations: WalkObservations,
    priors: LandmarkPriors,
    at: IntArray,
    place: ComplexArray,
    turn_rad: FloatArray,
    covariance_m2: FloatArray,
    prior_noise: TrackerNoise | None = None,
) -> SolvedWalk:
    """Map a walk by where the camera was at some frames ``at`` (k,) of the odometry, and by its landmarks if any.

    ``place`` (k,) complex, metres, with ``covariance_m2`` (2k, 2k) of x and y of each; ``turn_rad`` (k,) is
    ``bcs_R_continuous`` there. Places may be wrong, as those of :func:`solve_with_ties`.
    """
    path = observations.odometry.path
    turn = np.exp(1j * np.interp(np.arange(len(path)), at, np.unwrap(turn_rad)))
    middle = turn[1:] + turn[:-1]
    way = np.concatenate(([0.0], np.cumsum(np.diff(path) * middle / np.abs(middle))))
    model = Model(observations.with_places(at), way + (place - way[at]).mean(), turn, rough=False)
    return relinearise_until_converged(initial_problem(model, priors.with_places(place, covariance_m2), prior_noise))


def _frames(time_ns: IntArray, moments_ns: IntArray) -> tuple[IntArray, IntArray]:
    """Frames (k,) closest to those of the moments (m,) that have one nearby, and the indices (k,) of these moments."""
    after = np.searchsorted(time_ns, moments_ns).clip(1, len(time_ns) - 1)
    nearer = moments_ns - time_ns[after - 1] < time_ns[after] - moments_ns
    at = (after - nearer).astype(np.int64)
    rows = np.flatnonzero(np.abs(time_ns[at] - moments_ns) < AWAY_S * 1e9)
    return at[rows], rows


def mapped_path(smoothed: SolvedWalk) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Positions (n, 2) in the BCS, metres, their covariances (n, 2, 2) and ``bcs_R_acs`` (n,) as angles, rad."""
    model, knots = smoothed.model, states_between_nodes(smoothed.linear, smoothed.solution)
    count = len(model.path)
    state = knots.at_frames(knots.state, count)
    covariance = knots.at_frames(knots.covariance(2), count)
    covariance += model.observations.odometry.aside_m2[:, None, None] * np.eye(2)
    covariance += beside_the_survey(smoothed.linear, smoothed.solution)
    position = model.path + state[:, 0] + 1j * state[:, 1]
    turn = model.turn * model.observations.odometry.turn
    return as_points(position), covariance, np.angle(turn) + state[:, 3]
