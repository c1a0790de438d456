"""k nearest neighbours in signal space, the baseline of the field (Bahl and Padmanabhan 2000, RADAR).

Distances and representations of levels as compared by Torres-Sospedra et al. 2015, "Comprehensive analysis of distance
and similarity measures for Wi-Fi fingerprinting indoor positioning systems".
"""

from __future__ import annotations

from enum import StrEnum

import numpy as np
from scipy.spatial.distance import cdist

from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.positioning.baselines.votes import VotedPositions, Votes, counted_votes, joined_answers
from vislam2tag.positioning.baselines.voting_positioner import VotingPositioner
from vislam2tag.positioning.registry import register
from vislam2tag.positioning.scans.held_out import calibration_rows, walk_numbers
from vislam2tag.positioning.scans.places import ScanPlaces
from vislam2tag.positioning.scans.radio_scans import RadioScans
from vislam2tag.positioning.scans.representation import Representation, represented

NEAREST = 1e-3
"""Neighbours nearer than this in signal space count alike."""
_DISTANCES_AT_ONCE = 4_000_000


class SignalDistance(StrEnum):
    """How far two scans are apart; the values are SciPy's names."""

    EUCLIDEAN = "euclidean"
    SORENSEN = "braycurtis"
    COSINE = "cosine"


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
            ("distance", self.distance, [one.name.lower() for one in SignalDistance]),
            ("representation", self.representation, list(Representation)),
        ):
            if value not in values:
                raise UsageError(f"{name}={value}: there are {', '.join(values)}")

    def _learn(self, scans: RadioScans, places: ScanPlaces) -> None:
        super()._learn(scans, places)
        self._levels = represented(scans, Representation(self.representation))

    def _left_out(self, scans: RadioScans, places: ScanPlaces) -> tuple[FloatArray, FloatArray]:
        walk, rows = walk_numbers(scans, places), calibration_rows(len(scans))
        answer = self._answer(scans[rows], walk[rows], walk)
        return places[rows].distance_m(answer.xy), answer.spread_m

    def _answer(
        self, scans: RadioScans, walk: IntArray | None = None, learned_walk: IntArray | None = None
    ) -> VotedPositions:
        """Answer block by block; scans with a ``walk`` (n,) get no vote of learned scans of the same walk."""
        size = max(1, _DISTANCES_AT_ONCE // len(self._scans))
        answers = []
        for start in range(0, max(len(scans), 1), size):
            block = slice(start, start + size)
            away = self._distances(scans[block])
            if walk is not None and learned_walk is not None:
                away[walk[block, None] == learned_walk] = np.inf
            answers.append(counted_votes(self._votes(away), self._places))
        return joined_answers(answers)

    def _distances(self, scans: RadioScans) -> FloatArray:
        """(n, learned) distances; where they are undefined, as nothing loud enough was heard, the greatest."""
        levels = represented(scans, Representation(self.representation))
        away = cdist(levels, self._levels, SignalDistance[self.distance.upper()].value)
        return np.nan_to_num(away, nan=1.0)

    def _votes(self, away: FloatArray) -> Votes:
        """Let the nearest vote, by distances (n, learned); of neighbours equally far the first learned."""
        nearest = np.argsort(away, axis=1, kind="stable")[:, : self.k]
        near = np.maximum(np.take_along_axis(away, nearest, axis=1), NEAREST)
        weight = np.where(np.isfinite(near), (near[:, :1] / near) ** self.exponent, 0.0)
        return Votes(nearest, weight)


register("weighted-knn", NearestNeighbours)
