"""Hand-made local maps: subsets of a building's landmarks seen from frames of any place and turn."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.landmark_survey.local_map import LocalMap


def seen_from(
    place: ComplexArray,
    heading_rad: FloatArray,
    landmark: list[int],
    turn_rad: float,
    origin: complex,
    sigma_m: float = 0.1,
    sigma_rad: float = 0.03,
) -> LocalMap:
    """What a walk without error makes of some landmarks; NaN headings are not logged."""
    rows = np.array(landmark, dtype=np.int64)
    k = len(rows)
    return LocalMap(
        landmark=rows,
        position=(place[rows] - origin) * np.exp(-1j * turn_rad),
        heading_rad=heading_rad[rows] - turn_rad,
        covariance=np.diag([sigma_m**2] * (2 * k) + [sigma_rad**2] * k),
        passes=np.ones(k, dtype=np.int64),
    )


def surveyed(place: ComplexArray, which: list[int], sigma_m: float = 0.02) -> LandmarkPriors:
    """A survey of some of the landmarks."""
    priors = LandmarkPriors.nothing(len(place))
    priors.position[which] = place[which]
    priors.covariance[which] = np.eye(2) * sigma_m**2
    return priors


def building(count: int, seed: int) -> tuple[ComplexArray, FloatArray]:
    """Landmarks spread over 60 m x 30 m, at least some metres apart, and the headings of their sheets."""
    rng = np.random.default_rng(seed)
    cells = rng.permutation(40)[:count]
    place = 7.5 * (cells % 8) + 7.5j * (cells // 8) + rng.uniform(0, 3, count) + 1j * rng.uniform(0, 3, count)
    return place, rng.uniform(-np.pi, np.pi, count)
