"""A radio map by Gaussian processes: the mean and the deviation of the RSSI of one access point over a floor.

The RSSI of an access point is a trend that path loss makes, shadowing of a few metres (Gudmundson 1991), and noise:

    k(a, b) = trend^2 exp(-d^2 / 2 l^2) + shadowing^2 (1 + sqrt(3) d / m) exp(-sqrt(3) d / m),   d = |a - b|

What l, m and the three deviations are, walls and people decide, so that all access points of a floor share them: they
are those under which the readings of a sample of access points together are most likely. Only heard readings count
here; how often an access point is heard is a map of its own (:mod:`.map_heard`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.linalg.lapack import dpotri
from scipy.optimize import minimize
from scipy.spatial import cKDTree
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Kernel, Matern, WhiteKernel

from vislam2tag.common.records import Record
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.dataset.radio_mapping.map_readings import MapReadings

SAMPLE_READINGS = 120
"""Readings of an access point that set the kernel: a likelihood costs their cube."""
_SQUARE_M = 0.5
"""Side of the smallest square whose readings are averaged, metres: much shorter than shadowing is."""
_AT_ONCE = 4000
"""Positions predicted at once: each takes a row of the covariance with all points."""
_PRIOR_READINGS = 20
"""How many readings the kernel's own deviation counts as against what an access point's residuals say."""


class MapKernel(Record):
    """How RSSI varies over one floor."""

    trend_db: float = 10.0
    trend_m: float = 15.0
    shadowing_db: float = 4.0
    shadowing_m: float = 3.0
    noise_db: float = 3.0
    """Standard deviation of single readings at one place."""

    def smooth(self) -> Kernel:
        """The kernel without noise, as scikit-learn has it."""
        trend = ConstantKernel(self.trend_db**2, (1.0, 1e3)) * RBF(self.trend_m, (8.0, 100.0))
        return trend + ConstantKernel(self.shadowing_db**2, (0.01, 400.0)) * Matern(self.shadowing_m, (0.7, 8.0), 1.5)


@dataclass(frozen=True)
class MapPoints:
    """Readings of one access point, those of one square and fold as one where there are many (n points, k readings)."""

    position: FloatArray
    """(n, 2)"""
    rssi_dbm: FloatArray
    """(n,)"""
    fold: IntArray
    """(n,)"""
    of_reading: IntArray
    """(k,) point of each reading."""
    square_m: float | None
    """Side of the squares; None where each reading is a point."""

    @property
    def readings(self) -> IntArray:
        """How many readings each point is the mean of (n,)."""
        return np.bincount(self.of_reading, minlength=len(self.rssi_dbm))


def map_points(position: FloatArray, rssi_dbm: FloatArray, fold: IntArray, most: int) -> MapPoints:
    """Take readings (k,) as they are, or average them in squares that double until there are at most ``most``.

    So a map costs what its floor is large, not how often it was walked.
    """
    if len(rssi_dbm) <= most:
        return MapPoints(position, rssi_dbm, fold, np.arange(len(rssi_dbm)), None)
    side = _SQUARE_M
    while True:
        keys = np.column_stack((np.floor(position / side).astype(np.int64), fold))
        _, of_reading = np.unique(keys, axis=0, return_inverse=True)
        if int(of_reading.max()) < most:
            break
        side *= 2
    count = np.bincount(of_reading)
    mean = [np.bincount(of_reading, weights=column) / count for column in (*position.T, rssi_dbm)]
    part = np.zeros(len(count), dtype=np.int64)
    part[of_reading] = fold
    return MapPoints(np.column_stack(mean[:2]), mean[2], part, of_reading, side)


def fit_kernel(readings: MapReadings, access_points: IntArray) -> MapKernel:
    """Find the kernel under which the readings of access points (m,), by index, are together most likely."""
    samples = [_sample(*readings.of(int(index))[:2]) for index in access_points]
    start = MapKernel()
    kernel = start.smooth() + WhiteKernel(start.noise_db**2, (0.25, 200.0))
    processes = [
        GaussianProcessRegressor(kernel, alpha=1e-6, optimizer=None).fit(position, rssi - rssi.mean())
        for position, rssi in samples
    ]

    def cost(theta: FloatArray) -> tuple[float, FloatArray]:
        each = [one.log_marginal_likelihood(theta, eval_gradient=True, clone_kernel=False) for one in processes]
        return -sum(value for value, _ in each), -np.sum([slope for _, slope in each], axis=0)

    found = minimize(cost, kernel.theta, jac=True, method="L-BFGS-B", bounds=kernel.bounds, options={"maxiter": 30})
    trend, trend_m, shadowing, shadowing_m, noise = np.exp(found.x).tolist()
    return MapKernel(
        trend_db=trend**0.5,
        trend_m=trend_m,
        shadowing_db=shadowing**0.5,
        shadowing_m=shadowing_m,
        noise_db=noise**0.5,
    )


def _sample(position: FloatArray, rssi_dbm: FloatArray) -> tuple[FloatArray, FloatArray]:
    """At most SAMPLE_READINGS of readings (k, 2) and (k,), drawn alike each time."""
    if len(rssi_dbm) <= SAMPLE_READINGS:
        return position, rssi_dbm
    chosen = np.random.default_rng(0).permutation(len(rssi_dbm))[:SAMPLE_READINGS]
    return position[chosen], rssi_dbm[chosen]


@dataclass(frozen=True)
class LeftOutReadings:
    """Readings (k,) predicted from the other folds: error (truth less prediction) and stated deviation, dB."""

    error_db: FloatArray
    deviation_db: FloatArray
    distance_m: FloatArray
    """To the nearest point of another fold; inf where there is none."""


@dataclass(frozen=True)
class MapProcess:
    """The process of one access point, fitted; made by :func:`fit_process`."""

    kernel: MapKernel
    scale: float
    """Factor of all deviations, by what its own left-out readings say."""
    level_dbm: float
    left_out: LeftOutReadings
    _process: GaussianProcessRegressor

    def at(self, position: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Predict at positions (n, 2).

        Returns the mean (dBm), the standard deviation of a single reading there (dB), and that of the mean (dB).
        """
        parts = np.split(position, range(_AT_ONCE, len(position), _AT_ONCE)) if len(position) else []
        known = [self._process.predict(part, return_std=True) for part in parts]
        mean, sigma = (np.concatenate([np.empty(0), *(part[which] for part in known)]) for which in (0, 1))
        deviation = self.scale * np.hypot(sigma, self.kernel.noise_db)
        return mean + self.level_dbm, deviation, self.scale * sigma


def fit_process(points: MapPoints, rssi_dbm: FloatArray, kernel: MapKernel, reach_m: float) -> MapProcess:
    """Fit the map of one access point from its ``points``; ``rssi_dbm`` (k,) are its single readings.

    Deviations are set by left-out readings that have a point of another fold within ``reach_m``.
    """
    level = float(np.average(points.rssi_dbm, weights=points.readings))
    noise = kernel.noise_db**2 / points.readings
    process = GaussianProcessRegressor(kernel.smooth(), alpha=noise, optimizer=None)
    process.fit(points.position, points.rssi_dbm - level)
    error, sigma, distance = _left_out(points, process, noise)
    each = points.of_reading
    predicted = points.rssi_dbm - error
    left_out = LeftOutReadings(rssi_dbm - predicted[each], np.hypot(sigma, kernel.noise_db)[each], distance[each])
    ratio = (left_out.error_db / left_out.deviation_db)[left_out.distance_m < reach_m]
    scale = float(np.sqrt((_PRIOR_READINGS + (ratio**2).sum()) / (_PRIOR_READINGS + len(ratio))))
    return MapProcess(kernel, scale, level, replace(left_out, deviation_db=scale * left_out.deviation_db), process)


def _left_out(
    points: MapPoints, process: GaussianProcessRegressor, noise: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Predict each fold from the others, by blocks of the inverse covariance (Rasmussen and Williams 2006, eq. 5.12).

    With Q the inverse over all points, the residuals of a block B are Q_BB^-1 (Q y)_B and their covariance is Q_BB^-1.
    Returns the residuals (n,), the standard deviation of the mean there (n,), and the distance to the nearest point of
    another fold (n,).
    """
    half, _ = dpotri(process.L_, lower=True)
    inverse = np.tril(half) + np.tril(half, -1).T
    error, variance, distance = np.zeros((3, len(noise)))
    for fold in np.unique(points.fold):
        own, others = np.flatnonzero(points.fold == fold), np.flatnonzero(points.fold != fold)
        block = cho_factor(inverse[np.ix_(own, own)], lower=True)
        error[own] = cho_solve(block, process.alpha_[own])
        variance[own] = np.diag(cho_solve(block, np.eye(len(own)))) - noise[own]
        distance[own] = cKDTree(points.position[others]).query(points.position[own])[0]
    return error, np.sqrt(np.maximum(variance, 0.0)), distance
