"""Local maps of many walks and a survey of some landmarks, joined to one map of all landmarks
(docs/explanation/landmarks.md).

The unknowns are the places and headings of all landmarks in the BCS, and the position and rotation of each walk's
frame. A walk's map has errors by its covariance. It may also see a landmark at another place: a sheet that was moved,
or another one with its id. Surveyed places may be wrong, too. Tails of Student's t absorb what does not fit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray, of_landmarks
from vislam2tag.core.robust import Caution, StoppingRule, iterate, variance_factor
from vislam2tag.core.transforms import wrapped
from vislam2tag.estimation.landmark_priors import FREE_M, FREE_RAD, LandmarkPriors
from vislam2tag.estimation.landmark_survey.local_map import Chart, LinearMap, LocalMap, tied_to_survey

SHIFT_M, SHIFT_NUMBERS = 0.06, 1.0
"""Usual offset of a sight from the landmark's place, per axis (a prior with the weight of this many numbers) ..."""
SHIFT_DOF, WALK_DOF, SURVEY_DOF = 3.0, 4.0, 2.0
"""... and degrees of freedom of Student's t for larger ones. Walks as a whole and the survey also have such tails."""
SETTLED_M = 1e-6
"""Re-weighting has converged when no landmark moves by more than this. Rounds are few, and the result then depends
neither on the order of the walks nor on the building's frame."""
MOST_ROUNDS = 200
"""Iteration limit, far above the usual number."""
CAUTION = Caution(100.0, 0.5)
"""For the sights of walks, not for the survey: a few places that may all be wrong would follow the walks."""


@dataclass(frozen=True)
class Doubts:
    """Offset of sights, ``shift_m`` per axis, and factors on variances relative to the usual ones: ``shift`` (k,) for
    each map, ``walk`` (b,) and ``survey`` (m,).
    """

    shift_m: float
    shift: tuple[FloatArray, ...]
    walk: FloatArray
    survey: FloatArray

    @property
    def seen_off_m2(self) -> float:
        """Mean variance per axis of the offset of a walk's sights."""
        return self.shift_m**2 * (SHIFT_DOF + 2) / SHIFT_DOF

    def expected(self) -> Doubts:
        """For covariances: the mean variance of each offset instead of the inverse mean precision of re-weighting."""
        return replace(self, shift=tuple(one * (SHIFT_DOF + 2) / SHIFT_DOF for one in self.shift))

    def cautious(self, factor: float) -> Doubts:
        """Trust the sights of walks less, by a factor."""
        return replace(self, shift=tuple(one * factor for one in self.shift))


@dataclass(frozen=True)
class LandmarkMap:
    """``m`` landmarks in the BCS, from those of ``b`` maps that are connected to the survey.

    ``position`` (m,) complex, metres; ``heading_rad`` (m,); ``covariance`` (3m, 3m) of x, y of each, then of all
    headings, almost infinite for unknown values. ``origin`` (b,) complex and ``turn_rad`` (b,) are the poses of the
    maps' frames, NaN for maps that are not connected.
    """

    maps: tuple[LocalMap, ...]
    priors: LandmarkPriors
    doubts: Doubts
    position: ComplexArray
    heading_rad: FloatArray
    covariance: FloatArray
    origin: ComplexArray
    turn_rad: FloatArray
    converged: bool = True
    """Whether re-weighting converged."""

    @property
    def tied(self) -> BoolArray:
        """(b,) maps that take part."""
        return np.asarray(np.isfinite(self.turn_rad))

    @property
    def position_covariance(self) -> FloatArray:
        """(m, 2, 2) of the positions, m^2."""
        column = np.arange(2 * len(self.position)).reshape(-1, 2)
        return np.asarray(self.covariance[column[:, :, None], column[:, None, :]])

    def shared_covariance(self, rows: IntArray) -> FloatArray:
        """(3k, 3k) covariance of the sights of some landmarks (k,), headings last, including the offset of sights."""
        covariance, places = of_landmarks(self.covariance, rows), np.arange(2 * len(rows))
        covariance[places, places] += self.doubts.seen_off_m2
        return (covariance + covariance.T) / 2

    @property
    def placed(self) -> BoolArray:
        """(m,) landmarks that the survey or a walk places."""
        variance = np.trace(self.position_covariance, axis1=1, axis2=2) / 2
        return np.asarray(variance < (FREE_M / 2) ** 2)

    @property
    def agreed(self) -> BoolArray:
        """(m,) surveyed landmarks whose place is not less certain with the walks than by its survey."""
        variance = np.trace(self.position_covariance, axis1=1, axis2=2)
        return np.asarray(variance <= np.trace(self.priors.covariance, axis1=1, axis2=2))

    @property
    def heading_sigma_rad(self) -> FloatArray:
        """(m,) standard deviations of the headings."""
        return np.sqrt(np.diag(self.covariance)[2 * len(self.position) :])


def join(maps: Sequence[LocalMap], priors: LandmarkPriors, settled_m: float = SETTLED_M) -> LandmarkMap:
    """Join all maps that can be connected to the survey; the order of the maps does not matter.

    Re-weighting has converged when no landmark moves by more than ``settled_m``.
    """

    def step(before: LandmarkMap, number: int) -> LandmarkMap:
        return solved_anew(before, lambda doubts: doubts.cautious(CAUTION.at(number)))

    start = initial_map(tuple(maps), priors)
    done = iterate(
        "the joint landmark map",
        solved(replace(start, doubts=start.doubts.cautious(CAUTION.at(0)))),
        step,
        moved_m,
        StoppingRule(tolerance=settled_m, most_rounds=MOST_ROUNDS, least_rounds=CAUTION.rounds),
    )
    return solved_anew(replace(done.state, converged=done.converged), Doubts.expected)


def solved_anew(before: LandmarkMap, taken: Callable[[Doubts], Doubts] = lambda doubts: doubts) -> LandmarkMap:
    """Take a step with the weights that fit the solution, modified by ``taken``."""
    linear = linear_maps(before)
    return solved(replace(before, doubts=taken(_reweighted(before, linear))), linear)


def moved_m(before: LandmarkMap, after: LandmarkMap) -> float:
    """Largest movement of a landmark."""
    return float(np.abs(after.position - before.position).max(initial=0.0))


def initial_map(maps: tuple[LocalMap, ...], priors: LandmarkPriors) -> LandmarkMap:
    """Initial map: everything joined roughly, with usual weights."""
    chart: Chart = tied_to_survey(maps, priors)
    marks = len(priors.position)
    return LandmarkMap(
        maps=maps,
        priors=priors,
        doubts=Doubts(SHIFT_M, tuple(np.ones(len(one.landmark)) for one in maps), np.ones(len(maps)), np.ones(marks)),
        position=np.where(np.isfinite(chart.position), chart.position, 0),
        heading_rad=np.where(np.isfinite(chart.heading_rad), chart.heading_rad, 0.0),
        covariance=np.empty((3 * marks, 3 * marks)),
        origin=chart.origin,
        turn_rad=chart.turn_rad,
    )


def linear_map(joined: LandmarkMap, number: int) -> LinearMap:
    """Linearise one map's observations about the present solution."""
    frame = complex(joined.origin[number]), float(joined.turn_rad[number])
    return _doubted(joined.maps[number].linearised(joined.position, joined.heading_rad, frame), joined.doubts, number)


def linear_maps(joined: LandmarkMap) -> dict[int, LinearMap]:
    """Those of all connected maps, by their numbers."""
    return {number: linear_map(joined, number) for number in np.flatnonzero(joined.tied).tolist()}


def _doubted(linear: LinearMap, doubts: Doubts, number: int) -> LinearMap:
    return linear.doubted(float(doubts.walk[number]), doubts.shift_m**2 * doubts.shift[number])


def solved(joined: LandmarkMap, about: Mapping[int, LinearMap] | None = None) -> LandmarkMap:
    """Take one Gauss-Newton step with the present weights.

    ``about`` are the maps linearised about the same solution, with any weights, if available.
    """
    marks = len(joined.position)
    information, right = survey_equations(joined)
    linear = (
        linear_maps(joined)
        if about is None
        else {number: _doubted(one, joined.doubts, number) for number, one in about.items()}
    )
    for one in linear.values():
        of_map, of_right = one.equations()
        information[np.ix_(one.column, one.column)] += of_map
        right[one.column] += of_right
    covariance: FloatArray = np.asarray(np.linalg.inv((information + information.T) / 2), dtype=np.float64)
    step = covariance @ right
    origin, turn_rad = joined.origin.copy(), joined.turn_rad.copy()
    for number, one in linear.items():
        x, y, turn = one.frame_gain @ (one.residual - one.design @ step[one.column])
        origin[number] += complex(x, y)
        turn_rad[number] += turn
    return replace(
        joined,
        position=joined.position + step[: 2 * marks : 2] + 1j * step[1 : 2 * marks : 2],
        heading_rad=joined.heading_rad + step[2 * marks :],
        covariance=covariance,
        origin=origin,
        turn_rad=turn_rad,
    )


def survey_equations(joined: LandmarkMap) -> tuple[FloatArray, FloatArray]:
    """Information (3m, 3m) and right side (3m,) of the survey; almost zero if there is none."""
    priors, marks = joined.priors, len(joined.position)
    precision = np.tile(np.eye(2) * FREE_M**-2, (marks, 1, 1))
    rows = priors.surveyed
    precision[rows] = np.linalg.inv(priors.covariance[rows] * joined.doubts.survey[rows, None, None])
    information, right = np.zeros((3 * marks, 3 * marks)), np.zeros(3 * marks)
    column = np.arange(2 * marks).reshape(-1, 2)
    information[column[:, :, None], column[:, None, :]] = precision
    right[: 2 * marks] = np.einsum("mij,mj->mi", precision, _survey_miss(joined)).ravel()
    headed = np.isfinite(priors.heading_rad)
    worth = np.where(headed, priors.heading_sigma_rad, FREE_RAD) ** -2.0
    turned = np.where(headed, priors.heading_rad - joined.heading_rad, 0.0)
    heading = np.arange(2 * marks, 3 * marks)
    information[heading, heading] = worth
    right[heading] = worth * wrapped(turned)
    return information, right


def _survey_miss(joined: LandmarkMap) -> FloatArray:
    """(m, 2) from the landmarks to their surveyed places, metres; 0 if not surveyed."""
    miss = np.where(joined.priors.surveyed, joined.priors.position - joined.position, 0)
    return np.column_stack((miss.real, miss.imag))


def _reweighted(joined: LandmarkMap, linear: Mapping[int, LinearMap]) -> Doubts:
    """Weights that fit best to the errors of each walk, each sight and each surveyed place.

    A variance is the sum of squares over the number of observations that determine it (MacKay 1992), with the prior
    added to both. It is the limit of expectation maximisation, in fewer rounds.
    """
    old = joined.doubts
    misses = {number: _missed(joined, one) for number, one in linear.items()}
    square_m2 = sum(float(np.sum(square / old.shift[number])) for number, (square, *_) in misses.items())
    numbers = sum(float(np.sum(determined)) for _, determined, _, _ in misses.values())
    shift_m = float(np.sqrt((SHIFT_NUMBERS * SHIFT_M**2 + square_m2) / (SHIFT_NUMBERS + numbers)))
    shift, walk = list(old.shift), old.walk.copy()
    for number, (square, determined, of_walk, walk_numbers) in misses.items():
        shift[number] = variance_factor(square / shift_m**2, determined, SHIFT_DOF)
        walk[number] = max(float(variance_factor(of_walk, walk_numbers, WALK_DOF)), 1.0)
    return Doubts(shift_m, tuple(shift), walk, _survey_doubts(joined))


def _missed(joined: LandmarkMap, one: LinearMap) -> tuple[FloatArray, FloatArray, float, float]:
    """Most probable squared errors of a walk, and how many numbers of them the observations determine.

    For each of its ``k`` landmarks, m^2 over both axes; then for its map as a whole in units of its covariance.
    """
    design = one.design - one.frame @ (one.frame_gain @ one.design)
    spread = design @ joined.covariance[np.ix_(one.column, one.column)] @ design.T
    spread += one.frame @ one.frame_covariance @ one.frame.T
    precision = one.worth
    pull = precision @ one.residual
    determined = precision - precision @ spread @ precision
    places = slice(0, 2 * len(one.column) // 3)
    return (
        ((one.shift * pull) ** 2)[places].reshape(-1, 2).sum(axis=1),
        (one.shift * np.diag(determined))[places].reshape(-1, 2).sum(axis=1).clip(0),
        float(one.walk_factor * pull @ one.own @ pull),
        max(float(np.sum(determined * one.own)), 0.0),
    )


def _survey_doubts(joined: LandmarkMap) -> FloatArray:
    """Variance factors (m,) of the surveyed places; 1 where not surveyed."""
    priors, rows = joined.priors, joined.priors.surveyed
    worth = np.linalg.inv(priors.covariance[rows])
    miss = _survey_miss(joined)[rows]
    square = np.einsum("mi,mij,mj->m", miss, worth, miss)
    left = np.einsum("mij,mji->m", worth, joined.position_covariance[rows]) / joined.doubts.survey[rows]
    survey = np.ones(len(rows))
    survey[rows] = variance_factor(square, (2 - left).clip(0), SURVEY_DOF)
    return survey


CHANGE_SETTLED_M = 0.01
"""Coarser limit for comparing a survey with the others, which know its place to several centimetres at best."""


def predicted(joined: LandmarkMap, landmark: int) -> LandmarkMap:
    """Join again as if one landmark were not surveyed, starting from a usual weight for its best sight.

    Weights are estimated again, because a wrong survey makes walks past it look worse than they are.
    """
    trial = replace(_sights_usual(joined, landmark), priors=joined.priors.without(landmark))
    return _joined_again(trial)


def apart(joined: LandmarkMap, landmark: int, walks: Sequence[int]) -> LandmarkMap:
    """Join again as if some walks had seen another, unsurveyed landmark, which becomes the last one."""
    new, trial = len(joined.position), _sights_usual(joined, landmark)
    maps = list(joined.maps)
    for number in walks:
        own = maps[number].landmark
        maps[number] = replace(maps[number], landmark=np.where(own == landmark, new, own))
    return _joined_again(
        replace(
            trial,
            maps=tuple(maps),
            priors=joined.priors.with_another(),
            doubts=replace(trial.doubts, survey=np.append(trial.doubts.survey, 1.0)),
            position=np.append(joined.position, joined.position[landmark]),
            heading_rad=np.append(joined.heading_rad, joined.heading_rad[landmark]),
        )
    )


def _sights_usual(joined: LandmarkMap, landmark: int) -> LandmarkMap:
    """Increase the weights of sights of a landmark so that the best of them is a usual one."""
    rows = [one.landmark == landmark for one in joined.maps]
    least = min(
        (shift[row].min() for shift, row in zip(joined.doubts.shift, rows, strict=True) if row.any()), default=1
    )
    shift = tuple(np.where(row, old / least, old) for old, row in zip(joined.doubts.shift, rows, strict=True))
    return replace(joined, doubts=replace(joined.doubts, shift=shift))


def _joined_again(trial: LandmarkMap) -> LandmarkMap:
    """Solve a joint map that differs slightly from the original, with weights estimated again."""
    done = iterate(
        "the joint landmark map with a change",
        solved(trial),
        lambda before, _: solved_anew(before),
        moved_m,
        StoppingRule(tolerance=CHANGE_SETTLED_M, most_rounds=MOST_ROUNDS),
    )
    return solved_anew(done.state, Doubts.expected)
