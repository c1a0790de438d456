"""By how much the clock of a walk's Wi-Fi scans is off that of its poses: where other walks heard the same levels.

The levels of each access point that the floor's other walks heard are spread over cells; a walk whose scans are late
heard everywhere what they heard a few metres back.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray, runs_of
from vislam2tag.core.limits import MAX_LEVEL_CELLS
from vislam2tag.quality.diagnosis.evidence import Evidence, Way
from vislam2tag.site.model import SessionKey

CELL_M = 1.0
"""Side of a cell, metres; larger where there would be more than :data:`MAX_LEVEL_CELLS`."""
SPREADS_M = (1.2, 3.6)
"""How far readings speak for the cells about them (Gaussians' sigmas): nearby ones, and where none is near, further."""
FAR_WEIGHT = 0.03
"""What further readings say counts as this much near ones (of which one has 0.11 in its own cell)."""
LEAST_WEIGHT = 0.002
"""A cell of which other walks say less than this, even from afar, says nothing."""
STEP_S, REACH_S = 0.5, 60.0
FEWEST_SCANS, FEWEST_WALKS = 15, 3
LEAST_INSIDE = 0.6
"""Share of a walk's readings that must lie on its way, and where others heard, at an offset that is tried."""
GREATEST_DB = 12.0
BLOCKS, DRAWS = 12, 200
"""The error of an offset is that of offsets by scans drawn again (Efron's bootstrap, in blocks of successive scans)."""
SURE_SIGMAS = 4.0
"""An offset is believed from so many of its standard errors on."""


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

    @property
    def as_way(self) -> Way:
        """The way from its first frame on."""
        return Way(self.way_s - self.way_s[0], self.way)

    def places(self, offset_s: float) -> ComplexArray:
        """(k,) where the readings were taken if this is added to their times; NaN off the way."""
        return np.asarray(np.interp(self.time_s + offset_s, self.way_s, self.way, left=np.nan, right=np.nan))


class ClockOffset(NamedTuple):
    """What to add to the times of a walk's scans, and the standard error of that, seconds."""

    offset_s: float
    sigma_s: float

    @property
    def sure(self) -> bool:
        """Whether it is believed that the clock is off."""
        return abs(self.offset_s) > SURE_SIGMAS * self.sigma_s


def wifi_clock_offsets(floors: Mapping[int, Mapping[SessionKey, HeardOnWalk]]) -> dict[SessionKey, ClockOffset]:
    """By how much the scans of each walk are off, by floor the walks on its plan (:func:`heard_on_floors`); walks
    without a result are left out.
    """
    found: dict[SessionKey, ClockOffset] = {}
    for walks in floors.values():
        telling = {key: walk for key, walk in walks.items() if len(np.unique(walk.scan)) >= FEWEST_SCANS}
        if len(telling) >= FEWEST_WALKS:
            offsets = offsets_on_floor(list(telling.values()))
            found |= {key: at for key, at in zip(telling, offsets, strict=True) if at is not None}
    return found


def heard_on_floors(
    evidence: Evidence, heard: Mapping[SessionKey, HeardOnWalk]
) -> dict[int, dict[SessionKey, HeardOnWalk]]:
    """By floor the walks that could be laid onto its plan, their ways there.

    ``heard`` have their ways in the frames of the passes; ``evidence`` lays them onto the plan.
    """
    floors: dict[int, dict[SessionKey, HeardOnWalk]] = defaultdict(dict)
    for walk in evidence.walks:
        key = walk.passes.key
        if key in heard and len(heard[key].way) > 1 and (way := walk.on_plan(heard[key].as_way)) is not None:
            floors[key.floor][key] = replace(heard[key], way=way)
    return floors


def offsets_on_floor(telling: Sequence[HeardOnWalk]) -> list[ClockOffset | None]:
    """The same for walks of one floor whose ways are on its plan.

    What is surely off is corrected, the surest first, before the others are compared with it.
    """
    cells = _Cells.of(telling)
    walks = list(telling)
    shift_s = np.zeros(len(walks))
    while True:
        offsets = [_offset(cells, walk, of) for walk, of in zip(walks, cells.references(walks), strict=True)]
        off = {i: at for i, at in enumerate(offsets) if at is not None and at.sure and not shift_s[i]}
        if not off:
            return [
                None if at is None else at._replace(offset_s=at.offset_s + by)
                for at, by in zip(offsets, shift_s.tolist(), strict=True)
            ]
        surest = max(off, key=lambda i: abs(off[i].offset_s) / off[i].sigma_s)
        shift_s[surest] = off[surest].offset_s
        walks[surest] = replace(walks[surest], time_s=walks[surest].time_s + shift_s[surest])


_Levels: TypeAlias = FloatArray
"""(2, access points, rows, columns): sums of levels, and of their weights."""


@dataclass(frozen=True)
class _Cells:
    """Levels of access points over cells of a floor (access points, rows, columns)."""

    names: npt.NDArray[np.str_]
    corner: complex
    cell_m: float
    shape: tuple[int, int, int]

    @classmethod
    def of(cls, walks: Sequence[HeardOnWalk]) -> _Cells:
        """Cells about the ways of some walks."""
        names = np.unique(np.concatenate([walk.bssid for walk in walks]))
        ways = np.concatenate([walk.way[np.isfinite(walk.way)] for walk in walks])
        wide, high = np.ptp(ways.real), np.ptp(ways.imag)
        cell_m = max(CELL_M, float(np.sqrt(wide * high * len(names) / MAX_LEVEL_CELLS)))
        cell_m = max(cell_m, float(max(wide, high)) * len(names) / MAX_LEVEL_CELLS)
        corner = complex(ways.real.min(), ways.imag.min()) - complex(cell_m, cell_m)
        far = complex(ways.real.max(), ways.imag.max()) - corner
        return cls(names, corner, cell_m, (len(names), int(far.imag / cell_m) + 2, int(far.real / cell_m) + 2))

    def references(self, walks: Sequence[HeardOnWalk]) -> Iterator[_Levels]:
        """For each walk, one after the other, what the others heard; levels of devices differ by constants, which the
        first maps show.
        """
        nothing = np.zeros(len(walks))
        pairs = zip(walks, self._references(walks, nothing), strict=True)
        return self._references(walks, np.array([_middle_db(self.differences(walk, 0.0, of)) for walk, of in pairs]))

    def _references(self, walks: Sequence[HeardOnWalk], offsets_db: FloatArray) -> Iterator[_Levels]:
        """For each walk what the others heard, less the offsets (w,) of their devices; one map at a time is kept."""
        total = np.zeros((2, *self.shape))
        for walk, db in zip(walks, offsets_db, strict=True):
            total += self._levels(walk, walk.dbm - db)
        for walk, db in zip(walks, offsets_db, strict=True):
            yield self._spread(total - self._levels(walk, walk.dbm - db))

    def _index(self, walk: HeardOnWalk, offset_s: float) -> tuple[tuple[IntArray, ...], FloatArray]:
        """Cells of readings that lie on the way, and which of all readings do."""
        place = (walk.places(offset_s) - self.corner) / self.cell_m
        on = np.isfinite(place)
        point = np.searchsorted(self.names, walk.bssid[on])
        return (point, place.imag[on].astype(np.int64), place.real[on].astype(np.int64)), on

    def _levels(self, walk: HeardOnWalk, dbm: FloatArray) -> _Levels:
        """Sums of levels and numbers of a walk's readings."""
        index, on = self._index(walk, 0.0)
        levels = np.zeros((2, *self.shape))
        np.add.at(levels[0], index, dbm[on])
        np.add.at(levels[1], index, 1.0)
        return levels

    def _spread(self, levels: _Levels) -> _Levels:
        """Levels spread over the cells about each: from near, and for a small part from afar."""
        cells = (at_m / self.cell_m for at_m in SPREADS_M)
        near, far = (gaussian_filter(levels, (0.0, 0.0, sigma, sigma), truncate=2.5) for sigma in cells)
        known = far[1] >= LEAST_WEIGHT
        mean = np.divide(far[0], far[1], out=np.zeros(self.shape), where=known)
        return np.asarray(near + FAR_WEIGHT * np.stack((mean, known)))

    def differences(self, walk: HeardOnWalk, offset_s: float, reference: _Levels) -> FloatArray:
        """(k,) levels less those of the reference, dB; NaN where that says nothing."""
        index, on = self._index(walk, offset_s)
        weight = reference[1][index]
        level = np.divide(reference[0][index], weight, out=np.full(len(weight), np.nan), where=weight >= FAR_WEIGHT)
        found = np.full(len(walk.dbm), np.nan)
        found[on] = walk.dbm[on] - level
        return found


def _middle_db(difference_db: FloatArray) -> float:
    known = difference_db[np.isfinite(difference_db)]
    return float(np.median(known)) if len(known) else 0.0


def _offset(cells: _Cells, walk: HeardOnWalk, reference: _Levels) -> ClockOffset | None:
    """The offset at which a walk heard what others did; None where too few of its readings lie where these heard, as it
    is or from some offset on that fits better and better.
    """
    tried = np.arange(-REACH_S, REACH_S + STEP_S / 2, STEP_S)
    squares, count = _squares(cells, walk, reference, tried)
    possible = runs_of((count > 0).sum(axis=1) >= FEWEST_SCANS)
    about_none = [slice(*run) for run in possible if run[0] <= len(tried) // 2 < run[1]]
    if not about_none:
        return None
    squares, count, tried = (part[about_none[0]] for part in (squares, count, tried))
    block = np.arange(squares.shape[1]) * BLOCKS // squares.shape[1]
    drawn = np.random.default_rng(0).multinomial(BLOCKS, np.full(BLOCKS, 1 / BLOCKS), DRAWS)[:, block]
    each = np.where(count > 0, squares / np.maximum(count, 1), 0.0)
    mean = (drawn @ each.T) / np.maximum(drawn @ (count > 0).T, 1e-9)
    best = np.argmin(mean, axis=1)
    if not 0 < np.median(best) < len(tried) - 1:
        return None
    best_s = tried[best]
    return ClockOffset(float(best_s.mean()), float(np.hypot(best_s.std(), STEP_S / np.sqrt(12))))


def _squares(cells: _Cells, walk: HeardOnWalk, reference: _Levels, tried: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sums of squared differences, dB^2, of each scan at each offset (offsets, scans), and of how many readings; none
    at offsets at which too few readings lie where others heard.
    """
    scans, scan = np.unique(walk.scan, return_inverse=True)
    squares, count = np.zeros((2, len(tried), len(scans)))
    for row, offset_s in enumerate(tried.tolist()):
        difference = cells.differences(walk, offset_s, reference)
        known = np.isfinite(difference)
        if known.mean() >= LEAST_INSIDE:
            off = np.minimum(np.abs(difference[known] - np.median(difference[known])), GREATEST_DB)
            squares[row] = np.bincount(scan[known], off**2, len(scans))
            count[row] = np.bincount(scan[known], minlength=len(scans))
    return squares, count
