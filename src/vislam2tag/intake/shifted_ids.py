"""Ids that are all shifted by a constant: sets that overlap look nearly equal, distances between landmarks do not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray

MAX_SHIFT = 5
MIN_LANDMARKS = 3
FITS_M, FITS_SHARE = 0.6, 0.04
"""A distance fits within this, and this share of the way walked between both ends: as far as a tracker drifts."""
MAX_AS_LOGGED = 0.5
"""Ids are suspected only if at most this share of the distances fits the table as they are ..."""
MIN_SHIFTED = 0.85
"""... and believed to be shifted if at least this share fits then."""
MIN_DISTANCES, SURE_DISTANCES = 3, 6
MAX_AS_LOGGED_IF_FEW = 1 / 3
"""With fewer distances than is sure, only a shift by one is believed, if all fit then and at most this share as logged.
"""
MAX_SEEN = 60
"""The first landmarks of a walk, which suffice."""


@dataclass(frozen=True)
class IdShift:
    """What to add to logged ids to get those of the table, and how many distances between landmarks fit."""

    shift: int
    as_logged: int
    shifted: int
    known_as_logged: int
    """Distances whose two ends the table has; ``as_logged`` of them fit."""
    known_shifted: int

    @property
    def text(self) -> str:
        """By what it is known."""
        how = f"{'adding' if self.shift > 0 else 'subtracting'} {abs(self.shift)}"
        return (
            f"{self.as_logged} of {self.known_as_logged} distances between landmarks fit the table under the logged "
            f"ids, and {self.shifted} of {self.known_shifted} after {how}"
        )


def shift_by_geometry(
    ids: Sequence[str], place: ComplexArray, way_m: FloatArray, table: Mapping[str, complex]
) -> IdShift | None:
    """Find the constant by which all ids of a walk are shifted; None if they are not, or that cannot be known.

    ``ids`` (p,) of landmarks as logged; ``place`` (p,) complex, metres, where the tracker put them, in its own frame;
    ``way_m`` (p,) how far the walk had come then. ``table``: where the landmarks of the table are, complex metres.
    """
    rows = [i for i, name in enumerate(ids) if _number(name) is not None][:MAX_SEEN]
    if len({ids[i] for i in rows}) < MIN_LANDMARKS or len(rows) < MIN_SHIFTED * min(len(ids), MAX_SEEN):
        return None
    first, second = np.triu_indices(len(rows), 1)
    names, at, way = [ids[i] for i in rows], place[rows], way_m[rows]
    logged = np.abs(at[first] - at[second])
    within = FITS_M + FITS_SHARE * np.abs(way[first] - way[second])
    different = np.array([names[i] != names[j] for i, j in zip(first.tolist(), second.tolist(), strict=True)])

    def fit(shift: int) -> tuple[int, int]:
        """How many distances fit and are known with a shift."""
        wanted = np.array([table.get(_plus(name, shift), np.nan) for name in names], dtype=np.complex128)
        true = np.abs(wanted[first] - wanted[second])
        known = np.isfinite(true) & different
        return int(np.count_nonzero(known & (np.abs(true - logged) < within))), int(np.count_nonzero(known))

    as_logged, known = fit(0)
    if not known or as_logged > MAX_AS_LOGGED * known:
        return None
    found = []
    for shift in sorted(range(-MAX_SHIFT, MAX_SHIFT + 1), key=abs)[1:]:
        fits, there = fit(shift)
        if there < max(MIN_DISTANCES, known // 2):
            continue
        sure = there >= SURE_DISTANCES and fits >= MIN_SHIFTED * there
        if sure or (abs(shift) == 1 and fits == there and as_logged <= MAX_AS_LOGGED_IF_FEW * known):
            found.append(IdShift(shift, as_logged, fits, known, there))
    return max(found, key=lambda one: (one.shifted, -abs(one.shift)), default=None)


def _number(name: str) -> int | None:
    return int(name) if name.isdecimal() and len(name) < 10 else None


def _plus(name: str, shift: int) -> str:
    return str(int(name) + shift) if shift else name
