"""k nearest neighbours in signal space, the baseline of the field (Bahl and Padmanabhan 2000, RADAR).

Distances and representations of levels as compared by Torres-Sospedra et al. 2015, "Comprehensive analysis of distance
and similarity measures for Wi-Fi fingerprinting indoor positioning systems".
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import AnyArray, FloatArray, IntArray
from vislam2tag.positioning.baselines.scan_index import Apart, NearestScans, ScanIndex, SignalDistance
from vislam2tag.positioning.baselines.votes import VotedPositions, Votes, counted_votes
from vislam2tag.positioning.baselines.voting_positioner import VotingPositioner
from vislam2tag.positioning.checked_arrays import CheckedArrays
from vislam2tag.positioning.held_out_radii import like_limit
from vislam2tag.positioning.registry import NamedArrays, register
from vislam2tag.positioning.scans.held_out import calibration_rows, walk_numbers
from vislam2tag.positioning.scans.places import LabelledScans, Positions, ScanPlaces
from vislam2tag.positioning.scans.radio_scans import RadioScans
from vislam2tag.positioning.scans.representation import Representation, represented_levels

NEAREST = 1e-3
"""Neighbours nearer than this in signal space count alike."""


class NearestNeighbours(VotingPositioner):
    """The storey with most votes of the k nearest scans, and the mean of their places on it.

    Radii follow the spread of the neighbours, calibrated by leaving out each training scan with its walk.
    """

    like_: float
    """Distance of the nearest: beyond, a scan is unlike all that was learned."""

    def __init__(
        self, *, k: int = 5, distance: str = "sorensen", representation: str = "powed", exponent: float = 4.0
    ) -> None:
        """Take how many neighbours vote, each with distance to the minus ``exponent``; 0: all alike.

        ``distance``: euclidean, sorensen or cosine. ``representation``: positive, powed or exponential. The defaults
        are best in leave-one-walk-out cross-validation on training parts (docs/results/positioning-settings.md).
        """
        self.k = k
        self.distance = distance
        self.representation = representation
        self.exponent = exponent

    def _check(self) -> None:
        if self.k < 1 or self.exponent < 0:
            raise UsageError(f"k={self.k}, exponent={self.exponent}: k must be 1 or more, the exponent 0 or more")
        for name, value, values in (
            ("distance", self.distance, list(SignalDistance)),
            ("representation", self.representation, list(Representation)),
        ):
            if value not in values:
                raise UsageError(f"{name}={value}: there are {', '.join(values)}")

    def _learn(self, scans: RadioScans, places: ScanPlaces) -> None:
        super()._learn(scans, places)
        self._index = ScanIndex.of(scans, self._levels(scans), SignalDistance(self.distance))

    def _left_out(self, scans: RadioScans, places: ScanPlaces) -> tuple[FloatArray, FloatArray]:
        walk, rows = walk_numbers(scans, places), calibration_rows(len(scans))
        return self._calibrated(self._near(scans[rows], Apart.among(rows, walk)), places[rows], walk[rows])

    def _asked(self, scans: RadioScans, places: ScanPlaces) -> tuple[FloatArray, FloatArray]:
        return self._calibrated(self._near(scans), places, np.arange(len(scans)))

    def _calibrated(self, near: NearestScans, places: ScanPlaces, group: IntArray) -> tuple[FloatArray, FloatArray]:
        """Learn from what is near scans that are held out what is like them; return errors and spreads."""
        away = near.away[:, 0]
        known = np.isfinite(away)
        self.like_ = like_limit(away[known], group[known])
        answer = self._voted(near)
        return places.distance_m(answer.xy), answer.spread_m

    def _answer(self, scans: RadioScans) -> VotedPositions:
        return self._voted(self._near(scans))

    def _predict(self, scans: RadioScans) -> Positions:
        near = self._near(scans)
        answer = self._voted(near)
        return answer.positions(self._places, self.radii_.radii_m(answer.spread_m), near.away[:, 0] > self.like_)

    def arrays(self) -> NamedArrays:
        """Return what others that vote do, and what is like the scans learned."""
        return {**super().arrays(), "like": np.array([self.like_])}

    def restore(self, arrays: Mapping[str, AnyArray]) -> None:
        """Take back what :meth:`arrays` gave; a file of an earlier version does not tell what is unlike."""
        super().restore(arrays)
        self.like_ = float(CheckedArrays(arrays).floats("like", 1)[0]) if "like" in arrays else np.inf

    def learned(self) -> LabelledScans:
        """Return all that was learned from."""
        return self._scans, self._places

    def _near(self, scans: RadioScans, apart: Apart | None = None) -> NearestScans:
        return self._index.nearest(scans, self._levels(scans), self.k, apart)

    def _voted(self, found: NearestScans) -> VotedPositions:
        near = np.maximum(found.away, NEAREST)
        weight = np.where(np.isfinite(near), (near[:, :1] / near) ** self.exponent, 0.0)
        return counted_votes(Votes(found.which, weight), self._places)

    def _levels(self, scans: RadioScans) -> FloatArray:
        """(m,) of all readings."""
        return represented_levels(scans.rssi_dbm, Representation(self.representation))


register("weighted-knn", NearestNeighbours)
