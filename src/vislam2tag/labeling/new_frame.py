"""Tables and results of a session in another frame of the plan."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.transforms import Similarity2
from vislam2tag.labeling.results import (
    ContradictionMark,
    Drawing,
    EventMark,
    PlacingRecord,
    Polyline,
    SessionResult,
    Stretch,
    VisitMark,
)
from vislam2tag.site.frame_change import FrameChange

_DECIMALS = 2
"""Of drawn points, as where they are first made."""


def changed_result(result: SessionResult, changes: Mapping[int, FrameChange]) -> SessionResult:
    """A session's result in the new frame; ``changes`` by floor contain all floors of the result.

    Statistics of sigmas and of errors against truth are those of the old scale: where the scale changes they are left
    out, which is a finding.
    """
    own = changes[result.floor]
    rescaled = not np.isclose(own.scale, 1.0, rtol=0, atol=1e-6)
    findings = list(result.findings)
    if rescaled and (result.sigma is not None or result.errors is not None):
        message = (
            "statistics of sigmas and errors were removed, because the plan's scale changed; process the walk again"
        )
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
    """A result with every position in the new frame of its floor."""
    own = changes[result.floor]

    def moved(mark: VisitMark | EventMark) -> VisitMark | EventMark:
        change = own if mark.floor is None else changes[mark.floor]
        place = None if mark.position is None else _points([mark.position], change.new_T_old)[0]
        return mark.model_copy(update={"position": place})

    return result.model_copy(
        update={
            "visits": list(map(moved, result.visits)),
            "events": list(map(moved, result.events)),
            "contradictions": [_contradiction(mark, changes[mark.floor]) for mark in result.contradictions],
            "placing": _placing(result.placing, own),
            "drawing": _drawing(result.drawing, own),
            "elsewhere": {floor: _drawing(drawing, changes[floor]) for floor, drawing in result.elsewhere.items()},
        }
    )


def floors_of_result(result: SessionResult) -> set[int]:
    """Floors of a result."""
    at_times = [*(mark.floor for mark in result.visits), *(mark.floor for mark in result.events)]
    marked = [floor for floor in at_times if floor is not None]
    return {result.floor, *result.elsewhere, *marked, *(mark.floor for mark in result.contradictions)}


def _fingerprint(old: str, changes: Mapping[int, FrameChange]) -> str:
    """No longer what the old site's session would have: ``process`` must not take it for done."""
    said = "\n".join(changes[floor].model_dump_json() for floor in sorted(changes))
    return hashlib.sha256(f"{old}\n{said}".encode()).hexdigest()


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


def _placing(placing: PlacingRecord | None, change: FrameChange) -> PlacingRecord | None:
    if placing is None:
        return None
    moved = [path.model_copy(update={"points": _points(path.points, change.new_T_old)}) for path in placing.candidates]
    return placing.model_copy(update={"candidates": moved})


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


def changed_table(table: pl.LazyFrame, changes: Mapping[int, FrameChange], building: str | None = None) -> pl.LazyFrame:
    """A table with column ``floor`` in the new frame; ``building``: only its rows of that building change.

    Positions, sigmas, covariances, headings, orientations, lengths and heights change; null and NaN stay. Rows of
    floors without a change must have none of them.
    """
    columns = table.collect_schema().names()

    def part(of: Callable[[FrameChange], float], unchanged: float = 0.0) -> pl.Expr:
        """A part of each row's change, by the row's floor; rows of other buildings keep what they have."""
        chosen: pl.Expr = pl.lit(None, pl.Float64)
        for number, change in changes.items():
            chosen = pl.when(pl.col("floor") == number).then(pl.lit(of(change))).otherwise(chosen)
        if building is None:
            return chosen
        return pl.when(pl.col("building").fill_null("") == building).then(chosen).otherwise(pl.lit(unchanged))

    a, b = part(lambda change: change.new_T_old.a.real, 1.0), part(lambda change: change.new_T_old.a.imag)
    shift = part(lambda change: change.x_m), part(lambda change: change.y_m)
    scale, angle = part(lambda change: change.scale, 1.0), part(lambda change: change.new_T_old.rotation_rad)
    changed: list[pl.Expr] = []
    for pair in _POINTS:
        if set(pair) <= set(columns):
            x, y = map(pl.col, pair)
            changed += [(a * x - b * y + shift[0]).alias(pair[0]), (b * x + a * y + shift[1]).alias(pair[1])]
    changed += [(pl.col(name) * scale).alias(name) for name in _LENGTHS if name in columns]
    if "z" in columns:
        changed.append(pl.col("z") + part(lambda change: change.rise_m))
    if set(_COVARIANCE) <= set(columns):
        changed += _covariance(a, b)
    if set(_QUATERNION) <= set(columns):
        changed += _orientation(angle)
    headings = {
        "heading_deg": (pl.col("heading_deg") + angle * (180 / math.pi)) % 360.0,
        "heading_rad": (pl.col("heading_rad") + angle + math.pi) % math.tau - math.pi,
    }
    return table.with_columns(*changed, *(turned for name, turned in headings.items() if name in columns))


def _covariance(a: pl.Expr, b: pl.Expr) -> list[pl.Expr]:
    """``R C R^T`` by its elements, times the square of the scale: a + ib is scale times rotation."""
    xx, xy, yy = (pl.col(name) for name in _COVARIANCE)
    return [
        (a * a * xx - 2 * a * b * xy + b * b * yy).alias("cov_xx"),
        (a * b * (xx - yy) + (a * a - b * b) * xy).alias("cov_xy"),
        (b * b * xx + 2 * a * b * xy + a * a * yy).alias("cov_yy"),
    ]


def _orientation(angle: pl.Expr) -> list[pl.Expr]:
    """The turn about the vertical after the camera's own orientation, as a product of quaternions."""
    qx, qy, qz, qw = (pl.col(name) for name in _QUATERNION)
    sine, cosine = (angle / 2).sin(), (angle / 2).cos()
    return [
        (cosine * qx - sine * qy).alias("qx"),
        (cosine * qy + sine * qx).alias("qy"),
        (cosine * qz + sine * qw).alias("qz"),
        (cosine * qw - sine * qz).alias("qw"),
    ]
