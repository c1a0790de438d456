"""Fitting a station's clock (and the prism's place) to labels: one offset over several segments of walks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.interpolation import label_by_interpolation
from vislam2tag.core.tracks import Trajectory
from vislam2tag.quality.evaluation.truth import MAX_GAP_S

CLIP_M = 5.0
"""Errors count at most this much in the search: a wrongly mapped stretch must not decide it."""
GRID_S = 0.5
"""Step of the search."""
SEARCHED = 300
"""Measured points that the search looks at in each walk."""
TYPICAL_M = 0.15
"""Errors above this count linearly in the fit, not by their square."""
STEP_NS = 50_000_000
"""Half the time over which the labels' velocity is taken."""
PPM = 1e-6
"""A part per million."""


@dataclass(frozen=True)
class TrackSegment:
    """A walk, or a part of it, with the station's track: the labels to fit to, and ``k`` measured points.

    ``time_ns`` (k,) the station's wall clock; ``prism_bcs`` (k, 2) metres; ``ahead`` (k, 2) unit vector of walking,
    which is sure only where ``steady`` (k,): not in turns, and not where one stands.
    """

    reference: Trajectory
    time_ns: IntArray
    prism_bcs: FloatArray
    ahead: FloatArray
    steady: BoolArray

    def part(self, rows: slice | BoolArray) -> TrackSegment:
        """Only some of the measured points: a slice or mask (k,)."""
        return TrackSegment(
            self.reference, self.time_ns[rows], self.prism_bcs[rows], self.ahead[rows], self.steady[rows]
        )

    @property
    def left(self) -> FloatArray:
        """Unit vector (k, 2) to the left of walking."""
        return np.column_stack((-self.ahead[:, 1], self.ahead[:, 0]))


@dataclass(frozen=True)
class FreeParameters:
    """What is estimated beside the clock's offset."""

    drift: bool = False
    """The clocks' rates differ."""
    prism: bool = False
    """The prism is not at the camera."""


@dataclass(frozen=True)
class Adjustment:
    """From a measured point to where and when the camera was.

    ``clock_ns`` is the station's wall clock minus the clock of the labels at wall time ``epoch_ns``, growing by
    ``drift_ppm``; the prism is ``ahead_m`` before and ``left_m`` to the left of the camera, as one walks.
    """

    epoch_ns: int
    clock_ns: int
    drift_ppm: float = 0.0
    ahead_m: float = 0.0
    left_m: float = 0.0

    def label_time_ns(self, time_ns: IntArray) -> IntArray:
        """Times (k,) on the labels' clock of the station's times (k,)."""
        grown = np.round((time_ns - self.epoch_ns) * (self.drift_ppm * PPM)).astype(np.int64)
        return np.asarray(time_ns - self.clock_ns - grown)

    def camera_bcs(self, segment: TrackSegment) -> FloatArray:
        """Where the camera was (k, 2), metres."""
        return segment.prism_bcs - self.ahead_m * segment.ahead - self.left_m * segment.left


def errors_m(segment: TrackSegment, clock_ns: int) -> FloatArray:
    """Distance (k,) between each measured point and the label at its time, with this offset; NaN without a label."""
    labels = label_by_interpolation(segment.time_ns - clock_ns, segment.reference, MAX_GAP_S).position_bcs[:, :2]
    return np.asarray(np.linalg.norm(labels - segment.prism_bcs, axis=1))


def mean_clipped_error_m(segment: TrackSegment, clock_ns: int) -> float:
    """Mean error of a segment with this offset, each at most :data:`CLIP_M`, as is a point without a label."""
    return float(np.nan_to_num(errors_m(segment, clock_ns), nan=CLIP_M).clip(max=CLIP_M).mean())


def search_clock(segment: TrackSegment) -> int:
    """The offset (ns) with the least error among all at which track and walk overlap, to :data:`GRID_S`."""
    thinned = segment.part(slice(None, None, len(segment.time_ns) // SEARCHED + 1))
    first, last = (
        segment.time_ns[0] - segment.reference.time_ns.max(),
        segment.time_ns[-1] - segment.reference.time_ns.min(),
    )
    offsets = np.arange(first, last, round(GRID_S * 1e9), dtype=np.int64)
    return int(min(offsets.tolist(), key=lambda offset: mean_clipped_error_m(thinned, offset)))


def fit_adjustment(segments: Sequence[TrackSegment], start: Adjustment, freedom: FreeParameters) -> Adjustment:
    """Least robust squares of label minus camera over all points passed steadily, from a start within a second or so.

    Points without a label there do not count.
    """
    steady = [segment.part(segment.steady) for segment in segments]
    free = np.array([True, freedom.drift, freedom.prism, freedom.prism])

    def at(values: FloatArray) -> Adjustment:
        clock_s, drift_ppm, ahead_m, left_m = _spread(values, free)
        return Adjustment(start.epoch_ns, start.clock_ns + round(clock_s * 1e9), drift_ppm, ahead_m, left_m)

    def residual(values: FloatArray) -> FloatArray:
        return np.concatenate([_residual(segment, at(values)).ravel() for segment in steady])

    def jacobian(values: FloatArray) -> FloatArray:
        return np.concatenate([_jacobian(segment, at(values)) for segment in steady])[:, free]

    solution = least_squares(
        residual, np.zeros(int(free.sum())), jac=jacobian, loss="soft_l1", f_scale=TYPICAL_M, x_scale="jac"
    )
    return at(np.asarray(solution.x))


def _spread(values: FloatArray, free: BoolArray) -> list[float]:
    """Values (u,) of what is free (4,) among all parameters, the others 0."""
    full = np.zeros(len(free))
    full[free] = values
    return [float(value) for value in full]


def _residual(segment: TrackSegment, adjustment: Adjustment) -> FloatArray:
    """Label minus camera (k, 2), metres; 0 without a label."""
    time_ns = adjustment.label_time_ns(segment.time_ns)
    labels = label_by_interpolation(time_ns, segment.reference, MAX_GAP_S).position_bcs[:, :2]
    return np.nan_to_num(labels - adjustment.camera_bcs(segment))


def _jacobian(segment: TrackSegment, adjustment: Adjustment) -> FloatArray:
    """Derivative (2k, 4) of the residual by clock (s), drift (ppm), ahead and left (m)."""
    time_ns = adjustment.label_time_ns(segment.time_ns)
    ends = [label_by_interpolation(time_ns + step, segment.reference, MAX_GAP_S) for step in (-STEP_NS, STEP_NS)]
    velocity = np.nan_to_num((ends[1].position_bcs - ends[0].position_bcs)[:, :2] / (2e-9 * STEP_NS))
    since_s = (segment.time_ns - adjustment.epoch_ns) * 1e-9
    columns = (-velocity, -velocity * (since_s * PPM)[:, None], segment.ahead, segment.left)
    return np.stack(columns, axis=-1).reshape(-1, 4)
