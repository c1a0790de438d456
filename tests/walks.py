"""Small hand-made walks for unit tests: a camera on a line, landmarks beside it."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, with_rows
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks
from vislam2tag.core.transforms import Similarity2

FRAME_NS = 33_333_333


def landmarks_at(positions: dict[str, tuple[float, float]], sigma_m: float = 0.02) -> Landmarks:
    """Surveyed landmarks of floor 0."""
    m = len(positions)
    unknown = np.full(m, np.nan)
    return Landmarks(
        ids=tuple(positions),
        floor=np.zeros(m, dtype=np.int64),
        position_bcs=np.array(list(positions.values()), dtype=np.float64).reshape(m, 2),
        covariance_bcs=np.repeat(np.eye(2)[None] * sigma_m**2, m, axis=0),
        z_m=unknown,
        heading_rad=unknown,
        heading_sigma_rad=unknown,
    )


def to_acs(plane: FloatArray, height: float | FloatArray = 0.0) -> FloatArray:
    """Lift points of the ACS plane (n, 2) to ACS positions (n, 3)."""
    return np.column_stack((plane[:, 0], np.broadcast_to(height, len(plane)), -plane[:, 1]))


def camera_on(plane: FloatArray, height: float = 1.4) -> CameraTrack:
    """Frames at 30 Hz at these points of the ACS plane (n, 2)."""
    n = len(plane)
    return CameraTrack(
        time_ns=np.arange(n, dtype=np.int64) * FRAME_NS + 10**12,
        position_acs=to_acs(plane, height),
        orientation_acs=np.tile([0.0, 0, 0, 1], (n, 1)),
        status=np.zeros(n, dtype=np.int8),
    )


def log_of(camera: CameraTrack, acs: dict[str, FloatArray], lost: BoolArray | None = None) -> LandmarkLog:
    """Log of landmarks with logged ACS positions (n, 3), one row a frame; NaN rows are not logged.

    Frames where ``lost`` is set carry the camera's own position.
    """
    n = len(camera.time_ns)
    lost = np.zeros(n, dtype=bool) if lost is None else lost
    rows = []
    for i, position in enumerate(acs.values()):
        seen = np.flatnonzero(np.isfinite(position[:, 0]))
        logged = np.where(lost[seen, None], camera.position_acs[seen], position[seen])
        rows.append((np.full(len(seen), i), seen, logged, lost[seen]))
    return LandmarkLog(
        ids=tuple(acs),
        landmark=np.concatenate([row[0] for row in rows]),
        frame=np.concatenate([row[1] for row in rows]),
        position_acs=np.concatenate([row[2] for row in rows]),
        orientation_acs=np.tile([0.0, 0, 0, 1], (sum(len(row[1]) for row in rows), 1)),
        lost=np.concatenate([row[3] for row in rows]),
    )


def corridor_walk(
    bcs_T_acs: Similarity2, stations: dict[str, tuple[float, float]], length_m: float = 40.0
) -> tuple[CameraTrack, LandmarkLog, Landmarks, FloatArray]:
    """Walk along y = 0 at 3 cm a frame, seen by a perfect tracker.

    A landmark is logged from 2 m before it on. Returns camera, log, surveyed landmarks and the truth (n, 2) in BCS.
    """
    truth = np.column_stack((np.arange(0, length_m, 0.03), np.zeros(int(np.ceil(length_m / 0.03)))))
    acs_T_bcs = bcs_T_acs.inverse
    camera = camera_on(acs_T_bcs @ truth)
    acs = {}
    for name, station in stations.items():
        position = np.repeat(to_acs(acs_T_bcs @ np.array([station]), 1.4), len(truth), axis=0)
        position[truth[:, 0] < station[0] - 2] = np.nan
        acs[name] = position
    return camera, log_of(camera, acs), landmarks_at(stations), truth


def rows_of_log(log: LandmarkLog, keep: BoolArray) -> LandmarkLog:
    """Keep the rows of a mask (k,), and all ids."""
    return with_rows(log, keep, "landmark", "frame", "position_acs", "orientation_acs", "lost")
