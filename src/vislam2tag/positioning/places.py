"""Places of scans for training, and positions estimated by a model.

Also defines which training scans may be used for others in calibration (never those of the same walk), and a density
over cells near the surveyed places, on every storey.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from vislam2tag.core.arrays import AnyArray, BoolArray, FloatArray, IntArray
from vislam2tag.datasets.model import Storey
from vislam2tag.positioning.radio_scans import CheckedArrays, RadioScans, Rows, joined_rows, rows_of

SIXTY_EIGHT, NINETY_FIVE = 0.68, 0.95


@dataclass(frozen=True)
class ScanPlaces:
    """True (or labelled) places of ``n`` scans. It can be used as scikit-learn's ``y``."""

    storeys: tuple[Storey, ...]
    """All floors, in order."""
    storey: IntArray
    """(n,) index into ``storeys``."""
    xy: FloatArray
    """(n, 2) BCS metres."""
    z: FloatArray
    """(n,) metres above the building's zero; NaN: unknown."""
    sigma_m: FloatArray
    """(n,) standard deviation of the label per axis; NaN if unknown."""

    def __len__(self) -> int:
        return len(self.storey)

    @property
    def shape(self) -> tuple[int, int]:
        """Number of places, and of coordinates in the plane."""
        return len(self), 2

    def __getitem__(self, rows: Rows) -> ScanPlaces:
        return rows_of(self, rows)

    def arrays(self) -> dict[str, AnyArray]:
        """Return storeys, positions and heights, for saving; standard deviations of labels are not saved."""
        return {"storey": self.storey.astype(np.int32), "xy": self.xy, "z": self.z}

    @classmethod
    def restored(cls, arrays: CheckedArrays, storeys: tuple[Storey, ...]) -> Self:
        """Restore from the result of :meth:`arrays`; ``n`` is their number. Raises ValueError if it does not fit."""
        return cls(
            storeys=storeys,
            storey=arrays.integers("storey", "n", below=len(storeys)).astype(np.int64),
            xy=arrays.floats("xy", "n", 2),
            z=arrays.floats("z", "n", unknown=True),
            sigma_m=np.full(arrays.sizes["n"], np.nan),
        )

    def over(self, storeys: tuple[Storey, ...]) -> ScanPlaces:
        """Number the storeys by another list that contains them all."""
        number = np.array([storeys.index(storey) for storey in self.storeys], dtype=np.int64)
        return replace(self, storeys=storeys, storey=number[self.storey])

    def distance_m(self, xy: FloatArray) -> FloatArray:
        """Return the distances (n,) of positions (n, 2) from the places, metres in the plane; NaN if one is unknown."""
        return np.asarray(np.hypot(*(xy - self.xy).T))

    @property
    def floor(self) -> IntArray:
        """(n,) floor numbers."""
        return np.array([storey.floor for storey in self.storeys], dtype=np.int64)[self.storey]

    @property
    def storey_height_m(self) -> FloatArray:
        """(len(storeys),) median height of each storey's places, metres; NaN if none is known."""
        height_m = np.full(len(self.storeys), np.nan)
        known = np.isfinite(self.z)
        for storey in np.unique(self.storey[known]):
            height_m[storey] = np.median(self.z[known & (self.storey == storey)])
        return height_m


def joined_places(parts: Sequence[ScanPlaces]) -> ScanPlaces:
    """Concatenate places, over the storeys of all, in order."""
    storeys = tuple(sorted({storey for part in parts for storey in part.storeys}))
    return joined_rows([part.over(storeys) for part in parts])


LabelledScans = tuple[RadioScans, ScanPlaces]
"""Scans (n) and their places (n)."""


@dataclass(frozen=True)
class Positions:
    """Estimated positions of ``n`` scans."""

    storeys: tuple[Storey, ...]
    storey: IntArray
    """(n,) index into ``storeys``; -1: unknown (no known access point was heard)."""
    xy: FloatArray
    """(n, 2) BCS metres; NaN: unknown."""
    z: FloatArray
    """(n,) metres; NaN: unknown."""
    storey_probability: FloatArray
    """(n, len(storeys))"""
    radius_68_m: FloatArray
    """(n,) the true place is within this distance in the plane with 68 % probability; NaN: unknown."""
    radius_95_m: FloatArray
    """(n,) the same with 95 %."""
    unlike: BoolArray | None = None
    """(n,) whether the scan is unlike the training set, so that its radii are unreliable; None: not available."""

    def __len__(self) -> int:
        return len(self.storey)

    def __getitem__(self, rows: Rows) -> Positions:
        return rows_of(self, rows)

    @property
    def known(self) -> BoolArray:
        """(n,) whether the model has an answer."""
        return self.storey >= 0

    @property
    def floor(self) -> IntArray:
        """(n,) floor numbers; if unknown, that of the first storey (see ``known``)."""
        return np.array([storey.floor for storey in self.storeys], dtype=np.int64)[np.maximum(self.storey, 0)]

    def without(self, rows: BoolArray) -> Self:
        """Make the scans of the mask (n,) unknown."""
        names = ("xy", "z", "storey_probability", "radius_68_m", "radius_95_m")
        values = {name: getattr(self, name).copy() for name in names}
        for array in values.values():
            array[rows] = np.nan
        unlike = None if self.unlike is None else self.unlike & ~rows
        return replace(self, storey=np.where(rows, -1, self.storey), unlike=unlike, **values)


CALIBRATED_WITH = 2000
"""Largest number of scans that are left out in turn; more would not improve the radii."""


def calibration_rows(count: int, most: int = CALIBRATED_WITH) -> IntArray:
    """Return which scans are used for calibration: (k,), evenly spread, in order; none if there is only one scan."""
    return np.unique(np.linspace(0, count - 1, most if count > 1 else 0).astype(np.int64))


def walk_numbers(scans: RadioScans, places: ScanPlaces) -> IntArray:
    """Number the walks (n,). Scans of one walk are not independent, so they are left out together.

    Those of :func:`lone_walks` count as walks of one scan.
    """
    names, session = np.unique(scans.session, return_inverse=True)
    return np.where(lone_walks(scans, places), len(names) + np.arange(len(scans)), session)


def lone_walks(scans: RadioScans, places: ScanPlaces) -> BoolArray:
    """Return which scans (n,) have no session, or one that is alone on one of its storeys.

    Without such a session its storey would have no training data.
    """
    names, session = np.unique(scans.session, return_inverse=True)
    visited = np.zeros((len(names), len(places.storeys)), dtype=np.bool_)
    visited[session, places.storey] = True
    alone = (visited & (visited.sum(axis=0) == 1)).any(axis=1)
    return np.asarray((scans.session == "") | alone[session])


def area_numbers(places: ScanPlaces, side_m: float) -> IntArray:
    """Number the squares (n,) that contain the places, whatever the storey."""
    at = np.floor(places.xy / side_m).astype(np.int64)
    return np.unique(at, axis=0, return_inverse=True)[1].reshape(-1)


def folds(walks: IntArray, count: int, seed: int) -> Iterator[tuple[BoolArray, BoolArray]]:
    """Deal walks (n,) or areas to at most ``count`` folds; yield masks of training and held-out scans.

    Yields nothing if there is only one walk.
    """
    fold = fold_numbers(walks, count, seed)
    for number in range(fold.max(initial=-1) + 1):
        held_out = fold == number
        if not held_out.all():
            yield ~held_out, held_out


def fold_numbers(walks: IntArray, count: int, seed: int) -> IntArray:
    """Deal walks (n,) or areas to at most ``count`` folds; return the fold (n,) of each scan."""
    numbers, walk = np.unique(walks, return_inverse=True)
    return np.asarray((np.random.default_rng(seed).permutation(len(numbers)) % count)[walk])


def usable_validation(validation: LabelledScans | None) -> LabelledScans | None:
    """Return the held-out scans that hear something and have a place; None if there are none."""
    if validation is None:
        return None
    scans, places = validation
    good = (scans.heard > 0) & np.isfinite(places.xy).all(axis=1) & (places.storey >= 0)
    return (scans[good], places[good]) if good.any() else None


MEDIAN_STEPS = 12
"""Steps of the geometric median, a fixed number, so that an exported network does the same."""
SMOOTH_M = 1.0
"""Lower limit of distances in the geometric median."""


@dataclass(frozen=True)
class DensityCells:
    """``c`` square cells, sorted by storey."""

    storey: IntArray
    """(c,) index into the model's storeys."""
    centre_m: FloatArray
    """(c, 2) BCS."""

    def __len__(self) -> int:
        return len(self.storey)

    def on(self, storey: IntArray) -> BoolArray:
        """(n, c) whether each cell is on the storey (n,) of a scan."""
        return np.asarray(self.storey == storey[:, None])

    def label_densities(self, places: ScanPlaces, width_m: float) -> FloatArray:
        """Spread each of ``n`` places over the cells of its storey: (n, c), rows sum to 1.

        Uses a Gaussian of this standard deviation, or a wider one if the label is uncertain.
        """
        variance = width_m**2 + np.nan_to_num(places.sigma_m) ** 2
        exponent = np.where(self.on(places.storey), -self._distance_m2(places.xy) / (2 * variance[:, None]), -np.inf)
        density = np.exp(exponent - exponent.max(axis=1, keepdims=True))
        return np.asarray(density / density.sum(axis=1, keepdims=True))

    def median(self, density: FloatArray) -> FloatArray:
        """Return geometric medians (n, 2), metres, of densities (n, c), by Weiszfeld's steps from the mean.

        Distant second guesses do not pull it, as they pull the mean, and it does not jump, as the mode does.
        """
        pull = density
        for _ in range(MEDIAN_STEPS):
            xy = (pull @ self.centre_m) / pull.sum(axis=1, keepdims=True)
            pull = density / np.sqrt(self._distance_m2(xy) + SMOOTH_M**2)
        return np.asarray((pull @ self.centre_m) / pull.sum(axis=1, keepdims=True))

    def spread_m(self, density: FloatArray, xy: FloatArray) -> FloatArray:
        """Return the mean distances (n,), metres, of densities (n, c) from points (n, 2) in the plane."""
        distance_m = (density * np.sqrt(self._distance_m2(xy))).sum(axis=1)
        return np.asarray(distance_m / density.sum(axis=1))

    def _distance_m2(self, xy: FloatArray) -> FloatArray:
        """(n, c) squared distances of points (n, 2) from the cells' centres."""
        x, y = (xy[:, axis, None] - self.centre_m[:, axis] for axis in (0, 1))
        return np.asarray(x**2 + y**2)


def cells_near(places: ScanPlaces, side_m: float, around: int = 1) -> DensityCells:
    """Make the cells that contain a place, and cells up to ``around`` sides away; sides are multiples of ``side_m``."""
    near = np.unique(np.column_stack([places.storey, np.floor(places.xy / side_m).astype(np.int64)]), axis=0)
    for axis in (1, 2):
        steps = np.zeros((2 * around + 1, 3), dtype=np.int64)
        steps[:, axis] = np.arange(-around, around + 1)
        near = np.unique((near[:, None] + steps).reshape(-1, 3), axis=0)
    return DensityCells(storey=near[:, 0], centre_m=(near[:, 1:] + 0.5) * side_m)
