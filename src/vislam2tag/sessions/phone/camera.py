"""Camera frames of the phone app: exposure times, and what the tracker says of itself."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import BoolArray, runs_of
from vislam2tag.core.context import TrackerState
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.sessions.phone.schemas import TRACKING, unit_poses
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.tables.camera import POSE_COLUMNS, camera_track

_UNKNOWN = "unknown"


def phone_camera(rows: pl.DataFrame, file: str, settings: FindingSettings) -> tuple[CameraTrack, list[Finding]]:
    """Make the camera track of the parsed rows of a camera table.

    Frames without tracking are kept as lost ones, at the pose last tracked where they have none of their own.
    """
    tracking = rows["state"].to_numpy() == TRACKING
    camera, findings = camera_track(_held(rows), file, settings)
    failures = rows["failure"].unique().sort().to_list()
    failure = rows["failure"].cast(pl.Enum(failures)).to_physical().to_numpy().astype(np.int64)
    state = TrackerState(np.asarray(tracking, dtype=bool), rows["part"].to_numpy(), tuple(failures), failure)
    unknown = rows.filter(pl.col("frame_clock") == _UNKNOWN)["row"].to_list()
    if unknown:
        message = "the clock of the images is not known: these frames have the time at which they were logged"
        findings.append(Finding.at_lines("unknown_exposure", file, unknown, message))
    findings += [*_tracking_lost(camera, state, file), *_restarted(camera, state, file)]
    return replace(camera, state=state, exposure_known=bool(len(rows)) and not unknown), findings


def _held(rows: pl.DataFrame) -> pl.DataFrame:
    """Name the pose columns as usual; a frame without tracking gets the pose last tracked in its part, or next."""
    rows = unit_poses(rows)
    tracking = pl.col("state") == TRACKING
    pose = pl.col(list(POSE_COLUMNS))
    held = pl.when(tracking).then(pose).forward_fill().backward_fill().over("part")
    at_rest = [pl.lit(1.0 if name == "qw" else 0.0).alias(name) for name in POSE_COLUMNS]
    filled = rows.with_columns(pl.when(tracking).then(pose).otherwise(held))
    return filled.with_columns(
        pl.when(tracking).then(pl.col(name)).otherwise(pl.coalesce(name, rest)).alias(name)
        for name, rest in zip(POSE_COLUMNS, at_rest, strict=True)
    )


def _tracking_lost(camera: CameraTrack, state: TrackerState, file: str) -> list[Finding]:
    """Report the usable frames without tracking, with the tracker's reasons."""
    lost: BoolArray = camera.usable & ~state.tracking
    if not lost.any():
        return []
    spans = runs_of(lost)
    reasons = Counter(state.reason(first, after) for first, after in spans)
    counted = [f"{word.lower().replace('_', ' ')} ({count}x)" for word, count in _by_count(reasons)]
    why = f" for {', '.join(counted)}" if counted else ""
    message = f"tracking was lost {len(spans)} time{'s' if len(spans) > 1 else ''}{why}; it splits the walk"
    return [Finding.at_lines("tracking_lost", file, camera.row[lost].tolist(), message)]


def _restarted(camera: CameraTrack, state: TrackerState, file: str) -> list[Finding]:
    """Report the frames at which the tracker began anew."""
    first = np.flatnonzero(np.diff(state.section) != 0) + 1
    if not len(first):
        return []
    message = "the tracker began anew at these frames; each part of the walk is mapped on its own and needs landmarks"
    return [Finding.at_lines("tracking_restarted", file, camera.row[first].tolist(), message)]


def _by_count(reasons: Counter[str]) -> list[tuple[str, int]]:
    """Words with how often each was logged, the commonest first."""
    return sorted(((word, count) for word, count in reasons.items() if word), key=lambda each: (-each[1], each[0]))
