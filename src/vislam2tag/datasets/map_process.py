"""A radio map by Gaussian processes: mean and standard deviation of an access point's RSSI over a floor.

It is made from the labelled scans of one floor and technology, as arrays. The RSSI of an access point is the sum of a
trend from path loss, shadowing of a few metres (Gudmundson 1991), and noise:

    k(a, b) = trend^2 exp(-d^2 / 2 l^2) + shadowing^2 (1 + sqrt(3) d / m) exp(-sqrt(3) d / m),   d = |a - b|

l, m and the three standard deviations depend on walls and people, so all access points of a floor share them. They
maximise the joint likelihood of the readings of a sample of access points. Only heard readings count here; how often an
access point is heard is a separate map (:func:`.radio_maps.heard_share`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import polars as pl
from scipy.linalg import cho_factor, cho_solve
from scipy.linalg.lapack import dpotri
from scipy.optimize import minimize
from scipy.spatial import cKDTree
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Kernel, Matern, WhiteKernel

from vislam2tag.common.records import Record
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.datasets.model import Dataset, each_session
from vislam2tag.datasets.place_sums import PlaceMeans, device_offsets
from vislam2tag.datasets.statistics_record import UNKNOWN

FOLDS = 5
_PLACE = ("building", "floor", "technology")


class MapPlace(NamedTuple):
    """A floor and the technology that is mapped on it."""

    building: str
    floor: int
    technology: str


@dataclass(frozen=True)
class MapReadings:
    """Scans (s) and the readings (k) of the mapped access points (a); positions are BCS metres."""

    bssids: tuple[str, ...]
    scan_position: FloatArray
    """(s, 2)"""
    scan_fold: IntArray
    """(s,) fold of the scan, 0 to FOLDS - 1; walks stay whole if there are several."""
    scan: IntArray
    """(k,) index of the reading's scan."""
    access_point: IntArray
    """(k,) index of the reading's access point."""
    position: FloatArray
    """(k, 2) position of the phone at the reading; NaN if unknown."""
    rssi_dbm: FloatArray
    """(k,) RSSI without the offset of the reading's device, as the mean of all devices would hear it."""
    place: MapPlace
    offsets_db: Mapping[str, float]
    """Offsets of the devices."""

    def indices(self, bssids: Sequence[str]) -> IntArray:
        """Index of each of these access points (m,)."""
        return np.array([self.bssids.index(bssid) for bssid in bssids], dtype=np.int64)

    def of(self, access_point: int) -> tuple[FloatArray, FloatArray, IntArray]:
        """Position (n, 2), RSSI (n,) and fold (n,) of the readings of one access point that have a position."""
        own = (self.access_point == access_point) & np.isfinite(self.position[:, 0])
        return self.position[own], self.rssi_dbm[own], self.scan_fold[self.scan[own]]


def heard_at(dataset: Dataset) -> pl.DataFrame:
    """Count the labelled readings of each access point on each floor: building, floor, technology, bssid, readings.

    Sorted by readings on each floor, most first.
    """
    heard = dataset.readings.join(_labelled(dataset).select("scan_id", *_PLACE), on="scan_id")
    counts = heard.group_by(*_PLACE, "bssid").agg(readings=pl.len()).collect(engine="streaming")
    return counts.sort(*_PLACE, "readings", "bssid", descending=[False, False, False, True, False])


def offsets_db(dataset: Dataset) -> dict[tuple[str, str], float]:
    """Offset of each device against the mean of devices that share places with it, by technology and device."""
    places = PlaceMeans()
    scans = _labelled(dataset)
    devices = dict(scans.group_by("technology").agg(pl.col("device").unique().sort()).collect().iter_rows())
    if all(len(names) < 2 for names in devices.values()):
        return {}
    for tables in each_session(scans, dataset.readings):
        own = tables.fingerprints.select("scan_id", "technology", "building", "device")
        places.add(tables.readings.join(own, on="scan_id").drop_nulls(["x", "rssi_dbm"]))
    shared = places.shared()
    return {
        (technology, name): offset_db
        for technology, names in sorted(devices.items())
        for name, (offset_db, _) in device_offsets(shared.filter(pl.col("technology") == technology), names).items()
        if offset_db is not None
    }


def map_readings(
    dataset: Dataset, place: MapPlace, bssids: Collection[str], offsets: dict[tuple[str, str], float]
) -> MapReadings:
    """Collect the data of one floor's maps; ``offsets`` as from :func:`offsets_db`."""
    here = pl.all_horizontal(pl.col(name) == value for name, value in place._asdict().items())
    scans = _labelled(dataset).filter(here).sort("scan_id").collect()
    scans = scans.with_columns(fold=_folds(scans)).with_row_index("scan")
    names = sorted(bssids)
    own = scans.lazy().select("scan_id", "scan", "device")
    readings = (
        dataset.readings.filter(pl.col("bssid").is_in(names), pl.col("rssi_dbm").is_not_null())
        .join(own, on="scan_id")
        .with_columns(pl.when(pl.col("floor") == place.floor).then(pl.col("x", "y")))
        .select("scan", "bssid", "device", "x", "y", "rssi_dbm")
        .sort("scan", "bssid", "x", "y", "rssi_dbm")
        .collect()
    )
    offset = {device: value for (technology, device), value in offsets.items() if technology == place.technology}
    off = readings["device"].replace_strict(offset, default=0.0, return_dtype=pl.Float64)
    index = {name: number for number, name in enumerate(names)}
    return MapReadings(
        bssids=tuple(names),
        scan_position=scans.select("x", "y").to_numpy(),
        scan_fold=scans["fold"].to_numpy().astype(np.int64),
        scan=readings["scan"].to_numpy().astype(np.int64),
        access_point=readings["bssid"].replace_strict(index, return_dtype=pl.Int64).to_numpy(),
        position=readings.select(pl.col("x", "y").fill_null(float("nan"))).to_numpy(),
        rssi_dbm=readings["rssi_dbm"].cast(pl.Float64).to_numpy() - off.to_numpy(),
        place=place,
        offsets_db=offset,
    )


def _labelled(dataset: Dataset) -> pl.LazyFrame:
    known = dataset.fingerprints.filter(pl.col("x").is_not_null(), pl.col("floor").is_not_null())
    return known.with_columns(pl.col("device").fill_null(UNKNOWN), pl.col("building").fill_null(""))


def _folds(scans: pl.DataFrame) -> pl.Series:
    """Fold of each scan (in order of scan_id): whole walks in turn, or fifths of the path if there is only one walk."""
    walk = scans["session"].fill_null("").rank("dense").cast(pl.Int64) - 1
    if walk.n_unique() > 1:
        return walk % FOLDS
    return pl.Series(np.arange(len(scans)) * FOLDS // max(len(scans), 1))


SAMPLE_READINGS = 120
"""Readings of an access point used for the kernel; the cost of a likelihood grows with their cube."""
_SQUARE_M = 0.5
"""Side of the smallest square whose readings are averaged, metres; much shorter than the shadowing length."""
_AT_ONCE = 4000
"""Positions predicted at once; each takes a row of the covariance with all points."""
_PRIOR_READINGS = 20
"""Weight of the kernel's own deviation, in readings, against an access point's residuals."""


class MapKernel(Record):
    """How RSSI varies over one floor."""

    trend_db: float = 10.0
    trend_m: float = 15.0
    shadowing_db: float = 4.0
    shadowing_m: float = 3.0
    noise_db: float = 3.0
    """Standard deviation of single readings at one place."""

    def smooth(self) -> Kernel:
        """The kernel without noise, as a scikit-learn kernel."""
        trend = ConstantKernel(self.trend_db**2, (1.0, 1e3)) * RBF(self.trend_m, (8.0, 100.0))
        return trend + ConstantKernel(self.shadowing_db**2, (0.01, 400.0)) * Matern(self.shadowing_m, (0.7, 8.0), 1.5)


@dataclass(frozen=True)
class MapPoints:
    """Readings of one access point, averaged by square and fold if there are many (n points, k readings)."""

    position: FloatArray
    """(n, 2)"""
    rssi_dbm: FloatArray
    """(n,)"""
    fold: IntArray
    """(n,)"""
    of_reading: IntArray
    """(k,) point of each reading."""
    square_m: float | None
    """Side of the squares; None if each reading is a point."""

    @property
    def readings(self) -> IntArray:
        """Number of readings behind each point (n,)."""
        return np.bincount(self.of_reading, minlength=len(self.rssi_dbm))


def map_points(position: FloatArray, rssi_dbm: FloatArray, fold: IntArray, most: int) -> MapPoints:
    """Keep readings (k,) as they are, or average them in squares that double until there are at most ``most``.

    The cost of a map thus depends on the size of its floor, not on the number of walks.
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
    """Find the kernel that maximises the joint likelihood of the readings of access points (m,), by index."""
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
    """At most SAMPLE_READINGS of readings (k, 2) and (k,), always the same draw."""
    if len(rssi_dbm) <= SAMPLE_READINGS:
        return position, rssi_dbm
    chosen = np.random.default_rng(0).permutation(len(rssi_dbm))[:SAMPLE_READINGS]
    return position[chosen], rssi_dbm[chosen]


@dataclass(frozen=True)
class LeftOutReadings:
    """Readings (k,) predicted from the other folds: error (truth minus prediction) and stated deviation, dB."""

    error_db: FloatArray
    deviation_db: FloatArray
    distance_m: FloatArray
    """Distance to the nearest point of another fold; inf if there is none."""


@dataclass(frozen=True)
class MapProcess:
    """The fitted process of one access point, made by :func:`fit_process`."""

    kernel: MapKernel
    scale: float
    """Factor on all deviations, from its own left-out readings."""
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

    Deviations are calibrated with left-out readings that have a point of another fold within ``reach_m``.
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
