"""The landmark log of a session: rows matched to frames, sorted by landmark and frame."""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.sessions.tables.camera import POSE_COLUMNS, poses_of
from vislam2tag.site.names import landmark_id

LANDMARK_SCHEMA = {"id": pl.String, "time_ns": pl.Int64, **POSE_COLUMNS}
SAME_POSITION_M = 1e-6
"""A landmark this close to the camera is the camera's own pose: poses are logged with six decimals."""


def landmark_log(rows: pl.DataFrame, file: str, camera: CameraTrack) -> tuple[LandmarkLog, list[Finding]]:
    """Make the landmark log of the parsed rows of a landmark file (``row`` and :data:`LANDMARK_SCHEMA`).

    A row belongs to the usable frame of exactly its time; of rows with the same landmark and time the first counts.
    """
    position, orientation, sound, findings = poses_of(rows, file)
    frame, orphans = frames_of(rows["time_ns"].to_numpy(), camera)
    line = rows["row"].to_numpy()
    if (sound & orphans).any():
        message = "no frame has the time of these rows; they are not used"
        lines = line[sound & orphans].tolist()
        findings.append(Finding.at_lines("landmark_rows_without_frame", file, lines, message))
    ids, landmark = _landmarks_of(rows["id"])
    used = np.flatnonzero(sound & (frame >= 0))
    ids, landmark = _by_first_sighting(ids, landmark, frame, used)
    used, repeated = _sorted_once(landmark, frame, used)
    if len(repeated):
        message = "a landmark has several rows at the same time; the first counts"
        findings.append(Finding.at_lines("duplicate_landmark_rows", file, sorted(line[repeated].tolist()), message))
    frame, position = frame[used], position.take(used, axis=0)
    lost = _same_place(position, camera.position_acs.take(frame, axis=0))
    log = LandmarkLog(ids, landmark[used], frame, position, orientation.take(used, axis=0), lost, line[used])
    return log, findings + _tracking_lost(log, file, len(camera.time_ns))


def _same_place(position: FloatArray, camera: FloatArray) -> BoolArray:
    """Mask (k,) of the positions (k, 3) that are the camera's (k, 3), metres."""
    offset = position - camera
    same: BoolArray = np.einsum("ij,ij->i", offset, offset) <= SAME_POSITION_M**2
    return same


def frames_of(time_ns: IntArray, camera: CameraTrack) -> tuple[IntArray, BoolArray]:
    """Index (k,) of the usable frame at each time (k,), ns, -1 where there is none; mask (k,) of times of no frame."""
    usable = np.flatnonzero(camera.usable)
    at = np.searchsorted(camera.time_ns[usable], time_ns)
    padded = np.append(usable, -1)
    frame = padded[np.minimum(at, len(usable))]
    matched = (frame >= 0) & (camera.time_ns[frame] == time_ns) if len(usable) else np.zeros(len(time_ns), dtype=bool)
    orphans = ~matched
    if len(usable) < len(camera.time_ns):
        # Rows of an unusable frame are reported by that frame's own finding.
        orphans &= ~np.isin(time_ns, camera.time_ns)
    return np.where(matched, frame, -1), orphans


def _landmarks_of(raw_ids: pl.Series) -> tuple[tuple[str, ...], IntArray]:
    """The different ids in order of appearance, and the index (k,) of each row's among them."""
    spellings = raw_ids.unique(maintain_order=True).to_list()
    names = [landmark_id(spelling) for spelling in spellings]
    ids = tuple(dict.fromkeys(names))
    index = {landmark: i for i, landmark in enumerate(ids)}
    codes = np.array([index[name] for name in names], dtype=np.int64)
    spelled = raw_ids.cast(pl.Enum(spellings)).to_physical().to_numpy()
    return ids, codes[spelled]


def _by_first_sighting(
    ids: tuple[str, ...], landmark: IntArray, frame: IntArray, used: IntArray
) -> tuple[tuple[str, ...], IntArray]:
    """Number landmarks by the frame of their first used row, rows (k,); landmarks without one go."""
    never = np.iinfo(np.int64).max
    first = np.full(len(ids), never)
    np.minimum.at(first, landmark[used], frame[used])
    order = np.argsort(first, kind="stable")
    order = order[first[order] < never]
    rank = np.full(len(ids), -1, dtype=np.int64)
    rank[order] = np.arange(len(order))
    return tuple(ids[i] for i in order), rank[landmark]


def _sorted_once(landmark: IntArray, frame: IntArray, used: IntArray) -> tuple[IntArray, IntArray]:
    """Indices of the used rows in (landmark, frame) order, the first of equals only; and those of the others."""
    if np.any(np.diff(frame[used]) < 0):
        used = used[np.argsort(frame[used], kind="stable")]
    order = used[np.argsort(landmark[used].astype(_narrowest(landmark)), kind="stable")]
    repeated = np.zeros(len(order), dtype=bool)
    repeated[1:] = (np.diff(landmark[order]) == 0) & (np.diff(frame[order]) == 0)
    return order[~repeated], order[repeated]


def _narrowest(landmark: IntArray) -> type[np.int16 | np.int64]:
    """The narrowest type for numbers (k,): a stable sort of 16 bits is a radix sort, many times quicker."""
    return np.int16 if landmark.max(initial=0) < np.iinfo(np.int16).max else np.int64


def _tracking_lost(log: LandmarkLog, file: str, frames: int) -> list[Finding]:
    """Report the frames at which every landmark logged has the camera's pose."""
    logged = np.bincount(log.frame, minlength=frames)
    lost = np.bincount(log.frame[log.lost], minlength=frames)
    critical = (logged > 0) & (lost == logged)
    if not critical.any():
        return []
    first_line = np.full(frames, np.iinfo(np.int64).max)
    np.minimum.at(first_line, log.frame, log.row)
    runs = int(np.count_nonzero(np.diff(critical.astype(np.int8), prepend=0) == 1))
    message = (
        f"tracking was lost {runs} time{'s' if runs > 1 else ''}: at these frames every landmark has the camera's "
        "pose; they split the walk"
    )
    return [Finding.at_lines("tracking_lost", file, np.sort(first_line[critical]).tolist(), message)]
