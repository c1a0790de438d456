"""Counts, durations and lengths of a mapped session."""

from __future__ import annotations

from typing import Any

import numpy as np
import polars as pl

from vislam2tag.common import log_bins
from vislam2tag.core.path_length import step_frames, step_lengths, steps_without_jumps
from vislam2tag.core.status import STATUS_LABELS, Status, counts_by_label, has_position
from vislam2tag.core.tracks import CameraTrack, Trajectory
from vislam2tag.labeling.results import RecordingRecord, ScanStatistics, SigmaStatistics
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.readings import median_scan_interval_s


def walk_statistics(camera: CameraTrack, trajectory: Trajectory, max_gap_s: float) -> dict[str, Any]:
    """Duration, length, frame rate and frames by status, under their names in a session's result."""
    time_ns = camera.time_ns[camera.usable]
    rate_hz = camera.frame_rate_hz
    return {
        "start_ns": int(time_ns[0]) if len(time_ns) else None,
        "duration_s": round(camera.duration_s, 3),
        "distance_m": round(distance_m(camera, trajectory), 2),
        "frame_rate_hz": None if rate_hz is None else round(rate_hz, 3),
        "frames": counts_by_label(trajectory.status),
        "frame_seconds": frame_seconds(camera, trajectory, max_gap_s),
    }


def frame_seconds(camera: CameraTrack, trajectory: Trajectory, max_gap_s: float) -> dict[str, float]:
    """Seconds of the walk by status: each usable frame stands for the time to the next one.

    As for readings, longer than ``max_gap_s`` a mapped frame stands for nothing: that time is ``gap``, or ``invalid``
    where unusable frames lie in it.
    """
    frames = np.flatnonzero(camera.usable)
    seconds = np.diff(camera.time_ns[frames]) * 1e-9
    status = trajectory.status[frames[:-1]].copy()
    hole = has_position(status) & (seconds > max_gap_s)
    status[hole] = np.where(np.diff(frames)[hole] > 1, Status.INVALID, Status.GAP)
    sums = np.bincount(status, weights=seconds, minlength=len(STATUS_LABELS))
    return {label: round(float(total), 3) for label, total in zip(STATUS_LABELS, sums, strict=True) if total}


def distance_m(camera: CameraTrack, trajectory: Trajectory) -> float:
    """Length of the walk: in the BCS where both ends of a step are mapped, in the tracker's frame elsewhere.

    Jumps of the tracker are left out (:mod:`vislam2tag.core.path_length`).
    """
    frames = np.flatnonzero(camera.usable)
    frames = frames[step_frames(camera.time_ns[frames])]
    mapped = has_position(trajectory.status[frames])
    steps = np.where(
        mapped[1:] & mapped[:-1],
        step_lengths(trajectory.position_bcs[frames, :2]),
        step_lengths(camera.plane_acs[frames]),
    )
    return float(steps_without_jumps(steps, camera.time_ns[frames]).sum())


def sigma_statistics(trajectory: Trajectory) -> SigmaStatistics | None:
    """How sure the mapped frames are; None where no sigma is known."""
    known = has_position(trajectory.status) & np.isfinite(trajectory.sigma_m)
    sigma_m = trajectory.sigma_m[known]
    if not len(sigma_m):
        return None
    median_m, p95_m = np.quantile(sigma_m, (0.5, 0.95)).tolist()
    return SigmaStatistics(
        median_m=round(median_m, 4),
        p95_m=round(p95_m, 4),
        uncertain_share=round(float(np.mean(trajectory.status[known] == Status.UNCERTAIN)), 6),
        frames=log_bins.counts_of(sigma_m),
    )


def scan_statistics(wifi: pl.DataFrame) -> ScanStatistics | None:
    """Scans, their rate and what was stale (raw table, before labelling); None where there is no reading."""
    if len(wifi) == 0:
        return None
    interval_s = median_scan_interval_s(wifi)
    return ScanStatistics(
        scans=wifi["scan"].n_unique(),
        median_interval_s=None if interval_s is None else round(interval_s, 3),
        readings=len(wifi),
        repeated=int(wifi["repeated"].sum()),
        access_points=wifi["bssid"].n_unique(),
    )


def recording_record(session: Session) -> RecordingRecord | None:
    """What the recorder says of its own work; None where it says nothing."""
    recording = session.recording
    if recording is None:
        return None
    return RecordingRecord(
        ended=recording.ended,
        scans_refused=recording.scans_refused,
        exposure_known=session.camera.exposure_known,
        note=recording.note,
        events=recording.events,
    )
