"""What one session and one strategy show against one kind of truth: a label and a true position at each time."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory

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


@dataclass(frozen=True)
class PointErrors:
    """True positions and labels of a session at ``n`` times, both in the plane of the session's own floor.

    ``time_ns`` (n,) boot-clock nanoseconds, rising; ``truth_bcs`` (n, 2) metres, finite; ``label_bcs`` (n, 2) metres,
    NaN without a label; ``sigma_m`` (n,) that the label states, NaN where it states none; ``heading_rad`` (n,)
    direction of walking from the BCS x axis, NaN when standing or where it is not known; ``truth_sigma_m`` (n,) of the
    true position itself, along each axis, NaN where it is not known.
    """

    kind: TruthKind
    time_ns: IntArray
    truth_bcs: FloatArray
    label_bcs: FloatArray
    sigma_m: FloatArray
    heading_rad: FloatArray
    truth_sigma_m: FloatArray

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
        """How far (n,) the label lies ahead of the truth, metres; NaN without a label or a direction of walking."""
        return np.asarray((self.residual_bcs * self._ahead).sum(axis=1))

    @property
    def across_m(self) -> FloatArray:
        """How far (n,) the label lies to the left of the truth, metres; NaN without a label or a direction."""
        ahead, residual = self._ahead, self.residual_bcs
        return np.asarray(ahead[:, 0] * residual[:, 1] - ahead[:, 1] * residual[:, 0])

    @property
    def _ahead(self) -> FloatArray:
        """Unit vectors (n, 2) in the direction of walking."""
        return np.column_stack((np.cos(self.heading_rad), np.sin(self.heading_rad)))

    def select(self, wanted: BoolArray) -> PointErrors:
        """Keep only the true positions of a mask (n,)."""
        return PointErrors(
            self.kind,
            self.time_ns[wanted],
            self.truth_bcs[wanted],
            self.label_bcs[wanted],
            self.sigma_m[wanted],
            self.heading_rad[wanted],
            self.truth_sigma_m[wanted],
        )


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


def walking_heading(at_ns: IntArray, time_ns: IntArray, position_bcs: FloatArray) -> FloatArray:
    """Direction of walking (k,), radians from the BCS x axis, at times (k,) of a path as in :func:`walking_velocity`.

    NaN where the velocity is unknown or below :data:`STANDING_M_S`.
    """
    return heading_of(walking_velocity(at_ns, time_ns, position_bcs))


def heading_of(velocity_bcs: FloatArray) -> FloatArray:
    """Direction (k,) of velocities (k, 2), radians from the BCS x axis; NaN below :data:`STANDING_M_S`."""
    walking = np.linalg.norm(velocity_bcs, axis=1) >= STANDING_M_S
    return np.where(walking, np.arctan2(velocity_bcs[:, 1], velocity_bcs[:, 0]), np.nan)


def usable_path(trajectory: Trajectory) -> tuple[IntArray, FloatArray]:
    """Times (n,), strictly rising, and positions (n, 2) of a trajectory's usable frames, NaN where unmapped."""
    usable = (trajectory.status != Status.DUPLICATE) & (trajectory.status != Status.INVALID)
    return trajectory.time_ns[usable], trajectory.position_bcs[usable, :2]
