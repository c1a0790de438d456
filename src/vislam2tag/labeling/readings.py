"""Labels for the time-stamped tables of a session (paper, section IV-B, last paragraph), and which are too uncertain.

What is too uncertain to count as labelled keeps its position and its sigma, and says so by its status.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import polars as pl

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray, StatusArray
from vislam2tag.core.interpolation import Labels, label_by_interpolation, label_by_next_frame
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.labeling.settings import LabelRule, LabelSettings
from vislam2tag.labeling.status_column import status_text
from vislam2tag.sessions.model import Attachment


def label_readings(
    table: pl.DataFrame,
    trajectory: Trajectory,
    settings: LabelSettings,
    excluded_ns: Sequence[tuple[int, int]] = (),
    attached: Attachment | None = None,
) -> pl.DataFrame:
    """Add ``x``, ``y``, ``z`` (BCS, metres), ``sigma`` (metres) and ``status`` to a table of readings.

    ``table`` has ``time_ns`` and ``repeated`` (see :class:`~vislam2tag.sessions.model.Session`); rows and their
    order stay. A reading is ``uncertain`` where its own sigma exceeds the settings' limit. A repeated reading is
    ``duplicate`` and has no position: the first one counts. Readings in an excluded span (start included, end not;
    boot-clock ns) are ``invalid`` and have none either. Readings of a device that was ``attached`` are less sure: by
    the way walked within its clock's sigma, and by how far from the camera it was carried. Where the trajectory tells
    floors, ``floor`` is added, too.
    """
    labels = _labels(table, trajectory, settings)
    if attached is not None:
        labels = _less_sure(labels, table["time_ns"].to_numpy(), trajectory, settings.max_gap_s, attached)
    repeated = table["repeated"].to_numpy()
    excluded = _within(table["time_ns"].to_numpy(), excluded_ns)
    position = labels.position_bcs
    position[repeated | excluded] = np.nan
    status = with_uncertain(labels.status, labels.sigma_m, settings.max_sigma_m)
    status[excluded] = Status.INVALID
    status[repeated] = Status.DUPLICATE
    floor = [pl.Series("floor", labels.floor, dtype=pl.Int32)] if len(labels.floor) else []
    return table[[name for name in table.columns if name != "repeated"]].with_columns(
        *floor,
        *(pl.Series(name, values, nan_to_null=True) for name, values in zip("xyz", position.T, strict=True)),
        pl.Series("sigma", labels.sigma_m, nan_to_null=True),
        status_text(status),
    )


def walked_within_sigma(
    time_ns: IntArray, trajectory: Trajectory, max_gap_s: float, clock_sigma_s: float
) -> FloatArray:
    """(n,) metres walked while a clock's sigma passes: what a reading's position is off by if its time is.

    ``time_ns`` (n,) on the trajectory's clock; 0 where the way is not known.
    """
    sigma_ns = round(clock_sigma_s * 1e9)
    ends = [label_by_interpolation(time_ns + way * sigma_ns, trajectory, max_gap_s) for way in (-1, 1)]
    way = (ends[1].position_bcs - ends[0].position_bcs)[:, :2]
    return np.asarray(np.nan_to_num(np.linalg.norm(way, axis=1) / 2))


def _less_sure(
    labels: Labels, time_ns: IntArray, trajectory: Trajectory, max_gap_s: float, attached: Attachment
) -> Labels:
    walked_m = walked_within_sigma(time_ns, trajectory, max_gap_s, attached.clock_sigma_s)
    return replace(labels, sigma_m=np.sqrt(labels.sigma_m**2 + walked_m**2 + attached.lever_arm_m**2 / 2))


def with_uncertain(status: StatusArray, sigma_m: FloatArray, max_sigma_m: float) -> StatusArray:
    """Turn ``ok`` into ``uncertain`` where sigma (n,) exceeds ``max_sigma_m``, metres; an unknown sigma (NaN) never."""
    above = (status == Status.OK) & (sigma_m > max_sigma_m)
    marked: StatusArray = np.where(above, np.int8(Status.UNCERTAIN), status).astype(np.int8)
    return marked


def mark_uncertain(trajectory: Trajectory, max_sigma_m: float) -> Trajectory:
    """Mark the frames whose sigma exceeds ``max_sigma_m``, metres (``inf``: none); nothing else changes."""
    return replace(trajectory, status=with_uncertain(trajectory.status, trajectory.sigma_m, max_sigma_m))


def _within(time_ns: IntArray, spans_ns: Sequence[tuple[int, int]]) -> BoolArray:
    """Mask (r,) of the times in one of the spans."""
    inside = np.zeros(len(time_ns), dtype=bool)
    for start_ns, end_ns in spans_ns:
        inside |= (time_ns >= start_ns) & (time_ns < end_ns)
    return inside


def _labels(table: pl.DataFrame, trajectory: Trajectory, settings: LabelSettings) -> Labels:
    time_ns = table["time_ns"].to_numpy()
    if settings.rule is LabelRule.NEXT_FRAME:
        return label_by_next_frame(time_ns, trajectory)
    return label_by_interpolation(time_ns, trajectory, settings.max_gap_s)
