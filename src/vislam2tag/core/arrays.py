"""Array aliases used across the numeric core, and the runs of a mask."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.int64]
BoolArray: TypeAlias = npt.NDArray[np.bool_]
StatusArray: TypeAlias = npt.NDArray[np.int8]
ComplexArray: TypeAlias = npt.NDArray[np.complex128]
AnyArray: TypeAlias = npt.NDArray[Any]


def runs_of(mask: BoolArray) -> list[tuple[int, int]]:
    """Start (included) and stop (excluded) of each run of true values in a mask (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return [(int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]
