"""Where on a floor labels will be how uncertain: what is expected along walks, gathered in cells and by distance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt
from skimage.graph import MCP_Geometric

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.evaluation.self_check import expected_error_m
from vislam2tag.planning.prediction import Expected
from vislam2tag.walkable.space import WalkableSpace

CELL_M = 0.5
"""Side of a cell of the map."""
FILL_M = 4.0
"""Cells no farther than this from a walk take the value of the nearest one that was walked."""
COARSE_M = 0.2
"""Walking distances are found on cells of about this side."""
CLASS_M = 5.0
"""Width of a class of distances to the nearest landmark."""


@dataclass(frozen=True)
class SigmaMap:
    """``sigma_m`` (rows, columns) per axis, NaN where nobody walks."""

    grid: CellGrid
    sigma_m: FloatArray


@dataclass(frozen=True)
class DistanceField:
    """Walking distance (rows, columns) from the nearest landmark, metres; infinite where nobody gets to."""

    grid: CellGrid
    walking_m: FloatArray

    def at(self, points_m: FloatArray) -> FloatArray:
        """Values (n,) at points (n, 2), those outside taken at the edge."""
        cells = self.grid.cells_of(points_m).clip(0, np.array(self.grid.shape) - 1)
        return np.asarray(self.walking_m[cells[:, 0], cells[:, 1]])


@dataclass(frozen=True)
class DistanceClass:
    """Labels whose nearest landmark is ``low_m`` to ``high_m`` of walking away: root mean square sigma per axis,
    metres, mean length of the error to expect, share of the way.
    """

    low_m: float
    high_m: float
    sigma_m: float
    error_m: float
    share: float


def sigma_map(space: WalkableSpace, expected: Sequence[Expected]) -> SigmaMap:
    """Gather the variances of all walks in cells; cells beside the walks take their nearest neighbours' values."""
    left, right, low, high = space.area.grid.extent_m
    grid = CellGrid((left, low), CELL_M, int(np.ceil((high - low) / CELL_M)), int(np.ceil((right - left) / CELL_M)))
    total, count = np.zeros(grid.shape), np.zeros(grid.shape)
    for one in expected:
        rows, columns = grid.cells_of(one.path).clip(0, np.array(grid.shape) - 1).T
        np.add.at(total, (rows, columns), one.variance_m2)
        np.add.at(count, (rows, columns), 1.0)
    if not count.any():
        return SigmaMap(grid, np.full(grid.shape, np.nan))
    away, (row, column) = distance_transform_edt(np.asarray(count == 0), return_indices=True)
    sigma = np.sqrt(total / np.maximum(count, 1))[row, column]
    cells = np.argwhere(np.ones(grid.shape, dtype=np.bool_))
    walkable = space.inside(grid.centres_m(cells)).reshape(grid.shape)
    return SigmaMap(grid, np.where(walkable & (away * CELL_M <= FILL_M), sigma, np.nan))


def distance_field(space: WalkableSpace, landmarks: FloatArray) -> DistanceField:
    """Walking distance to the nearest of some landmarks (m, 2) on the walls, everywhere on a floor."""
    factor = max(1, round(COARSE_M / space.area.cell_m))
    rows, columns = space.area.mask.shape
    padded = np.zeros((-(-rows // factor) * factor, -(-columns // factor) * factor), dtype=np.bool_)
    padded[:rows, :columns] = space.area.mask
    mask = padded.reshape(padded.shape[0] // factor, factor, -1, factor).any(axis=(1, 3))
    grid = CellGrid(space.area.origin_m, space.area.cell_m * factor, *mask.shape)
    _, nearest = distance_transform_edt(np.asarray(~mask), return_indices=True)
    cells = grid.cells_of(landmarks).clip(0, np.array(mask.shape) - 1)
    starts = [tuple(nearest[:, row, column].tolist()) for row, column in cells.tolist()]
    if not starts:
        return DistanceField(grid, np.full(mask.shape, np.inf))
    cost, _ = MCP_Geometric(np.where(mask, 1.0, np.inf)).find_costs(starts)
    return DistanceField(grid, np.asarray(cost, dtype=np.float64) * grid.cell_m)


def distance_classes(field: DistanceField, expected: Sequence[Expected]) -> list[DistanceClass]:
    """What is expected by the walking distance to the nearest landmark, in classes of 5 m."""
    if not expected:
        return []
    path = np.vstack([one.path for one in expected])
    variance = np.concatenate([one.variance_m2 for one in expected])
    error = np.concatenate([expected_error_m(one.covariance) for one in expected])
    away = field.at(path)
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
