"""The nearest learned scans in signal space, and places from their votes.

An index by access point finds them exactly. A scan hears few of all access points. The common part of two scans is
therefore summed over the access points that one of them hears (an inverted index, as in text search). A matrix of all
levels is not made.

If this would need too many readings, scans are dealt to cells, and only those of the nearest cells are compared (an
inverted file; Sivic and Zisserman 2003; Jegou et al. 2011). The cells belong to randomly drawn scans. Each scan is in
the cell with the direction most like its own, and a query searches the cells most like it. Distances there are exact;
neighbours in other cells are missed.

Votes are common to all models that weight examples: places of training scans vote for those of others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt
from scipy.spatial.distance import cdist

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.positioning.places import MEDIAN_STEPS, SMOOTH_M, Positions, ScanPlaces
from vislam2tag.positioning.radio_scans import RadioScans

PROBED = 10
"""Number of cells that a query searches."""
_SEED = 0
_SORTED_AT_ONCE = 4096
_LEAST_LENGTH = 1e-9
Directions = npt.NDArray[np.float32]


class ScanCell(NamedTuple):
    """The learned scans of a cell."""

    members: IntArray
    """(c,) indices of the scans, in order."""
    columns: IntArray
    """(u,) access points heard by any of them."""
    level: FloatArray
    """(c, u) from 0 (not heard) to 1."""


@dataclass(frozen=True)
class ScanCells:
    """``c`` cells, about as many as the root of the number of scans."""

    centre: Directions
    """(c, a) directions of the drawn scans, length 1."""
    cells: tuple[ScanCell, ...]

    @classmethod
    def of(cls, scans: RadioScans, level: FloatArray) -> Self:
        """Deal scans (n) with these levels of readings (m,) to cells."""
        count = max(1, round(len(scans) ** 0.5))
        drawn = np.sort(np.random.default_rng(_SEED).permutation(len(scans))[:count])
        centre = _directions(dense_levels(scans, level, drawn))
        blocks = (
            np.arange(start, min(start + _SORTED_AT_ONCE, len(scans)))
            for start in range(0, len(scans), _SORTED_AT_ONCE)
        )
        near = [(_directions(dense_levels(scans, level, rows)) @ centre.T).argmax(axis=1) for rows in blocks]
        cell = np.concatenate(near)
        order = np.argsort(cell, kind="stable")
        bounds = np.searchsorted(cell[order], np.arange(count + 1))
        dealt = (order[start:end] for start, end in pairwise(bounds))
        return cls(centre, tuple(_cell(scans, level, members) for members in dealt))

    def nearest(self, level: FloatArray) -> IntArray:
        """Return the cells to search for scans of levels (q, a): (q, p)."""
        like = _directions(level) @ self.centre.T
        probed = min(PROBED, len(self.cells))
        return np.asarray(np.argpartition(-like, probed - 1, axis=1)[:, :probed])


def dense_levels(scans: RadioScans, level: FloatArray, rows: IntArray) -> FloatArray:
    """Make the (r, a) levels of some scans from the levels (m,) of all readings; 0 if not heard."""
    return replace(scans, rssi_dbm=level)[rows].dense(not_heard=0.0)


def _cell(scans: RadioScans, level: FloatArray, members: IntArray) -> ScanCell:
    own = dense_levels(scans, level, members)
    columns = np.flatnonzero(own.any(axis=0))
    return ScanCell(members, columns, own[:, columns])


def _directions(level: FloatArray) -> Directions:
    length = np.maximum(np.linalg.norm(level, axis=1, keepdims=True), _LEAST_LENGTH)
    return np.asarray(level / length, dtype=np.float32)


MOST_READINGS = 100_000
"""If a scan would be compared with more readings than this, on average, cells are searched instead."""
_AT_ONCE = 1024


class SignalDistance(StrEnum):
    """Measure of the distance between two scans."""

    EUCLIDEAN = "euclidean"
    SORENSEN = "sorensen"
    COSINE = "cosine"


class Apart(NamedTuple):
    """Groups of one or several kinds, such as walks and places, whose scans are not compared among each other."""

    asked: IntArray
    """(q, g) groups of the queries."""
    learned: IntArray
    """(n, g) groups of the learned scans."""

    @classmethod
    def among(cls, rows: IntArray, *groups: IntArray) -> Self:
        """Keep learned scans ``rows`` (q,) apart from scans with the same group of any kind; each kind (n,)."""
        learned = np.column_stack(groups)
        return cls(learned[rows], learned)

    def same(self, rows: IntArray, members: IntArray | slice = slice(None)) -> BoolArray:
        """Return which of the learned scans (m,) share a group with queries (r,): (r, m)."""
        kinds = zip(self.asked[rows].T, self.learned[members].T, strict=True)
        return np.asarray(np.logical_or.reduce([asked[:, None] == learned for asked, learned in kinds]))


class NearestScans(NamedTuple):
    """The k nearest of each of ``q`` scans."""

    which: IntArray
    """(q, k) indices in order of distance."""
    away: FloatArray
    """(q, k) distances; infinite for scans of the same group."""


@dataclass(frozen=True)
class ScanIndex:
    """``n`` scans as readings, sorted by access point, then scan."""

    distance: SignalDistance
    start: IntArray
    """(a + 1,) readings ``start[j]`` to ``start[j + 1]`` are those of access point j."""
    scan: IntArray
    """(m,) scan of each reading."""
    level: FloatArray
    """(m,) from 0 (not heard) to 1."""
    size: FloatArray
    """(n,) sum of a scan's levels (``sorensen``), or of their squares."""
    cells: ScanCells | None = None
    """None: all scans are compared."""

    @classmethod
    def of(cls, scans: RadioScans, level: FloatArray, distance: SignalDistance) -> Self:
        """Index scans (n) with these levels of readings (m,)."""
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
        """Find the k nearest (all, if fewer) of each of ``q`` scans with these levels of readings (m,).

        In a tie the first learned scans come first. Scans of the same group as the query have infinite distance.
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
        """(r, c) common part of scans of levels (n, a), by index (r,), with the scans of a cell."""
        own = level[asking][:, cell.columns]
        if self.distance is not SignalDistance.SORENSEN:
            return np.asarray(own @ cell.level.T)
        both = own.sum(axis=1)[:, None] + cell.level.sum(axis=1)
        return np.asarray((both - cdist(own, cell.level, "cityblock")) / 2)

    def away(self, column: IntArray, level: FloatArray) -> FloatArray:
        """Return the distances (n,) from one scan: its access points (k,) and their levels (k,).

        If neither contains a strong enough level, the distance is the greatest one.
        """
        parts = [slice(self.start[one], self.start[one + 1]) for one in column]
        scan = np.concatenate([self.scan[:0], *(self.scan[part] for part in parts)])
        theirs = np.concatenate([self.level[:0], *(self.level[part] for part in parts)])
        own = np.repeat(level, [part.stop - part.start for part in parts])
        shared = np.minimum(own, theirs) if self.distance is SignalDistance.SORENSEN else own * theirs
        common = np.asarray(np.bincount(scan, shared, minlength=len(self)), np.float64)
        return self._apart(_sizes(level, self.distance).sum(), self.size, common)

    def _apart(self, size: FloatArray, theirs: FloatArray, common: FloatArray) -> FloatArray:
        """Distances from the sizes of scans and their common part; arrays of compatible shapes."""
        if self.distance is SignalDistance.EUCLIDEAN:
            return np.asarray(np.sqrt(np.maximum(size + theirs - 2 * common, 0.0)))
        whole = (size + theirs) / 2 if self.distance is SignalDistance.SORENSEN else np.sqrt(size * theirs)
        return np.asarray(1.0 - np.divide(common, whole, out=np.zeros_like(whole), where=whole > 0))


def _smallest(away: FloatArray, k: int, which: IntArray | None = None) -> IntArray:
    """(k,) indices of the smallest distances (n,), in order; ties by ``which`` (n,), or by index."""
    near = np.flatnonzero(away <= np.partition(away, k - 1)[k - 1])
    return near[np.lexsort((near if which is None else which[near], away[near]))][:k]


def _sizes(level: FloatArray, distance: SignalDistance) -> FloatArray:
    return level if distance is SignalDistance.SORENSEN else level**2


Middle = Callable[[FloatArray, FloatArray], FloatArray]
"""From weights (n, m) of places (n, m, 2) to one place (n, 2) each."""


@dataclass(frozen=True)
class Votes:
    """For each of ``n`` scans, ``m`` of the learned places with weights."""

    index: IntArray
    """(n, m) indices of places."""
    weight: FloatArray
    """(n, m) weights, 0 or more; at least one is positive."""

    @property
    def share(self) -> FloatArray:
        """(n, m) share of the total weight."""
        return np.asarray(self.weight / self.weight.sum(axis=1, keepdims=True))

    def storey_shares(self, places: ScanPlaces) -> FloatArray:
        """(n, s) share of the votes for each storey."""
        n, s = len(self.index), len(places.storeys)
        cell = np.arange(n)[:, None] * s + places.storey[self.index]
        return np.asarray(np.bincount(cell.reshape(-1), self.share.reshape(-1), n * s).reshape(n, s), np.float64)


@dataclass(frozen=True)
class VotedPositions:
    """Places of ``n`` scans by their votes."""

    storey_probability: FloatArray
    """(n, s) share of the votes for each storey."""
    storey: IntArray
    """(n,) the storey with the most votes."""
    xy: FloatArray
    """(n, 2) mean of the places on that storey, metres."""
    z: FloatArray
    """(n,) mean of their heights, metres; NaN if none is known."""
    spread_m: FloatArray
    """(n,) root mean square distance in the plane of all places, on any storey, from the answer."""
    torn: FloatArray
    """(n,) share of the votes for storeys other than the one with the most."""

    def positions(
        self, places: ScanPlaces, radii_m: tuple[FloatArray, FloatArray], unlike: BoolArray | None = None
    ) -> Positions:
        """Convert to a model's answer, with radii (n,) of 68 % and 95 %, metres, and novelty flags (n,)."""
        return Positions(places.storeys, self.storey, self.xy, self.z, self.storey_probability, *radii_m, unlike)


def counted_votes(votes: Votes, places: ScanPlaces) -> VotedPositions:
    """Count votes for places: first the storey, then the mean of those on it."""
    return _counted(votes, places, _mean)


def median_votes(votes: Votes, places: ScanPlaces, further: FloatArray | None = None) -> VotedPositions:
    """Count votes for places: first the storey, then the geometric median of those on it (all, if there are none).

    ``further`` (n, s) are additional votes for storeys; the votes' sum is 1.
    """
    return _counted(votes, places, _median, further)


def _counted(votes: Votes, places: ScanPlaces, middle: Middle, further: FloatArray | None = None) -> VotedPositions:
    share, by_votes = votes.share, votes.storey_shares(places)
    probability = by_votes if further is None else by_votes + further
    probability = probability / probability.sum(axis=1, keepdims=True)
    storey = probability.argmax(axis=1)
    here = share * (places.storey[votes.index] == storey[:, None])
    here = np.where(here.sum(axis=1, keepdims=True) > 0, here, share)
    xy_of, z_of = places.xy[votes.index], places.z[votes.index]
    xy = middle(here, xy_of)
    away_m2 = ((xy_of - xy[:, None]) ** 2).sum(axis=2)
    return VotedPositions(
        storey_probability=probability,
        storey=storey,
        xy=xy,
        z=_mean(here * np.isfinite(z_of), np.nan_to_num(z_of)[..., None])[:, 0],
        spread_m=np.sqrt((share * away_m2).sum(axis=1)),
        torn=1.0 - by_votes.max(axis=1),
    )


def _mean(weight: FloatArray, values: FloatArray) -> FloatArray:
    """(n, d) weighted mean of values (n, m, d); NaN if all weights (n, m) are 0."""
    total = weight.sum(axis=1)[:, None]
    weighted = (weight[..., None] * values).sum(axis=1)
    return np.asarray(np.divide(weighted, total, out=np.full_like(weighted, np.nan), where=total > 0))


def _median(weight: FloatArray, xy: FloatArray) -> FloatArray:
    """(n, 2) geometric medians of places (n, m, 2), metres, by Weiszfeld's steps from the mean."""
    pull = weight
    for _ in range(MEDIAN_STEPS):
        away_m2 = ((xy - _mean(pull, xy)[:, None]) ** 2).sum(axis=2)
        pull = weight / np.sqrt(away_m2 + SMOOTH_M**2)
    return _mean(pull, xy)
