"""Extremely randomised trees (Geurts et al. 2006) whose leaves vote for the place of the training scan they hold.

One forest learns the storey and the position at once. Its leaves' scans are weighed as neighbours are (Lin and Jeon
2006, "Random forests and adaptive nearest neighbors"), so that a position is never a mean over storeys.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from sklearn.ensemble import ExtraTreesRegressor

from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import AnyArray, FloatArray, IntArray
from vislam2tag.positioning.baselines.forest import LEAF, Forest, Levels, forest_of
from vislam2tag.positioning.baselines.votes import VotedPositions, Votes, counted_votes, joined_answers
from vislam2tag.positioning.baselines.voting_positioner import VotingPositioner
from vislam2tag.positioning.checked_arrays import CheckedArrays
from vislam2tag.positioning.error_radii import SpreadRadii
from vislam2tag.positioning.registry import NamedArrays, register
from vislam2tag.positioning.scans.held_out import folds, walk_numbers
from vislam2tag.positioning.scans.places import ScanPlaces
from vislam2tag.positioning.scans.radio_scans import RadioScans
from vislam2tag.positioning.scans.representation import Representation, represented

FOLDS = 5
"""Forests that are grown without some walks to calibrate the radii, where no validation part is given."""
FOLD_TREES = 40
"""Most trees of these: more make little difference to their errors."""
MOST_TREES = 100_000
_AT_ONCE = 2000


class ExtraTrees(VotingPositioner):
    """A forest over levels; each tree gives one vote, radii follow how far the votes lie apart."""

    def __init__(self, *, trees: int = 200, levels_a_split: float = 0.3, storey_m: float = 15.0, seed: int = 0) -> None:
        """Take the number of trees, which share of the access points each split tries, and the random seed.

        ``storey_m`` is how far apart storeys count when a split is judged, metres. The defaults are best in
        cross-validation over walks on training parts (docs/results/positioning-settings.md); leaves hold one place.
        """
        self.trees = trees
        self.levels_a_split = levels_a_split
        self.storey_m = storey_m
        self.seed = seed

    def _check(self) -> None:
        if not (1 <= self.trees <= MOST_TREES and 0 < self.levels_a_split <= 1 and self.storey_m >= 0):
            raise UsageError(
                f"trees={self.trees}, levels_a_split={self.levels_a_split}, storey_m={self.storey_m}: "
                f"there are 1 to {MOST_TREES} trees, the share lies above 0 and up to 1, the distance is 0 or more"
            )

    def _learn(self, scans: RadioScans, places: ScanPlaces) -> None:
        super()._learn(scans, places)
        self._forest, self._scan = self._grown(_levels(scans), places, self.trees)

    def _grown(self, levels: Levels, places: ScanPlaces, trees: int) -> tuple[Forest, AnyArray]:
        """Grow a forest; return it and for each leaf a scan that it holds (nodes,)."""
        storey = np.eye(len(places.storeys))[places.storey] * (self.storey_m / np.sqrt(2))
        grower = ExtraTreesRegressor(trees, max_features=self.levels_a_split, random_state=self.seed, n_jobs=-1)
        grower.fit(levels, np.column_stack([places.xy, storey]))
        forest = forest_of(grower.estimators_)
        scan = np.full(len(forest.feature), -1, dtype=np.int32)
        # Several scans share a leaf only where place or levels are the same; the first of them speaks.
        scan[forest.leaves(levels)[::-1]] = np.arange(len(levels), dtype=np.int32)[::-1, None]
        return forest, scan

    def _left_out(self, scans: RadioScans, places: ScanPlaces) -> tuple[FloatArray, FloatArray]:
        levels = _levels(scans)
        error_m, spread_m = np.full(len(scans), np.nan), np.zeros(len(scans))
        for number, (learned, held_out) in enumerate(folds(walk_numbers(scans, places), FOLDS, self.seed)):
            forest, scan = self._grown(levels[learned], places[learned], min(self.trees, FOLD_TREES))
            answer = _voted(forest, scan, places[learned], levels[held_out])
            error_m[held_out], spread_m[held_out] = places[held_out].distance_m(answer.xy), answer.spread_m
            self.progress(number + 1, FOLDS)
        return error_m, spread_m

    def _answer(self, scans: RadioScans) -> VotedPositions:
        blocks = (scans[start : start + _AT_ONCE] for start in range(0, max(len(scans), 1), _AT_ONCE))
        return joined_answers([_voted(self._forest, self._scan, self._places, _levels(block)) for block in blocks])

    def arrays(self) -> NamedArrays:
        """Return the trees, the scan of each leaf, all scans' places, and the radii."""
        return {
            **self._forest.arrays(),
            "scan": self._scan,
            **self._places.arrays(),
            "radii": self.radii_.array(),
        }

    def restore(self, arrays: Mapping[str, AnyArray]) -> None:
        """Take back what :meth:`arrays` gave."""
        checked = CheckedArrays(arrays, a=len(self.access_points_))
        self._places = ScanPlaces.restored(checked, self.storeys_)
        self._forest = Forest.restored(checked)
        self._scan = checked.integers("scan", "nodes", least=LEAF, below=len(self._places))
        if (self._scan[self._forest.feature == LEAF] < 0).any():
            raise ValueError("a leaf holds no scan")
        self.radii_ = SpreadRadii.restored(checked, "radii")


def _levels(scans: RadioScans) -> Levels:
    """(n, a) levels from 0 to 1."""
    return represented(scans, Representation.POSITIVE).astype(np.float32)


def _voted(forest: Forest, scan: AnyArray, places: ScanPlaces, levels: Levels) -> VotedPositions:
    """Let the scans of the leaves that levels (n, a) reach vote; ``scan`` (nodes,)."""
    index: IntArray = scan[forest.leaves(levels)].astype(np.int64)
    return counted_votes(Votes(index, np.ones(index.shape)), places)


register("extra-trees", ExtraTrees)
