"""Where on a floor labels will be how uncertain: what is expected along walks, gathered in cells and by distance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter

from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.core.limits import MAX_CELLS
from vislam2tag.preparation.planning.prediction import ExpectedLabels
from vislam2tag.self_check.accuracy import expected_error_m
from vislam2tag.site.walkable.space import WalkableSpace
from vislam2tag.site.walkable.walked.walking_distances import WalkingDistances

CELL_M = 0.25
"""Side of a cell of the map, metres; of a floor with more than :data:`MAX_CELLS` of them, larger."""
CLASS_M = 5.0
"""Width of a class of distances to the nearest landmark."""


@dataclass(frozen=True)
class SigmaMap:
    """``sigma_m`` (rows, columns) per axis, NaN where nobody walks."""

    grid: CellGrid
    sigma_m: FloatArray


@dataclass(frozen=True)
class DistanceClass:
    """Labels whose nearest landmark is ``low_m`` to ``high_m`` of walking away: root mean square sigma per axis,
    metres, mean length of the error to expect, share of the corridor.
    """

    low_m: float
    high_m: float
    sigma_m: float
    error_m: float
    share: float


def sigma_map(space: WalkableSpace, expected: Sequence[ExpectedLabels]) -> SigmaMap:
    """Gather the variances of all walks in cells. What lies beside the walks takes its neighbours' values, not through
    walls: the inner end of a deep room has the value of the place from which one goes there.
    """
    left, right, low, high = space.area.grid.extent_m
    cell_m = max(CELL_M, float(np.sqrt((right - left) * (high - low) / MAX_CELLS)))
    grid = CellGrid((left, low), cell_m, int(np.ceil((high - low) / cell_m)), int(np.ceil((right - left) / cell_m)))
    total, count = np.zeros(grid.shape), np.zeros(grid.shape)
    for one in expected:
        rows, columns = grid.cells_of(one.path).clip(0, np.array(grid.shape) - 1).T
        np.add.at(total, (rows, columns), one.variance_m2)
        np.add.at(count, (rows, columns), 1.0)
    cells = np.argwhere(np.ones(grid.shape, dtype=np.bool_))
    walkable = (space.clearance_at(grid.centres_m(cells)) > cell_m / 2).reshape(grid.shape)
    variance = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return SigmaMap(grid, np.sqrt(_filled(variance, walkable)))


def _filled(values: FloatArray, allowed: BoolArray) -> FloatArray:
    """Give ``allowed`` (rows, columns) cells without a value, ring after ring, the mean of their neighbours that have
    one.
    """
    while True:
        known = np.isfinite(values)
        weight = uniform_filter(known.astype(np.float64), 3, mode="constant")
        reached = allowed & ~known & (weight > 1e-6)
        if not reached.any():
            return values
        sums = uniform_filter(np.where(known, values, 0.0), 3, mode="constant")
        values = np.where(reached, sums / np.maximum(weight, 1e-9), values)


def distance_classes(
    space: WalkableSpace, landmarks: FloatArray, expected: Sequence[ExpectedLabels]
) -> list[DistanceClass]:
    """What is expected by the walking distance to the nearest of the landmarks (m, 2), in classes of 5 m."""
    if not expected:
        return []
    path = np.vstack([one.path for one in expected])
    variance = np.concatenate([one.variance_m2 for one in expected])
    error = np.concatenate([expected_error_m(one.covariance) for one in expected])
    away = WalkingDistances(space).to_nearest(path, landmarks)
    known = np.isfinite(away)
    number = np.floor(away[known] / CLASS_M).astype(np.int64)
    variance, error = variance[known], error[known]
    return [
        DistanceClass(
            low_m=float(k * CLASS_M),
            high_m=float((k + 1) * CLASS_M),
            sigma_m=float(np.sqrt(variance[number == k].mean())),
            error_m=float(error[number == k].mean()),
            share=float((number == k).mean()),
        )
        for k in np.unique(number).tolist()
    ]
