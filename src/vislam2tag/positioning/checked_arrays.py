"""Arrays of a model's file, taken one by one with what they must be: nothing is used that does not fit the rest."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from vislam2tag.core.arrays import AnyArray

Size = int | str
"""Of an axis: a number, or a letter that stands for the same number in all arrays; the first array sets it."""

_GREATEST = 1e100
"""Numbers whose products and squares are finite, too."""


class CheckedArrays:
    """Named arrays; each is taken with its kind, shape and range. Raises ValueError where it has others."""

    def __init__(self, arrays: Mapping[str, AnyArray], **sizes: int) -> None:
        """Take the arrays, and the sizes of axes that are known already."""
        self._arrays = arrays
        self.sizes = dict(sizes)

    def floats(self, name: str, *shape: Size, least: float = -math.inf, unknown: bool = False) -> AnyArray:
        """Take finite numbers of ``least`` or more; ``unknown``: NaN may stand for some."""
        array = self._taken(name, "f", shape)
        if array.dtype.itemsize < 4:
            raise ValueError(f"{name} has numbers of {array.dtype}, expected single or double precision")
        usable = (np.abs(array) <= _GREATEST) & (array >= least)
        if not (usable | np.isnan(array) if unknown else usable).all():
            raise ValueError(f"{name} has numbers that are not finite, or out of its range")
        return array

    def integers(self, name: str, *shape: Size, least: int = 0, below: float = math.inf) -> AnyArray:
        """Take whole numbers from ``least`` to ``below``, exclusive."""
        array = self._taken(name, "iu", shape)
        if array.size and not (least <= int(array.min()) and int(array.max()) < below):
            raise ValueError(f"{name} has numbers out of its range")
        return array

    def booleans(self, name: str, *shape: Size) -> AnyArray:
        """Take truth values."""
        return self._taken(name, "b", shape)

    def count(self, prefix: str) -> int:
        """How many arrays' names begin so."""
        return sum(name.startswith(prefix) for name in self._arrays)

    def _taken(self, name: str, kinds: str, shape: tuple[Size, ...]) -> AnyArray:
        if name not in self._arrays:
            raise ValueError(f"{name} is missing")
        array = self._arrays[name]
        if array.dtype.kind not in kinds:
            raise ValueError(f"{name} has numbers of {array.dtype}")
        if array.ndim != len(shape):
            raise ValueError(f"{name} has {array.ndim} axes, expected {len(shape)}")
        for size, found in zip(shape, array.shape, strict=True):
            known = self.sizes.setdefault(size, found) if isinstance(size, str) else size
            if found != known or not found:
                raise ValueError(f"{name} has the shape {array.shape}, which does not fit the rest")
        return array
