"""What further landmarks would gain: the places where the error to expect falls most, one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.preparation.planning.prediction import PassedLandmarks, expected_along, passes_near, smoothed_walk
from vislam2tag.preparation.planning.sheet_places import SheetPlaces, Stations
from vislam2tag.self_check.accuracy import expected_error_m
from vislam2tag.self_check.gain_map import APART_M, BESIDE_M, GainMap, session_gains
from vislam2tag.self_check.landmark_gain import CELL_M, gains, positions_each_metre

MOST_WALKS = 12
"""Gains are looked for on so many walks, spread evenly over all."""


@dataclass(frozen=True)
class FurtherPlace:
    """One more landmark: the ``place``, and by how much the mean error to expect falls with it and those before it."""

    place: int
    gain_m: float


def further_landmarks(
    paths: Sequence[FloatArray],
    sheets: PassedLandmarks,
    places: SheetPlaces,
    stations: Stations,
    free: BoolArray,
    count: int,
    survey_sigma_m: float,
) -> list[FurtherPlace]:
    """Propose ``count`` more landmarks at ``free`` (p,) places, the best first; each gain is solved for anew."""
    found: list[FurtherPlace] = []
    errors = [_errors_m(path, sheets, survey_sigma_m) for path in paths]
    promised = _first_order_gains(paths, sheets, survey_sigma_m)
    feet = stations.point[places.station]
    value = np.array([promised.get(cell, 0.0) for cell in map(tuple, np.floor(feet / CELL_M).astype(int).tolist())])
    beside = cdist(places.position, sheets.position).min(axis=1, initial=np.inf) < BESIDE_M
    value = np.where(free & ~beside, value, 0.0)
    for _ in range(count):
        if not len(value) or value.max() <= 0:
            break
        best = int(np.argmax(value))
        sheets = sheets.with_one(places.position[best], feet[best], float(places.pass_m[best]))
        after = [
            _errors_m(path, sheets, survey_sigma_m) if passes_near(path, feet[best]) else error
            for path, error in zip(paths, errors, strict=True)
        ]
        found.append(FurtherPlace(best, _mean(errors) - _mean(after)))
        errors = after
        value[np.linalg.norm(feet - feet[best], axis=1) < APART_M] = 0.0
    return found


def _errors_m(path: FloatArray, sheets: PassedLandmarks, survey_sigma_m: float) -> FloatArray:
    """Mean lengths (n,) of the errors to expect along a walk; empty where it cannot be mapped."""
    expected = expected_along(path, sheets, survey_sigma_m)
    return np.zeros(0) if expected is None else expected_error_m(expected.covariance)


def _mean(errors: Sequence[FloatArray]) -> float:
    """Mean of all errors, (n,) each, metres."""
    return float(np.concatenate([*errors, np.zeros(0)]).mean())


def _first_order_gains(
    paths: Sequence[FloatArray], sheets: PassedLandmarks, survey_sigma_m: float
) -> dict[tuple[int, int], float]:
    """By how much the mean expected error on walks, (n, 2) each, falls with a landmark in each cell, to first order."""
    total = GainMap()
    for number in sorted(set(np.linspace(0, len(paths) - 1, min(MOST_WALKS, len(paths))).astype(int).tolist())):
        path = paths[number]
        smoothed = smoothed_walk(path, sheets, survey_sigma_m)
        if smoothed is None:
            continue
        positions = positions_each_metre(smoothed)
        here = gains(smoothed, positions, np.zeros(len(positions.at), dtype=np.int64))
        total.add(session_gains(here, 1.0, np.zeros(len(path), dtype=np.int64), np.ones(len(path))))
    return total.mean_gain_m(0) if total.frames else {}
