"""Truths, labels at their times, and the errors of these as vectors with the covariances that the labels state."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TypeAlias

import numpy as np
import polars as pl

from vislam2tag.common.errors import SessionError, first_line
from vislam2tag.common.files.table_files import read_csv
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray, with_rows
from vislam2tag.core.interpolation import Labels, label_by_interpolation
from vislam2tag.core.limits import MAX_AT_ONCE
from vislam2tag.core.status import Status, has_position
from vislam2tag.core.tracks import Trajectory
from vislam2tag.intake.extents import MAX_LOCAL_M
from vislam2tag.labeling.settings import USUAL_TRUTH, TruthSettings

STRIDE_S = 0.5
"""Half the time over which a direction of walking is taken, seconds: a stride or so."""
STANDING_M_S = 0.2
"""Who is slower than that does not walk, metres per second."""


class TruthKind(StrEnum):
    """Where the true positions come from."""

    CONTROL_POINTS = "control_points"
    """Presses at surveyed points: a few to the walk."""
    TOTAL_STATION = "total_station"
    """A total station's track, at its own rate, where it saw the prism."""
    DENSE = "dense"
    """A trajectory of the whole walk: the simulator's, or that of another tracking system."""


_Known: TypeAlias = tuple[TruthKind, IntArray, FloatArray]
"""What true positions (n, 2) come from, their times (n,), and they themselves."""


@dataclass(frozen=True)
class PointErrors:
    """True positions and labels of a session at ``n`` times, both in the plane of the session's own floor.

    ``time_ns`` (n,) boot-clock nanoseconds, rising. ``truth_bcs`` (n, 2) metres, finite. ``label_bcs`` (n, 2) metres,
    NaN without a label. ``sigma_m`` (n,) that the label states, NaN where it states none. ``heading_rad`` (n,)
    direction of walking from the BCS x axis, NaN when standing or where it is not known. ``truth_sigma_m`` (n,) of the
    true position itself, along each axis, NaN where it is not known.
    """

    kind: TruthKind
    time_ns: IntArray
    truth_bcs: FloatArray
    label_bcs: FloatArray
    sigma_m: FloatArray
    heading_rad: FloatArray
    truth_sigma_m: FloatArray

    @classmethod
    def of(cls, truth: _Known, labels: Labels, velocity_bcs: FloatArray, truth_sigma_m: FloatArray) -> PointErrors:
        """Compare labels with a truth at their times, passed with these velocities (n, 2), metres per second."""
        plane, heading = labels.position_bcs[:, :2], heading_of(velocity_bcs)
        return cls(*truth, plane, labels.sigma_m, heading, truth_sigma_m)

    def __post_init__(self) -> None:
        """Raise ValueError where the shapes do not match: a mistake of the program, not of the data."""
        count = len(self.time_ns)
        planes = (self.truth_bcs, self.label_bcs)
        rows = (self.time_ns, self.sigma_m, self.heading_rad, self.truth_sigma_m)
        if any(plane.shape != (count, 2) for plane in planes) or any(row.shape != (count,) for row in rows):
            raise ValueError("the arrays of PointErrors must have the same number of rows")

    def __len__(self) -> int:
        """Number of true positions."""
        return len(self.time_ns)

    @property
    def labelled(self) -> BoolArray:
        """Mask (n,) of the true positions with a label."""
        return np.asarray(np.isfinite(self.label_bcs).all(axis=1))

    @property
    def residual_bcs(self) -> FloatArray:
        """Label minus truth (n, 2), metres; NaN without a label."""
        return self.label_bcs - self.truth_bcs

    @property
    def error_m(self) -> FloatArray:
        """Distance (n,) between label and truth, metres; NaN without a label."""
        return np.asarray(np.linalg.norm(self.residual_bcs, axis=1))

    @property
    def along_m(self) -> FloatArray:
        """How far (n,) the label is ahead of the truth, metres; NaN without a label or a direction of walking."""
        return np.asarray((self.residual_bcs * self._ahead).sum(axis=1))

    @property
    def across_m(self) -> FloatArray:
        """How far (n,) the label is to the left of the truth, metres; NaN without a label or a direction."""
        ahead, residual = self._ahead, self.residual_bcs
        return np.asarray(ahead[:, 0] * residual[:, 1] - ahead[:, 1] * residual[:, 0])

    @property
    def _ahead(self) -> FloatArray:
        """Unit vectors (n, 2) in the direction of walking."""
        return np.column_stack((np.cos(self.heading_rad), np.sin(self.heading_rad)))

    def select(self, wanted: BoolArray) -> PointErrors:
        """Keep only the true positions of a mask (n,)."""
        names = ("time_ns", "truth_bcs", "label_bcs", "sigma_m", "heading_rad", "truth_sigma_m")
        return with_rows(self, wanted, *names)


def walking_velocity(at_ns: IntArray, time_ns: IntArray, position_bcs: FloatArray) -> FloatArray:
    """Velocity (k, 2), metres per second, at times (k,) of a path, over a stride or so.

    The path's ``time_ns`` (n,) rise strictly, ``position_bcs`` is (n, 2), NaN where unknown. The velocity is that from
    :data:`STRIDE_S` before to as long after, less at the path's ends; NaN where that is unknown.
    """
    known = np.isfinite(position_bcs).all(axis=1)
    if known.sum() < 2:
        return np.full((len(at_ns), 2), np.nan)
    origin = int(time_ns[0])
    knots = (time_ns - origin) * 1e-9
    around = (at_ns - origin) * 1e-9 + np.array([[-STRIDE_S], [STRIDE_S]])
    around = np.clip(around, knots[known][0], knots[known][-1])
    before, after = np.stack([np.interp(around, knots, position_bcs[:, axis]) for axis in (0, 1)], axis=-1)
    span_s = around[1] - around[0]
    return np.asarray((after - before) / np.where(span_s > 0, span_s, np.nan)[:, None])


def heading_of(velocity_bcs: FloatArray) -> FloatArray:
    """Direction (k,) of velocities (k, 2), radians from the BCS x axis; NaN below :data:`STANDING_M_S`."""
    walking = np.linalg.norm(velocity_bcs, axis=1) >= STANDING_M_S
    return np.where(walking, np.arctan2(velocity_bcs[:, 1], velocity_bcs[:, 0]), np.nan)


def usable_path(trajectory: Trajectory) -> tuple[IntArray, FloatArray]:
    """Times (n,), strictly rising, and positions (n, 2) of a trajectory's usable frames, NaN where unmapped."""
    usable = (trajectory.status != Status.DUPLICATE) & (trajectory.status != Status.INVALID)
    return trajectory.time_ns[usable], trajectory.position_bcs[usable, :2]


MAX_GAP_S = 1.0
"""Labels are interpolated over at most this to the times of the truth, as readings are by default."""
LATEST_NS = 9_000_000_000_000_000_000
"""Later times leave no room below what 64 bits hold."""
_COLUMNS = {"time_ns": pl.Int64, "x": pl.Float64, "y": pl.Float64}
_SIGMA = "sigma_m"
"""A further column that a truth file may have: how exactly each position is known."""


@dataclass(frozen=True)
class Truth:
    """True positions (t, 2) in the BCS, metres, at strictly increasing boot-clock times (t,), ns."""

    time_ns: IntArray
    position_bcs: FloatArray
    findings: tuple[Finding, ...] = ()
    """Rows of its file that are left out."""
    sigma_m: FloatArray | None = None
    """(t,) how exactly each position is known, metres along each axis; None if the truth does not contain it."""

    def sigma_or(self, default_m: float) -> FloatArray:
        """Sigma (t,), metres along each axis; ``default_m`` where it is not known."""
        return np.full(len(self.time_ns), default_m) if self.sigma_m is None else self.sigma_m


def read_truth(path: Path) -> Truth:
    """Read ``truth.csv``: ``time_ns,x,y`` and, where it is known, ``sigma_m``; of equal times the first counts.

    Further columns are ignored. Rows without a time or a position, as motion capture has them where it saw nothing, are
    left out and counted. Raises SessionError where the file is not such a table or no row is left.
    """
    expected = f"{path}: expected a table with the columns time_ns, x and y, and optionally sigma_m"
    try:
        texts = read_csv(path, infer_schema=False, truncate_ragged_lines=True, quote_char=None, encoding="utf8-lossy")
        rows = texts.with_row_index("row", offset=2).select(
            pl.col("row").cast(pl.Int64),
            *(_number(name, kind) for name, kind in _COLUMNS.items()),
            *([_number(_SIGMA, pl.Float64)] if _SIGMA in texts.columns else []),
        )
    except (OSError, pl.exceptions.PolarsError) as error:
        raise SessionError(f"{expected} ({first_line(error)})") from error
    conditions = [pl.col("time_ns").is_between(0, LATEST_NS), pl.col("x", "y").abs() <= MAX_LOCAL_M]
    if _SIGMA in rows.columns:
        conditions.append(pl.col(_SIGMA).is_between(0, MAX_LOCAL_M))
    sound = rows.select(pl.all_horizontal(conditions).fill_null(value=False)).to_series()
    usable = rows.filter(sound)
    if usable.is_empty():
        raise SessionError(f"{expected}; no row has a time and a finite position")
    time_ns, first = np.unique(usable["time_ns"].to_numpy(), return_index=True)
    position_bcs = usable.select("x", "y").to_numpy()[first]
    sigma_m = usable[_SIGMA].to_numpy()[first] if _SIGMA in usable.columns else None
    return Truth(time_ns, position_bcs, rows_left_out(path.name, rows["row"].filter(~sound).to_list()), sigma_m)


def _number(name: str, kind: type[pl.DataType]) -> pl.Expr:
    return pl.col(name).str.strip_chars().cast(kind, strict=False)


def rows_left_out(file: str, lines: list[int]) -> tuple[Finding, ...]:
    """Report the lines (1-based) of a truth that have no usable time or position; nothing where there is none."""
    message = "these rows of the truth have no time, no finite position or no usable sigma_m; they are skipped"
    return (Finding.at_lines("unusable_truth_rows", file, lines, message),) if lines else ()


def errors_at_frames(trajectory: Trajectory, truth: Truth) -> FloatArray:
    """Distance (n,) in the plane between each mapped frame and the truth interpolated at its time, metres.

    NaN where a frame has no position or is outside the truth.
    """
    known = has_position(trajectory.status)
    known &= (trajectory.time_ns >= truth.time_ns[0]) & (trajectory.time_ns <= truth.time_ns[-1])
    since = (trajectory.time_ns - truth.time_ns[0]).astype(np.float64)
    knots = (truth.time_ns - truth.time_ns[0]).astype(np.float64)
    true = np.column_stack([np.interp(since, knots, truth.position_bcs[:, axis]) for axis in (0, 1)])
    return np.where(known, np.linalg.norm(trajectory.position_bcs[:, :2] - true, axis=1), np.nan)


CONTROL_POINTS = "presses at control points"
"""What results call the truth of :func:`residuals_at_presses`."""


@dataclass(frozen=True)
class Residuals:
    """Label minus truth ``error_m`` (k, 2), NaN without a label. ``covariance_m2`` (k, 2, 2) that the labels state, NaN
    where none is stated. ``truth_covariance_m2`` (k, 2, 2) of the truth's own error, NaN where not known.
    """

    error_m: FloatArray
    covariance_m2: FloatArray
    truth_covariance_m2: FloatArray


def residuals_at_truth(trajectory: Trajectory, truth: Truth, settings: TruthSettings = USUAL_TRUTH) -> Residuals:
    """Compare the label at each true point's time with it, in the plane."""
    labels = label_by_interpolation(truth.time_ns, trajectory, MAX_GAP_S).position_bcs[:, :2]
    own = truth.sigma_or(settings.file_sigma_m)[:, None, None] ** 2 * np.eye(2)
    return Residuals(labels - truth.position_bcs, covariances_at(truth.time_ns, trajectory), own)


def residuals_at_presses(
    trajectory: Trajectory, presses_ns: IntArray, control_points: FloatArray, settings: TruthSettings = USUAL_TRUTH
) -> Residuals:
    """Compare the label at each press (k,) with the *nearest* control point (p, 2), p at least 1, as the paper does.

    The nearest point need not be the one pressed at: large errors come out too small where points are close together.
    """
    labels = label_by_interpolation(presses_ns, trajectory, MAX_GAP_S).position_bcs[:, :2]
    own = press_covariance(walking_velocity(presses_ns, *usable_path(trajectory)), settings)
    return Residuals(labels - nearest_points(labels, control_points), covariances_at(presses_ns, trajectory), own)


def press_covariance(velocity_bcs: FloatArray, settings: TruthSettings) -> FloatArray:
    """Covariance (k, 2, 2) of the place where one presses, m^2, by the walk's velocity (k, 2) then, metres per second.

    A finger off by ``s_t`` seconds presses ``v s_t`` off: ``s_t^2 v v' + s_m^2 I``; NaN where the velocity is unknown.
    """
    along = settings.press_sigma_s**2 * velocity_bcs[:, :, None] * velocity_bcs[:, None, :]
    return along + settings.press_sigma_m**2 * np.eye(2)


def nearest_points(places: FloatArray, points: FloatArray) -> FloatArray:
    """Of the points (p, 2) the one (k, 2) nearest to each place (k, 2); the first one where the place is not known."""
    parts = np.array_split(places, max(1, -(-places.size * len(points) // MAX_AT_ONCE)))
    nearest = [np.nan_to_num(np.linalg.norm(part[:, None] - points, axis=2)).argmin(axis=1) for part in parts]
    return np.asarray(points[np.concatenate(nearest)])


def covariances_at(time_ns: IntArray, trajectory: Trajectory) -> FloatArray:
    """Covariance (k, 2, 2), m^2, at each time (k,), linear between the usable frames; NaN where one of them has none.

    Beyond the frames that of the first or last one: there is no label there anyway.
    """
    usable = (trajectory.status != Status.DUPLICATE) & (trajectory.status != Status.INVALID)
    if not usable.any():
        return np.full((len(time_ns), 2, 2), np.nan)
    start = trajectory.time_ns[usable][0]
    at, frames = time_ns - start, trajectory.time_ns[usable] - start
    covariance = trajectory.covariance_bcs[usable]
    xx, xy, yy = (np.interp(at, frames, covariance[:, i, j]) for i, j in ((0, 0), (0, 1), (1, 1)))
    return np.stack((xx, xy, xy, yy), axis=-1).reshape(-1, 2, 2)
