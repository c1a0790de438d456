"""Local maps of many walks and a survey of some landmarks, joined to one map of all landmarks
(docs/explanation/landmarks.md).

Unknown are the places and headings of all landmarks in the BCS, and for each walk where its frame lies and how it is
turned. A walk's map may be wrong by its covariance, and it may see a landmark off its place: a sheet that was moved, or
another one with its id. Surveyed places may be wrong, too. Tails of Student's t take what does not fit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray, of_landmarks
from vislam2tag.core.robust import Caution, iterate, variance_factor
from vislam2tag.core.transforms import wrapped
from vislam2tag.estimation.landmark_priors import FREE_M, FREE_RAD, LandmarkPriors
from vislam2tag.estimation.landmark_survey.local_map import Chart, LinearMap, LocalMap, tied_to_survey

SHIFT_M, SHIFT_NUMBERS = 0.06, 1.0
"""A walk sees a landmark off its place by this, per axis (assumed, as if so many numbers told it, before anything is
seen) ..."""
SHIFT_DOF, WALK_DOF, SURVEY_DOF = 3.0, 4.0, 2.0
"""... or by far more: degrees of freedom of Student's t. Walks as a whole and the survey have such tails, too."""
SETTLED_M = 1e-6
"""Re-weighting has converged when no landmark moves any more by this: rounds are few, and then neither the order of the
walks nor the building's frame shows."""
MOST_ROUNDS = 200
"""Far more than any takes that converges: a limit, not a number of rounds."""
CAUTION = Caution(100.0, 0.5)
"""With each walk's sight of a landmark. Not so the survey: few places that all may be wrong would bend to the walks."""


@dataclass(frozen=True)
class Doubts:
    """How far walks see landmarks off their places, ``shift_m`` per axis, and by which factor each variance exceeds the
    usual one: ``shift`` (k,) for each map, ``walk`` (b,) and ``survey`` (m,).
    """

    shift_m: float
    shift: tuple[FloatArray, ...]
    walk: FloatArray
    survey: FloatArray

    @property
    def seen_off_m2(self) -> float:
        """Mean variance per axis of how far a walk sees a landmark off its place."""
        return self.shift_m**2 * (SHIFT_DOF + 2) / SHIFT_DOF

    def expected(self) -> Doubts:
        """For covariances: the mean variance of each shift where re-weighting gives the inverse mean precision."""
        return replace(self, shift=tuple(one * (SHIFT_DOF + 2) / SHIFT_DOF for one in self.shift))

    def cautious(self, factor: float) -> Doubts:
        """Be more doubtful about what walks see, by a factor."""
        return replace(self, shift=tuple(one * factor for one in self.shift))


@dataclass(frozen=True)
class LandmarkMap:
    """``m`` landmarks in the BCS, from those of ``b`` maps that are tied to the survey.

    ``position`` (m,) complex, metres; ``heading_rad`` (m,); ``covariance`` (3m, 3m) of x, y of each, then of all
    headings: next to infinite for what nothing is known of. ``origin`` (b,) complex and ``turn_rad`` (b,): where the
    maps' frames lie, NaN for maps that are not tied.
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
    """Whether re-weighting ended because another round would change nothing that matters."""

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
        """(3k, 3k) of where walks see some landmarks (k,), headings last: how far off their places is part of it."""
        covariance, places = of_landmarks(self.covariance, rows), np.arange(2 * len(rows))
        covariance[places, places] += self.doubts.seen_off_m2
        return (covariance + covariance.T) / 2

    @property
    def agreed(self) -> BoolArray:
        """(m,) surveyed landmarks whose place the walks do not make less certain than its survey says."""
        variance = np.trace(self.position_covariance, axis1=1, axis2=2)
        return np.asarray(variance <= np.trace(self.priors.covariance, axis1=1, axis2=2))

    @property
    def heading_sigma_rad(self) -> FloatArray:
        """(m,) standard deviations of the headings."""
        return np.sqrt(np.diag(self.covariance)[2 * len(self.position) :])


def join(maps: Sequence[LocalMap], priors: LandmarkPriors, settled_m: float = SETTLED_M) -> LandmarkMap:
    """Join all maps that can be tied to the survey; the order of the maps does not matter.

    Re-weighting has converged when no landmark moves any more by ``settled_m``.
    """

    def step(before: LandmarkMap, number: int) -> LandmarkMap:
        return solved_anew(before, lambda doubts: doubts.cautious(CAUTION.at(number)))

    start = initial_map(tuple(maps), priors)
    done = iterate(
        "the joint landmark map",
        solved(replace(start, doubts=start.doubts.cautious(CAUTION.at(0)))),
        step,
        moved_m,
        tolerance=settled_m,
        most_rounds=MOST_ROUNDS,
        least_rounds=CAUTION.rounds,
    )
    return solved_anew(replace(done.state, converged=done.converged), Doubts.expected)


def solved_anew(before: LandmarkMap, taken: Callable[[Doubts], Doubts] = lambda doubts: doubts) -> LandmarkMap:
    """Take a step with the doubts that fit the solution, as they are ``taken``."""
    linear = linear_maps(before)
    return solved(replace(before, doubts=taken(_reweighted(before, linear))), linear)


def moved_m(before: LandmarkMap, after: LandmarkMap) -> float:
    """By how much the landmark that moved most did."""
    return float(np.abs(after.position - before.position).max(initial=0.0))


def initial_map(maps: tuple[LocalMap, ...], priors: LandmarkPriors) -> LandmarkMap:
    """Where to begin: everything put together roughly, nothing doubted."""
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
    """Those of all maps that are tied, by their numbers."""
    return {number: linear_map(joined, number) for number in np.flatnonzero(joined.tied).tolist()}


def _doubted(linear: LinearMap, doubts: Doubts, number: int) -> LinearMap:
    return linear.doubted(float(doubts.walk[number]), doubts.shift_m**2 * doubts.shift[number])


def solved(joined: LandmarkMap, about: Mapping[int, LinearMap] | None = None) -> LandmarkMap:
    """Take one step of Gauss and Newton with the doubts as they are.

    ``about`` are the maps linearised about the same solution, with whichever doubts, where they are at hand.
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
    """Information (3m, 3m) and right side (3m,) of the survey; next to nothing if there is none."""
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
    """(m, 2) from where the landmarks are to where the survey has them, metres; 0 if it has none."""
    miss = np.where(joined.priors.surveyed, joined.priors.position - joined.position, 0)
    return np.column_stack((miss.real, miss.imag))


def _reweighted(joined: LandmarkMap, linear: Mapping[int, LinearMap]) -> Doubts:
    """Doubts that fit best what each walk, each sight of a landmark and each surveyed place was off by.

    A variance is the sum of squares over how many of them the observations determine (MacKay 1992), with what is
    assumed before added to both: where expectation maximisation ends, but in fewer rounds.
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
    """What a walk was most probably off by, squared, and how many numbers of it the observations determine.

    Both for each of its ``k`` landmarks, m^2 over both axes; then for its map as a whole in units of its covariance.
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
"""To compare a survey with all others, which tell its place to several centimetres at best, less will do."""


def predicted(joined: LandmarkMap, landmark: int) -> LandmarkMap:
    """Join again as if one landmark were not surveyed, from its best sight in a walk being a usual one.

    Doubts are found again: a wrong survey has made walks past it look worse than they are.
    """
    trial = replace(_sights_usual(joined, landmark), priors=joined.priors.without(landmark))
    return _joined_again(trial)


def apart(joined: LandmarkMap, landmark: int, walks: Sequence[int]) -> LandmarkMap:
    """Join again as if some walks had seen another landmark, which no one surveyed: it becomes the last one."""
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
    """Doubt sights of a landmark by as much less that the best of them is a usual one."""
    rows = [one.landmark == landmark for one in joined.maps]
    least = min(
        (shift[row].min() for shift, row in zip(joined.doubts.shift, rows, strict=True) if row.any()), default=1
    )
    shift = tuple(np.where(row, old / least, old) for old, row in zip(joined.doubts.shift, rows, strict=True))
    return replace(joined, doubts=replace(joined.doubts, shift=shift))


def _joined_again(trial: LandmarkMap) -> LandmarkMap:
    """Solve a joint map that differs a little from the one it was made of, its doubts found again."""
    done = iterate(
        "the joint landmark map with a change",
        solved(trial),
        lambda before, _: solved_anew(before),
        moved_m,
        tolerance=CHANGE_SETTLED_M,
        most_rounds=MOST_ROUNDS,
    )
    return solved_anew(done.state, Doubts.expected)
