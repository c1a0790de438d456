"""A walk that was mapped in memory: its frames as a table, labels for further tables, and a drawing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.common.findings import Finding
from vislam2tag.common.given_tables import GivenTable, frame_of
from vislam2tag.common.palette import STATUS_STYLES
from vislam2tag.common.tabular import Tabular
from vislam2tag.core.notebook import Drawable
from vislam2tag.core.status import Status, has_position
from vislam2tag.core.tracks import Landmarks
from vislam2tag.core.transforms import level_view
from vislam2tag.labeling.tables import LabelledWalk, label_readings, trajectory_table
from vislam2tag.sessions.given_times import GivenTimes, given_times, outside_walk, refuse_mixed_dates

_CAUSES = {name: style.meaning for name, style in STATUS_STYLES.items() if name != Status.OK.label}


@dataclass(frozen=True, repr=False)
class MappedWalk(Drawable, Tabular):
    """A walk that :func:`~vislam2tag.api.map_walk` mapped.

    ``frames`` is a table with one row for each pose, in the order given; values that are not known are null:

    * ``floor``, ``time_ns``; ``x``, ``y``, ``z`` of the camera on the plan, metres; ``qx`` .. ``qw``, camera to plan;
    * ``sigma``, one standard deviation per axis, metres; ``cov_xx``, ``cov_xy``, ``cov_yy``, square metres;
    * ``status``: ``ok``, or why the position is uncertain or not known, and ``cause``, the same as a sentence;
    * ``heading_rad``: where the camera looks in the plane, counter-clockwise from x.

    ``findings`` are those of ``process`` on poses, landmarks and mapping. ``label(table, time_column="time_ns")`` adds
    ``x``, ``y``, ``z``, ``sigma`` and ``status`` to a table. ``plot()`` draws path and landmarks, and returns
    Matplotlib axes. ``to_pandas()`` returns the frames for pandas.
    """

    main_table: ClassVar[str] = "frames"

    walk: LabelledWalk
    landmarks: Landmarks
    """Those that the walk may use."""
    findings: tuple[Finding, ...]
    times: GivenTimes
    """Those of the poses, as given."""

    @cached_property
    def frames(self) -> pl.DataFrame:
        """One row for each pose, in the order given."""
        trajectory = self.walk.trajectory
        heading = np.full(len(trajectory.status), np.nan)
        placed = has_position(trajectory.status)
        view = level_view(trajectory.orientation_bcs[placed])
        heading[placed] = np.where(view.any(axis=1), np.arctan2(view[:, 1], view[:, 0]), np.nan)
        return (
            trajectory_table(self.walk.key, trajectory)
            .drop("device", "session")
            .with_columns(
                pl.Series("heading_rad", heading, nan_to_null=True),
                pl.col("status").replace_strict(_CAUSES, default=None, return_dtype=pl.String).alias("cause"),
            )
        )

    def label(self, table: GivenTable, time_column: str = "time_ns") -> pl.DataFrame:
        """Add ``x``, ``y``, ``z``, ``sigma`` (metres) and ``status`` to a table, as ``process`` does to its own.

        ``time_column`` has times on the poses' clock: numbers in the unit of its name (``time_s``), else nanoseconds,
        or date-times. Without ``time_ns``, a column is recognised by its header, such as ``timestamp``. Rows without a
        time are ``invalid``. ``floor`` is added, too, if the landmarks have several. Raises UsageError if the column
        is missing or wrong, if no row is within the walk, or if the table has one of those columns already.
        """
        rows = frame_of(table, "table")
        walk_ns = self.walk.mapped.time_ns[self.walk.mapped.status != Status.INVALID]
        times = given_times(rows, "table", time_column, walk_ns)
        if len(walk_ns) and times.ns.is_not_null().any():
            refuse_mixed_dates([("table", times), ("poses", self.times)])
        if outside := outside_walk(times, "table", walk_ns):
            raise UsageError(outside)
        missing = times.ns.is_null()
        readings = pl.DataFrame([times.ns.fill_null(0), missing.alias("repeated")])
        labels = label_readings(readings, self.walk.mapped, self.walk.settings)
        invalid = pl.when(missing).then(pl.lit(Status.INVALID.label)).otherwise(pl.col("status"))
        labels = labels.with_columns(invalid.alias("status"))
        labels = labels.drop("time_ns", *(["floor"] if len(self.floors) < 2 else []), strict=False)
        if taken := [name for name in labels.columns if name in rows.columns]:
            raise UsageError(f"table: the column {' and '.join(taken)} already exists; rename it")
        return rows.hstack(labels)

    @property
    def floors(self) -> list[int]:
        """Numbers of the floors of its landmarks, and of the one on which it starts."""
        return sorted({self.walk.key.floor, *self.landmarks.floor.tolist()})

    def _frames(self) -> dict[str, Callable[[], pl.DataFrame]]:
        return {self.main_table: lambda: self.frames}

    def _facts(self) -> dict[str, object]:
        trajectory = self.walk.trajectory
        sigma_m = trajectory.sigma_m[has_position(trajectory.status) & np.isfinite(trajectory.sigma_m)]
        return {
            **trajectory._facts(),
            "landmarks": len(self.landmarks.ids),
            "median sigma": f"{np.median(sigma_m):.2f} m" if len(sigma_m) else "not known",
            "findings": ", ".join(dict.fromkeys(finding.kind for finding in self.findings)) or "none",
        }
