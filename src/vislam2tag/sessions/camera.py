"""The camera track of a session: which frames count, and what is wrong with the others."""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.core.arrays import BoolArray, IntArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.findings import Finding, Severity
from vislam2tag.sessions.poses import POSE_COLUMNS, poses_of
from vislam2tag.settings import FindingSettings

CAMERA_SCHEMA = {"time_ns": pl.Int64, **POSE_COLUMNS}


def camera_track(rows: pl.DataFrame, file: str, settings: FindingSettings) -> tuple[CameraTrack, list[Finding]]:
    """Make the camera track of the parsed rows of a pose file (columns ``row`` and :data:`CAMERA_SCHEMA`).

    Of frames with the same time the first counts; a frame before the latest time so far is invalid.
    """
    position, orientation, sound, findings = poses_of(rows, file)
    time_ns = rows["time_ns"].to_numpy()
    line = rows["row"].to_numpy()
    duplicate, backward = _out_of_order(time_ns, sound)
    status = np.where(sound, np.int8(Status.OK), np.int8(Status.INVALID))
    status[duplicate] = Status.DUPLICATE
    status[backward] = Status.INVALID
    track = CameraTrack(time_ns, position, orientation, status)
    for kind, mask, message in (
        ("duplicate_times", duplicate, "frames repeat the time of an earlier one; the first counts"),
        ("backward_times", backward, "frames are earlier than one before them; they are not used"),
    ):
        if mask.any():
            findings.append(Finding.at_lines(kind, file, line[mask].tolist(), message))
    return track, findings + _frame_gaps(track, line, file, settings) + _unusable(track, file)


def _out_of_order(time_ns: IntArray, sound: BoolArray) -> tuple[BoolArray, BoolArray]:
    """Masks (n,) of sound frames at the latest time so far, and before it."""
    latest = np.full(len(time_ns), -1, dtype=np.int64)
    if len(time_ns) > 1:
        latest[1:] = np.maximum.accumulate(np.where(sound, time_ns, -1))[:-1]
    return sound & (time_ns == latest), sound & (time_ns < latest)


def _frame_gaps(track: CameraTrack, line: IntArray, file: str, settings: FindingSettings) -> list[Finding]:
    step_s = np.diff(track.time_ns[track.usable]) / 1e9
    gaps = step_s > settings.frame_gap_s
    if not gaps.any():
        return []
    after = line[track.usable][1:][gaps].tolist()
    message = (
        f"no frame for more than {settings.frame_gap_s:g} s before these lines (longest {step_s.max():.1f} s); "
        "nothing is known of the way walked there"
    )
    return [Finding.at_lines("frame_gap", file, after, message)]


def _unusable(track: CameraTrack, file: str) -> list[Finding]:
    if track.usable.any():
        return []
    message = "no usable camera pose; the session cannot be mapped"
    return [Finding(kind="no_frames", file=file, count=1, message=message, severity=Severity.ERROR)]
