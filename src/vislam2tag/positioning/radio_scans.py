"""Radio scans as sparse arrays of levels, for many scans at once.

RSSI can be represented by numbers that a model can compare (Torres-Sospedra et al. 2015), and scans can be augmented.
Arrays of a model's file are checked one by one before they are used.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Self, TypeVar

import numpy as np
import numpy.typing as npt

from vislam2tag.core.arrays import AnyArray, BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Size = int | str
"""Size of an axis: a number, or a letter for the same number in all arrays, which the first array sets."""

_GREATEST = 1e100
"""Larger numbers may have infinite products and squares."""


class CheckedArrays:
    """Named arrays with checks of type, shape and range; raises ValueError if one does not fit."""

    def __init__(self, arrays: Mapping[str, AnyArray], **sizes: int) -> None:
        """Set the arrays, and the known sizes of axes."""
        self._arrays = arrays
        self.sizes = dict(sizes)

    def floats(self, name: str, *shape: Size, least: float = -math.inf, unknown: bool = False) -> AnyArray:
        """Return finite numbers of ``least`` or more; with ``unknown`` NaN is allowed."""
        array = self._taken(name, "f", shape)
        if array.dtype.itemsize < 4:
            raise ValueError(f"{name} contains {array.dtype} values, expected single or double precision")
        usable = (np.abs(array) <= _GREATEST) & (array >= least)
        if not (usable | np.isnan(array) if unknown else usable).all():
            raise ValueError(f"{name} contains numbers that are not finite, or out of range")
        return array

    def integers(self, name: str, *shape: Size, least: int = 0, below: float = math.inf) -> AnyArray:
        """Return whole numbers from ``least`` to ``below``, exclusive."""
        array = self._taken(name, "iu", shape)
        if array.size and not (least <= int(array.min()) and int(array.max()) < below):
            raise ValueError(f"{name} contains numbers out of range")
        return array

    def booleans(self, name: str, *shape: Size) -> AnyArray:
        """Return truth values."""
        return self._taken(name, "b", shape)

    def __contains__(self, name: str) -> bool:
        return name in self._arrays

    def _taken(self, name: str, kinds: str, shape: tuple[Size, ...]) -> AnyArray:
        if name not in self._arrays:
            raise ValueError(f"{name} is missing")
        array = self._arrays[name]
        if array.dtype.kind not in kinds:
            raise ValueError(f"{name} contains {array.dtype} values")
        if array.ndim != len(shape):
            raise ValueError(f"{name} has {array.ndim} axes, expected {len(shape)}")
        for size, found in zip(shape, array.shape, strict=True):
            known = self.sizes.setdefault(size, found) if isinstance(size, str) else size
            if found != known or not found:
                raise ValueError(f"{name} has the shape {array.shape}, which does not fit the other arrays")
        return array


TextArray = npt.NDArray[np.str_]
Rows = IntArray | BoolArray | slice
RecordT = TypeVar("RecordT", bound="DataclassInstance")


def rows_of(record: RecordT, rows: Rows) -> RecordT:
    """Select rows of a record with arrays of equal length; fields that are not arrays are kept."""
    values = {each.name: getattr(record, each.name) for each in fields(record)}
    return replace(record, **{name: value[rows] for name, value in values.items() if isinstance(value, np.ndarray)})


def joined_rows(parts: Sequence[RecordT]) -> RecordT:
    """Concatenate the rows of records; there is at least one."""
    names = [each.name for each in fields(parts[0]) if isinstance(getattr(parts[0], each.name), np.ndarray)]
    return replace(parts[0], **{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


_DEVICE, _WALK = "device", "walk"


@dataclass(frozen=True)
class RadioScans:
    """``n`` scans over ``a`` access points; only heard levels are stored, row after row.

    It can be used as scikit-learn's ``X``: it has a length and a shape, and rows can be selected by index or mask.
    """

    access_points: tuple[str, ...]
    """Name of each column."""
    start: IntArray
    """(n + 1,) readings ``start[i]`` to ``start[i + 1]`` are those of scan i."""
    column: IntArray
    """(m,) access point of each reading, at most once in a scan."""
    rssi_dbm: FloatArray
    """(m,)"""
    device: TextArray
    """(n,) phone; empty if unknown."""
    session: TextArray
    """(n,) walk; empty if unknown."""
    time_ns: IntArray
    """(n,) start of the scan; 0 if unknown."""

    def __len__(self) -> int:
        return len(self.start) - 1

    @property
    def shape(self) -> tuple[int, int]:
        """Number of scans and of access points."""
        return len(self), len(self.access_points)

    @property
    def heard(self) -> IntArray:
        """(n,) number of access points heard in each scan."""
        return np.diff(self.start)

    @property
    def row(self) -> IntArray:
        """(m,) scan of each reading."""
        return np.repeat(np.arange(len(self)), self.heard)

    def __getitem__(self, rows: Rows) -> RadioScans:
        chosen = np.arange(len(self))[rows]
        counts = self.heard[chosen]
        start = np.concatenate([[0], np.cumsum(counts)])
        taken = np.repeat(self.start[chosen] - start[:-1], counts) + np.arange(start[-1])
        return RadioScans(
            access_points=self.access_points,
            start=start,
            column=self.column[taken],
            rssi_dbm=self.rssi_dbm[taken],
            device=self.device[chosen],
            session=self.session[chosen],
            time_ns=self.time_ns[chosen],
        )

    def over(self, access_points: Sequence[str]) -> RadioScans:
        """Return the scans over other columns; readings of other access points are dropped."""
        place = {name: column for column, name in enumerate(access_points)}
        new = np.array([place.get(name, -1) for name in self.access_points], dtype=np.int64)
        column = new[self.column] if len(self.column) else self.column
        return replace(self, access_points=tuple(access_points), column=column).only(column >= 0)

    def only(self, readings: BoolArray) -> RadioScans:
        """Keep only the readings in the mask (m,)."""
        heard = np.bincount(self.row[readings], minlength=len(self))
        return replace(
            self,
            start=np.concatenate([[0], np.cumsum(heard)]),
            column=self.column[readings],
            rssi_dbm=self.rssi_dbm[readings],
        )

    def arrays(self) -> dict[str, AnyArray]:
        """Return arrays for saving; devices and sessions become numbers, and times are dropped."""
        return {
            "start": self.start,
            "column": self.column.astype(np.int32),
            "rssi_dbm": self.rssi_dbm,
            _DEVICE: _numbered(self.device),
            _WALK: _numbered(self.session),
        }

    @classmethod
    def restored(cls, arrays: CheckedArrays, access_points: Sequence[str]) -> Self:
        """Restore from the result of :meth:`arrays`; ``n`` is their number. Raises ValueError if it does not fit.

        Older files contain neither devices nor sessions.
        """
        column = arrays.integers("column", "readings", below=len(access_points)).astype(np.int64)
        rssi_dbm = arrays.floats("rssi_dbm", "readings")
        start = arrays.integers("start", "ends", below=len(column) + 1)
        n = arrays.sizes.setdefault("n", len(start) - 1)
        if start[0] != 0 or start[-1] != len(column) or (np.diff(start) < 0).any() or len(start) != n + 1:
            raise ValueError("start does not fit the number of readings")
        return cls(
            access_points=tuple(access_points),
            start=start,
            column=column,
            rssi_dbm=rssi_dbm,
            device=_named(arrays, _DEVICE, n),
            session=_named(arrays, _WALK, n),
            time_ns=np.zeros(n, dtype=np.int64),
        )

    def dense(self, not_heard: float = np.nan) -> FloatArray:
        """Make the (n, a) matrix of levels, dBm; ``not_heard`` if there is no reading."""
        matrix = np.full(self.shape, not_heard)
        matrix[self.row, self.column] = self.rssi_dbm
        return matrix


def joined_scans(parts: Sequence[RadioScans]) -> RadioScans:
    """Concatenate scans, over the access points of all, sorted by name."""
    access_points = sorted({name for part in parts for name in part.access_points})
    whole = [part.over(access_points) for part in parts]
    heard = np.concatenate([part.heard for part in whole])
    return replace(joined_rows(whole), start=np.concatenate([[0], np.cumsum(heard)]))


def _numbered(names: TextArray) -> IntArray:
    """(n,) a number for each name, -1 if it is empty."""
    return np.where(names == "", -1, np.unique(names, return_inverse=True)[1]).astype(np.int32)


def _named(arrays: CheckedArrays, kind: str, n: int) -> TextArray:
    """(n,) unique names made from numbers; empty if there are none."""
    if kind not in arrays:
        return np.full(n, "", dtype=np.str_)
    number = arrays.integers(kind, "n", least=-1)
    return np.where(number < 0, "", np.char.add(f"learned {kind} ", number.astype(np.str_)))


def scans_from_readings(
    rows: IntArray,
    bssid: TextArray,
    rssi_dbm: FloatArray,
    n: int,
    **known: Any,
) -> RadioScans:
    """Make ``n`` scans from readings in any order: scan (0 to n-1), access point and level of each (k,).

    Columns are the access points sorted by name. Several readings of one access point in a scan are averaged in dBm;
    levels that are not finite count as not heard. ``known`` may contain ``device``, ``session`` and ``time_ns`` (n,).
    """
    finite = np.isfinite(rssi_dbm)
    names, column = np.unique(bssid[finite], return_inverse=True)
    cell, which = np.unique(rows[finite] * max(len(names), 1) + column, return_inverse=True)
    level = np.bincount(which, rssi_dbm[finite]) / np.bincount(which) if len(cell) else np.empty(0)
    heard = np.bincount(cell // max(len(names), 1), minlength=n)
    empty = np.full(n, "", dtype=np.str_)
    return RadioScans(
        access_points=tuple(str(name) for name in names),
        start=np.concatenate([[0], np.cumsum(heard)]),
        column=cell % max(len(names), 1),
        rssi_dbm=level,
        device=known.get("device", empty),
        session=known.get("session", empty),
        time_ns=known.get("time_ns", np.zeros(n, dtype=np.int64)),
    )


def scans_of_walk(scan: IntArray, bssid: TextArray, rssi_dbm: FloatArray, time_ns: IntArray, device: str) -> RadioScans:
    """Make the scans of one walk of a ``device`` from readings (k,), in order of their numbers ``scan`` (k,).

    Each has the mean time of its readings.
    """
    rows = np.unique(scan, return_inverse=True)[1]
    count = int(rows.max(initial=-1)) + 1
    start_ns = int(time_ns.min(initial=np.iinfo(np.int64).max))
    later_ns = np.bincount(rows, time_ns - start_ns, count) / np.bincount(rows, minlength=count)
    return scans_from_readings(
        rows,
        bssid,
        rssi_dbm,
        count,
        device=np.full(count, device),
        time_ns=start_ns + later_ns.astype(np.int64),
    )


FAINTEST_DBM = -105.0
"""Level that counts as zero; phones report no lower one."""
EXPONENT = float(np.e)
"""Exponent of the powed representation."""
SOFTNESS_DBM = 24.0
"""Scale of the exponential representation."""
_NOISE, _OFFSET = 0.03, 0.04
"""Standard deviation of single levels, and of a scan's common offset (3 dB and 4 dB, in units of 105 dB)."""
_FAINTEST = 0.005
_MOST_MISSED = 0.4
"""Each augmented scan misses a share of its access points, drawn from 0 to this."""


class Representation(StrEnum):
    """Conversion of a level to a number from 0 (not heard) to 1 (0 dBm)."""

    POSITIVE = "positive"
    """Linear in dBm."""
    POWED = "powed"
    """The positive representation to the power of e; differences between strong levels count more."""
    EXPONENTIAL = "exponential"
    """Still closer to received power."""


def represented(scans: RadioScans, representation: Representation) -> FloatArray:
    """Make the (n, a) matrix of numbers from 0 to 1; 0 if an access point is not heard."""
    return represented_levels(scans.dense(FAINTEST_DBM), representation)


def represented_levels(level_dbm: FloatArray, representation: Representation) -> FloatArray:
    """Convert levels, dBm, in an array of any shape to numbers from 0 to 1."""
    above = np.clip(level_dbm - FAINTEST_DBM, 0.0, -FAINTEST_DBM)
    if representation is Representation.EXPONENTIAL:
        return np.where(above > 0, np.exp((above + FAINTEST_DBM) / SOFTNESS_DBM), 0.0)
    share = above / -FAINTEST_DBM
    return share**EXPONENT if representation is Representation.POWED else share


def augmented(level: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return augmented levels (n, a) from 0 to 1: some access points missed, a common offset, noise."""
    n = len(level)
    heard = (level > 0) & (rng.random(level.shape) > _MOST_MISSED * rng.random((n, 1)))
    offset = _OFFSET * rng.standard_normal((n, 1))
    noise = _NOISE * rng.standard_normal(level.shape)
    return np.where(heard, np.clip(level + offset + noise, _FAINTEST, 1.0), 0.0)
