"""The boundary of a region of cells as wall segments."""

from __future__ import annotations

import numpy as np
from skimage.measure import approximate_polygon, find_contours

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.cell_grid import WalkableArea

_TOLERANCE_CELLS = 0.8
"""Segments leave the cells' own outline by at most this: a slanting wall is one, not a staircase."""


def wall_segments(area: WalkableArea) -> FloatArray:
    """Segments (w, 2, 2) of an area's boundary, BCS metres, with the area on the left of start to stop."""
    rings = find_contours(np.pad(area.mask, 1).astype(np.float32), 0.5, positive_orientation="low")
    segments = []
    for ring in rings:
        corners = approximate_polygon(ring, _TOLERANCE_CELLS)[:, ::-1]
        if len(corners) > 3:
            segments.append(np.stack((corners[:-1], corners[1:]), axis=1))
    if not segments:
        return np.empty((0, 2, 2))
    # Row and column 0 of the padded mask lie half a cell outside the first cell's edge.
    placed: FloatArray = (np.vstack(segments) - 0.5) * area.cell_m + np.array(area.origin_m)
    return placed
