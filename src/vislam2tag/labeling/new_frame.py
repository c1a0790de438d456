"""Tables and results of a session in another frame of the plan."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.transforms import Similarity2
from vislam2tag.labeling.results import ContradictionMark, Drawing, Polyline, SessionResult, Stretch
from vislam2tag.site.frame_change import FrameChange

Pair = tuple[float, float]
_DECIMALS = 2
"""Of drawn points, as where they are first made."""


def changed_result(result: SessionResult, changes: Mapping[int, FrameChange]) -> SessionResult:
    """A session's result in the new frame; ``changes`` by floor hold all floors that it tells of.

    Statistics of sigmas and of errors against truth are those of the old scale: where the scale changes they are left
    out, which is a finding.
    """
    own = changes[result.floor]
    rescaled = not np.isclose(own.scale, 1.0, rtol=0, atol=1e-6)
    findings = list(result.findings)
    if rescaled and (result.sigma is not None or result.errors is not None):
        message = "statistics of sigmas and errors are left out: the plan's scale changed; process the walk anew"
        findings.append(Finding(kind="statistics_left_out", file="", count=1, message=message, severity=Severity.INFO))
    turned = turned_result(result, changes)
    return turned.model_copy(
        update={
            "fingerprint": _fingerprint(result.fingerprint, changes),
            "distance_m": result.distance_m * own.scale,
            "sigma": None if rescaled else result.sigma,
            "errors": None if rescaled else result.errors,
            "findings": findings,
            "passes": None,
        }
    )


def turned_result(result: SessionResult, changes: Mapping[int, FrameChange]) -> SessionResult:
    """A result with every place that it tells of in the new frame of its floor."""
    own = changes[result.floor]
    return result.model_copy(
        update={
            "visits": [
                mark.model_copy(update={"position": _moved(mark.position, _on(mark.floor, own, changes))})
                for mark in result.visits
            ],
            "events": [
                mark.model_copy(update={"position": _moved(mark.position, _on(mark.floor, own, changes))})
                for mark in result.events
            ],
            "contradictions": [_contradiction(mark, changes[mark.floor]) for mark in result.contradictions],
            "drawing": _drawing(result.drawing, own),
            "elsewhere": {floor: _drawing(drawing, changes[floor]) for floor, drawing in result.elsewhere.items()},
        }
    )


def floors_of_result(result: SessionResult) -> set[int]:
    """Floors that a result tells of."""
    marked = [mark.floor for mark in result.visits]
    marked += [mark.floor for mark in result.events]
    marked += [mark.floor for mark in result.contradictions]
    return {result.floor, *result.elsewhere, *(floor for floor in marked if floor is not None)}


def _fingerprint(old: str, changes: Mapping[int, FrameChange]) -> str:
    """No longer what the old site's session would have: ``process`` must not take it for done."""
    said = "\n".join(changes[floor].model_dump_json() for floor in sorted(changes))
    return hashlib.sha256(f"{old}\n{said}".encode()).hexdigest()


def _on(floor: int | None, own: FrameChange, changes: Mapping[int, FrameChange]) -> Similarity2:
    return (own if floor is None else changes[floor]).new_T_old


def _moved(point: Pair | None, change: Similarity2) -> Pair | None:
    return None if point is None else _points([point], change)[0]


def _points(points: Polyline, change: Similarity2) -> Polyline:
    moved = (change @ np.array(points, dtype=np.float64).reshape(len(points), 2)).round(_DECIMALS) + 0.0
    return [(x, y) for x, y in moved.tolist()]


def _contradiction(mark: ContradictionMark, change: FrameChange) -> ContradictionMark:
    map_ = change.new_T_old
    (offset,) = _points([mark.offset_m], Similarity2(map_.a, 0j))
    (place,) = _points([mark.surveyed_m], map_)
    return mark.model_copy(
        update={
            "size_m": mark.size_m * map_.scale,
            "sigma_m": mark.sigma_m * map_.scale,
            "surveyed_m": place,
            "offset_m": offset,
        }
    )


def _drawing(drawing: Drawing, change: FrameChange) -> Drawing:
    map_ = change.new_T_old

    def stretches(old: list[Stretch]) -> list[Stretch]:
        return [
            each.model_copy(
                update={
                    "points": _points(each.points, map_),
                    "sigma_m": [sigma_m * map_.scale for sigma_m in each.sigma_m],
                }
            )
            for each in old
        ]

    return Drawing(
        mapped=stretches(drawing.mapped),
        discarded=stretches(drawing.discarded),
        raw=_points(drawing.raw, map_),
        wifi=_points(drawing.wifi, map_),
    )


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
            changed += _turned_points(pair, values)
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


def _turned_points(pair: tuple[str, str], values: _Values) -> list[pl.Expr]:
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
