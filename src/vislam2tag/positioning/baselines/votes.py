"""Places of training scans that speak for where others were taken: what all models that weigh examples share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.positioning.cell_density.density_cells import MEDIAN_STEPS, SMOOTH_M
from vislam2tag.positioning.scans.places import Positions, ScanPlaces

Middle = Callable[[FloatArray, FloatArray], FloatArray]
"""From weights (n, m) of places (n, m, 2) to one place each (n, 2)."""


@dataclass(frozen=True)
class Votes:
    """For each of ``n`` scans ``m`` of the places that were learned."""

    index: IntArray
    """(n, m) which places."""
    weight: FloatArray
    """(n, m) how much each counts, 0 or more; at least one counts."""

    @property
    def share(self) -> FloatArray:
        """(n, m) of the whole weight."""
        return np.asarray(self.weight / self.weight.sum(axis=1, keepdims=True))

    def storey_shares(self, places: ScanPlaces) -> FloatArray:
        """(n, s) share of the votes for each storey."""
        n, s = len(self.index), len(places.storeys)
        cell = np.arange(n)[:, None] * s + places.storey[self.index]
        return np.asarray(np.bincount(cell.reshape(-1), self.share.reshape(-1), n * s).reshape(n, s), np.float64)


@dataclass(frozen=True)
class VotedPositions:
    """Where ``n`` scans were taken by their votes."""

    storey_probability: FloatArray
    """(n, s) share of the votes for each storey."""
    storey: IntArray
    """(n,) the storey with most."""
    xy: FloatArray
    """(n, 2) mean of the places on that storey, metres."""
    z: FloatArray
    """(n,) mean of their heights, metres; NaN where none is known."""
    spread_m: FloatArray
    """(n,) root mean square distance in the plane of all places, on whichever storey, from the answer."""
    torn: FloatArray
    """(n,) share of the votes for other storeys than the one with most votes."""

    def positions(
        self, places: ScanPlaces, radii_m: tuple[FloatArray, FloatArray], unlike: BoolArray | None = None
    ) -> Positions:
        """Say it as a model does, with radii (n,) of 68 % and 95 %, metres, and which scans are unlike all (n,)."""
        radius_68_m, radius_95_m = radii_m
        return Positions(
            storeys=places.storeys,
            storey=self.storey,
            xy=self.xy,
            z=self.z,
            storey_probability=self.storey_probability,
            radius_68_m=radius_68_m,
            radius_95_m=radius_95_m,
            unlike=unlike,
        )


def counted_votes(votes: Votes, places: ScanPlaces) -> VotedPositions:
    """Count votes for places: first the storey, then the mean of those on it."""
    return _counted(votes, places, _mean)


def median_votes(votes: Votes, places: ScanPlaces, further: FloatArray | None = None) -> VotedPositions:
    """Count votes for places: first the storey, then the geometric median of those on it (all, if there are none).

    ``further`` (n, s) are shares for storeys by something else; the votes' sum to 1.
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


def joined_answers(answers: list[VotedPositions]) -> VotedPositions:
    """Put answers for some scans after those for others."""
    return VotedPositions(
        **{
            name: np.concatenate([getattr(one, name) for one in answers])
            for name in VotedPositions.__dataclass_fields__
        }
    )


def _mean(weight: FloatArray, values: FloatArray) -> FloatArray:
    """(n, d) weighted mean of values (n, m, d); NaN where all weights (n, m) are 0."""
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
