"""Array aliases used across the numeric core, the runs of a mask, and rows of values made of arrays."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.int64]
BoolArray: TypeAlias = npt.NDArray[np.bool_]
StatusArray: TypeAlias = npt.NDArray[np.int8]
ComplexArray: TypeAlias = npt.NDArray[np.complex128]
AnyArray: TypeAlias = npt.NDArray[Any]


_Value = TypeVar("_Value", bound="DataclassInstance")


def with_rows(value: _Value, rows: AnyArray | slice, *names: str) -> _Value:
    """The same value with some rows only of its arrays of these names; a name whose array is None or empty is kept."""
    arrays = {name: array for name in names if (array := getattr(value, name)) is not None and len(array)}
    # take is many times quicker than array[rows] where an array has columns.
    return replace(value, **{name: array.take(np.arange(len(array))[rows], axis=0) for name, array in arrays.items()})


def runs_of(mask: BoolArray) -> list[tuple[int, int]]:
    """Start (included) and stop (excluded) of each run of true values in a mask (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return [(int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]


def joint_columns(rows: IntArray, count: int) -> IntArray:
    """(3k,) where x, y of some landmarks (k,), then their headings, stand among those of all ``count``."""
    return np.concatenate(((2 * rows[:, None] + (0, 1)).ravel(), 2 * count + rows)).astype(np.int64)


def of_landmarks(joint: FloatArray, rows: IntArray) -> FloatArray:
    """Of a covariance (3m, 3m) of x, y of each landmark, then of all headings, the part (3k, 3k) of some (k,)."""
    column = joint_columns(rows, len(joint) // 3)
    return np.asarray(joint[np.ix_(column, column)])
