"""k nearest neighbours in signal space, the baseline of the field (Bahl and Padmanabhan 2000, RADAR).

Distances and representations of levels as compared by Torres-Sospedra et al. 2015, "Comprehensive analysis of distance
and similarity measures for Wi-Fi fingerprinting indoor positioning systems".
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import AnyArray, FloatArray, IntArray
from vislam2tag.positioning.error_radii import SpreadRadii, fitted_radii, like_limit
from vislam2tag.positioning.places import (
    LabelledScans,
    Positions,
    ScanPlaces,
    calibration_rows,
    usable_validation,
    walk_numbers,
)
from vislam2tag.positioning.radio_scans import CheckedArrays, RadioScans, Representation, represented_levels
from vislam2tag.positioning.registry import NamedArrays, Positioner, register
from vislam2tag.positioning.signal_distance import (
    Apart,
    NearestScans,
    ScanIndex,
    SignalDistance,
    VotedPositions,
    Votes,
    counted_votes,
)

NEAREST = 1e-3
"""Neighbours with a smaller distance in signal space have the same weight."""


class NearestNeighbours(Positioner):
    """The storey with the most votes of the k nearest scans, and the mean of their places on it.

    Radii follow the spread of the neighbours. They are calibrated by leaving out each training scan with its walk, or
    on the validation set. The saved model contains the learned scans.
    """

    radii_: SpreadRadii
    like_: float
    """Distance of the nearest scan above which a scan is unlike the training set."""
    _scans: RadioScans
    _places: ScanPlaces
    _index: ScanIndex

    def __init__(
        self, *, k: int = 5, distance: str = "sorensen", representation: str = "powed", exponent: float = 4.0
    ) -> None:
        """Make a model with ``k`` neighbours, each with weight distance to the minus ``exponent``; 0: equal weights.

        ``distance``: euclidean, sorensen or cosine. ``representation``: positive, powed or exponential. The defaults
        are the best in leave-one-walk-out cross-validation on training sets (benchmarks/NOTES.md).
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
                raise UsageError(f"{name}={value}: expected one of {', '.join(values)}")

    def _fit(self, scans: RadioScans, places: ScanPlaces, validation: LabelledScans | None) -> None:
        self._check()
        self._learn(scans, places)
        held_out = usable_validation(validation)
        if held_out is None:
            walk, rows = walk_numbers(scans, places), calibration_rows(len(scans))
            self._calibrate(self._near(scans[rows], Apart.among(rows, walk)), places[rows], walk[rows])
        else:
            asked, truth = held_out
            self._calibrate(self._near(asked), truth, np.arange(len(asked)))
        self.progress(1, 1)

    def _learn(self, scans: RadioScans, places: ScanPlaces) -> None:
        self._scans, self._places = scans, places
        self._index = ScanIndex.of(scans, self._levels(scans), SignalDistance(self.distance))

    def _calibrate(self, near: NearestScans, places: ScanPlaces, group: IntArray) -> None:
        """Fit the radii and the limit of novelty to held-out scans (n) of walks (n,)."""
        away = near.away[:, 0]
        known = np.isfinite(away)
        self.like_ = like_limit(away[known], group[known])
        answer = self._voted(near)
        self.radii_ = fitted_radii(places.distance_m(answer.xy), answer.spread_m)

    def _predict(self, scans: RadioScans) -> Positions:
        near = self._near(scans)
        answer = self._voted(near)
        return answer.positions(self._places, self.radii_.radii_m(answer.spread_m), near.away[:, 0] > self.like_)

    def arrays(self) -> NamedArrays:
        """Return the learned scans, their places, the radii, and the limit of novelty."""
        scans_and_places = {**self._scans.arrays(), **self._places.arrays()}
        return {**scans_and_places, "radii": self.radii_.array(), "like": np.array([self.like_])}

    def restore(self, arrays: Mapping[str, AnyArray]) -> None:
        """Restore from the result of :meth:`arrays`; files of earlier versions have no limit of novelty."""
        self._check()
        checked = CheckedArrays(arrays)
        scans = RadioScans.restored(checked, self.access_points_)
        self._learn(scans, ScanPlaces.restored(checked, self.storeys_))
        self.radii_ = SpreadRadii.restored(checked, "radii")
        self.like_ = float(checked.floats("like", 1)[0]) if "like" in arrays else np.inf

    def learned(self) -> LabelledScans:
        """Return all learned scans."""
        return self._scans, self._places

    def _near(self, scans: RadioScans, apart: Apart | None = None) -> NearestScans:
        return self._index.nearest(scans, self._levels(scans), self.k, apart)

    def _voted(self, found: NearestScans) -> VotedPositions:
        near = np.maximum(found.away, NEAREST)
        weight = np.where(np.isfinite(near), (near[:, :1] / near) ** self.exponent, 0.0)
        return counted_votes(Votes(found.which, weight), self._places)

    def _levels(self, scans: RadioScans) -> FloatArray:
        """(m,) levels of all readings."""
        return represented_levels(scans.rssi_dbm, Representation(self.representation))


register("weighted-knn", NearestNeighbours)
