"""Where scans were taken (what a model learns), and where a model puts them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from vislam2tag.core.arrays import AnyArray, BoolArray, FloatArray, IntArray
from vislam2tag.dataset.model import Storey
from vislam2tag.positioning.checked_arrays import CheckedArrays
from vislam2tag.positioning.scans.radio_scans import RadioScans, Rows

SIXTY_EIGHT, NINETY_FIVE = 0.68, 0.95


@dataclass(frozen=True)
class ScanPlaces:
    """True (or labelled) places of ``n`` scans; behaves as scikit-learn expects of ``y``."""

    storeys: tuple[Storey, ...]
    """All floors there are, in order."""
    storey: IntArray
    """(n,) index into ``storeys``."""
    xy: FloatArray
    """(n, 2) BCS metres."""
    z: FloatArray
    """(n,) metres above the building's zero; NaN: unknown."""
    sigma_m: FloatArray
    """(n,) standard deviation of the label per axis; NaN: not stated."""

    def __len__(self) -> int:
        return len(self.storey)

    @property
    def shape(self) -> tuple[int, int]:
        """Number of places, and of coordinates in the plane."""
        return len(self), 2

    def __getitem__(self, rows: Rows) -> ScanPlaces:
        return replace(self, storey=self.storey[rows], xy=self.xy[rows], z=self.z[rows], sigma_m=self.sigma_m[rows])

    def arrays(self) -> dict[str, AnyArray]:
        """Return storeys, positions and heights, for saving; how sure the labels were is not kept."""
        return {"storey": self.storey.astype(np.int32), "xy": self.xy, "z": self.z}

    @classmethod
    def restored(cls, arrays: CheckedArrays, storeys: tuple[Storey, ...]) -> Self:
        """Take back what :meth:`arrays` gave; ``n`` is their number. Raises ValueError where it does not fit."""
        return cls(
            storeys=storeys,
            storey=arrays.integers("storey", "n", below=len(storeys)).astype(np.int64),
            xy=arrays.floats("xy", "n", 2),
            z=arrays.floats("z", "n", unknown=True),
            sigma_m=np.full(arrays.sizes["n"], np.nan),
        )

    def over(self, storeys: tuple[Storey, ...]) -> ScanPlaces:
        """Number storeys by another list that holds them all."""
        number = np.array([storeys.index(storey) for storey in self.storeys], dtype=np.int64)
        return replace(self, storeys=storeys, storey=number[self.storey])

    def distance_m(self, xy: FloatArray) -> FloatArray:
        """Return how far (n,) positions (n, 2) lie from the places, metres in the plane; NaN where one is unknown."""
        return np.asarray(np.hypot(*(xy - self.xy).T))

    @property
    def floor(self) -> IntArray:
        """(n,) floor numbers."""
        return np.array([storey.floor for storey in self.storeys], dtype=np.int64)[self.storey]

    @property
    def storey_height_m(self) -> FloatArray:
        """(len(storeys),) median height of each storey's places, metres; NaN where none is known."""
        height_m = np.full(len(self.storeys), np.nan)
        known = np.isfinite(self.z)
        for storey in np.unique(self.storey[known]):
            height_m[storey] = np.median(self.z[known & (self.storey == storey)])
        return height_m


def joined_places(parts: Sequence[ScanPlaces]) -> ScanPlaces:
    """Put places after others, over the storeys of all, in order."""
    storeys = tuple(sorted({storey for part in parts for storey in part.storeys}))
    whole = [part.over(storeys) for part in parts]
    names = ("storey", "xy", "z", "sigma_m")
    return ScanPlaces(storeys, **{name: np.concatenate([getattr(part, name) for part in whole]) for name in names})


LabelledScans = tuple[RadioScans, ScanPlaces]
"""Scans (n) and where they were taken (n)."""


@dataclass(frozen=True)
class Positions:
    """What a model says of ``n`` scans."""

    storeys: tuple[Storey, ...]
    storey: IntArray
    """(n,) index into ``storeys``; -1: unknown (nothing known was heard)."""
    xy: FloatArray
    """(n, 2) BCS metres; NaN: unknown."""
    z: FloatArray
    """(n,) metres; NaN: unknown."""
    storey_probability: FloatArray
    """(n, len(storeys))"""
    radius_68_m: FloatArray
    """(n,) the true place lies within this distance in the plane with 68 % probability; NaN: unknown."""
    radius_95_m: FloatArray
    """(n,) the same with 95 %."""
    unlike: BoolArray | None = None
    """(n,) nothing like the scan was learned, so that no radius can be relied on; None: the model cannot tell."""

    def __len__(self) -> int:
        return len(self.storey)

    def __getitem__(self, rows: Rows) -> Positions:
        return replace(
            self,
            storey=self.storey[rows],
            xy=self.xy[rows],
            z=self.z[rows],
            storey_probability=self.storey_probability[rows],
            radius_68_m=self.radius_68_m[rows],
            radius_95_m=self.radius_95_m[rows],
            unlike=None if self.unlike is None else self.unlike[rows],
        )

    @property
    def known(self) -> BoolArray:
        """(n,) whether the model could say anything."""
        return self.storey >= 0

    @property
    def floor(self) -> IntArray:
        """(n,) floor numbers; where unknown, that of the first storey: look at ``known``."""
        return np.array([storey.floor for storey in self.storeys], dtype=np.int64)[np.maximum(self.storey, 0)]

    def without(self, rows: BoolArray) -> Self:
        """Make the scans of the mask (n,) unknown."""
        return replace(
            self,
            storey=np.where(rows, -1, self.storey),
            xy=np.where(rows[:, None], np.nan, self.xy),
            z=np.where(rows, np.nan, self.z),
            storey_probability=np.where(rows[:, None], np.nan, self.storey_probability),
            radius_68_m=np.where(rows, np.nan, self.radius_68_m),
            radius_95_m=np.where(rows, np.nan, self.radius_95_m),
            unlike=None if self.unlike is None else self.unlike & ~rows,
        )
