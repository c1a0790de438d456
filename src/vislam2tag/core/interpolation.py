"""A position or a cause for any point in time, from a mapped trajectory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray, StatusArray, with_rows
from vislam2tag.core.status import Status, has_position
from vislam2tag.core.tracks import Trajectory


@dataclass(frozen=True)
class Labels:
    """Positions of ``r`` readings: ``position_bcs`` (r, 3) metres, NaN where there is none. ``sigma_m`` (r,) metres,
    NaN only where it is not known. ``status`` (r,) codes of :class:`~vislam2tag.core.status.Status`. ``floor`` (r,)
    that of the closer frame, empty where the trajectory's is (all on the session's own floor) or there is no frame.
    """

    position_bcs: FloatArray
    sigma_m: FloatArray
    status: StatusArray
    floor: IntArray


def _usable_frames(trajectory: Trajectory) -> tuple[Trajectory, BoolArray]:
    """The usable frames alone, times strictly increasing, and where unusable ones lie between one and that before."""
    usable = np.flatnonzero((trajectory.status != Status.DUPLICATE) & (trajectory.status != Status.INVALID))
    frames = with_rows(trajectory, usable, "time_ns", "position_bcs", "covariance_bcs", "status", "floor")
    return frames, np.diff(usable, prepend=-1) > 1


def label_by_interpolation(time_ns: IntArray, trajectory: Trajectory, max_gap_s: float) -> Labels:
    """Interpolate linearly between the neighbouring frames of each time (r,), boot-clock nanoseconds.

    Never across a discarded stretch (the reading gets its cause) nor between frames more than ``max_gap_s`` apart
    (``gap``; ``invalid`` where only unusable frames lie between). Times outside the frames are ``outside_frames``.
    """
    frames, holed = _usable_frames(trajectory)
    if frames.time_ns.size == 0:
        return _unlabelled(len(time_ns), Status.OUTSIDE_FRAMES)
    after = np.minimum(np.searchsorted(frames.time_ns, time_ns), len(frames.time_ns) - 1)
    exact = frames.time_ns[after] == time_ns
    before = np.where(exact, after, np.maximum(after - 1, 0))
    span_ns = frames.time_ns[after] - frames.time_ns[before]
    share = np.where(exact, 0.0, (time_ns - frames.time_ns[before]) / np.maximum(span_ns, 1))
    status = _status_between(frames, before, after)
    too_far = has_position(status) & (span_ns > max_gap_s * 1e9)
    status[too_far] = np.where(holed[after[too_far]], Status.INVALID, Status.GAP)
    outside = (time_ns < frames.time_ns[0]) | (time_ns > frames.time_ns[-1])
    status[outside] = Status.OUTSIDE_FRAMES
    position = _blend(frames.position_bcs, before, after, share[:, None])
    position[~has_position(status)] = np.nan
    sigma = _blend(frames.sigma_m, before, after, share)
    sigma[too_far | outside] = np.nan
    floor = _chosen(frames.floor, np.where(share < 0.5, before, after))
    return Labels(position, sigma, status, floor)


def label_by_next_frame(time_ns: IntArray, trajectory: Trajectory) -> Labels:
    """Give each time (r,) the label of the first frame that is not before it (the paper's rule, section IV-B)."""
    frames, _ = _usable_frames(trajectory)
    if frames.time_ns.size == 0:
        return _unlabelled(len(time_ns), Status.OUTSIDE_FRAMES)
    after = np.minimum(np.searchsorted(frames.time_ns, time_ns), len(frames.time_ns) - 1)
    outside = (time_ns < frames.time_ns[0]) | (time_ns > frames.time_ns[-1])
    status = np.where(outside, np.int8(Status.OUTSIDE_FRAMES), frames.status[after]).astype(np.int8)
    labelled = has_position(status)
    return Labels(
        np.where(labelled[:, None], frames.position_bcs[after], np.nan),
        np.where(outside, np.nan, frames.sigma_m[after]),
        status,
        _chosen(frames.floor, after),
    )


def _status_between(frames: Trajectory, before: IntArray, after: IntArray) -> StatusArray:
    """Status (r,) of readings between frames ``before`` and ``after`` (r,): the first cause met, or the less sure."""
    first, second = frames.status[before], frames.status[after]
    cause = np.where(has_position(first), second, first)
    uncertain = (
        has_position(first) & has_position(second) & ((first == Status.UNCERTAIN) | (second == Status.UNCERTAIN))
    )
    return np.where(uncertain, np.int8(Status.UNCERTAIN), cause).astype(np.int8)


def _chosen(floor: IntArray, frame: IntArray) -> IntArray:
    """Floor (r,) of frames (r,), from that of each (n,); empty where all lie on the session's own."""
    return floor[frame] if len(floor) else floor


def _blend(values: FloatArray, before: IntArray, after: IntArray, share: FloatArray) -> FloatArray:
    """Values (r, ...) at a ``share`` of the way from frames ``before`` to frames ``after`` (r,) of values (n, ...)."""
    start = values.take(before, axis=0)
    blended: FloatArray = values.take(after, axis=0)  # many times quicker than values[after] where values has columns
    blended -= start
    blended *= share
    blended += start
    return blended


def _unlabelled(count: int, cause: Status) -> Labels:
    cause_of_all = np.full(count, cause, dtype=np.int8)
    return Labels(np.full((count, 3), np.nan), np.full(count, np.nan), cause_of_all, np.empty(0, dtype=np.int64))
