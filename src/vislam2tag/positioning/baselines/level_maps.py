"""How loud and how often each access point is heard in every cell near the training scans, by kernel smoothing.

Quick and coarse: what a likelihood over thousands of access points needs. Maps to look at are those of
``vislam2tag radio-maps``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.scans.places import ScanPlaces
from vislam2tag.positioning.scans.radio_scans import RadioScans

FAINT_DBM = -88.0
"""What a level is expected to be where an access point was never heard."""
_SURENESS = 0.003, 0.995
"""An access point is never heard with less or more probability."""
_WEIGHTS_AT_ONCE = 4_000_000
_REACH_CELLS = 1.5
"""Cells lie around training scans up to this far, in sides."""


@dataclass(frozen=True)
class LevelMaps:
    """``c`` cells of all storeys, ``a`` access points."""

    cells: ScanPlaces
    """Centres."""
    heard: FloatArray
    """(c, a) probability that a scan hears the access point."""
    level_dbm: FloatArray
    """(c, a) expected level if it does."""


def level_maps(
    scans: RadioScans, places: ScanPlaces, cell_m: float, smoothing_m: float, prior_scans: float
) -> LevelMaps:
    """Smooth scans (n) over the cells of their storey by a Gaussian kernel.

    A cell believes besides its scans in ``prior_scans`` further ones that hear as all scans on average do.
    """
    average = np.bincount(scans.column, minlength=len(scans.access_points)) / len(scans)
    parts = []
    for storey in np.unique(places.storey):
        here = places.storey == storey
        own, xy = places[here], _centres(places.xy[here], cell_m)
        level = scans[here].dense()
        heard = np.isfinite(level).astype(np.float64)
        level = np.nan_to_num(level)
        size = max(1, _WEIGHTS_AT_ONCE // len(own))
        for start in range(0, len(xy), size):
            cells = xy[start : start + size]
            away_m2 = cdist(cells, own.xy, "sqeuclidean")
            weight = np.exp(-away_m2 / (2 * smoothing_m**2))
            count = weight @ heard
            share = (count + prior_scans * average) / (weight.sum(axis=1)[:, None] + prior_scans)
            expected = (weight @ level + prior_scans * FAINT_DBM) / (count + prior_scans)
            nearest = own.z[away_m2.argmin(axis=1)]
            parts.append((np.full(len(cells), storey), cells, nearest, np.clip(share, *_SURENESS), expected))
    storeys, xy, z, share, expected = (np.concatenate(part) for part in zip(*parts, strict=True))
    return LevelMaps(ScanPlaces(places.storeys, storeys, xy, z, np.full(len(xy), np.nan)), share, expected)


def _centres(xy: FloatArray, cell_m: float) -> FloatArray:
    """Return the centres (c, 2) of all cells near places (n, 2), metres."""
    occupied = np.unique(np.floor(xy / cell_m).astype(np.int64), axis=0)
    steps = np.arange(-int(_REACH_CELLS), int(_REACH_CELLS) + 1)
    around = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    around = around[np.hypot(*around.T) <= _REACH_CELLS]
    cells = np.unique((occupied[:, None] + around).reshape(-1, 2), axis=0)
    return np.asarray((cells + 0.5) * cell_m)
