"""Learned scans dealt to cells around some of them, so that of very many only those of the nearest cells are compared.

An inverted file (Sivic and Zisserman 2003; Jegou et al. 2011): its cells are those of drawn scans, each scan is in the
cell of the one whose direction is most like its own, and a scan that asks looks into the cells most like it. What is
found there is compared exactly; a neighbour in no such cell is missed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.positioning.scans.radio_scans import RadioScans

PROBED = 10
"""Cells that a scan looks into."""
_SEED = 0
_AT_ONCE = 4096
_LEAST_LENGTH = 1e-9
Directions = npt.NDArray[np.float32]


class ScanCell(NamedTuple):
    """The learned scans of a cell."""

    members: IntArray
    """(c,) which, in order."""
    columns: IntArray
    """(u,) access points that any of them hears."""
    level: FloatArray
    """(c, u) from 0 (not heard) to 1."""


@dataclass(frozen=True)
class ScanCells:
    """``c`` cells, about as many as the root of the number of scans."""

    centre: Directions
    """(c, a) of the drawn scans, length 1."""
    cells: tuple[ScanCell, ...]

    @classmethod
    def of(cls, scans: RadioScans, level: FloatArray) -> Self:
        """Deal scans (n) whose readings (m,) have these levels."""
        count = max(1, round(len(scans) ** 0.5))
        drawn = np.sort(np.random.default_rng(_SEED).permutation(len(scans))[:count])
        centre = _directions(dense_levels(scans, level, drawn))
        blocks = (np.arange(start, min(start + _AT_ONCE, len(scans))) for start in range(0, len(scans), _AT_ONCE))
        near = [(_directions(dense_levels(scans, level, rows)) @ centre.T).argmax(axis=1) for rows in blocks]
        cell = np.concatenate(near)
        order = np.argsort(cell, kind="stable")
        bounds = np.searchsorted(cell[order], np.arange(count + 1))
        dealt = (order[start:end] for start, end in pairwise(bounds))
        return cls(centre, tuple(_cell(scans, level, members) for members in dealt))

    def nearest(self, level: FloatArray) -> IntArray:
        """Return for scans of levels (q, a) the cells to look into, (q, p)."""
        like = _directions(level) @ self.centre.T
        probed = min(PROBED, len(self.cells))
        return np.asarray(np.argpartition(-like, probed - 1, axis=1)[:, :probed])


def dense_levels(scans: RadioScans, level: FloatArray, rows: IntArray) -> FloatArray:
    """Make the (r, a) levels of some scans, of the levels (m,) of all readings; 0 where not heard."""
    return replace(scans, rssi_dbm=level)[rows].dense(not_heard=0.0)


def _cell(scans: RadioScans, level: FloatArray, members: IntArray) -> ScanCell:
    own = dense_levels(scans, level, members)
    columns = np.flatnonzero(own.any(axis=0))
    return ScanCell(members, columns, own[:, columns])


def _directions(level: FloatArray) -> Directions:
    length = np.maximum(np.linalg.norm(level, axis=1, keepdims=True), _LEAST_LENGTH)
    return np.asarray(level / length, dtype=np.float32)
