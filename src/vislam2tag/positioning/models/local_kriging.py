"""Kriging in signal space: the place of a scan from the most similar learned scans and their mutual similarity.

Each of the k nearest learned scans gets a weight by ordinary kriging (Cressie 1993, section 3.2; with near scans only:
Vecchia 1988). A scan that repeats its neighbours counts less than in a vote by distance, and an almost equal scan
counts most. The place is the geometric median with these weights. All scans are learned, whatever their number, and
found through an index (:mod:`~vislam2tag.positioning.signal_distance`).

Storeys are determined by votes and by a kernel regression that a random part of the scans spans
(:mod:`~vislam2tag.positioning.cell_density.scan_kernels`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import AnyArray, FloatArray, IntArray
from vislam2tag.positioning.cell_density.density_model import learned_storeys
from vislam2tag.positioning.cell_density.scan_kernels import (
    EXPONENT,
    KernelRegression,
    StoreyKernel,
    directions,
    levels,
)
from vislam2tag.positioning.error_radii import HeldOut, HeldOutRadii, held_out_radii, like_limit
from vislam2tag.positioning.places import (
    LabelledScans,
    Positions,
    ScanPlaces,
    area_numbers,
    calibration_rows,
    fold_numbers,
    lone_walks,
    usable_validation,
    walk_numbers,
)
from vislam2tag.positioning.radio_scans import (
    CheckedArrays,
    RadioScans,
    Representation,
    joined_rows,
    represented_levels,
)
from vislam2tag.positioning.registry import NamedArrays, Positioner, register
from vislam2tag.positioning.signal_distance import (
    Apart,
    ScanIndex,
    SignalDistance,
    VotedPositions,
    Votes,
    median_votes,
)

EXPONENTS = (1.3, 1.7, 2.2, 2.7)
"""Candidates for the exponent of levels, chosen by leaving walks out."""
_CHOSEN_WITH, _CHOSEN_AMONG = 400, 4000
"""Largest number of scans for this choice, and of scans among which neighbours are searched."""
SHARPNESS, RIDGE = 1.0, 0.3
"""Parameters of the kernel between directions, from cross-validation on six public data sets
(docs/results/how-good.md)."""
REACH = 0.1
"""Distance in signal space within which a scan shares the variation of the ridge with a learned one.

    The ridge is variation of too short a range to be visible between learned scans. A scan at the place of a learned
one, as in the same walk, shares it (microscale variation; Cressie 1993, section 3.2.1). 0.05 to 0.2 do about as well.
"""
LEAST_WEIGHT = 1e-6
"""Smallest weight of a vote; kriging's weights may be negative."""
STOREY_REGRESSION = 2.0
"""Weight of the regression onto storeys against the votes."""
MOST_CENTRES, MOST_EXAMPLES = 1000, 5000
"""Limits of the regression onto storeys; neighbours are searched among all scans."""
CALIBRATED_WITH = 750
"""Largest number of scans for fitting radii; the error of a share of 68 % is then 1.7 % (binomial)."""
FOLDS = 5
"""Folds of walks that are left out together, because users walk in other ways later."""
COMPARED = (1, 10, None)
"""Numbers of nearest scans whose distances measure novelty; None: all that vote."""
NEAREST = 2
"""Index of the feature from the nearest scan's distance."""
LEAST_SPREAD_M, LEAST_AWAY = 0.5, 0.01
"""Lower limits before logarithms are taken."""
SAME_PLACE_M = 3.0
"""Side of the squares that are left out, because users stand between the surveyed paths."""
_AT_ONCE = 128


class KrigedAnswer(NamedTuple):
    """Answers of the nearest scans for ``n`` scans."""

    voted: VotedPositions
    away: FloatArray
    """(n, k) distances from the nearest in signal space, 0 to 1, ascending."""

    @property
    def features(self) -> FloatArray:
        """(n, 5) features that an error may depend on: spread of the votes, ambiguity of the storey, and novelty.

        Novelty has three values: from the distance of the nearest scan, of ten, and of all.
        """
        spread = np.log(np.maximum(self.voted.spread_m, LEAST_SPREAD_M))
        unlike = (np.log(self.away[:, :count].mean(axis=1) + LEAST_AWAY) for count in COMPARED)
        return np.column_stack([spread, self.voted.torn, *unlike])


class LocalKriging(Positioner):
    """Kriging of the nearest scans.

    Radii are fitted to scans left out alone, with a fold of walks, and also with all scans of their place.

    The radii of a walk's scans depend on all of its scans in the same request.
    """

    exponent_: float
    radii_: HeldOutRadii
    like_: float
    """Limit of the feature ``NEAREST`` above which a scan is unlike the training set."""
    _scans: RadioScans
    _places: ScanPlaces
    _index: ScanIndex
    _powed: RadioScans
    """Scans with powed levels, as directions need them."""
    _storeys: KernelRegression[StoreyKernel]
    _centres: IntArray

    def __init__(self, *, k: int = 30, seed: int = 0) -> None:
        """Make a model with ``k`` nearest scans; ``seed`` is that of the draw for the regression onto storeys."""
        self.k = k
        self.seed = seed

    def _fit(self, scans: RadioScans, places: ScanPlaces, validation: LabelledScans | None) -> None:
        self._check()
        self._learn(scans, places, self._best_exponent(scans, places))
        self.progress(0.4, 1)
        some = calibration_rows(len(scans), MOST_EXAMPLES) if len(scans) > 1 else np.zeros(1, np.int64)
        drawn = np.sort(np.random.default_rng(self.seed).permutation(len(some))[:MOST_CENTRES])
        self._centres = some[drawn]
        self._storeys = learned_storeys(scans[some], places[some], drawn)
        self.progress(0.7, 1)
        ways = self._held_out(usable_validation(validation))
        self.radii_ = held_out_radii(ways)
        self.like_ = like_limit(ways[0].features[:, NEAREST], ways[0].group)
        self.progress(1, 1)

    def _best_exponent(self, scans: RadioScans, places: ScanPlaces) -> float:
        """Choose by leaving walks out."""
        some = slice(None, None, -(-len(scans) // _CHOSEN_AMONG))
        scans, places = scans[some], places[some]
        rows, walk = _asked_rows(scans, places, _CHOSEN_WITH), walk_numbers(scans, places)
        error_m = dict[float, float]()
        for exponent in EXPONENTS if len(rows) else ():
            self._learn(scans, places, exponent)
            error_m[exponent] = float(self._left_out(rows, walk, walk).error_m.mean())
        return min(error_m, key=lambda one: error_m[one]) if error_m else EXPONENTS[1]

    def _check(self) -> None:
        if self.k < 1:
            raise UsageError(f"k={self.k}: k must be 1 or more")

    def _learn(self, scans: RadioScans, places: ScanPlaces, exponent: float) -> None:
        self._scans, self._places, self.exponent_ = scans, places, exponent
        self._index = ScanIndex.of(scans, self._levels(scans), SignalDistance.SORENSEN)
        self._powed = _powed(scans)

    def _levels(self, scans: RadioScans) -> FloatArray:
        """(m,) levels of all readings."""
        return np.asarray(represented_levels(scans.rssi_dbm, Representation.POSITIVE) ** self.exponent_)

    def _left_out(self, rows: IntArray, group: IntArray, *apart: IntArray) -> HeldOut:
        """Return errors on scans ``rows`` (q,) as if scans that share a group ``apart`` (n,) had not been learned.

        Errors of scans of the same ``group`` (n,) are not independent; without groups, scans are left out alone.
        """
        answer = self._kriged(self._scans[rows], Apart.among(rows, *(apart or (group,))))
        return HeldOut(self._places[rows].distance_m(answer.voted.xy), answer.features, group[rows], not apart)

    def _held_out(self, given: LabelledScans | None) -> tuple[HeldOut, ...]:
        if given is not None:
            answer = self._kriged(given[0])
            held_out = HeldOut(given[1].distance_m(answer.voted.xy), answer.features, np.arange(len(given[0])), False)
            return (held_out,)
        rows, walk = _asked_rows(self._scans, self._places, CALIBRATED_WITH), walk_numbers(self._scans, self._places)
        alone, place = np.arange(len(self._scans)), area_numbers(self._places, SAME_PLACE_M)
        fold = fold_numbers(walk, FOLDS, self.seed)
        ways = [(walk, fold), (alone,), *([(walk, fold, place)] if place.any() else [])]
        return tuple(self._left_out(rows, *way) for way in ways)

    def _kriged(self, scans: RadioScans, apart: Apart | None = None) -> KrigedAnswer:
        """Answer; with groups kept apart, storeys follow from votes alone, because the regression has seen the
        scans."""
        near = self._index.nearest(scans, self._levels(scans), self.k, apart)
        answers = []
        for rows in (slice(start, start + _AT_ONCE) for start in range(0, max(len(scans), 1), _AT_ONCE)):
            block, which = scans[rows], near.which[rows]
            votes = Votes(which, self._weights(block, which, near.away[rows]))
            further = STOREY_REGRESSION * self._regressed(block) if apart is None else None
            answers.append(median_votes(votes, self._places, further))
        away = np.where(np.isfinite(near.away), near.away, 1.0)
        return KrigedAnswer(joined_rows(answers), away)

    def _regressed(self, scans: RadioScans) -> FloatArray:
        """(n, s) shares of storeys by the regression."""
        share = np.maximum(self._storeys(levels(scans)), 0.0)
        return np.asarray(share / np.maximum(share.sum(axis=1, keepdims=True), LEAST_WEIGHT))

    def _weights(self, scans: RadioScans, which: IntArray, away: FloatArray) -> FloatArray:
        """(n, k) weights by ordinary kriging from the scans ``which`` (n, k); 0 if infinitely ``away`` (n, k)."""
        used, place = np.unique(which, return_inverse=True)
        learned, own = _directions(self._powed[used]), _directions(_powed(scans))
        near = learned[place.reshape(which.shape)]
        among = np.exp(2 * SHARPNESS * (near @ near.transpose(0, 2, 1) - 1)) + RIDGE * np.eye(which.shape[1])
        towards = np.exp(2 * SHARPNESS * ((near @ own[:, :, None])[:, :, 0] - 1)) + RIDGE * np.exp(-away / REACH)
        right = np.stack([towards, np.ones_like(towards)], axis=2)
        simple, one = np.moveaxis(np.linalg.solve(among, right), 2, 0)
        missing = (1 - simple.sum(axis=1, keepdims=True)) / one.sum(axis=1, keepdims=True)
        weight = np.maximum(simple + missing * one, LEAST_WEIGHT)
        return np.where(np.isfinite(away), weight, 0.0)

    def _predict(self, scans: RadioScans) -> Positions:
        answer = self._kriged(scans)
        unlike = answer.features[:, NEAREST] > self.like_
        return answer.voted.positions(self._places, self.radii_.radii_m(answer.features, scans.session), unlike)

    def learned(self) -> LabelledScans:
        """Return all learned scans."""
        return self._scans, self._places

    def arrays(self) -> NamedArrays:
        """Return the scans learned and their places, the regression onto storeys, and the radii."""
        return {
            **self._scans.arrays(),
            **self._places.arrays(),
            "exponent": np.array([self.exponent_]),
            "storey_centre": self._centres,
            "storey_weight": self._storeys.weight,
            "storey_mean": self._storeys.mean,
            **self.radii_.arrays(),
            "like": np.array([self.like_]),
        }

    def restore(self, arrays: Mapping[str, AnyArray]) -> None:
        """Restore from the result of :meth:`arrays`."""
        self._check()
        checked = CheckedArrays(arrays, s=len(self.storeys_))
        scans = RadioScans.restored(checked, self.access_points_)
        places = ScanPlaces.restored(checked, self.storeys_)
        self._learn(scans, places, float(checked.floats("exponent", 1, least=0.1)[0]))
        self._centres = checked.integers("storey_centre", "m", below=len(scans))
        kernel = StoreyKernel.around(levels(scans[self._centres]))
        weight, mean = checked.floats("storey_weight", "m", "s"), checked.floats("storey_mean", "s")
        self._storeys = KernelRegression(kernel, weight, mean)
        self.radii_ = HeldOutRadii.restored(checked)
        self.like_ = float(checked.floats("like", 1)[0])


def _asked_rows(scans: RadioScans, places: ScanPlaces, most: int) -> IntArray:
    """Return which scans (k,) are left out in turn, evenly spread, so that enough others of their storey remain."""
    rows, among = calibration_rows(len(scans)), ~lone_walks(scans, places)
    if among[rows].sum() >= _CHOSEN_WITH / 4:
        rows = rows[among[rows]]
    return rows[:: -(-len(rows) // most)] if len(rows) else rows


def _powed(scans: RadioScans) -> RadioScans:
    """Replace levels in dBm by powed levels, once, because they are used repeatedly."""
    return replace(scans, rssi_dbm=represented_levels(scans.rssi_dbm, Representation.POSITIVE) ** EXPONENT)


def _directions(powed: RadioScans) -> FloatArray:
    """(n, a) of length 1."""
    return directions(powed.dense(not_heard=0.0), 1.0)


register("local-kriging", LocalKriging)
