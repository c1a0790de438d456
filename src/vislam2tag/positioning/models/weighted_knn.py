"""k nearest neighbours in signal space, the baseline of the field (Bahl and Padmanabhan 2000, RADAR).

Distances and representations of levels as compared by Torres-Sospedra et al. 2015, "Comprehensive analysis of distance
and similarity measures for Wi-Fi fingerprinting indoor positioning systems".
"""

from __future__ import annotations

import numpy as np

from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.baselines.scan_index import Apart, ScanIndex, SignalDistance
from vislam2tag.positioning.baselines.votes import VotedPositions, Votes, counted_votes
from vislam2tag.positioning.baselines.voting_positioner import VotingPositioner
from vislam2tag.positioning.registry import register
from vislam2tag.positioning.scans.held_out import calibration_rows, walk_numbers
from vislam2tag.positioning.scans.places import LabelledScans, ScanPlaces
from vislam2tag.positioning.scans.radio_scans import RadioScans
from vislam2tag.positioning.scans.representation import Representation, represented_levels

NEAREST = 1e-3
"""Neighbours nearer than this in signal space count alike."""


class NearestNeighbours(VotingPositioner):
    """The storey with most votes of the k nearest scans, and the mean of their places on it.

    Radii follow the spread of the neighbours, calibrated by leaving out each training scan with its walk.
    """

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
        answer = self._voted(scans[rows], Apart.among(rows, walk))
        return places[rows].distance_m(answer.xy), answer.spread_m

    def _answer(self, scans: RadioScans) -> VotedPositions:
        return self._voted(scans)

    def learned(self) -> LabelledScans:
        """Return all that was learned from."""
        return self._scans, self._places

    def _voted(self, scans: RadioScans, apart: Apart | None = None) -> VotedPositions:
        index, away = self._index.nearest(scans, self._levels(scans), self.k, apart)
        near = np.maximum(away, NEAREST)
        weight = np.where(np.isfinite(near), (near[:, :1] / near) ** self.exponent, 0.0)
        return counted_votes(Votes(index, weight), self._places)

    def _levels(self, scans: RadioScans) -> FloatArray:
        """(m,) of all readings."""
        return represented_levels(scans.rssi_dbm, Representation(self.representation))


register("weighted-knn", NearestNeighbours)
