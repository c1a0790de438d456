"""Where access points stand and how their levels fall with distance: what is to be expected where nobody was.

The log-distance model (Seidel and Rappaport 1992): a level falls by ten times an exponent for each tenfold distance.
Every access point has its own place and exponent, and on every storey its own power, as ceilings take different shares.
What was not heard was too faint or, rarely, missed (the Tobit model of Tobin 1958).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import log_ndtr

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.positioning.cell_density.density_cells import cells_near
from vislam2tag.positioning.scans.places import ScanPlaces

_GRID_M = 4.0
_BEYOND_CELLS = 3
"""Places of access points that are tried: this far apart, up to this many farther than anybody was."""
_CLOSEST_M = 3.0
"""Levels rise no further within this distance: antennas hang above heads."""
_POWER_DBM = -40.0, 15.0
_EXPONENT = 2.8, 0.5
"""Believed before anything is heard: mean and standard deviation."""
_LEAST_EXPONENT = 1.0
"""Levels fall with distance, whatever is heard: along a corridor hardly more slowly than this."""
_DEVIATION_DB = 6.0
"""Of levels from the model: walls, shadows, and fading."""
_MISSED = 0.05
"""Share of levels that a scan misses although they are loud enough."""
_CENSORED_DB = 8.0
"""What is not heard tells of the model only where that expects it at most this much below the faintest level."""
_ROUNDS = 8
"""A part of the model, no limit: which unheard levels count follows from the model before, so that more rounds need not
settle. The eighth moves expected levels by 0.03 dB (root mean square) on the demo's data set, where the fifteenth does
by 0.01 dB, and by 3.6 dB on 500 scans of Tampere, where the fifteenth does by 3.4 dB."""


@dataclass(frozen=True)
class PathLoss:
    """The model for ``a`` access points on ``s`` storeys."""

    xy: FloatArray
    """(a, 2) where they stand, metres."""
    exponent: FloatArray
    """(a,)"""
    power_dbm: FloatArray
    """(s, a) level that a storey would have at 1 m."""

    def level_dbm(self, storey: IntArray, xy: FloatArray) -> FloatArray:
        """Return the levels (n, a) to be expected at places (n) and (n, 2)."""
        return np.asarray(self.power_dbm[storey] - self.exponent * _fall_db(xy, self.xy))


def fitted_path_loss(level_dbm: FloatArray, places: ScanPlaces, faintest_dbm: float) -> PathLoss:
    """Fit to the levels (n, a) of scans, NaN where not heard; below the faintest level nothing is heard.

    For each access point all places of a grid are tried; given the place, exponent and powers are a ridge regression.
    """
    heard = np.isfinite(level_dbm)
    grid = cells_near(replace(places, storey=np.zeros_like(places.storey)), _GRID_M, _BEYOND_CELLS).centre_m
    fall_db = _fall_db(places.xy, grid)
    level, weight = np.nan_to_num(level_dbm), heard.astype(np.float64)
    for _ in range(_ROUNDS):
        model = _best(level, weight, fall_db, places, grid)
        expected = model.level_dbm(places.storey, places.xy)
        censored = ~heard & (expected > faintest_dbm - _CENSORED_DB)
        level = np.where(heard, level, unheard_dbm(expected, _DEVIATION_DB, faintest_dbm))
        weight = (heard | censored).astype(np.float64)
    return model


def unheard_dbm(expected_dbm: FloatArray, deviation_db: float | FloatArray, faintest_dbm: float) -> FloatArray:
    """Estimate levels that were not heard where so much was expected, all of one shape, dBm.

    The mean of what is below the faintest level, but for the chance that the scan missed it (:data:`_MISSED`).
    """
    z = (faintest_dbm - expected_dbm) / deviation_db
    log_below = log_ndtr(z)
    fall_db = deviation_db * np.exp(-(z**2) / 2 - log_below) / np.sqrt(2 * np.pi)
    below = np.exp(log_below)
    return np.asarray(expected_dbm - fall_db * below / (below + _MISSED))


def _best(level: FloatArray, weight: FloatArray, fall_db: FloatArray, places: ScanPlaces, grid: FloatArray) -> PathLoss:
    """Choose for each access point the place of the ``grid`` (g, 2), metres, under which its levels (n, a) fit best.

    ``weight`` (n, a): 1 where a level counts, else 0; ``fall_db`` (n, g) is how much a level falls from each place.

    With y the levels above the power believed, p the power above it and m the exponent, y = p - m f on each storey:
    the powers are eliminated, one equation in m is left.
    """
    believed, ridge = _EXPONENT[0], (_DEVIATION_DB / _EXPONENT[1]) ** 2
    flat = (_DEVIATION_DB / _POWER_DBM[1]) ** 2
    shape = weight.shape[1], fall_db.shape[1]
    moment, normal, squares = np.zeros(shape), np.full(shape, ridge), np.zeros(shape)
    storeys = []
    for storey in range(len(places.storeys)):
        on = places.storey == storey
        w, y, f = weight[on], weight[on] * (level[on] - _POWER_DBM[0]), fall_db[on]
        # Sums over scans: of weights, falls, their squares; of levels as they lie above the believed fall, and so on.
        total, falls, falls2 = w.sum(axis=0)[:, None] + flat, w.T @ f, w.T @ f**2
        above = y.sum(axis=0)[:, None] + believed * falls
        together = y.T @ f
        moment += above * falls / total - together - believed * falls2
        normal += falls2 - falls**2 / total
        squares += believed * (2 * together + believed * falls2) - above**2 / total
        storeys.append((above, falls, total[:, 0]))
    steeper = np.maximum(moment / normal, _LEAST_EXPONENT - believed)
    best = (squares - 2 * moment * steeper + normal * steeper**2).argmin(axis=1)
    each = np.arange(len(best))
    steeper = steeper[each, best]
    power = [(above[each, best] + steeper * falls[each, best]) / total for above, falls, total in storeys]
    return PathLoss(grid[best], believed + steeper, _POWER_DBM[0] + np.stack(power))


def _fall_db(xy: FloatArray, of: FloatArray) -> FloatArray:
    """(n, m) how much a level falls from 1 m to the distance of places (n, 2) and (m, 2) for each unit of exponent."""
    away2 = sum((xy[:, axis, None] - of[:, axis]) ** 2 for axis in (0, 1))
    return np.asarray(5 * np.log10(away2 + _CLOSEST_M**2))
