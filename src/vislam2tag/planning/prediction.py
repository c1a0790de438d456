"""The label sigma to expect: typical walks past the planned landmarks, solved by the smoother's own equations.

Nothing is drawn at random about a walk but its route: its passes follow from the landmarks, and the covariance of every
frame from :mod:`vislam2tag.core` as for a real session, at the usual noise of phones. Only what no equation knows
before a walk is measured once in the simulator: how much a phone turns in walking and to look at a sheet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.similarity import as_complex
from vislam2tag.estimation.factors import LinearWalk, Model, Weights
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.noise import USUAL, NoiseLevels
from vislam2tag.estimation.observations import Passes, WalkObservations
from vislam2tag.estimation.odometry import Odometry
from vislam2tag.estimation.reweighting import equivalent_variances
from vislam2tag.estimation.smoother import SolvedWalk, mapped_path
from vislam2tag.self_check.accuracy import expected_error_m

PASSED_M = 0.7
"""A walk that comes so near to a landmark's station passes it."""
SPEED_M_S = 0.85
"""Walking speed, pauses included."""
SWAY_RAD_M = 0.22
"""A phone turns to and fro by so much over a metre walked ..."""
LOOK_RAD = 1.4
"""... and by so much to a sheet, and back."""
LOOK_M = 1.5
"""Over so many metres before a sheet, and after."""
SPREAD_M = 0.02
"""Scatter of the sightings of one pass, per axis."""
LEAST_BETWEEN_M = 4.0
"""Who stays within this of a landmark passes it once."""


@dataclass(frozen=True)
class PassedLandmarks:
    """Landmarks as the prediction needs them: ``position`` (m, 2) on the walls, ``foot`` (m, 2) the points of the
    corridors at which they are passed, ``pass_m`` (m,) the distance then; BCS metres.
    """

    position: FloatArray
    foot: FloatArray
    pass_m: FloatArray

    def with_one(self, position: FloatArray, foot: FloatArray, pass_m: float) -> PassedLandmarks:
        """The same and one more: ``position`` (2,), ``foot`` (2,)."""
        return PassedLandmarks(
            np.vstack((self.position, position[None])),
            np.vstack((self.foot, foot[None])),
            np.append(self.pass_m, pass_m),
        )


@dataclass(frozen=True)
class ExpectedLabels:
    """What is expected along one walk: ``path`` (n, 2) BCS metres and the covariances (n, 2, 2) of its labels."""

    path: FloatArray
    covariance: FloatArray

    @property
    def variance_m2(self) -> FloatArray:
        """(n,) per axis."""
        return np.asarray(np.trace(self.covariance, axis1=1, axis2=2) / 2)


def expected_along(
    path: FloatArray, sheets: PassedLandmarks, survey_sigma_m: float, noise: NoiseLevels = USUAL
) -> ExpectedLabels | None:
    """Covariances (n, 2, 2) of the labels of a walk (n, 2); None where it passes no two landmarks apart, so that
    nothing is mapped.
    """
    smoothed = smoothed_walk(path, sheets, survey_sigma_m, noise)
    return None if smoothed is None else ExpectedLabels(path, mapped_path(smoothed)[1])


def smoothed_walk(
    path: FloatArray, sheets: PassedLandmarks, survey_sigma_m: float, noise: NoiseLevels = USUAL
) -> SolvedWalk | None:
    """A walk (n, 2) as the smoother would have it once solved; None where it passes no two landmarks."""
    at, landmark = _passes(path, sheets.foot)
    if len(np.unique(landmark)) < 2:
        return None
    passed, landmark = np.unique(landmark, return_inverse=True)
    sheets = PassedLandmarks(sheets.position[passed], sheets.foot[passed], sheets.pass_m[passed])
    observations = _simulated_walk(path, sheets, at, landmark)
    priors = _surveyed_landmarks(sheets, survey_sigma_m)
    plane = as_complex(path)
    model = Model(observations, plane, np.ones_like(plane), rough=False)
    # A pass tells two numbers, of which the walk itself takes about one: the rest tells the level of sightings.
    weights = Weights.even(replace(noise, sighting_numbers=float(len(at))), len(at), len(sheets.position))
    return SolvedWalk.of(LinearWalk(model, priors, equivalent_variances(model, weights)))


def _passes(path: FloatArray, foot: FloatArray) -> tuple[IntArray, IntArray]:
    """Samples (p,) of a path at which it comes nearest to landmarks (p,), in order."""
    found: list[tuple[int, int]] = []
    for landmark, place in enumerate(foot):
        away = np.linalg.norm(path - place, axis=1)
        near = np.flatnonzero(away < PASSED_M)
        step = LEAST_BETWEEN_M / max(float(np.linalg.norm(np.diff(path[:2], axis=0))), 0.05)
        runs = np.split(near, np.flatnonzero(np.diff(near) > step) + 1)
        found += [(int(run[np.argmin(away[run])]), landmark) for run in runs if len(run)]
    found.sort()
    order = np.array(found, dtype=np.int64).reshape(-1, 2)
    return order[:, 0], order[:, 1]


def passes_near(path: FloatArray, foot: FloatArray) -> bool:
    """Whether a walk passes a landmark whose station is at ``foot`` (2,)."""
    return bool((np.linalg.norm(path - foot, axis=1) < PASSED_M).any())


def _simulated_walk(path: FloatArray, sheets: PassedLandmarks, at: IntArray, landmark: IntArray) -> WalkObservations:
    """The odometry of a path (n, 2) and the passes (p,) of landmarks (p,) that a tracker would have logged, without any
    fault.
    """
    count = len(path)
    step = np.diff(path, axis=0)
    step_length_m = np.linalg.norm(step, axis=1)
    direction = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    turned = np.abs(np.diff(direction, append=direction[-1])) + SWAY_RAD_M * step_length_m
    along = np.concatenate(([0.0], np.cumsum(step_length_m)))
    for sample in at.tolist():
        about = np.abs(along[:-1] - along[sample]) <= LOOK_M
        turned[about] += LOOK_RAD / LOOK_M * step_length_m[about]
    nothing, zero = np.zeros(count - 1), np.zeros(count)
    odometry = Odometry(
        frame=np.arange(count),
        time_s=along / SPEED_M_S,
        path=as_complex(path),
        turn=np.ones(count, dtype=np.complex128),
        step_length_m=step_length_m,
        turned_rad=turned,
        jump_m2=nothing,
        jump_rad2=nothing,
        doubt=nothing.astype(np.complex128),
        rewritten=np.zeros(count, dtype=np.bool_),
        aside_m2=zero,
        jumped=np.zeros(count - 1, dtype=np.bool_),
        blind=np.zeros(count - 1, dtype=np.bool_),
        events=(),
    )
    away = as_complex(sheets.position[landmark]) - as_complex(path[at])
    distance = sheets.pass_m[landmark] + 0.15
    passes = Passes(
        at=at,
        landmark=landmark,
        offset=away / np.maximum(np.abs(away), 1e-9) * distance,
        heading=np.ones(len(at), dtype=np.complex128),
        distance_m=distance,
        spread_m=np.full(len(at), SPREAD_M),
        count=np.ones(len(at), dtype=np.int64),
    )
    return WalkObservations(tuple(str(i) for i in range(len(sheets.position))), odometry, passes)


def _surveyed_landmarks(sheets: PassedLandmarks, sigma_m: float) -> LandmarkPriors:
    priors = LandmarkPriors.nothing(len(sheets.position))
    priors.position[:] = as_complex(sheets.position)
    priors.covariance[:] = np.eye(2) * sigma_m**2
    return priors


def expected_on_walks(
    paths: Sequence[FloatArray], sheets: PassedLandmarks, survey_sigma_m: float
) -> list[ExpectedLabels]:
    """What is expected along many walks, (n, 2) each; those that cannot be mapped are left out."""
    found = (expected_along(path, sheets, survey_sigma_m) for path in paths)
    return [one for one in found if one is not None]


def mean_error_m(expected: Sequence[ExpectedLabels]) -> float:
    """Mean length of the errors to expect on some walks; NaN where there are none."""
    errors = [expected_error_m(one.covariance) for one in expected]
    return float(np.concatenate(errors).mean()) if errors else float("nan")
