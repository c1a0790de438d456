"""The learned scans nearest to another in signal space, found exactly through an index by access point.

A scan hears few of all access points, and so do those that it shares any with: what two scans have in common is summed
over the readings of the access points that the one hears (an inverted index, as text search has). No matrix of all
levels is made. Where that would look at too many readings, the scans of the nearest cells alone are compared
(:mod:`.scan_cells`).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple, Self

import numpy as np
from scipy.spatial.distance import cdist

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.positioning.baselines.scan_cells import ScanCell, ScanCells, dense_levels
from vislam2tag.positioning.scans.radio_scans import RadioScans

MOST_READINGS = 100_000
"""Where a scan would be compared with more readings than this, on average, cells are looked into instead."""
_AT_ONCE = 1024


class SignalDistance(StrEnum):
    """How far two scans are apart."""

    EUCLIDEAN = "euclidean"
    SORENSEN = "sorensen"
    COSINE = "cosine"


class Apart(NamedTuple):
    """Groups of one kind or several, such as walks and places, whose scans are not compared among each other."""

    asked: IntArray
    """(q, g) of the scans that neighbours are looked for."""
    learned: IntArray
    """(n, g) of the learned ones."""

    @classmethod
    def among(cls, rows: IntArray, *groups: IntArray) -> Self:
        """Keep learned scans ``rows`` (q,) apart from those of the same group of any kind; each kind (n,)."""
        learned = np.column_stack(groups)
        return cls(learned[rows], learned)

    def same(self, rows: IntArray, members: IntArray | slice = slice(None)) -> BoolArray:
        """Which of the learned scans (m,) share a group with scans that ask (r,): (r, m)."""
        kinds = zip(self.asked[rows].T, self.learned[members].T, strict=True)
        return np.asarray(np.logical_or.reduce([asked[:, None] == learned for asked, learned in kinds]))


class NearestScans(NamedTuple):
    """The k nearest of each of ``q`` scans."""

    which: IntArray
    """(q, k) indices in order of distance."""
    away: FloatArray
    """(q, k); infinite for those of the same group."""


@dataclass(frozen=True)
class ScanIndex:
    """``n`` scans, reading by reading in order of access point, then scan."""

    distance: SignalDistance
    start: IntArray
    """(a + 1,) readings ``start[j]`` to ``start[j + 1]`` are those of access point j."""
    scan: IntArray
    """(m,) whose reading it is."""
    level: FloatArray
    """(m,) from 0 (not heard) to 1."""
    size: FloatArray
    """(n,) sum of a scan's levels (``sorensen``), or of their squares."""
    cells: ScanCells | None = None
    """None: all scans are compared."""

    @classmethod
    def of(cls, scans: RadioScans, level: FloatArray, distance: SignalDistance) -> Self:
        """Index scans (n) whose readings (m,) have these levels."""
        order = np.argsort(scans.column, kind="stable")
        count = np.bincount(scans.column, minlength=len(scans.access_points))
        size = np.bincount(scans.row, _sizes(level, distance), minlength=len(scans)).astype(np.float64)
        start = np.concatenate([[0], np.cumsum(count)])
        many = float((count.astype(np.float64) ** 2).sum()) > MOST_READINGS * max(len(scans), 1)
        cells = ScanCells.of(scans, level) if many else None
        return cls(distance, start, scans.row[order].astype(np.int32), level[order], size, cells)

    def __len__(self) -> int:
        return len(self.size)

    def nearest(self, scans: RadioScans, level: FloatArray, k: int, apart: Apart | None = None) -> NearestScans:
        """Find the k nearest (all, if fewer) of each of ``q`` scans whose readings (m,) have these levels.

        Of scans equally far the first learned come first. Those of the same group as the scan are infinitely far.
        """
        index = np.zeros((len(scans), min(k, len(self))), dtype=np.int64)
        away = np.full(index.shape, np.inf)
        if self.cells is not None:
            for start in range(0, len(scans), _AT_ONCE):
                rows = np.arange(start, min(start + _AT_ONCE, len(scans)))
                self._among_cells(self.cells, rows, dense_levels(scans, level, rows), NearestScans(index, away), apart)
            return NearestScans(index, away)
        for row in range(len(scans)):
            own = slice(scans.start[row], scans.start[row + 1])
            distance = self.away(scans.column[own], level[own])
            if apart is not None:
                distance[apart.same(np.array([row]))[0]] = np.inf
            index[row] = _smallest(distance, index.shape[1])
            away[row] = distance[index[row]]
        return NearestScans(index, away)

    def _among_cells(
        self, cells: ScanCells, rows: IntArray, level: FloatArray, found: NearestScans, apart: Apart | None
    ) -> None:
        """Write the nearest in the cells most like the scans ``rows`` (r,), of levels (r, a), into ``found``."""
        size = _sizes(level, self.distance).sum(axis=1)
        probed = cells.nearest(level)
        members: list[list[IntArray]] = [[] for _ in rows]
        distances: list[list[FloatArray]] = [[] for _ in rows]
        asking, cell = np.divmod(np.argsort(probed, axis=None, kind="stable"), probed.shape[1])
        cell = probed[asking, cell]
        for part in np.split(np.arange(len(cell)), np.flatnonzero(np.diff(cell)) + 1):
            own = cells.cells[cell[part[0]]]
            away = self._apart(size[asking[part], None], self.size[own.members], self._common(level, asking[part], own))
            if apart is not None:
                away[apart.same(rows[asking[part]], own.members)] = np.inf
            for one, distance in zip(asking[part].tolist(), away, strict=True):
                members[one].append(own.members)
                distances[one].append(distance)
        for one, row in enumerate(rows.tolist()):
            which, distance = np.concatenate(members[one]), np.concatenate(distances[one])
            nearest = _smallest(distance, min(found.which.shape[1], len(which)), which)
            found.which[row, : len(nearest)] = which[nearest]
            found.away[row, : len(nearest)] = distance[nearest]

    def _common(self, level: FloatArray, asking: IntArray, cell: ScanCell) -> FloatArray:
        """(r, c) what scans of levels (n, a), by index (r,), have in common with those of a cell."""
        own = level[asking][:, cell.columns]
        if self.distance is not SignalDistance.SORENSEN:
            return np.asarray(own @ cell.level.T)
        both = own.sum(axis=1)[:, None] + cell.level.sum(axis=1)
        return np.asarray((both - cdist(own, cell.level, "cityblock")) / 2)

    def away(self, column: IntArray, level: FloatArray) -> FloatArray:
        """Return the distances (n,) from one scan: its access points (k,) and their levels (k,).

        Where nothing loud enough was heard in either, the greatest.
        """
        parts = [slice(self.start[one], self.start[one + 1]) for one in column]
        scan = np.concatenate([self.scan[:0], *(self.scan[part] for part in parts)])
        theirs = np.concatenate([self.level[:0], *(self.level[part] for part in parts)])
        own = np.repeat(level, [part.stop - part.start for part in parts])
        shared = np.minimum(own, theirs) if self.distance is SignalDistance.SORENSEN else own * theirs
        common = np.asarray(np.bincount(scan, shared, minlength=len(self)), np.float64)
        return self._apart(_sizes(level, self.distance).sum(), self.size, common)

    def _apart(self, size: FloatArray, theirs: FloatArray, common: FloatArray) -> FloatArray:
        """Distances of scans of these sizes by what they have in common; arrays of shapes that fit."""
        if self.distance is SignalDistance.EUCLIDEAN:
            return np.asarray(np.sqrt(np.maximum(size + theirs - 2 * common, 0.0)))
        whole = (size + theirs) / 2 if self.distance is SignalDistance.SORENSEN else np.sqrt(size * theirs)
        return np.asarray(1.0 - np.divide(common, whole, out=np.zeros_like(whole), where=whole > 0))


def _smallest(away: FloatArray, k: int, which: IntArray | None = None) -> IntArray:
    """(k,) indices of the smallest of distances (n,), in order; equal ones by ``which`` (n,), or as they come."""
    near = np.flatnonzero(away <= np.partition(away, k - 1)[k - 1])
    return near[np.lexsort((near if which is None else which[near], away[near]))][:k]


def _sizes(level: FloatArray, distance: SignalDistance) -> FloatArray:
    return level if distance is SignalDistance.SORENSEN else level**2
