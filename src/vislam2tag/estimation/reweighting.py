"""Noise levels and weights from a solution: one round of expectation maximisation with Student's t tails.

Residuals of a smoothed walk are too small, so their remaining variance, given all observations, is added. The mean
square of each noise then maximises the likelihood (Dempster, Laird and Rubin 1977; for Student's t: Lange, Little and
Taylor 1989). Noise levels that are estimated from the walk itself therefore do not shrink to zero.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.robust import variance_factor
from vislam2tag.estimation.factors import LinearWalk, Model, sighting_variance
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.least_squares import Solution
from vislam2tag.estimation.tracker_errors import (
    DEGREES_OF_FREEDOM,
    ESTIMATED,
    LANDMARK_DOF,
    PRIOR_WEIGHT,
    SHEET_DOF,
    SIGHTING_DOF,
    USUAL,
    DriftSource,
    NoiseEvidence,
    NoiseLevels,
    VarianceFactors,
    assumed,
)

BROKEN_STRETCHES = 3.0
"""With so many stretches on which the tracker broke, a walk's sightings show half as much of their own errors."""
FEWEST_OBSERVATIONS = 1.75
"""Minimum of the effective observations behind the level of sightings, for walks past two or three landmarks."""


@dataclass(frozen=True)
class ExpectedSquares:
    """Squares (k,) of noises: ``squared_residual`` at the solution, ``residual_variance`` about it."""

    squared_residual: FloatArray
    residual_variance: FloatArray

    @property
    def expected(self) -> FloatArray:
        """Expected squares (k,), given the observations."""
        return np.asarray(self.squared_residual + self.residual_variance)


@dataclass(frozen=True)
class NoiseSquares:
    """Sums of squares in units of the covariances at unit level.

    ``stretch`` (p + 1,) for each source; ``sighting`` (p,) m^2 over both axes; ``sheet`` (p,) rad^2; ``landmark`` (m,)
    expected squared Mahalanobis distance from the survey, 0 if not surveyed.
    """

    stretch: dict[DriftSource, ExpectedSquares]
    sighting: ExpectedSquares
    sheet: ExpectedSquares
    landmark: FloatArray


def expected_squares(walk: LinearWalk, solution: Solution) -> NoiseSquares:
    """Squares of all noises, expected given the observations."""
    sightings, sheets, headed = walk.sightings, walk.sheet_headings, walk.model.headed
    return NoiseSquares(
        stretch=_drift_squares(walk, solution),
        sighting=ExpectedSquares(sightings.squared_residual(solution), sightings.residual_variance(solution)),
        sheet=ExpectedSquares(
            np.where(headed, sheets.squared_residual(solution), 0.0),
            np.where(headed, sheets.residual_variance(solution), 0.0),
        ),
        landmark=_landmark_squares(walk.priors, solution),
    )


def _drift_squares(walk: LinearWalk, solution: Solution) -> dict[DriftSource, ExpectedSquares]:
    """Squares (p + 1,) of each source's drift: its part of the drift over each stretch."""
    model, drift, scale = walk.model, walk.drift_factor, walk.variance_factors.stretch_scale
    residual, precision = drift.residual(solution.state), drift.precision
    cross = drift.transition @ solution.next_covariance
    variance = solution.covariance[1:] + drift.transition @ solution.covariance[:-1] @ drift.transition.transpose(
        0, 2, 1
    )
    variance = variance - (cross + cross.transpose(0, 2, 1))
    weighted_square = precision @ (residual[:, :, None] * residual[:, None, :]) @ precision
    determined = precision @ (drift.covariance - variance) @ precision
    squares = scale * np.einsum("kij,skji->sk", weighted_square, model.unit_covariances)
    dimensions = scale * np.einsum("kij,skji->sk", determined, model.unit_covariances)
    return {
        source: ExpectedSquares(
            scale[number] * squares[number],
            scale[number] * np.maximum(model.ranks[source] - dimensions[number], 0),
        )
        for number, source in enumerate(DriftSource)
    }


def _landmark_squares(priors: LandmarkPriors, solution: Solution) -> FloatArray:
    """Expected squared distances (m,) from the survey, in units of its covariance; 0 if not surveyed.

    For places of the camera by other sessions, only their own errors count.
    """
    rows, count = np.flatnonzero(priors.surveyed), 2 * len(priors.position)
    column = np.stack((2 * rows, 2 * rows + 1), axis=1)
    errors, covariance = solution.border[:count], solution.border_covariance[:count, :count]
    if priors.places is not None:
        own = priors.places.own_errors(len(priors.position))
        errors, covariance = own @ errors, own @ covariance @ own.T
    error = errors[column]
    expected = error[:, :, None] * error[:, None, :] + covariance[column[:, :, None], column[:, None, :]]
    squares = np.zeros(len(priors.position))
    squares[rows] = np.einsum("mij,mji->m", priors.precision[rows], expected)
    return squares


def reweighted(model: Model, factors: VarianceFactors, squares: NoiseSquares) -> VarianceFactors:
    """Noise levels and variance factors that fit the squares best, with a weak prior."""
    better = _levels(model, factors, squares)
    stretch = {}
    for source, square in squares.stretch.items():
        normalised = square.expected / better.level(source) ** 2
        stretch[source] = variance_factor(normalised, model.ranks[source], DEGREES_OF_FREEDOM[source])
    return VarianceFactors(
        better,
        stretch,
        variance_factor(squares.sighting.expected / sighting_variance(model, better), 2, SIGHTING_DOF),
        variance_factor(squares.sheet.expected / better.sheet_rad**2, 1, SHEET_DOF),
        variance_factor(squares.landmark, 2, LANDMARK_DOF),
        factors.prior_noise,
    )


def _levels(model: Model, factors: VarianceFactors, squares: NoiseSquares) -> NoiseLevels:
    noise, passes = factors.noise, model.observations.passes
    prior, prior_observations = assumed(factors.prior_noise)
    # A pass's own scatter explains part of its squares.
    growth = (1 + passes.distance_m**2) / 2
    share = noise.sighting_m**2 * growth / sighting_variance(model, noise)
    precision = share**2 / (growth * factors.sighting)
    sighting = _LevelEstimate.of(noise.sighting_m, 2 * share, squares.sighting, precision)
    sheet = _LevelEstimate.of(noise.sheet_rad, model.headed, squares.sheet, 1 / factors.sheet)
    drift = {
        source: _LevelEstimate.of(
            noise.level(source), model.ranks[source], squares.stretch[source], 1 / factors.stretch[source]
        )
        for source in ESTIMATED
    }
    # A tracker with unusual noise of some kinds also has it in kinds that the walk hardly shows.
    shown = _evidence({prior.sighting_m: sighting, **{prior.level(source): drift[source] for source in ESTIMATED}})
    common_scale = _LevelEstimate(shown.observations, shown.squares).level(1.0, prior_observations)
    levels = {
        source: found.level(prior.level(source) * common_scale, prior_observations) for source, found in drift.items()
    }
    return NoiseLevels(
        position_m=levels[DriftSource.POSITION],
        heading_rad=levels[DriftSource.HEADING],
        scale=noise.scale if model.rough else levels[DriftSource.SCALE],
        sighting_m=sighting.level(prior.sighting_m, prior_observations),
        sheet_rad=sheet.level(USUAL.sheet_rad, PRIOR_WEIGHT),
        sighting_observations=sighting.effective_observations,
        drift_observations={source: found.effective_observations for source, found in drift.items()},
        evidence=replace(shown, squares=shown.squares * (prior.sighting_m / USUAL.sighting_m) ** 2),
    )


def _evidence(estimates: dict[float, _LevelEstimate]) -> NoiseEvidence:
    """What estimates show together, in units of their prior levels, which are the keys."""
    return NoiseEvidence(
        sum(found.effective_observations for found in estimates.values()),
        sum(found.squares / prior**2 for prior, found in estimates.items()),
    )


@dataclass(frozen=True)
class _LevelEstimate:
    """Estimate of one noise level: the sum of ``squares``, and the effective number of observations."""

    effective_observations: float
    squares: float

    @classmethod
    def of(
        cls, present: float, dimensions: npt.NDArray[Any], square: ExpectedSquares, precision: FloatArray
    ) -> _LevelEstimate:
        """Add up squares (k,), each of ``dimensions`` (k,), with ``precision`` (k,) in units of the level's.

        Only dimensions that the observations determine count: an undetermined residual carries no information on the
        ``present`` level.
        """
        determined = float(np.sum(dimensions - precision * square.residual_variance / present**2))
        return cls(max(determined, 0.0), float(np.sum(precision * square.squared_residual)))

    def level(self, prior: float, prior_observations: float) -> float:
        """Root mean square of these observations and of the ``prior`` level with its weight in observations.

        It has the same fixed point as the mean of the expected squares, in fewer rounds (MacKay 1992).
        """
        observations = prior_observations + self.effective_observations
        return float(np.sqrt((prior_observations * prior**2 + self.squares) / observations))


def equivalent_variances(model: Model, factors: VarianceFactors) -> VarianceFactors:
    """Factors for covariances: those of the normal distribution equivalent to each Student's t.

    :func:`reweighted` gives inverse mean precisions, which solve for the states but understate the variances. The level
    itself is also uncertain, because it follows from few observations. With a variance that is a mean square of n
    numbers, the predictive distribution is Student's t with n degrees of freedom (Gelman et al. 2013, section 3.2). For
    sightings the heavier of both distributions is used.

    Where the tracker broke, sightings first show what it did there, and less of their own errors. In generated walks
    that broke on three stretches they count for half.
    """
    broken = int(np.count_nonzero(model.ranks[DriftSource.JUMP]))
    shown = factors.noise.sighting_observations / (1 + broken / BROKEN_STRETCHES)
    known = assumed(factors.prior_noise)[1] + shown
    return replace(
        factors,
        stretch={
            source: np.asarray(factor * _widening(_drift_dof(source, factors, model.ranks[source])))
            for source, factor in factors.stretch.items()
        },
        sighting=factors.sighting * _widening(min(SIGHTING_DOF + 2, known), FEWEST_OBSERVATIONS),
        sheet=factors.sheet * _widening(SHEET_DOF + 1),
    )


def _drift_dof(source: DriftSource, factors: VarianceFactors, rank: IntArray) -> npt.ArrayLike:
    """Degrees of freedom (1 or p + 1) of the drift of stretches with these ranks (p + 1,).

    Few observations, from few stretches, show a walk's drift, so these may be unusual. If other walks show the
    tracker's noise, the heavier of both distributions is used, as for sightings.
    """
    own, observations = DEGREES_OF_FREEDOM[source] + rank, factors.noise.drift_observations.get(source)
    if observations is None:
        return own
    known = assumed(factors.prior_noise)[1] + observations
    return known if factors.prior_noise is None else np.minimum(known, own)


def _widening(freedom: npt.ArrayLike, fewest: float = 2.0) -> FloatArray:
    """Variance factor for a normal distribution with about the same 68 % and 95 % regions as Student's t.

    It is between 1 and the t distribution's own variance, ``freedom / (freedom - 2)``; ``fewest`` is the minimum of the
    degrees of freedom.
    """
    return np.asarray(1 + 1.45 / (np.maximum(np.asarray(freedom, dtype=np.float64), fewest) - 1.45))
