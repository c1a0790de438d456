"""The expected path through a walk's fixes: Gauss-Newton for each possible scatter of the fixes, then the mean.

Its covariance also covers walkers and buildings unlike those of the calibration. Few fixes cannot distinguish an
unusual speed, or a plan with a wrong north, from a wrong path. The path is therefore fitted a second time with a much
less certain speed and north. With enough fixes both fits agree, and the covariance stays the usual one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, pi, remainder

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.robust import StoppingRule, iterate
from vislam2tag.core.transforms import as_points
from vislam2tag.estimation.dead_reckoning.factors import HEADING, STATES, PathModel, PathState, WalkFixes
from vislam2tag.estimation.least_squares import most_probable, solve

ROUNDS = 100
CLOSE_M = 0.02
"""Farthest that a node may be from the limit."""
LONGEST_TURN_RAD = 0.7
"""Largest turn of the path in a round; the equations hold for small turns."""
LONG_M2 = 4.0
"""Smallest spread of fixes and path for estimating a heading from both."""
FAR_M2 = 50.0
"""Smallest spread (two fixes 10 m apart) for concluding that the phone is carried turned."""
CARRIED_TURNED_RAD = 0.5
"""A phone in the hand points forward at least this well."""
AGAINST_TURNED = 6.0
"""Minus twice the logarithm of the probability that a phone is carried turned (one walk in twenty)."""
FACTORS = np.exp(np.linspace(-0.8, 1.1, 6))
"""Candidates for the scatter of fixes, as multiples of the usual one."""
FIX_SIGMA_SPREAD = 0.6
"""Variation of that scatter between sessions: standard deviation of its logarithm."""
LEAST_SHARE = 0.02
"""Candidates with a smaller probability are skipped."""
WIDE_SCALE_SIGMA = 0.3
"""Relative error of an unusual walker's speed, one standard deviation."""
WIDE_NORTH_MEMORY_S = 100.0
"""Duration of an error of the phone's north if the plan has a wrong north, seconds."""


@dataclass(frozen=True)
class SmoothedPath:
    """A path through a walk's fixes: ``state`` at ``k`` nodes and ``covariance`` (k, 5, 5) of x, y, scale, heading and
    offset.

    Both are means over the possible scatters of the fixes. ``fix_sigma_m`` is the root mean square of that scatter,
    ``scatter_m`` (k,) its value at each node, and ``unreached_m`` the estimated distance from the limit where the path
    did not converge, else 0.
    """

    state: PathState
    covariance: FloatArray
    fix_sigma_m: float
    scatter_m: FloatArray
    unreached_m: float


@dataclass(frozen=True)
class _Step:
    """A state, the logarithm of the determinant of the equations that led to it, and how far they ``moved`` the nodes
    (k,), complex metres; infinite if the turn was limited.
    """

    state: PathState
    moved: ComplexArray
    log_determinant: float


@dataclass(frozen=True)
class _Fitted:
    state: PathState
    cost: float
    evidence: float
    sigma_m: float
    unreached_m: float


def smooth_path(model: PathModel, fixes: WalkFixes) -> SmoothedPath:
    """Find the path that fits sensors and fixes, as a mean over the possible scatters of fixes by their evidence.

    Needs at least one fix. Raises numpy.linalg.LinAlgError if the numbers overflow.
    """
    tries = [(_fitted(carried, fixes, state), carried, doubt) for carried, state, doubt in _starts(model, fixes)]
    start, model, _ = min(tries, key=lambda each: each[0].cost + each[2])
    fitted = [
        _fitted(model, replace(fixes, sigma_m=fixes.sigma_m * factor), start.state) for factor in FACTORS.tolist()
    ]
    against = np.array([each.evidence for each in fitted])
    against += (np.log(FACTORS) / FIX_SIGMA_SPREAD) ** 2
    share = np.exp((against.min() - against) / 2)
    share = np.where(share < LEAST_SHARE * share.sum(), 0, share)
    likely = np.flatnonzero(share).tolist()
    return _mean_path(model, fixes, [fitted[index] for index in likely], share[likely] / share.sum())


def _mean_path(model: PathModel, fixes: WalkFixes, fitted: list[_Fitted], share: FloatArray) -> SmoothedPath:
    """Mean of paths with shares (p,) that sum to 1, and its covariance: their own plus their differences."""
    states = np.stack([each.state.columns for each in fitted])
    mean = np.tensordot(share, states, axes=1)
    covariance = np.zeros((len(mean), STATES, STATES))
    for part, each, state in zip(share.tolist(), fitted, states, strict=True):
        own = solve(model.equations(each.state, replace(fixes, sigma_m=each.sigma_m))).covariance
        covariance += part * (own + (state - mean)[:, :, None] * (state - mean)[:, None, :])
    sigma_m = float(np.sqrt(share @ np.square([each.sigma_m for each in fitted])))
    path = PathState.of_columns(mean)
    scatter_m = sigma_m * model.scatter(path)
    return SmoothedPath(path, covariance, sigma_m, scatter_m, max(each.unreached_m for each in fitted))


def _starts(model: PathModel, fixes: WalkFixes) -> list[tuple[PathModel, PathState, float]]:
    """Models and states to start from, with their penalties: turned by the phone's own heading, and by the fixes. If
    these differ much, the phone may be carried turned, as in a pocket.
    """
    raw, drift = model.nodes.raw, model.nodes.drift_rad
    known = drift[np.isfinite(drift)]
    own = float(np.angle(np.exp(1j * known).mean())) if len(known) else 0.0
    seen, there = _centred(raw[fixes.node]), _centred(fixes.position)
    alike = complex((seen.conj() * there).sum())
    starts = [(model, _turned(raw, fixes, own), 0.0)]
    if abs(alike) > LONG_M2:
        lie = float(np.angle(alike))
        turn = remainder(lie - own, 2 * pi) if len(known) else 0.0
        starts.append((model, _turned(raw, fixes, lie), 0.0))
        if abs(turn) > CARRIED_TURNED_RAD and abs(alike) > FAR_M2:
            carried = replace(model, nodes=replace(model.nodes, drift_rad=drift + turn))
            starts.append((carried, _turned(raw, fixes, lie), AGAINST_TURNED))
    return starts


def _turned(raw: ComplexArray, fixes: WalkFixes, heading_rad: float) -> PathState:
    """The sensors' path (k,), metres, turned and moved onto the fixes."""
    path = raw * np.exp(1j * heading_rad)
    path += fixes.position.mean() - path[fixes.node].mean()
    return PathState(path, np.zeros(len(raw)), np.full(len(raw), heading_rad), np.zeros(len(raw)))


def _centred(values: ComplexArray) -> ComplexArray:
    return np.asarray(values - values.mean())


def _fitted(model: PathModel, fixes: WalkFixes, start: PathState) -> _Fitted:
    """Gauss-Newton steps from a start, with turns limited to the range of the linearisation."""

    def step(before: _Step, _number: int, times: float = 1.0) -> _Step:
        change, log_determinant = most_probable(model.equations(before.state, fixes))
        share = min(1.0, LONGEST_TURN_RAD / max(times * float(np.abs(change[:, HEADING]).max()), 1e-12))
        moved = change[:, 0] + 1j * change[:, 1] if share == 1 else np.array(inf + 0j)
        return _Step(PathState.of_columns(before.state.columns + share * times * change), moved, log_determinant)

    done = iterate(
        "the path through a walk's fixes",
        _Step(start, np.array(inf + 0j), 0.0),
        step,
        lambda _, after: after.moved,
        StoppingRule(tolerance=CLOSE_M, most_rounds=ROUNDS),
        long_step=step,
        logged=False,
    )
    state, log_determinant = done.state.state, done.state.log_determinant
    cost = model.cost(state, fixes)
    volume = log_determinant + 4 * len(fixes.node) * float(np.log(fixes.sigma_m))
    return _Fitted(state, cost, cost + volume, fixes.sigma_m, done.unreached)


def covering_covariance(path: SmoothedPath, model: PathModel, fixes: WalkFixes) -> FloatArray:
    """(k, 2, 2) covariance of each node's position: the path's own, or, if greater, the second fit's spread about it.

    Raises numpy.linalg.LinAlgError as :func:`~vislam2tag.estimation.dead_reckoning.smoothing.smooth_path` does.
    """
    own = path.covariance[:, :2, :2]
    unusual = replace(model, scale_sigma=WIDE_SCALE_SIGMA, north_memory_s=WIDE_NORTH_MEMORY_S)
    other = smooth_path(unusual, fixes)
    apart_m = as_points(other.state.position - path.state.position)
    spread = other.covariance[:, :2, :2] + apart_m[:, :, None] * apart_m[:, None, :]
    greater = np.trace(spread, axis1=1, axis2=2) > np.trace(own, axis1=1, axis2=2)
    return np.where(greater[:, None, None], spread, own)
