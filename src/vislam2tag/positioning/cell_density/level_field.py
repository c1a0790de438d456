"""Expected levels everywhere on a storey, also at places without scans, and positions from them.

Positions of access points and the decrease of their levels follow the log-distance model (Seidel and Rappaport 1992): a
level decreases by ten times an exponent for each tenfold distance. Every access point has its own place and exponent.
It also has its own power on every storey, because ceilings attenuate differently. Signals that were not heard were too
faint or, rarely, missed (the Tobit model of Tobin 1958).

A Gaussian process models deviations from the path loss of each access point (as Ferris, Haehnel and Fox 2006, "Gaussian
processes for signal strength-based location estimation", do around a constant). Near training scans levels are theirs;
far from all of them they follow the path loss.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import log_ndtr

from vislam2tag.core.arrays import AnyArray, FloatArray, IntArray
from vislam2tag.positioning.places import DensityCells, ScanPlaces, cells_near
from vislam2tag.positioning.radio_scans import CheckedArrays

_GRID_M = 4.0
_BEYOND_CELLS = 3
"""Candidate places of access points extend this many cells beyond the surveyed places."""
_CLOSEST_M = 3.0
"""Levels are constant within this distance, because antennas are mounted above heads."""
_POWER_DBM = -40.0, 15.0
_EXPONENT = 2.8, 0.5
"""Prior of the exponent: mean and standard deviation."""
_LEAST_EXPONENT = 1.0
"""Smallest exponent: levels decrease with distance, even along a corridor, by hardly less than this."""
_DEVIATION_DB = 6.0
"""Standard deviation of levels from the model: walls, shadows, and fading."""
_MISSED = 0.05
"""Share of levels that a scan misses although they are strong enough."""
_CENSORED_DB = 8.0
"""A missing level affects the model only if the expected level is at most this much below the faintest one."""
_PATH_LOSS_ROUNDS = 8
"""Part of the model, not an iteration limit: the unheard levels that count follow from the model before, so more rounds
need not converge. The eighth round changes expected levels by 0.03 dB (root mean square) on the demo's data set, and
the fifteenth by 0.01 dB. On 500 scans of Tampere the changes are 3.6 dB and 3.4 dB."""


@dataclass(frozen=True)
class PathLoss:
    """The path loss model for ``a`` access points on ``s`` storeys."""

    xy: FloatArray
    """(a, 2) positions, metres."""
    exponent: FloatArray
    """(a,)"""
    power_dbm: FloatArray
    """(s, a) level at 1 m, for each storey."""

    def level_dbm(self, storey: IntArray, xy: FloatArray) -> FloatArray:
        """Return the expected levels (n, a) at places (n) and (n, 2)."""
        return np.asarray(self.power_dbm[storey] - self.exponent * _fall_db(xy, self.xy))


def fitted_path_loss(level_dbm: FloatArray, places: ScanPlaces, faintest_dbm: float) -> PathLoss:
    """Fit to the levels (n, a) of scans, NaN if not heard; levels below the faintest are never heard.

    For each access point all places of a grid are tried; for each place, exponent and powers are a ridge regression.
    """
    heard = np.isfinite(level_dbm)
    grid = cells_near(replace(places, storey=np.zeros_like(places.storey)), _GRID_M, _BEYOND_CELLS).centre_m
    fall_db = _fall_db(places.xy, grid)
    level, weight = np.nan_to_num(level_dbm), heard.astype(np.float64)
    for _ in range(_PATH_LOSS_ROUNDS):
        model = _best(level, weight, fall_db, places, grid)
        expected = model.level_dbm(places.storey, places.xy)
        censored = ~heard & (expected > faintest_dbm - _CENSORED_DB)
        level = np.where(heard, level, unheard_dbm(expected, _DEVIATION_DB, faintest_dbm))
        weight = (heard | censored).astype(np.float64)
    return model


def unheard_dbm(expected_dbm: FloatArray, deviation_db: float | FloatArray, faintest_dbm: float) -> FloatArray:
    """Estimate unheard levels from the expected ones, all of one shape, dBm.

    The mean of levels below the faintest one, combined with the chance that the scan missed it (:data:`_MISSED`).
    """
    z = (faintest_dbm - expected_dbm) / deviation_db
    log_below = log_ndtr(z)
    fall_db = deviation_db * np.exp(-(z**2) / 2 - log_below) / np.sqrt(2 * np.pi)
    below = np.exp(log_below)
    return np.asarray(expected_dbm - fall_db * below / (below + _MISSED))


def _best(level: FloatArray, weight: FloatArray, fall_db: FloatArray, places: ScanPlaces, grid: FloatArray) -> PathLoss:
    """Choose for each access point the place of the ``grid`` (g, 2), metres, that fits its levels (n, a) best.

    ``weight`` (n, a): 1 if a level counts, else 0; ``fall_db`` (n, g) is the decrease of a level from each place.

    With y the levels above the prior power, p the power above it and m the exponent, y = p - m f on each storey. The
    powers are eliminated, which leaves one equation in m.
    """
    believed, ridge = _EXPONENT[0], (_DEVIATION_DB / _EXPONENT[1]) ** 2
    flat = (_DEVIATION_DB / _POWER_DBM[1]) ** 2
    shape = weight.shape[1], fall_db.shape[1]
    moment, normal, squares = np.zeros(shape), np.full(shape, ridge), np.zeros(shape)
    storeys = []
    for storey in range(len(places.storeys)):
        on = places.storey == storey
        w, y, f = weight[on], weight[on] * (level[on] - _POWER_DBM[0]), fall_db[on]
        # Sums over scans: of weights, decreases and their squares; of levels above the prior decrease, and so on.
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
    """(n, m) decrease of a level from 1 m to the distance between places (n, 2) and (m, 2) for each unit of
    exponent."""
    away2 = sum((xy[:, axis, None] - of[:, axis]) ** 2 for axis in (0, 1))
    return np.asarray(5 * np.log10(away2 + _CLOSEST_M**2))


NOISES_DB = (3.0, 6.0, 12.0)
"""Candidates for the standard deviation of levels at one place, without the offset common to a scan."""
OFFSET_DB = 4.0
"""Standard deviation of a scan's common offset, because phones and bodies differ."""
_SHADOW_DB, _SHADOW_LENGTH_M = 8.0, 20.0
"""Standard deviation of levels from the path loss, and its correlation length."""
_REACH_M = 12.0
"""Largest distance of a place from training scans."""
_SIDE_M = 1.5
_COARSER = 1.25
_MOST_NUMBERS = 4_000_000
_FEWEST = 200
"""Smallest side of cells. It grows until cells times access points are below this limit; fewer access points count as
this number."""
_FAINT_SHARE = 0.02
"""Share of heard levels below the level that counts as the faintest."""
_ROUNDS = 3
"""Number of times that unheard levels are estimated from the scans around; part of the model, not an iteration limit.
On the demo's data set the third estimate differs from the second by 0.2 to 0.8 dB (root mean square, by noise), the
tenth from the ninth by 0.04 to 0.1 dB."""


@dataclass(frozen=True)
class LevelField:
    """Expected levels of ``a`` access points in ``c`` cells."""

    cells: DensityCells
    level_dbm: FloatArray
    """(c, a) expected."""
    variance: FloatArray
    """(c,) variance of a level around the expected one, dB^2."""

    def place(self, level_dbm: FloatArray, storey: IntArray) -> FloatArray:
        """Return the mean place (n, 2), metres, on storeys (n,), by the likelihood of levels (n, a), NaN: not heard.

        The offset is integrated out. With m levels, r their residuals, v their variance and o^2 that of the offset, the
        residuals' covariance is v I + o^2 1 1'. Its inverse is (I - 1 1' o^2 / (v + m o^2)) / v (Sherman and Morrison).
        """
        at_once = max(_MOST_NUMBERS // len(self.cells), 1)
        blocks = (slice(start, start + at_once) for start in range(0, max(len(level_dbm), 1), at_once))
        return np.concatenate([self._place(level_dbm[rows], storey[rows]) for rows in blocks])

    def _place(self, level_dbm: FloatArray, storey: IntArray) -> FloatArray:
        """(n, 2) mean places, metres, of levels (n, a)."""
        likelihood = np.exp(self._log_likelihood(level_dbm, storey))
        return np.asarray(likelihood @ self.cells.centre_m / likelihood.sum(axis=1, keepdims=True))

    def _log_likelihood(self, level_dbm: FloatArray, storey: IntArray) -> FloatArray:
        """(n, c) 0 for the likeliest cell of the storey, -inf for cells of others; without cells there, all count."""
        heard = np.isfinite(level_dbm).astype(np.float64)
        level = np.nan_to_num(level_dbm)
        count = heard.sum(axis=1)[:, None]
        total = level.sum(axis=1)[:, None] - heard @ self.level_dbm.T
        squares = (level**2).sum(axis=1)[:, None] - 2 * level @ self.level_dbm.T + heard @ (self.level_dbm**2).T
        shared = OFFSET_DB**2 / (self.variance + count * OFFSET_DB**2)
        spread = (count - 1) * np.log(self.variance) + np.log(self.variance + count * OFFSET_DB**2)
        log = -((squares - shared * total**2) / self.variance + spread) / 2
        on = self.cells.on(storey)
        log = np.where(on | ~on.any(axis=1, keepdims=True), log, -np.inf)
        return np.asarray(log - log.max(axis=1, keepdims=True))

    def arrays(self) -> dict[str, AnyArray]:
        """Return the arrays of cells and expected levels, for saving."""
        return {
            "field_storey": self.cells.storey,
            "field_centre_m": self.cells.centre_m,
            "field_level_dbm": self.level_dbm,
            "field_variance": self.variance,
        }

    @classmethod
    def restored(cls, arrays: CheckedArrays) -> Self:
        """Restore from the result of :meth:`arrays`, over ``a`` access points and ``s`` storeys.

        Raises ValueError if it does not fit.
        """
        storey = arrays.integers("field_storey", "f", below=arrays.sizes["s"])
        cells = DensityCells(storey, arrays.floats("field_centre_m", "f", 2))
        level_dbm = arrays.floats("field_level_dbm", "f", "a")
        return cls(cells, level_dbm, arrays.floats("field_variance", "f", least=np.finfo(np.float64).tiny))


def learned_fields(level_dbm: FloatArray, places: ScanPlaces, noises_db: Sequence[float]) -> list[LevelField]:
    """Learn from levels (n, a) at places (n), NaN if not heard: one field for each noise, with the same path loss."""
    faintest_dbm = float(np.nanquantile(level_dbm, _FAINT_SHARE))
    path_loss = fitted_path_loss(level_dbm, places, faintest_dbm)
    cells = _cells(places, level_dbm.shape[1])
    data = _FieldData(level_dbm, places, path_loss, faintest_dbm)
    return [_field(data, cells, noise_db) for noise_db in noises_db]


def _cells(places: ScanPlaces, access_points: int) -> DensityCells:
    side_m = _SIDE_M
    most = _MOST_NUMBERS // max(access_points, _FEWEST)
    while len(cells := cells_near(places, side_m, round(_REACH_M / side_m))) > most:
        side_m *= _COARSER
    return cells


class _FieldData(NamedTuple):
    """Data that fields are learned from."""

    level_dbm: FloatArray
    """(n, a) NaN if not heard."""
    places: ScanPlaces
    path_loss: PathLoss
    faintest_dbm: float


def _field(data: _FieldData, cells: DensityCells, noise_db: float) -> LevelField:
    expected = data.path_loss.level_dbm(cells.storey, cells.centre_m)
    variance = np.full(len(cells), _SHADOW_DB**2 + noise_db**2)
    for storey in np.unique(data.places.storey):
        on, cell = data.places.storey == storey, cells.storey == storey
        xy, mean_dbm = data.places.xy[on], data.path_loss.level_dbm(data.places.storey[on], data.places.xy[on])
        among = _covariance(xy, xy) + noise_db**2 * np.eye(len(xy))
        inverse = cho_solve(cho_factor(among), np.eye(len(xy)))
        residual = _residuals(data.level_dbm[on], mean_dbm, inverse, data.faintest_dbm)
        towards = _covariance(cells.centre_m[cell], xy)
        expected[cell] += towards @ (inverse @ residual)
        variance[cell] -= ((towards @ inverse) * towards).sum(axis=1)
    return LevelField(cells, expected, variance)


def _residuals(level_dbm: FloatArray, mean_dbm: FloatArray, inverse: FloatArray, faintest_dbm: float) -> FloatArray:
    """Return the excess of levels (n, a) over the path loss (n, a), dB; unheard ones are estimated from neighbours.

    ``inverse`` (n, n) is that of the levels' covariance.
    """
    heard = np.isfinite(level_dbm)
    residual = np.where(heard, level_dbm - mean_dbm, 0.0)
    own = np.diag(inverse)[:, None]
    for _ in range(_ROUNDS):
        around_dbm = mean_dbm + residual - (inverse @ residual) / own  # prediction from all others (leave-one-out)
        guess = unheard_dbm(around_dbm, 1 / np.sqrt(own), faintest_dbm) - mean_dbm
        residual = np.where(heard, residual, guess)
    return residual


def _covariance(one: FloatArray, other: FloatArray) -> FloatArray:
    """(n, m) covariance of deviations from the path loss at places (n, 2) and (m, 2), dB^2 (Gudmundson 1991)."""
    away_m = np.hypot(*(one[:, axis, None] - other[:, axis] for axis in (0, 1)))
    return np.asarray(_SHADOW_DB**2 * np.exp(-away_m / _SHADOW_LENGTH_M))
