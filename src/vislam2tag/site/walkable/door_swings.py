"""Doors drawn with their swing: the quarter circle about the hinge and the open leaf are not walls."""

from __future__ import annotations

import cv2
import numpy as np
from skimage.morphology import skeletonize

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.site.walkable.painted_cells import clearance_px
from vislam2tag.site.walkable.skeleton import traced

_RADII = 8
"""So many radii are tried, evenly by ratio."""
_STAIRS = 1.06
"""A line of cells is longer than the arc that it follows, in the mean."""
_CHORD = (0.74, 0.92)
"""Range of a quarter circle's chord, by the length of the line of cells: less is a corner, more is straight."""
_SPAN_RAD = (1.2, 1.9)
"""Swings span a quarter circle, more or less."""
_ROUND = 0.04
"""Points of a swing lie on its circle within this share of the radius, and a pixel."""
_HINGE = 0.2
"""The circle's centre is a hinge: so near to a wall, in radii."""
_LEAF_SHARE = 0.85
"""A leaf is drawn over at least this share of the line from the swing's end to the hinge."""


def without_swings(walls: BoolArray, radii: tuple[float, float]) -> BoolArray:
    """Leave out of walls (rows, columns) quarter circles about a hinge with a radius in a range (pixels), and lines
    from their ends to it.
    """
    off_wall, depth = (clearance_px(mask).astype(np.float64) for mask in (~walls, walls))
    erased = np.zeros(walls.shape, dtype=np.uint8)
    for branch in traced(np.argwhere(skeletonize(walls)), CellGrid((0.0, 0.0), 1.0, *walls.shape)).branches.values():
        for arc, hinge, radius in _swings_on(branch.line, radii, off_wall):
            column, row = arc.astype(int).T
            width = round(2 * float(np.median(depth[row, column])) + 1)
            _erase(erased, arc, width)
            for end in (arc[0], arc[-1]):
                leaf = np.linspace(end, hinge, round(radius))
                if _ink_along(leaf, off_wall) >= _LEAF_SHARE:
                    _erase(erased, leaf[: round(len(leaf) * (1 - _HINGE))], width)
    kept: BoolArray = walls & (erased == 0)
    return kept


def _erase(erased: np.ndarray[tuple[int, ...], np.dtype[np.uint8]], line: FloatArray, width: int) -> None:
    """Mark a line (k, 2) of columns and rows as erased."""
    cv2.polylines(erased, [line.astype(np.int32)], False, 1, width)


def _ink_along(line: FloatArray, off_wall: FloatArray) -> float:
    """Share of a line's points (k, 2) on ink, or beside it."""
    column, row = line.astype(int).T
    return float((off_wall[row, column] <= 1.5).mean())


def _swings_on(
    line: FloatArray, radii: tuple[float, float], off_wall: FloatArray
) -> list[tuple[FloatArray, FloatArray, float]]:
    """The swings on a line (k, 2), best first, none over another: columns and rows (k, 2), hinge (2,) and radius."""
    found = []
    for start, stop in _windows(line, radii).tolist():
        if (swing := _swing_through(line[start:stop], radii, off_wall)) is not None:
            error, hinge, radius = swing
            found.append((error, start, stop, hinge, radius))
    taken = np.zeros(len(line), dtype=np.bool_)
    kept = []
    for _, start, stop, hinge, radius in sorted(found, key=lambda each: each[:3]):
        if not taken[start:stop].any():
            taken[start:stop] = True
            kept.append((line[start:stop], hinge, radius))
    return kept


def _windows(line: FloatArray, radii: tuple[float, float]) -> IntArray:
    """Start and stop (w, 2) of parts of a line that are as long as a swing and bent about as much."""
    along = arc_lengths(line)
    windows = [np.empty((0, 2), dtype=np.int64)]
    for radius in np.geomspace(*radii, _RADII).tolist():
        length = np.pi / 2 * _STAIRS * radius
        if along[-1] < length:
            break
        start = np.arange(0, np.searchsorted(along, along[-1] - length, side="right"), max(1, round(0.05 * radius)))
        stop = np.searchsorted(along, along[start] + length).clip(max=len(line) - 1)
        chord = np.linalg.norm(line[stop] - line[start], axis=1) / length
        bent = (chord > _CHORD[0]) & (chord < _CHORD[1])
        windows.append(np.column_stack((start[bent], stop[bent] + 1)))
    return np.vstack(windows)


def _swing_through(
    arc: FloatArray, radii: tuple[float, float], off_wall: FloatArray
) -> tuple[float, FloatArray, float] | None:
    """The swing that pixels (k, 2) are, by the circle that fits them best (Kasa 1976); None where they are none.

    Greatest distance of its pixels from the circle, in radii; hinge (2,); radius.
    """
    middle = arc.mean(axis=0)
    x, y = (arc - middle).T
    (a, b, c), _, rank, _ = np.linalg.lstsq(np.column_stack((x, y, np.ones(len(x)))), x**2 + y**2, rcond=None)
    square = float(c + (a**2 + b**2) / 4)
    if rank < 3 or not radii[0] ** 2 <= square <= radii[1] ** 2:
        return None
    hinge, radius = middle + np.array((a, b)) / 2, square**0.5
    error = float(np.abs(np.linalg.norm(arc - hinge, axis=1) - radius).max())
    ends = (arc[[0, -1]] - hinge) @ np.array((1, 1j))
    span = abs(float(np.angle(ends[1] / ends[0])))
    column, row = np.floor(hinge).astype(int).tolist()
    inside = 0 <= row < off_wall.shape[0] and 0 <= column < off_wall.shape[1]
    fits = error < _ROUND * radius + 1 and _SPAN_RAD[0] < span < _SPAN_RAD[1]
    if not (inside and fits and off_wall[row, column] <= _HINGE * radius):
        return None
    return error / radius, hinge, radius
