"""Noise levels and weights from a solution: one round of expectation maximisation with Student's t tails.

Residuals of a smoothed walk are too small: what they could still be, given all observations, has to be added. With it
the mean square of each noise is what maximises the likelihood (Dempster, Laird and Rubin 1977; for Student's t: Lange,
Little and Taylor 1989), and estimating noise levels from the walk itself does not shrink them to nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.robust import variance_factor
from vislam2tag.estimation.chain import Solution
from vislam2tag.estimation.factors import LinearWalk, Model, Weights, sighting_variance
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.noise import (
    ESTIMATED,
    LANDMARK_TAIL,
    PRIOR_WEIGHT,
    SHEET_TAIL,
    SIGHTING_TAIL,
    TAIL,
    USUAL,
    DriftSource,
    NoiseLevels,
    assumed,
)

FEWEST_NUMBERS = 1.75
"""Sightings whose level follows from fewer numbers, on walks past two or three landmarks, count as known by so many."""


@dataclass(frozen=True)
class ExpectedSquares:
    """Squares (k,) of noises: ``missed`` of the smoothed residuals, ``open`` what they could still be on average."""

    missed: FloatArray
    open: FloatArray

    @property
    def expected(self) -> FloatArray:
        """Expected squares (k,), given the observations."""
        return np.asarray(self.missed + self.open)


@dataclass(frozen=True)
class NoiseSquares:
    """Sums of squares in units of the unit-level covariances.

    ``stretch`` (p + 1,) for each source; ``sighting`` (p,) m^2 over both axes; ``sheet`` (p,) rad^2; ``landmark`` (m,)
    expected squared Mahalanobis distance from the survey, 0 where not surveyed.
    """

    stretch: dict[DriftSource, ExpectedSquares]
    sighting: ExpectedSquares
    sheet: ExpectedSquares
    landmark: FloatArray


def expected_squares(walk: LinearWalk, solution: Solution) -> NoiseSquares:
    """Squares of all noises, expected given the observations."""
    sightings, sheets = walk.sightings, walk.sheet_headings
    headed = walk.model.headed
    return NoiseSquares(
        stretch=_drift_squares(walk, solution),
        sighting=ExpectedSquares(sightings.missed(solution), sightings.spread(solution)),
        sheet=ExpectedSquares(
            np.where(headed, sheets.missed(solution), 0.0), np.where(headed, sheets.spread(solution), 0.0)
        ),
        landmark=_landmark_squares(walk.priors, solution),
    )


def _drift_squares(walk: LinearWalk, solution: Solution) -> dict[DriftSource, ExpectedSquares]:
    """Squares (p + 1,) of each source's drift: its part of what the stretches led elsewhere by."""
    model, drift, scale = walk.model, walk.drift, walk.weights.stretch_scale
    miss = drift.residual(solution.state)
    cross = drift.carry @ solution.next_covariance
    spread = solution.covariance[1:] + drift.carry @ solution.covariance[:-1] @ drift.carry.transpose(0, 2, 1)
    spread = spread - (cross + cross.transpose(0, 2, 1))
    worth = drift.precision
    missed = worth @ (miss[:, :, None] * miss[:, None, :]) @ worth
    determined = worth @ (drift.covariance - spread) @ worth
    missing = scale * np.einsum("kij,skji->sk", missed, model.units)
    numbers = scale * np.einsum("kij,skji->sk", determined, model.units)
    return {
        source: ExpectedSquares(
            scale[number] * missing[number],
            scale[number] * np.maximum(model.ranks[source] - numbers[number], 0),
        )
        for number, source in enumerate(DriftSource)
    }


def _landmark_squares(priors: LandmarkPriors, solution: Solution) -> FloatArray:
    """Expected squared distances (m,) from the survey, in units of its covariance; 0 where not surveyed.

    Of places of the camera by other sessions, those of their own errors.
    """
    rows, count = np.flatnonzero(priors.surveyed), 2 * len(priors.position)
    column = np.stack((2 * rows, 2 * rows + 1), axis=1)
    errors, covariance = solution.border[:count], solution.border_covariance[:count, :count]
    if priors.places is not None:
        own = priors.places.own_errors(len(priors.position))
        errors, covariance = own @ errors, own @ covariance @ own.T
    error = errors[column]
    spread = covariance[column[:, :, None], column[:, None, :]]
    worth = np.linalg.inv(priors.covariance[rows])
    squares = np.zeros(len(priors.position))
    squares[rows] = np.einsum("mij,mji->m", worth, error[:, :, None] * error[:, None, :] + spread)
    return squares


def reweighted(model: Model, weights: Weights, squares: NoiseSquares) -> Weights:
    """Noise levels and weights that fit the squares best, pulled gently to the noise assumed before."""
    better = _levels(model, weights, squares)
    stretch = {
        source: variance_factor(square.expected / better.level(source) ** 2, model.ranks[source], TAIL[source])
        for source, square in squares.stretch.items()
    }
    return Weights(
        better,
        stretch,
        variance_factor(squares.sighting.expected / sighting_variance(model, better), 2, SIGHTING_TAIL),
        variance_factor(squares.sheet.expected / better.sheet_rad**2, 1, SHEET_TAIL),
        variance_factor(squares.landmark, 2, LANDMARK_TAIL),
        weights.told,
    )


def _levels(model: Model, weights: Weights, squares: NoiseSquares) -> NoiseLevels:
    noise, passes = weights.noise, model.observations.passes
    usual, believed = assumed(weights.told)
    # Of the squares of a pass, its own scatter explains a part.
    growth = (1 + passes.distance_m**2) / 2
    share = noise.sighting_m**2 * growth / sighting_variance(model, noise)
    worth = share**2 / (growth * weights.sighting)
    sighting = _determined(noise.sighting_m, 2 * share, squares.sighting, worth)
    sighting_m = sighting.level(usual.sighting_m, believed)
    sheet = _determined(noise.sheet_rad, model.headed, squares.sheet, 1 / weights.sheet)
    drift = {
        source: _determined(
            noise.level(source), model.ranks[source], squares.stretch[source], 1 / weights.stretch[source]
        )
        for source in ESTIMATED
    }
    # As far as nothing tells of one source, a tracker that does worse than usual in others does so there, too.
    kinship = _times_usual(
        {usual.sighting_m: sighting, **{usual.level(source): drift[source] for source in ESTIMATED}}, believed
    )
    levels = {source: found.level(usual.level(source) * kinship, believed) for source, found in drift.items()}
    return NoiseLevels(
        position_m=levels[DriftSource.POSITION],
        heading_rad=levels[DriftSource.HEADING],
        scale=noise.scale if model.rough else levels[DriftSource.SCALE],
        sighting_m=sighting_m,
        sheet_rad=sheet.level(USUAL.sheet_rad, PRIOR_WEIGHT),
        sighting_numbers=sighting.numbers,
        drift_numbers={source: found.numbers for source, found in drift.items()},
    )


@dataclass(frozen=True)
class _Determined:
    """What the observations tell of one level: how many numbers, and the sum of their squares."""

    numbers: float
    squares: float

    def level(self, usual: float, believed: float) -> float:
        """Mean square of these numbers and of what is assumed before, which counts as so many, as a level.

        The same fixed point as the mean of the expected squares, reached in fewer rounds (MacKay 1992).
        """
        return float(np.sqrt((believed * usual**2 + self.squares) / (believed + self.numbers)))


def _times_usual(determined: dict[float, _Determined], believed: float) -> float:
    """By how much noises, by their usual levels, exceed these together; 1 as far as nothing is determined of any.

    That they do not counts as so many numbers.
    """
    squares = sum(found.squares / usual**2 for usual, found in determined.items())
    return _Determined(sum(found.numbers for found in determined.values()), squares).level(1.0, believed)


def _determined(present: float, numbers: npt.NDArray[Any], square: ExpectedSquares, worth: FloatArray) -> _Determined:
    """What squares (k,) of this ``worth`` (k,) each say of a level, and how many of ``numbers`` (k,) they determine."""
    determined = float(np.sum(numbers - worth * square.open / present**2))
    return _Determined(max(determined, 0.0), float(np.sum(worth * square.missed)))


def equivalent_variances(model: Model, weights: Weights) -> Weights:
    """Weights for covariances: those of the normal distribution that stands for each Student's t.

    :func:`reweighted` gives inverse mean precisions, which solve for the states but understate the spread. Nor is a
    level known better than from as many numbers as tell of it: what a normal variance of so many numbers' mean square
    predicts is Student's t with as many degrees of freedom (Gelman et al. 2013, section 3.2). The heavier of both laws
    of sightings stands for both.
    """
    sighting_freedom = min(SIGHTING_TAIL + 2, assumed(weights.told)[1] + weights.noise.sighting_numbers)
    return replace(
        weights,
        stretch={
            source: np.asarray(factor * _widening(_freedom(source, weights, model.ranks[source])))
            for source, factor in weights.stretch.items()
        },
        sighting=weights.sighting * _widening(sighting_freedom, FEWEST_NUMBERS),
        sheet=weights.sheet * _widening(SHEET_TAIL + 1),
    )


def _freedom(source: DriftSource, weights: Weights, rank: IntArray) -> npt.ArrayLike:
    """Degrees of freedom (1 or p + 1) of the drift of stretches with these ranks (p + 1,).

    Few numbers tell a walk's drift, of as few stretches: that these may be unusual is a part of not knowing its level.
    Where others tell of the tracker, the heavier of both laws stands for both, as of sightings.
    """
    own, numbers = TAIL[source] + rank, weights.noise.drift_numbers.get(source)
    if numbers is None:
        return own
    known = assumed(weights.told)[1] + numbers
    return known if weights.told is None else np.minimum(known, own)


def _widening(freedom: npt.ArrayLike, fewest: float = 2.0) -> FloatArray:
    """Variance factor with which a normal distribution holds about as much in its 68 % and 95 % regions as Student's t.

    Between 1 and the t distribution's own variance, ``freedom / (freedom - 2)``; fewer degrees of freedom than
    ``fewest`` count as so many.
    """
    return np.asarray(1 + 1.45 / (np.maximum(np.asarray(freedom, dtype=np.float64), fewest) - 1.45))
