"""The magnetic field that a walk felt along its way, without what depends on where the phone points.

Gravity says what of the field is vertical and what horizontal; no heading is needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
import polars as pl

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.sessions.tables.sensor_table import readings_of
from vislam2tag.walk_ties.traces import WalkTrace

STEP_M = 0.25
"""The field is taken once in so much of the way: much less than it varies over."""
MOST_STEPS = 16_384
"""Of a walk; what comes after 4 km is not told."""
LEVEL_S = 1.0
"""Gravity is what the accelerometer shows on average over so long."""
FEWEST_READINGS = 100
COURSE_M = 1.0
"""The course is the direction from the place so far behind to that so far ahead."""


@dataclass(frozen=True)
class FeltField:
    """The magnetic field at ``n`` readings: ``time_ns`` (n,) boot clock, ``field_ut`` (n, 2) its vertical and its
    horizontal part, microtesla.
    """

    time_ns: IntArray
    field_ut: FloatArray

    @classmethod
    def of(cls, sensors: pl.DataFrame) -> Self | None:
        """Take the readings out of a ``sensors`` table; None where there are none, or nothing says what is vertical."""
        time_ns, field = readings_of(sensors, "MAG", ("v1", "v2", "v3"))
        if len(time_ns) < FEWEST_READINGS:
            time_ns, raw = readings_of(sensors, "MAG_UN", ("v1", "v2", "v3", "v4", "v5", "v6"))
            field = raw[:, :3] - raw[:, 3:]
        up = _up(sensors, time_ns) if len(time_ns) >= FEWEST_READINGS else None
        if up is None:
            return None
        vertical = np.einsum("ni,ni->n", up, field)
        horizontal = np.sqrt(np.maximum((field**2).sum(axis=1) - vertical**2, 0.0))
        known = np.isfinite(vertical)
        return cls(time_ns[known], np.column_stack((vertical, horizontal))[known])


@dataclass(frozen=True)
class FeltWay:
    """A walk's way in ``n`` steps.

    ``time_ns`` (n,) boot clock; ``place`` (n, 2) metres; ``course`` (n, 2) unit vectors; ``sigma_m`` (n,) per axis;
    ``way_m`` (n,) of the trace until then; ``field_ut`` (n, 2) as of :class:`FeltField`, NaN where nothing was felt.
    """

    time_ns: IntArray
    place: FloatArray
    course: FloatArray
    sigma_m: FloatArray
    way_m: FloatArray
    field_ut: FloatArray

    @classmethod
    def of(cls, trace: WalkTrace, felt: FeltField) -> Self:
        """Average the readings of each step of a way."""
        way_m = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(trace.position_bcs, axis=0).T))))
        count = min(int(way_m[-1] / STEP_M) + 1, MOST_STEPS)
        later_ns = np.interp(np.arange(count) * STEP_M, way_m, (trace.time_ns - trace.time_ns[0]).astype(np.float64))
        time_ns = trace.time_ns[0] + later_ns.astype(np.int64)
        at_m = np.interp(felt.time_ns - trace.time_ns[0], trace.time_ns - trace.time_ns[0], way_m)
        step = np.rint(at_m / STEP_M).astype(np.int64)
        on_way = trace.along(time_ns)
        return cls(
            time_ns=time_ns,
            place=on_way[:, :2],
            course=_course(on_way[:, :2]),
            sigma_m=on_way[:, 2],
            way_m=on_way[:, 3],
            field_ut=_means(step, felt.field_ut, trace.knows(felt.time_ns) & (step < count), count),
        )


def _means(step: IntArray, field_ut: FloatArray, known: BoolArray, count: int) -> FloatArray:
    """(count, 2) means of the known ones of readings (k, 2) in each step; NaN in those without any."""
    readings = np.bincount(step[known], minlength=count).astype(np.float64)
    readings[readings == 0] = np.nan
    return np.column_stack([np.bincount(step[known], axis, count) for axis in field_ut[known].T]) / readings[:, None]


def _course(place: FloatArray) -> FloatArray:
    """(n, 2) unit vectors along a way (n, 2); zero where it leads nowhere."""
    reach = round(COURSE_M / STEP_M)
    row = np.arange(len(place))
    ahead = place[np.minimum(row + reach, len(row) - 1)] - place[np.maximum(row - reach, 0)]
    return np.asarray(ahead / np.maximum(np.hypot(*ahead.T), 1e-9)[:, None])


def _up(sensors: pl.DataFrame, time_ns: IntArray) -> FloatArray | None:
    """(n, 3) the direction up in the phone's axes at some moments (n,); None where no sensor tells it."""
    for name in ("GAME_ROT", "ROT"):
        known_ns, vector = readings_of(sensors, name, ("v1", "v2", "v3", "v4"))
        if len(known_ns) >= FEWEST_READINGS:
            x, y, z, real = vector.T  # the real part need not be written
            w = np.where(real < 0, -1.0, 1.0) * np.sqrt(np.clip(1 - x**2 - y**2 - z**2, 0.0, 1.0))
            up = np.column_stack((2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x**2 + y**2)))
            return _at(known_ns, up, time_ns)
    known_ns, force = readings_of(sensors, "ACC", ("v1", "v2", "v3"))
    if len(known_ns) < FEWEST_READINGS:
        return None
    wide = max(round(LEVEL_S / max(float(np.median(np.diff(known_ns))) * 1e-9, 1e-3)), 1)
    mean = np.column_stack([np.convolve(axis, np.ones(wide) / wide, mode="same") for axis in force.T])
    return _at(known_ns, mean, time_ns)


def _at(known_ns: IntArray, direction: FloatArray, time_ns: IntArray) -> FloatArray:
    """(n, 3) unit vectors at some moments (n,), between those (k, 3) that are known."""
    axes = [np.interp(time_ns - known_ns[0], known_ns - known_ns[0], axis) for axis in direction.T]
    found = np.column_stack(axes)
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))
