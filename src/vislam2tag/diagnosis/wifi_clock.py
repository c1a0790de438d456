"""By how much the clock of a walk's Wi-Fi scans is off that of its poses: where other walks heard the same levels.

The levels of each access point that the floor's other walks heard are spread over cells; a walk whose scans are late
heard everywhere what they heard a few metres back.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.diagnosis.evidence import Evidence
from vislam2tag.survey.model import SessionKey

CELL_M, SPREAD_M = 1.0, 1.2
"""Side of a cell, and how far a reading speaks for the cells about it (a Gaussian's sigma)."""
LEAST_WEIGHT = 0.02
"""A cell of which other walks say less than this (a reading has 0.11 in its own) says nothing."""
STEP_S, REACH_S = 0.5, 60.0
FEWEST_SCANS, FEWEST_WALKS = 15, 3
LEAST_INSIDE = 0.6
"""Share of a walk's readings that must lie on its way, and where others heard, at an offset that is tried."""
GREATEST_DB = 12.0
LEAST_SIGMAS = 4.0
"""An offset is believed where the scans fit better by it, on average, by so many of its standard errors ..."""
LEAST_BETTER = 0.1
"""... and the squared differences are less by this share at least."""


@dataclass(frozen=True)
class HeardOnWalk:
    """``k`` readings of one walk and its way of ``n`` frames on the floor.

    ``time_s`` (k,), ``scan`` (k,), ``bssid`` (k,), ``dbm`` (k,); ``way_s`` (n,) increasing, ``way`` (n,) complex,
    metres. Both times are of the phone's boot clock.
    """

    time_s: FloatArray
    scan: IntArray
    bssid: npt.NDArray[np.str_]
    dbm: FloatArray
    way_s: FloatArray
    way: ComplexArray

    def places(self, offset_s: float) -> ComplexArray:
        """(k,) where the readings were taken if this is added to their times; NaN off the way."""
        return np.asarray(np.interp(self.time_s + offset_s, self.way_s, self.way, left=np.nan, right=np.nan))


def wifi_clock_offsets_s(evidence: Evidence, heard: Mapping[SessionKey, HeardOnWalk]) -> dict[SessionKey, float]:
    """What to add to the times of each walk's scans, seconds; walks of which nobody can tell are left out.

    ``heard`` have their ways in the frames of the passes; ``evidence`` lays them onto the plan.
    """
    floors: dict[int, dict[SessionKey, HeardOnWalk]] = defaultdict(dict)
    for walk in evidence.walks:
        key = walk.passes.key
        if key in heard and (way := walk.on_plan(heard[key].way)) is not None and len(way) > 1:
            floors[key.floor][key] = replace(heard[key], way=way)
    found: dict[SessionKey, float] = {}
    for walks in floors.values():
        telling = {key: walk for key, walk in walks.items() if len(np.unique(walk.scan)) >= FEWEST_SCANS}
        if len(telling) >= FEWEST_WALKS:
            offsets = offsets_on_floor_s(list(telling.values()))
            found |= {key: at for key, at in zip(telling, offsets, strict=True) if at is not None}
    return found


def offsets_on_floor_s(telling: Sequence[HeardOnWalk]) -> list[float | None]:
    """The same for walks of one floor whose ways are on its plan."""
    names = np.unique(np.concatenate([walk.bssid for walk in telling]))
    ways = np.concatenate([walk.way for walk in telling])
    corner = complex(ways.real.min(), ways.imag.min()) - complex(CELL_M, CELL_M)
    far = complex(ways.real.max(), ways.imag.max()) - corner
    shape = (len(names), int(far.imag / CELL_M) + 2, int(far.real / CELL_M) + 2)
    cells = _Cells(names, corner, shape)
    offsets_db = np.zeros(len(telling))
    for _ in range(2):  # levels of devices differ by constants, which the first maps tell
        maps = [cells.spread(walk, walk.dbm - db) for walk, db in zip(telling, offsets_db, strict=True)]
        total = [sum(one[i] for one in maps) for i in range(2)]
        references = [(total[0] - own[0], total[1] - own[1]) for own in maps]
        pairs = list(zip(telling, references, strict=True))
        offsets_db = np.array([float(np.nanmedian(cells.differences(walk, 0.0, of))) for walk, of in pairs])
    return [_offset_s(cells, walk, of) for walk, of in pairs]


@dataclass(frozen=True)
class _Cells:
    """Levels of access points over cells of a floor (access points, rows, columns)."""

    names: npt.NDArray[np.str_]
    corner: complex
    shape: tuple[int, int, int]

    def _index(self, walk: HeardOnWalk, offset_s: float) -> tuple[tuple[IntArray, ...], FloatArray]:
        """Cells of readings that lie on the way, and which of all readings do."""
        place = (walk.places(offset_s) - self.corner) / CELL_M
        on = np.isfinite(place)
        point = np.searchsorted(self.names, walk.bssid[on])
        return (point, place.imag[on].astype(np.int64), place.real[on].astype(np.int64)), on

    def spread(self, walk: HeardOnWalk, dbm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Sums of levels and weights of a walk's readings, spread over the cells about each."""
        index, on = self._index(walk, 0.0)
        sums, weights = np.zeros(self.shape), np.zeros(self.shape)
        np.add.at(sums, index, dbm[on])
        np.add.at(weights, index, 1.0)
        sigma = (0.0, SPREAD_M / CELL_M, SPREAD_M / CELL_M)
        return gaussian_filter(sums, sigma, truncate=2.5), gaussian_filter(weights, sigma, truncate=2.5)

    def differences(self, walk: HeardOnWalk, offset_s: float, reference: tuple[FloatArray, FloatArray]) -> FloatArray:
        """(k,) levels less those of the reference, dB; NaN where that says nothing."""
        index, on = self._index(walk, offset_s)
        weight = reference[1][index]
        found = np.full(len(walk.dbm), np.nan)
        found[on] = np.where(
            weight >= LEAST_WEIGHT, walk.dbm[on] - reference[0][index] / np.maximum(weight, LEAST_WEIGHT), np.nan
        )
        return found


def _offset_s(cells: _Cells, walk: HeardOnWalk, reference: tuple[FloatArray, FloatArray]) -> float | None:
    tried = np.arange(-REACH_S, REACH_S + STEP_S / 2, STEP_S)
    scans, scan = np.unique(walk.scan, return_inverse=True)
    by_scan = np.full((len(tried), len(scans)), np.nan)
    for row, offset_s in enumerate(tried.tolist()):
        difference = cells.differences(walk, offset_s, reference)
        known = np.isfinite(difference)
        if known.mean() >= LEAST_INSIDE:
            squares = np.minimum(np.abs(difference[known] - np.median(difference[known])), GREATEST_DB) ** 2
            count = np.bincount(scan[known], minlength=len(scans))
            by_scan[row] = np.where(count, np.bincount(scan[known], squares, len(scans)) / np.maximum(count, 1), np.nan)
    own = by_scan[len(tried) // 2]
    possible = np.isfinite(by_scan).sum(axis=1) >= FEWEST_SCANS
    if not possible.any():
        return None
    mean = np.full(len(tried), np.inf)
    mean[possible] = np.nanmean(by_scan[possible], axis=1)
    best = int(np.argmin(mean))
    both = np.isfinite(own) & np.isfinite(by_scan[best])
    if both.sum() < FEWEST_SCANS:
        return None
    better = own[both] - by_scan[best][both]
    error = float(better.std(ddof=1)) / np.sqrt(both.sum())
    sure = better.mean() >= max(LEAST_SIGMAS * error, LEAST_BETTER * own[both].mean())
    return float(tried[best]) if sure else 0.0
