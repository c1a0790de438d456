"""The phone's heading and speed within time spans, and the labelled length of a walk."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.path_length import FASTEST_M_PER_S, STEP_NS, step_frames, step_lengths, steps_without_jumps

LEAST_SPAN_NS = 1_000_000_000
"""Shorter spans are widened to this length about their middle."""
LEAST_LOOK = 0.5
"""A camera tilted by more than 60 degrees (horizontal part below 0.5) has no heading."""
UNUSABLE = ("duplicate", "invalid")


@dataclass(frozen=True)
class PhoneMotion:
    """The usable frames of a trajectory (n,), with strictly increasing times, and cumulative sums along them."""

    time_ns: IntArray
    positioned: BoolArray
    """Frames with a position."""
    unpositioned_before: IntArray
    """(n + 1,) number of frames without a position before each one."""
    look_before: FloatArray
    """(n + 1, 2) sum of the camera's horizontal viewing directions (unit length) before each frame, BCS."""
    knot_ns: IntArray
    """(k,) times between which the path length is summed."""
    path_length_m: FloatArray
    """(k,) labelled path length until each of them, metres."""

    @classmethod
    def of(cls, trajectory: pl.DataFrame) -> PhoneMotion:
        """Make it from a session's trajectory as ``process`` wrote it."""
        frames = trajectory.filter(~pl.col("status").is_in(UNUSABLE))
        time_ns = frames["time_ns"].to_numpy()
        values = frames.select("x", "y", "qx", "qy", "qz", "qw").cast(pl.Float64).fill_null(float("nan")).to_numpy()
        positioned = np.isfinite(values[:, 0])
        knots = step_frames(time_ns)
        return cls(
            time_ns,
            positioned,
            np.concatenate(([0], np.cumsum(~positioned))),
            np.concatenate((np.zeros((1, 2)), np.cumsum(_look(values[:, 2:]), axis=0))),
            time_ns[knots],
            _labelled_length_m(time_ns[knots], values[knots, :2]),
        )

    @property
    def labelled_m(self) -> float:
        """Length of the labelled path, metres."""
        return float(self.path_length_m[-1]) if len(self.path_length_m) else 0.0

    def heading_and_speed(self, start_ns: IntArray, end_ns: IntArray) -> tuple[FloatArray, FloatArray]:
        """Heading (degrees from the BCS x axis, counter-clockwise, 0 to 360) and speed (m/s) within spans (s,).

        Heading is the mean viewing direction of the camera. It is NaN if the span contains a frame without position or
        no frame, or if the camera looks up, down or all around. Speed is path length over time. It is NaN in spans with
        such frames, and if it is faster than a person walks.
        """
        start_ns, end_ns = _widened(start_ns, end_ns)
        first = np.searchsorted(self.time_ns, start_ns)
        stop = np.searchsorted(self.time_ns, end_ns, side="right")
        frames = stop - first
        whole = (frames > 0) & (self.unpositioned_before[stop] == self.unpositioned_before[first])
        look = (self.look_before[stop] - self.look_before[first]) / np.maximum(frames, 1)[:, None]
        clear = whole & (np.linalg.norm(look, axis=1) >= LEAST_LOOK)
        heading = np.where(clear, np.degrees(np.arctan2(look[:, 1], look[:, 0])) % 360.0, np.nan)
        return heading, np.where(whole, self._speed(start_ns, end_ns), np.nan)

    def _speed(self, start_ns: IntArray, end_ns: IntArray) -> FloatArray:
        """Path length over time (s,) within spans (s,), m/s; NaN if a span is too short or the speed too high."""
        if len(self.knot_ns) < 2:
            return np.full(len(start_ns), np.nan)
        start_ns = np.maximum(start_ns, self.knot_ns[0])
        end_ns = np.minimum(end_ns, self.knot_ns[-1])
        length_m = np.diff([np.interp(ends, self.knot_ns, self.path_length_m) for ends in (start_ns, end_ns)], axis=0)[
            0
        ]
        speed = length_m / (np.maximum(end_ns - start_ns, 1) * 1e-9)
        believable: FloatArray = np.where((end_ns - start_ns >= STEP_NS) & (speed <= FASTEST_M_PER_S), speed, np.nan)
        return believable


def _look(orientation: FloatArray) -> FloatArray:
    """Horizontal viewing direction (n, 2) of a camera (it looks along its negative z axis) by quaternions (n, 4).

    Zero if the orientation is unknown or the camera looks steeply up or down.
    """
    x, y, z, w = orientation.T
    look = -2.0 * np.stack((x * z + w * y, y * z - w * x), axis=1)
    length = np.linalg.norm(look, axis=1)
    level = np.isfinite(length) & (length >= LEAST_LOOK)
    direction: FloatArray = np.where(level[:, None], look / np.where(level, length, 1.0)[:, None], 0.0)
    return direction


def _labelled_length_m(time_ns: IntArray, position: FloatArray) -> FloatArray:
    """Sum the path (k,) over positions (k, 2); steps with an unknown end, and jumps, do not count."""
    if not len(time_ns):
        return np.empty(0)
    return np.concatenate(([0.0], np.cumsum(steps_without_jumps(step_lengths(position), time_ns))))


def _widened(start_ns: IntArray, end_ns: IntArray) -> tuple[IntArray, IntArray]:
    """Widen spans (s,) that are too short about their middle."""
    missing = np.maximum(LEAST_SPAN_NS - (end_ns - start_ns), 0)
    return start_ns - missing // 2, end_ns + (missing - missing // 2)
