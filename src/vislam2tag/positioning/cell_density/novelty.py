"""Novelty of a scan: how unlike the training set it is, and radii that grow with it.

A model also answers scans from places that were not surveyed. Such a scan differs in two ways. Its levels have another
direction than those of the most similar training scans, by more than these differ among themselves (compare the local
outlier factor of Breunig et al. 2000). And the places of those training scans are far apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.error_radii import SMALLEST_SCALE_M, UNKNOWN_M, conformal_quantile
from vislam2tag.positioning.places import NINETY_FIVE, SIXTY_EIGHT
from vislam2tag.positioning.radio_scans import CheckedArrays

COMPARED, PLACED = 3, 5
"""Number of most similar scans for the distance in signal space, and for places."""
TIE = 1e-7
"""In a tie the first scans count: each is treated as this much less similar than the one before it."""
LEAST_EXCESS = 1e-6
"""Precision of distances between directions."""
MOST_NOVEL = 4.0
"""Largest possible novelty, because directions are at most 2 apart."""
_MOST_GROWTH = 16.0
"""Limit of the median growth of radii for scans from left-out places, relative to familiar ones: if signals hardly
separate both, familiar scans would pay for the others."""
_GROWTH_QUANTILE = 0.75
"""Radii grow up to the novelty of this quantile of scans from left-out places; larger ones were not tested."""
_BISECTIONS = 40
"""Each step halves the interval of the root; the remaining one is 1e-12 of it."""


@dataclass(frozen=True)
class ReferenceScans:
    """``m`` training scans for comparison."""

    direction: FloatArray
    """(m, a) of their levels, length 1."""
    xy: FloatArray
    """(m, 2) their places, metres."""
    apart: FloatArray
    """(m,) mean distance of their directions from those of the most similar others, 0 to 2."""

    @classmethod
    def of(cls, direction: FloatArray, xy: FloatArray) -> Self:
        """Compare training scans among themselves: directions (m, a) and places (m, 2), metres."""
        among = _distance(direction, direction)
        np.fill_diagonal(among, np.inf)
        nearest = np.sort(among, axis=1)[:, :COMPARED]
        nearest = np.where(np.isfinite(nearest), nearest, 0.0)  # fewer scans than required
        return cls(direction, xy, nearest.mean(axis=1))

    def compared(self, direction: FloatArray, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compare scans with these directions (n, a) and estimated places (n, 2).

        Returns the mean distance (n,) of the answers from the places of the most similar scans, metres, and the novelty
        (n,). Novelty is 0 if a scan is as similar to them as training scans are to each other.
        """
        distance = _distance(direction, self.direction)
        ranked = distance + TIE * np.arange(distance.shape[1])
        nearest = np.argpartition(ranked, min(PLACED, distance.shape[1] - 1), axis=1)[:, :PLACED]
        nearest = np.take_along_axis(nearest, np.argsort(np.take_along_axis(ranked, nearest, axis=1), axis=1), axis=1)
        dispersal_m = np.hypot(*(self.xy[nearest] - xy[:, None]).transpose(2, 0, 1)).mean(axis=1)
        compared = nearest[:, :COMPARED]
        unlike = np.take_along_axis(distance, compared, axis=1).mean(axis=1)
        excess = np.maximum(unlike - self.apart[compared].mean(axis=1) - LEAST_EXCESS, 0.0)
        return dispersal_m, excess * unlike


def _distance(one: FloatArray, other: FloatArray) -> FloatArray:
    """(n, m) Euclidean distances of directions (n, a) and (m, a)."""
    return np.asarray(np.sqrt(np.maximum(2.0 - 2.0 * (one @ other.T), 0.0)))


@dataclass(frozen=True)
class HeldOutErrors:
    """Answers to ``n`` scans that were not in the training set."""

    error_m: FloatArray
    """(n,) in the plane."""
    scale_m: FloatArray
    """(n,) spread of the model's own guesses, metres."""
    novelty: FloatArray
    """(n,) of :meth:`ReferenceScans.compared`."""

    def __len__(self) -> int:
        return len(self.error_m)


@dataclass(frozen=True)
class RadiusGrowth:
    """A radius in scales: ``factor`` if nothing is new, ``by_novelty`` more for each unit of novelty."""

    factor: float
    by_novelty: float

    def radius_m(self, scale_m: FloatArray, novelty: FloatArray) -> FloatArray:
        """Return radii (n,), metres, of scans with these scales (n,), metres, and novelties (n,)."""
        return np.asarray(scale_m * (self.factor + self.by_novelty * novelty))


@dataclass(frozen=True)
class NoveltyRadii:
    """Circles that grow with the spread of guesses and with what is new about a scan."""

    base_m: float
    """Median of the errors on familiar scans; scale of the error if guesses do not spread."""
    growth_68: RadiusGrowth
    growth_95: RadiusGrowth
    most_novel: float
    """Larger novelties count as this one."""

    def radii_m(self, spread_m: FloatArray, novelty: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return 68 % and 95 % radii (n,), metres, of scans with such spreads (n,), metres, and novelties (n,)."""
        scale_m, novelty = _scale(self.base_m, spread_m), np.minimum(novelty, self.most_novel)
        return self.growth_68.radius_m(scale_m, novelty), self.growth_95.radius_m(scale_m, novelty)

    def array(self) -> FloatArray:
        """Return the six numbers (6,), for saving."""
        growths = (self.growth_68, self.growth_95)
        numbers = (number for one in growths for number in (one.factor, one.by_novelty))
        return np.array([self.base_m, *numbers, self.most_novel])

    @classmethod
    def restored(cls, arrays: CheckedArrays, name: str) -> Self:
        """Restore from the result of :meth:`array`; raises ValueError if it does not fit."""
        base_m, *growth, most_novel = (float(number) for number in arrays.floats(name, 6))
        return cls(base_m, RadiusGrowth(*growth[:2]), RadiusGrowth(*growth[2:]), most_novel)


def _scale(base_m: float, spread_m: FloatArray) -> FloatArray:
    """(n,) scale of errors, metres, of spreads (n,), metres."""
    return np.maximum(np.hypot(base_m, spread_m), SMALLEST_SCALE_M)


def fitted_novelty_radii(familiar: HeldOutErrors, strange: HeldOutErrors) -> NoveltyRadii:
    """Fit to scans as expected in use, and to scans from left-out places.

    Circles contain their share of both or, if signals cannot separate them, of the familiar scans.
    """
    if not len(familiar):
        return NoveltyRadii(UNKNOWN_M, RadiusGrowth(1.0, 0.0), RadiusGrowth(2.0, 0.0), 0.0)
    base_m = float(np.median(familiar.error_m))
    most_novel = float(np.quantile(strange.novelty, _GROWTH_QUANTILE)) if len(strange) else 0.0
    near, far = (
        HeldOutErrors(one.error_m, _scale(base_m, one.scale_m), np.minimum(one.novelty, most_novel))
        for one in (familiar, strange)
    )
    return NoveltyRadii(base_m, _growth(near, far, SIXTY_EIGHT), _growth(near, far, NINETY_FIVE), most_novel)


def _growth(familiar: HeldOutErrors, strange: HeldOutErrors, share: float) -> RadiusGrowth:
    """Find by bisection the factor that puts this share of the familiar scans inside."""
    ratio = np.sort(familiar.error_m / familiar.scale_m)
    low, high = 0.0, conformal_quantile(ratio, share)
    for _ in range(_BISECTIONS):
        growth = RadiusGrowth((low + high) / 2, _by_novelty((low + high) / 2, strange, share))
        needed = familiar.error_m / growth.radius_m(familiar.scale_m, familiar.novelty)
        low, high = (low, growth.factor) if conformal_quantile(np.sort(needed), share) <= 1 else (growth.factor, high)
    return RadiusGrowth(high, _by_novelty(high, strange, share))


def _by_novelty(factor: float, strange: HeldOutErrors, share: float) -> float:
    """Return the growth that this share of strange scans needs, within bounds; 0 without strange or new ones."""
    new = strange.novelty > 0
    if not new.any():
        return 0.0
    missing = strange.error_m / strange.scale_m - factor
    needed = np.divide(missing, strange.novelty, out=np.where(missing > 0, np.inf, 0.0), where=new)
    most = (_MOST_GROWTH - 1) * factor / float(np.median(strange.novelty[new]))
    return min(max(conformal_quantile(np.sort(needed), share), 0.0), most)
