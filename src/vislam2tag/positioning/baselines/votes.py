"""Places of training scans that speak for where others were taken: what all models that weigh examples share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.positioning.error_radii import SpreadRadii
from vislam2tag.positioning.scans.places import Positions, ScanPlaces


@dataclass(frozen=True)
class Votes:
    """For each of ``n`` scans ``m`` of the places that were learned."""

    index: IntArray
    """(n, m) which places."""
    weight: FloatArray
    """(n, m) how much each counts, 0 or more; at least one counts."""


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

    def positions(self, places: ScanPlaces, radii: SpreadRadii) -> Positions:
        """Say it as a model does."""
        radius_68_m, radius_95_m = radii.radii_m(self.spread_m)
        return Positions(
            storeys=places.storeys,
            storey=self.storey,
            xy=self.xy,
            z=self.z,
            storey_probability=self.storey_probability,
            radius_68_m=radius_68_m,
            radius_95_m=radius_95_m,
        )


def counted_votes(votes: Votes, places: ScanPlaces) -> VotedPositions:
    """Count votes for places: first the storey, then the position among those on it."""
    share = votes.weight / votes.weight.sum(axis=1, keepdims=True)
    storey_of, xy_of = places.storey[votes.index], places.xy[votes.index]
    probability = np.stack([(share * (storey_of == s)).sum(axis=1) for s in range(len(places.storeys))], axis=1)
    storey = probability.argmax(axis=1)
    here = share * (storey_of == storey[:, None])
    xy = _mean(here, xy_of)
    z_of = places.z[votes.index]
    away_m2 = ((xy_of - xy[:, None]) ** 2).sum(axis=2)
    return VotedPositions(
        storey_probability=probability,
        storey=storey,
        xy=xy,
        z=_mean(here * np.isfinite(z_of), np.nan_to_num(z_of)[..., None])[:, 0],
        spread_m=np.sqrt((share * away_m2).sum(axis=1)),
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
