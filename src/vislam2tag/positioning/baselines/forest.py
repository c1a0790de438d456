"""Decision trees as plain arrays: kept without pickle, followed without scikit-learn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from vislam2tag.core.arrays import AnyArray, FloatArray, IntArray
from vislam2tag.positioning.checked_arrays import CheckedArrays

LEAF = -1
_AT_ONCE = 1_000_000

Levels = npt.NDArray[np.float32]
"""Trees compare numbers of single precision, as scikit-learn's do."""


@dataclass(frozen=True)
class Forest:
    """``t`` trees, their nodes one after the other."""

    root: AnyArray
    """(t,) first node of each tree."""
    feature: AnyArray
    """(nodes,) which number a node asks for; LEAF at the end."""
    threshold: FloatArray
    """(nodes,) numbers up to this go left."""
    left: AnyArray
    """(nodes,) next node."""
    right: AnyArray
    """(nodes,) next node."""

    def leaves(self, levels: Levels) -> IntArray:
        """Follow all trees for numbers (n, a); return the leaves reached (n, t) as node numbers."""
        size = max(1, _AT_ONCE // len(self.root))
        blocks = [self._followed(levels[start : start + size]) for start in range(0, max(len(levels), 1), size)]
        return np.concatenate(blocks)

    def _followed(self, levels: Levels) -> IntArray:
        """Leaves (n, t) reached by numbers (n, a)."""
        node = np.tile(self.root.astype(np.int64), (len(levels), 1))
        while True:
            feature = self.feature[node]
            inner = feature != LEAF
            if not inner.any():
                return node
            number = np.take_along_axis(levels, np.where(inner, feature, 0), axis=1)
            onward = np.where(number <= self.threshold[node], self.left[node], self.right[node])
            node = np.where(inner, onward, node)

    def arrays(self) -> dict[str, AnyArray]:
        """Return the arrays by name."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}

    @classmethod
    def restored(cls, arrays: CheckedArrays) -> Self:
        """Take back what :meth:`arrays` gave; ``nodes`` is the number of nodes, ``a`` that of numbers asked for.

        Raises ValueError where it does not fit: a node leads to later ones only, so that every way ends.
        """
        threshold = arrays.floats("threshold", "nodes")
        feature = arrays.integers("feature", "nodes", least=LEAF, below=arrays.sizes["a"])
        ways = [arrays.integers(name, "nodes", least=LEAF, below=len(threshold)) for name in ("left", "right")]
        for way in ways:
            if (way <= np.arange(len(threshold)))[feature != LEAF].any():
                raise ValueError("a node of a tree leads back, or nowhere")
        return cls(arrays.integers("root", "trees", below=len(threshold)), feature, threshold, *ways)


def forest_of(trees: Sequence[Any]) -> Forest:
    """Take the structure of scikit-learn's fitted trees."""
    sizes = [tree.tree_.node_count for tree in trees]
    root = np.cumsum([0, *sizes[:-1]])

    def all_of(name: str, kind: type) -> AnyArray:
        return np.concatenate([getattr(tree.tree_, name) for tree in trees]).astype(kind)

    left, right = (all_of(name, np.int32) for name in ("children_left", "children_right"))
    first = np.repeat(root, sizes).astype(np.int32)
    return Forest(
        root=root.astype(np.int32),
        feature=np.where(left == LEAF, LEAF, all_of("feature", np.int32)),
        threshold=all_of("threshold", np.float64),
        left=np.where(left == LEAF, LEAF, left + first),
        right=np.where(left == LEAF, LEAF, right + first),
    )
