"""Radio maps: for each floor and access point, the mean signal strength, its variation, and how often it is heard.

The share of scans at a place that hear an access point is a kernel regression over all scans of a floor. "Not heard" is
neither a weak reading nor a missing one: it is another outcome of a scan and has its own map. The map of the mean is
therefore a map of the readings that *are* heard.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import polars as pl
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree
from threadpoolctl import threadpool_limits

from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.progress import Progress, counted, silent
from vislam2tag.common.records import Record
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.core.notebook import Drawable
from vislam2tag.datasets import map_process
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.settings import RadioMapSettings

LEAST_READINGS = 10
"""Readings on a floor that an access point needs for a map."""
MOST_POINTS = 1000
"""Readings of an access point above which they are averaged in squares; the cost of a map grows with their cube."""
WIDTHS_M = (1.0, 1.5, 2.0, 3.0, 4.0)
"""Candidate widths of the kernel (one standard deviation), metres."""
_REACH = 3.0
"""Scans at more than this many widths do not count."""
_PRIOR_SCANS = 0.5
"""Weight of the whole floor's share, in scans."""
_SAMPLE_SCANS = 1500
"""Number of scans at which widths are compared."""


def heard_share(
    position: FloatArray, scan_position: FloatArray, heard: csr_array, floor_share: FloatArray, width_m: float
) -> FloatArray:
    """Share of scans (n, a), 0 to 1, that hear each access point at positions (n, 2).

    ``heard`` (s, a) is 1 if a scan heard it; ``floor_share`` (a,) is the result if no scan is near.
    """
    return _share(_weights(position, scan_position, width_m), heard, floor_share)


def heard_matrix(scan: IntArray, access_point: IntArray, scans: int, access_points: int) -> csr_array:
    """Make (s, a) with 1 if a scan heard an access point, from the scan and access point of each reading (k,)."""
    matrix = csr_array((np.ones(len(scan)), (scan, access_point)), shape=(scans, access_points))
    matrix.sum_duplicates()
    matrix.data[:] = 1.0
    return matrix


def best_width(scan_position: FloatArray, fold: IntArray, heard: csr_array) -> float:
    """Find the width (m) that best predicts what scans (s,) hear, by :func:`heard_error` over all access points."""
    return min(WIDTHS_M, key=lambda width: float(heard_error(scan_position, fold, heard, width).mean()))


def heard_error(scan_position: FloatArray, fold: IntArray, heard: csr_array, width_m: float) -> FloatArray:
    """Mean squared error (a,) of the share that the scans of other folds predict for a scan (Brier 1950)."""
    sample = np.arange(0, len(fold), -(-len(fold) // _SAMPLE_SCANS))
    weights = _weights(scan_position[sample], scan_position, width_m)
    own = np.repeat(sample, np.diff(weights.indptr))
    weights.data[fold[own] == fold[weights.indices]] = 0.0
    share = _share(weights, heard, np.asarray(heard.mean(axis=0)))
    error: FloatArray = ((share - heard[sample].toarray()) ** 2).mean(axis=0)
    return error


def _share(weights: csr_array, heard: csr_array, floor_share: FloatArray) -> FloatArray:
    """Shares (n, a) by the weights (n, s) of scans, shrunk towards the floor's (a,)."""
    total = np.asarray(weights.sum(axis=1))[:, None]
    share: FloatArray = ((weights @ heard).toarray() + _PRIOR_SCANS * floor_share) / (total + _PRIOR_SCANS)
    return share


def _weights(position: FloatArray, scan_position: FloatArray, width_m: float) -> csr_array:
    """Gaussian weight (n, s) of each scan near each position."""
    near = cKDTree(position).sparse_distance_matrix(cKDTree(scan_position), _REACH * width_m, output_type="ndarray")
    # Some output types drop pairs that coincide; this one keeps them.
    weight = np.exp(-0.5 * (near["v"] / width_m) ** 2)
    return csr_array((weight, (near["i"], near["j"])), shape=(len(position), len(scan_position)))


MapLayer: TypeAlias = NDArray[np.float32]
_SAMPLE = 12
"""Number of access points of a floor that determine the parameters of all its maps."""
_MOST_CELLS = 250_000
"""Cells of a floor (500 x 500) above which a label must be wrong or the cell too small for memory."""


class MapErrors(Record):
    """Errors of readings predicted without their own fold: walks left out together, or fifths of the only walk."""

    readings: int
    """Number of readings with one of another fold within reach; others are not counted."""
    rms_db: float | None
    bias_db: float | None
    within_one_deviation: float | None
    """Share of the readings, 0 to 1; 0.68 if deviations are right."""

    @classmethod
    def of(cls, left_out: map_process.LeftOutReadings, reach_m: float) -> MapErrors:
        """Summarise the left-out readings of one map."""
        counted = left_out.distance_m < reach_m
        if not counted.any():
            return cls(readings=0, rms_db=None, bias_db=None, within_one_deviation=None)
        error = left_out.error_db[counted]
        within = np.abs(error) < left_out.deviation_db[counted]
        return cls(
            readings=int(counted.sum()),
            rms_db=round(float(np.sqrt((error**2).mean())), 3),
            bias_db=round(float(error.mean()), 3),
            within_one_deviation=round(float(within.mean()), 4),
        )


class RadioMap(Record):
    """Summary of one access point's map."""

    bssid: str
    ssid: str | None
    readings: int
    square_m: float | None
    """Side of the squares in which readings were averaged, metres; None if each reading counts on its own."""
    loudest_dbm: float | None
    """Greatest mean of a cell."""
    errors: MapErrors
    heard_error: float
    """Mean squared error (Brier) of the share of scans that hear it, predicted without their own fold."""


@dataclass(frozen=True, repr=False)
class FloorMaps(Drawable):
    """The maps of one floor and technology; arrays are (access points, rows, columns), NaN if unknown."""

    place: map_process.MapPlace
    grid: CellGrid
    scans: int
    maps: tuple[RadioMap, ...]
    """Sorted by readings, most first."""
    kernel: map_process.MapKernel
    heard_width_m: float
    offsets_db: dict[str, float]
    """Offset that was subtracted from the readings of each device."""
    mean_dbm: MapLayer
    """Mean of heard readings, for the mean of all devices."""
    deviation_db: MapLayer
    """Standard deviation of a single reading from that mean."""
    sigma_db: MapLayer
    """Standard deviation of the mean itself."""
    heard: MapLayer
    """Share of scans that hear it, 0 to 1."""

    def _facts(self) -> dict[str, object]:
        return {
            "floor": self.place.floor,
            "technology": self.place.technology,
            "access points": len(self.maps),
            "cells": f"{self.grid.rows} x {self.grid.columns} of {self.grid.cell_m:g} m",
            "fingerprints": self.scans,
        }


def radio_maps(
    dataset: Dataset,
    settings: RadioMapSettings,
    access_points: Sequence[str] = (),
    progress: Progress[int] = silent,
) -> Iterator[FloorMaps]:
    """Make the maps floor by floor; ``access_points`` selects some, otherwise the most heard of each floor are mapped.

    Access points with owners who ask not to be mapped (``_nomap``) are mapped only if they are named.

    Raises DatasetError if no access point is heard often enough in labelled fingerprints, and UsageError if a named one
    is not in the data set.
    """
    heard = _often_heard(dataset, settings, access_points)
    wanted = heard.filter("wanted")
    step = counted(progress, len(wanted))
    offsets = map_process.offsets_db(dataset)
    names = dict(dataset.access_points.select("bssid", "ssid").collect().iter_rows())
    for (building, floor, technology), own in wanted.group_by(*map_process.MapPlace._fields, maintain_order=True):
        place = map_process.MapPlace(str(building), int(floor), str(technology))
        sample = heard.filter(pl.struct(map_process.MapPlace._fields) == place._asdict(), "sample")["bssid"].to_list()
        mapped = own["bssid"].to_list()
        readings = map_process.map_readings(dataset, place, {*mapped, *sample}, offsets)
        order, shared = readings.indices(mapped), readings.indices(sample or mapped)
        # The matrices are small, and the number of threads that add up a sum affects its last digits.
        with threadpool_limits(limits=1):
            maps = _floor_maps(readings, order, shared, names, settings, step)
        yield maps


def _often_heard(dataset: Dataset, settings: RadioMapSettings, access_points: Sequence[str]) -> pl.DataFrame:
    """Return the access points that are heard often enough on each floor, sorted by readings.

    Columns are building, floor, technology, bssid, readings, ``wanted``, and ``sample``: whether it helps to determine
    the parameters of all maps of a floor, which do not depend on the wanted maps.
    """
    known = dataset.access_points.select("bssid", "ssid", "nomap").collect()
    unknown = sorted(set(access_points) - set(known["bssid"]))
    if unknown:
        raise UsageError(f"--ap {unknown[0]}: no such access point in this data set; {_instead(known, unknown[0])}")
    open_to_all = pl.col("bssid").is_in(known.filter(~pl.col("nomap").fill_null(False))["bssid"].to_list())
    named = pl.col("bssid").is_in(list(access_points))
    enough = map_process.heard_at(dataset).filter(pl.col("readings") >= LEAST_READINGS)
    rank = pl.int_range(pl.len()).over(*map_process.MapPlace._fields, open_to_all)
    mapped = open_to_all & (rank < settings.most)
    every = (mapped.sum().over(map_process.MapPlace._fields) / _SAMPLE).ceil().clip(1).cast(pl.Int64)
    enough = enough.with_columns(wanted=named if access_points else mapped, sample=mapped & (rank % every == 0))
    if not enough["wanted"].any():
        heard = map_process.heard_at(dataset).filter(named if access_points else open_to_all)
        raise DatasetError(
            f"{dataset.info.name}: no access point has {LEAST_READINGS} readings in labelled fingerprints of one floor "
            f"(at most {max(heard['readings'].to_list(), default=0)}), so no map can be made; label more scans or name "
            "another --ap"
        )
    return enough


def _instead(known: pl.DataFrame, name: str) -> str:
    """Suggestion for a name that is not a BSSID."""
    called = [str(bssid) for bssid in known.filter(pl.col("ssid") == name)["bssid"]]
    if called:
        return f"{len(called)} access points have this name; pass a BSSID such as {called[0]}"
    return f"pass a BSSID such as {next(iter(known['bssid']), 'those')} in access_points.parquet"


def _floor_maps(
    readings: map_process.MapReadings,
    order: IntArray,
    sample: IntArray,
    names: Mapping[str, str | None],
    settings: RadioMapSettings,
    progress: Progress[str],
) -> FloorMaps:
    """Map the access points ``order``, most heard first; ``sample`` determines the shared parameters."""
    grid = grid_of(readings.scan_position, settings)
    cells = np.argwhere(np.ones(grid.shape, dtype=bool))
    centres = grid.centres_m(cells)
    near = _near(centres, readings.scan_position, settings.reach_m)
    kernel = map_process.fit_kernel(readings, sample)
    width_m, brier, heard = _heard(readings, order, sample, centres[near])
    layers = np.full((4, len(order), len(cells)), np.nan, dtype=np.float32)
    layers[3][:, near] = heard
    records = []
    for number, index in enumerate(order.tolist()):
        position, rssi, fold = readings.of(index)
        points = map_process.map_points(position, rssi, fold, MOST_POINTS)
        process = map_process.fit_process(points, rssi, kernel, settings.reach_m)
        inside = _near(centres, position, settings.reach_m)
        mean_dbm = layers[0, number]
        layers[:3, number, inside] = process.at(centres[inside])
        record = RadioMap(
            bssid=readings.bssids[index],
            ssid=names.get(readings.bssids[index]),
            readings=len(rssi),
            square_m=points.square_m,
            loudest_dbm=round(float(np.nanmax(mean_dbm)), 2) if np.isfinite(mean_dbm).any() else None,
            errors=MapErrors.of(process.left_out, settings.reach_m),
            heard_error=round(float(brier[number]), 5),
        )
        records.append(record)
        progress(record.bssid, len(order))
    known = (len(readings.scan_fold), tuple(records), kernel, width_m, dict(readings.offsets_db))
    return FloorMaps(readings.place, grid, *known, *layers.reshape(4, len(order), *grid.shape))


def _heard(
    here: map_process.MapReadings, order: IntArray, sample: IntArray, centres: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """Width of the kernel, its error for each access point (a,), and the share (a, n) at centres (n, 2)."""
    matrix = heard_matrix(here.scan, here.access_point, len(here.scan_fold), len(here.bssids))
    width_m = best_width(here.scan_position, here.scan_fold, matrix[:, sample])
    matrix = matrix[:, order]
    error = heard_error(here.scan_position, here.scan_fold, matrix, width_m)
    share = heard_share(centres, here.scan_position, matrix, np.asarray(matrix.mean(axis=0)), width_m)
    return width_m, error, share.T


def grid_of(points: FloatArray, settings: RadioMapSettings) -> CellGrid:
    """Make the grid of all cells near points (n, 2); its edges are multiples of the cell, so that grids agree.

    Raises DatasetError for more cells than a floor can have.
    """
    low = np.floor((points.min(axis=0) - settings.reach_m) / settings.cell_m)
    high = np.ceil((points.max(axis=0) + settings.reach_m) / settings.cell_m)
    columns, rows = (int(size) for size in high - low)
    if rows * columns > _MOST_CELLS:
        raise DatasetError(
            f"the labelled fingerprints of one floor span {(high - low)[0] * settings.cell_m:.0f} x "
            f"{(high - low)[1] * settings.cell_m:.0f} m, which is too many cells ({rows * columns}); correct the "
            "labels "
            "or choose a larger --cell"
        )
    left, bottom = (low * settings.cell_m).tolist()
    return CellGrid((left, bottom), settings.cell_m, rows, columns)


def _near(centres: FloatArray, points: FloatArray, reach_m: float) -> BoolArray:
    """Mask (n,) of centres (n, 2) that are within reach of one of the points (k, 2)."""
    distance, _ = cKDTree(points).query(centres, distance_upper_bound=reach_m)
    return np.isfinite(distance)
