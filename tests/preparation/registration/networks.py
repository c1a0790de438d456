"""Surveys with total stations whose truth is known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.registration.network import Measurement

SHOT_M, KNOWN_M = 0.003, 0.005


@dataclass(frozen=True)
class Survey:
    truth: dict[str, complex]
    shots: list[Measurement]
    known: list[Measurement]

    @property
    def all(self) -> list[Measurement]:
        return [*self.shots, *self.known]


def survey(
    seed: int, *, known: int = 5, landmarks: int = 12, stations: int = 2, seen: float = 0.75, noise: float = 1.0
) -> Survey:
    """Points in 60 m x 30 m, stations anywhere with frames turned anyhow; each sees a share of all points."""
    rng = np.random.default_rng(seed)
    names = [f"K{i}" for i in range(known)] + [str(i) for i in range(landmarks)]
    truth = {name: complex(rng.uniform(0, 60), rng.uniform(0, 30)) for name in names}
    shots = []
    for number in range(stations):
        turn, shift = np.exp(1j * rng.uniform(-np.pi, np.pi)), complex(*rng.uniform(0, 1000, 2))
        for name in names:
            if rng.random() < seen or name in ("K0", "K1"):
                place = complex(turn * truth[name] + shift) + noise * complex(*rng.normal(0, SHOT_M, 2))
                shots.append(Measurement(point=name, station=f"S{number}", place=place, sigma_m=SHOT_M))
    given = [
        Measurement(point=name, place=truth[name] + noise * complex(*rng.normal(0, KNOWN_M, 2)), sigma_m=KNOWN_M)
        for name in names[:known]
    ]
    return Survey(truth, shots, given)


def shot_of(surveyed: Survey, station: str, point: str) -> int:
    return next(i for i, one in enumerate(surveyed.shots) if (one.station, one.point) == (station, point))


def swapped_shots(surveyed: Survey, station: str, one: str, other: str) -> Survey:
    """The names of two points interchanged in one station."""
    shots = list(surveyed.shots)
    i, j = shot_of(surveyed, station, one), shot_of(surveyed, station, other)
    shots[i], shots[j] = replace(shots[i], place=shots[j].place), replace(shots[j], place=shots[i].place)
    return replace(surveyed, shots=shots)


def swapped_known(surveyed: Survey, i: int, j: int) -> Survey:
    known = list(surveyed.known)
    known[i], known[j] = replace(known[i], place=known[j].place), replace(known[j], place=known[i].place)
    return replace(surveyed, known=known)


def squares(error: FloatArray, covariance: FloatArray) -> float:
    """Squared Mahalanobis distance of one error (2,)."""
    return float(error @ np.linalg.solve(covariance, error))


def as_array(value: complex) -> FloatArray:
    return np.array((value.real, value.imag))
