"""Trees as plain arrays lead where scikit-learn's lead."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.ensemble import ExtraTreesRegressor

from vislam2tag.positioning.baselines.forest import Forest, forest_of
from vislam2tag.positioning.checked_arrays import CheckedArrays


@pytest.mark.parametrize("leaf", [1, 4])
def test_leaves_are_those_of_scikit_learn(leaf: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    levels = rng.integers(0, 6, (80, 5)).astype(np.float32)
    grown = ExtraTreesRegressor(7, min_samples_leaf=leaf, random_state=1).fit(levels, rng.normal(size=(80, 2)))
    forest = Forest.restored(CheckedArrays(forest_of(grown.estimators_).arrays(), a=levels.shape[1]))
    new = rng.uniform(-1, 7, (50, 5)).astype(np.float32)
    for asked in (levels, new, new[:0], new[:1]):
        expected = grown.apply(asked) if len(asked) else np.empty((0, 7))
        np.testing.assert_array_equal(forest.leaves(asked) - forest.root, expected)
    whole = forest.leaves(new)
    monkeypatch.setattr("vislam2tag.positioning.baselines.forest._AT_ONCE", 21)
    np.testing.assert_array_equal(forest.leaves(new), whole)


def test_a_tree_of_one_leaf() -> None:
    grown = ExtraTreesRegressor(2, random_state=1).fit(np.zeros((3, 2), np.float32), np.ones(3))
    assert forest_of(grown.estimators_).leaves(np.ones((2, 2), np.float32)).tolist() == [[0, 1], [0, 1]]
