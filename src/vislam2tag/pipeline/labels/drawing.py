"""Thinned polylines of a session for the report."""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.core.arrays import FloatArray, IntArray, StatusArray
from vislam2tag.core.path_length import arc_lengths, line_length
from vislam2tag.core.status import STATUS_LABELS, Status, has_position
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.core.transforms import Similarity2
from vislam2tag.labeling.results import Drawing, Polyline, Stretch

SPACING_M = 0.4
"""Minimum distance between drawn points."""
MAX_POINTS = 500
"""Maximum number of points drawn for one session and layer."""
MAX_EXTENT_M = 2000.0
"""Points beyond this distance are not drawn, because the tracker has diverged."""


def draw(
    own: int,
    camera: CameraTrack,
    log: LandmarkLog,
    landmarks: Landmarks,
    trajectory: Trajectory,
    wifi: pl.DataFrame,
) -> dict[int, Drawing]:
    """Reduce a mapped session to what the report draws on each floor, including ``own``; all in BCS metres.

    ``wifi`` is the labelled table. The raw path is drawn on the ``own`` floor only.
    """
    frames = np.flatnonzero(camera.usable)
    floor = trajectory.floor[frames] if len(trajectory.floor) else np.full(len(frames), own)
    aligned = _aligned(camera, log, landmarks, trajectory, frames)
    mapped = has_position(trajectory.status[frames])
    runs = _runs(trajectory.status[frames], floor)
    spacing = max(SPACING_M, line_length(camera.plane_acs[frames]) / MAX_POINTS)
    positions, sigma_m = trajectory.position_bcs[frames, :2], trajectory.sigma_m[frames]
    scans = _scan_positions(wifi)
    return {
        number: Drawing(
            mapped=[
                _stretch(Status(status), positions[a:b], spacing, sigma_m[a:b])
                for status, a, b in runs
                if mapped[a] and floor[a] == number
            ],
            discarded=[
                _stretch(Status(status), aligned[a : b + 1], spacing)
                for status, a, b in runs
                if not mapped[a] and floor[a] == number and len(aligned)
            ],
            raw=_polyline(aligned, spacing) if number == own else [],
            wifi=scans.get(number, []),
        )
        for number in sorted({own, *floor.tolist()})
    }


def _aligned(
    camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks, trajectory: Trajectory, frames: IntArray
) -> FloatArray:
    """Raw positions (f, 2) aligned with the plan by one similarity; (0, 2) if none can be found."""
    plane = camera.plane_acs[frames]
    mapped = has_position(trajectory.status[frames])
    source, target = plane[mapped], trajectory.position_bcs[frames][mapped, :2]
    if not mapped.any():
        first = [
            i for i, name in enumerate(log.ids) if name in landmarks.index and log.rows_of(i).start < len(log.frame)
        ]
        source = log.plane_acs[[log.rows_of(i).start for i in first]]
        target = landmarks.position_bcs[[landmarks.index[log.ids[i]] for i in first]]
    known = np.isfinite(target).all(axis=1)
    try:
        return Similarity2.fit(source[known], target[known]) @ plane
    except ValueError:
        return np.zeros((0, 2))


def _runs(status: StatusArray, floor: IntArray) -> list[tuple[int, int, int]]:
    """Runs of equal status on one floor as (status, start, stop)."""
    if len(status) == 0:
        return []
    edges = np.flatnonzero((np.diff(status) != 0) | (np.diff(floor) != 0)) + 1
    starts, stops = np.concatenate(([0], edges)), np.concatenate((edges, [len(status)]))
    return [(int(status[a]), int(a), int(b)) for a, b in zip(starts, stops, strict=True)]


def _stretch(status: Status, points: FloatArray, spacing_m: float, sigma_m: FloatArray | None = None) -> Stretch:
    """Thin a run of frames; ``sigma_m`` (n,) is omitted if any of it is unknown."""
    kept = _kept(points, spacing_m)
    sigma = [] if sigma_m is None or np.isnan(sigma_m).any() else np.round(sigma_m[kept], 3).tolist()
    return Stretch(status=STATUS_LABELS[status], points=_rounded(points[kept]), sigma_m=sigma)


def _polyline(points: FloatArray, spacing_m: float) -> Polyline:
    """Thin points (n, 2), metres."""
    return _rounded(points[_kept(points, spacing_m)])


def _kept(points: FloatArray, spacing_m: float) -> IntArray:
    """Keep about one point (n, 2) per ``spacing_m`` of the way, and both ends; return their indices."""
    near: IntArray = np.flatnonzero((np.abs(points) < MAX_EXTENT_M).all(axis=1))
    if len(near) == 0:
        return near
    way = arc_lengths(points[near])
    keep = np.flatnonzero(np.diff(np.floor(way / spacing_m), prepend=-1.0) > 0)
    kept: IntArray = near[np.unique(np.append(keep, len(near) - 1))]
    return kept


def _rounded(points: FloatArray) -> Polyline:
    """Points (n, 2) to the centimetre."""
    return [(x, y) for x, y in np.round(points, 2).tolist()]


def _scan_positions(wifi: pl.DataFrame) -> dict[int, Polyline]:
    """Mean labelled position of each scan, by the floor on which it began."""
    positions = wifi.select("x", "y").to_numpy()
    labelled = np.isfinite(positions[:, 0])
    _, first, scan = np.unique(wifi["scan"].to_numpy()[labelled], return_index=True, return_inverse=True)
    sums = np.column_stack([np.bincount(scan, values) for values in positions[labelled].T])
    drawn = slice(None, None, max(1, len(first) // MAX_POINTS))
    means, floor = (sums / np.bincount(scan)[:, None])[drawn], wifi["floor"].to_numpy()[labelled][first][drawn]
    return {number: _rounded(means[floor == number]) for number in np.unique(floor).tolist()}
