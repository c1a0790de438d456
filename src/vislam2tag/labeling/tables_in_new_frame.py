"""Tables of labels and of data sets in another frame: every column that depends on it, row by row by its floor."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import polars as pl

from vislam2tag.site.frame_change import FrameChange

_POINTS = (("x", "y"), ("x_median", "y_median"), ("x_start", "y_start"), ("x_end", "y_end"))
_LENGTHS = (
    "sigma",
    "sigma_start",
    "sigma_end",
    "spread",
    "displacement_x",
    "displacement_y",
    "speed_m_s",
    "distance_m",
    "labelled_m",
)
"""Grow with the scale, wherever they point."""
_COVARIANCE = ("cov_xx", "cov_xy", "cov_yy")
_QUATERNION = ("qx", "qy", "qz", "qw")


@dataclass(frozen=True)
class _Values:
    """What a change's parts are in each row: expressions by the row's floor.

    Rows of another building than ``building`` keep what they have.
    """

    changes: Mapping[int, FrameChange]
    building: str | None

    def _of(self, part: Callable[[FrameChange], float], unchanged: float) -> pl.Expr:
        chosen: pl.Expr = pl.lit(None, pl.Float64)
        for number, change in self.changes.items():
            chosen = pl.when(pl.col("floor") == number).then(pl.lit(part(change))).otherwise(chosen)
        if self.building is None:
            return chosen
        here = pl.col("building").fill_null("") == self.building
        return pl.when(here).then(chosen).otherwise(pl.lit(unchanged))

    def real(self) -> pl.Expr:
        """Real part of scale times rotation."""
        return self._of(lambda change: change.new_T_old.a.real, 1.0)

    def imaginary(self) -> pl.Expr:
        """Imaginary part of scale times rotation."""
        return self._of(lambda change: change.new_T_old.a.imag, 0.0)

    def shift(self) -> tuple[pl.Expr, pl.Expr]:
        """Translation, metres."""
        return self._of(lambda change: change.x_m, 0.0), self._of(lambda change: change.y_m, 0.0)

    def scale(self) -> pl.Expr:
        """Factor of lengths."""
        return self._of(lambda change: change.scale, 1.0)

    def angle(self) -> pl.Expr:
        """Rotation, radians."""
        return self._of(lambda change: change.new_T_old.rotation_rad, 0.0)

    def rise(self) -> pl.Expr:
        """What heights gain, metres."""
        return self._of(lambda change: change.rise_m, 0.0)


def changed_table(table: pl.LazyFrame, changes: Mapping[int, FrameChange], building: str | None = None) -> pl.LazyFrame:
    """A table with column ``floor`` in the new frame; ``building``: only its rows of that building change.

    Positions, sigmas, covariances, headings, orientations, lengths and heights change; null and NaN stay. Rows of
    floors without a change must have none of them.
    """
    columns = table.collect_schema().names()
    values = _Values(changes, building)
    changed: list[pl.Expr] = []
    for pair in _POINTS:
        if set(pair) <= set(columns):
            changed += _points(pair, values)
    changed += [(pl.col(name) * values.scale()).alias(name) for name in _LENGTHS if name in columns]
    if "z" in columns:
        changed.append(pl.col("z") + values.rise())
    if set(_COVARIANCE) <= set(columns):
        changed += _covariance(values)
    if set(_QUATERNION) <= set(columns):
        changed += _orientation(values)
    if "heading_deg" in columns:
        changed.append((pl.col("heading_deg") + values.angle() * (180 / math.pi)) % 360.0)
    if "heading_rad" in columns:
        turned = pl.col("heading_rad") + values.angle() + math.pi
        changed.append((turned % math.tau - math.pi).alias("heading_rad"))
    return table.with_columns(changed)


def _points(pair: tuple[str, str], values: _Values) -> list[pl.Expr]:
    x, y = (pl.col(name) for name in pair)
    a, b = values.real(), values.imaginary()
    x_m, y_m = values.shift()
    return [(a * x - b * y + x_m).alias(pair[0]), (b * x + a * y + y_m).alias(pair[1])]


def _covariance(values: _Values) -> list[pl.Expr]:
    """``R C R^T`` by its elements, times the square of the scale."""
    xx, xy, yy = (pl.col(name) for name in _COVARIANCE)
    a, b = values.real(), values.imaginary()
    return [
        (a * a * xx - 2 * a * b * xy + b * b * yy).alias("cov_xx"),
        (a * b * (xx - yy) + (a * a - b * b) * xy).alias("cov_xy"),
        (b * b * xx + 2 * a * b * xy + a * a * yy).alias("cov_yy"),
    ]


def _orientation(values: _Values) -> list[pl.Expr]:
    """The turn about the vertical after the camera's own orientation, as a product of quaternions."""
    qx, qy, qz, qw = (pl.col(name) for name in _QUATERNION)
    sine, cosine = (values.angle() / 2).sin(), (values.angle() / 2).cos()
    return [
        (cosine * qx - sine * qy).alias("qx"),
        (cosine * qy + sine * qx).alias("qy"),
        (cosine * qz + sine * qw).alias("qz"),
        (cosine * qw - sine * qz).alias("qw"),
    ]
