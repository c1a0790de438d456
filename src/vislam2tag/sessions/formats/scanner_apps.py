"""Scanner apps for iOS, one description each; axes are ARKit's (y up) unless stated otherwise.

``arkit-data-logger``: ``ARKit_camera_pose.txt``, nanoseconds and a 3 x 4 matrix by rows, neither pictures nor readings,
so that landmarks must come from elsewhere (``sightings.csv``). ``ios-logger``: ``ARposes.txt`` (t, tx, ty, tz, qw, qx,
qy, qz), ``Frames.txt`` (t, number, fx, fy, cx, cy), ``Frames.m4v``, ``Accel.txt`` and ``Gyro.txt`` (t, x, y, z),
seconds. ``stray-scanner`` (its docs/format.md): ``odometry.csv``, ``camera_matrix.csv``, ``rgb.mp4``, ``imu.csv``; its
camera has y down and z ahead, and accelerations are in g, whatever its documentation says.

``polycam``: raw keyframes ``keyframes/cameras/TIME.json`` with ``t_00`` to ``t_23`` and the lens, microseconds;
``corrected_cameras`` were moved afterwards, to fit pictures that were undistorted, and are not read.
``scanner-3d-app``: ``frame_00000.json`` with ``cameraPoseARFrame`` (4 x 4 by rows), ``intrinsics`` and ``time``,
seconds, beside ``frame_00000.jpg`` if it kept the picture. ``record3d`` is recognised and refused: its poses
(``metadata``) are in a frame that starts as the phone was held, not levelled by gravity, and it logs no accelerometer
to level it by.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from vislam2tag.common.documentation import page_of
from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.core.arrays import FloatArray
from vislam2tag.intake.time_units import FRAMES
from vislam2tag.sessions.apps import MATRIX, AppFormat, Keyframe, Keyframes, Pictures, Readings, pose_table, timed
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.session_files import FileFormat, SessionFiles
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.text_tables import Columns, FieldTable, RawTable, header_of
from vislam2tag.site.model import SessionKey
from vislam2tag.site.site_table import is_file

LENS = ("fx", "fy", "cx", "cy")
_FROM_MATRIX = (0, 1, 0, 1), (0, 1, 2, 2)
"""Where a matrix (3, 3) of a lens has them."""
SAME_FRAME_S = 0.005
"""A pose this near to a picture is of the same frame: they come 60 times a second at most."""
AXES = ("x", "y", "z")


def _numbers(*names: str, whole: str = "") -> Columns:
    """Columns of numbers, and of one that is whole."""
    return {name: pl.Int64 if name == whole else pl.Float64 for name in names}


_ARKIT = FieldTable(_numbers("time_ns", *MATRIX, whole="time_ns"), " ")
_IOS_POSES = FieldTable(_numbers("time_s", "tx", "ty", "tz", "qw", "qx", "qy", "qz"), ",")
_IOS_FRAMES = FieldTable(_numbers("time_s", "number", *LENS, whole="number"), ",")
_IOS_READINGS = FieldTable(_numbers("time_s", *AXES), ",")
_STRAY_POSES = _numbers("timestamp", "frame", "tx", "ty", "tz", "qx", "qy", "qz", "qw", whole="frame")
_STRAY_READINGS = FieldTable(_numbers("timestamp", "a_x", "a_y", "a_z", "w_x", "w_y", "w_z"), ",", header=True)


def _ios_video(folder: Path) -> Pictures | None:
    """The video's frames, each with the pose of the same moment."""
    video = folder / "Frames.m4v"
    if not is_file(video):
        return None
    try:
        data = read_bytes(folder / "Frames.txt")
    except OSError as error:
        raise SessionError(
            f"{folder / 'Frames.txt'}: cannot be read ({error.strerror}); it describes the camera's lens"
        ) from error
    frames = _IOS_FRAMES.read(data, "Frames.txt").rows.sort("time_s")
    poses = timed(_IOS_POSES.read(read_bytes(folder / "ARposes.txt"), "ARposes.txt").rows, FRAMES, "ARposes.txt")[0]
    of_pose = poses.select("time_s", "time_ns").sort("time_s")
    both = frames.join_asof(of_pose, on="time_s", strategy="nearest", tolerance=SAME_FRAME_S).drop_nulls("time_ns")
    return Pictures(both["time_ns"].to_numpy(), both.select(LENS).to_numpy(), video, both["number"].to_numpy())


def _stray_table(data: bytes, file: str) -> RawTable:
    """Poses with the columns that the file has: newer versions of the app add the lens, and what may follow it."""
    more = _numbers(*header_of(data)[len(_STRAY_POSES) :])
    return FieldTable({**_STRAY_POSES, **more}, ",", header=True).read(data, file)


def _stray_video(folder: Path) -> Pictures | None:
    """The video's frames, by the number that each pose gives."""
    video = folder / "rgb.mp4"
    if not is_file(video):
        return None
    rows = timed(_stray_table(read_bytes(folder / "odometry.csv"), "odometry.csv").rows, FRAMES, "odometry.csv")[0]
    own = set(LENS) <= set(rows.columns)
    lens = rows.select(LENS).to_numpy() if own else np.tile(_stray_lens(folder / "camera_matrix.csv"), (rows.height, 1))
    return Pictures(rows["time_ns"].to_numpy(), lens, video, rows["frame"].to_numpy())


def _stray_lens(path: Path) -> FloatArray:
    """Focal lengths and principal point (4,), pixels; raises SessionError if the file does not contain 3 x 3
    numbers."""
    try:
        lines = [line.split(",") for line in read_bytes(path).decode().split("\n") if line.strip()]
        return np.array(lines, dtype=np.float64).reshape(3, 3)[_FROM_MATRIX]
    except (OSError, ValueError) as error:
        raise SessionError(f"{path}: expected the camera's 3 x 3 matrix, which is needed to place landmarks") from error


def _polycam_frame(values: Mapping[str, Any]) -> Keyframe:
    matrix = np.array([[float(values[f"t_{row}{column}"]) for column in range(4)] for row in range(3)])
    return int(values["timestamp"]) * 1000, matrix, np.array([float(values[name]) for name in LENS])


def _polycam_picture(file: Path) -> Path:
    return file.parents[1] / "images" / f"{file.stem}.jpg"


def _scanner_frame(values: Mapping[str, Any]) -> Keyframe:
    matrix = np.reshape(np.asarray(values["cameraPoseARFrame"], dtype=np.float64), (4, 4))[:3]
    lens = np.reshape(np.asarray(values["intrinsics"], dtype=np.float64), (3, 3))
    return round(float(values["time"]) * 1e9), matrix, lens[_FROM_MATRIX]


_RECORD3D = {"metadata": "rgbd", "metadata.json": "rgb", "EXR_RGBD/metadata.json": "EXR_RGBD/rgb"}
"""Metadata of Record3D, and the pictures beside them."""


def _is_record3d(folder: Path) -> bool:
    return any(is_file(folder / file) and (folder / pictures).is_dir() for file, pictures in _RECORD3D.items())


def _record3d(reading: SessionFiles, key: SessionKey, settings: FindingSettings) -> Session:
    """Raise SessionError: the direction of gravity is unknown."""
    del reading, settings
    raise SessionError(
        f"{key}: Record3D neither aligns its frame with gravity nor logs an accelerometer, so the floor cannot be "
        f"found: record with Stray Scanner or another app of {page_of('how-to/iphone')}"
    )


register(AppFormat("arkit-data-logger", {"poses": ("ARKit_camera_pose.txt",)}, pose_table(_ARKIT.read)))
register(
    AppFormat(
        "ios-logger",
        {"poses": ("ARposes.txt",), "sensors": ("Accel.txt",), "rates": ("Gyro.txt",), "frames": ("Frames.txt",)},
        pose_table(_IOS_POSES.read),
        readings={"sensors": Readings(_IOS_READINGS, force=AXES), "rates": Readings(_IOS_READINGS, rate=AXES)},
        video=_ios_video,
    )
)
register(
    AppFormat(
        "stray-scanner",
        {"poses": ("odometry.csv",), "sensors": ("imu.csv",), "lens": ("camera_matrix.csv",)},
        pose_table(_stray_table, camera="y-down"),
        readings={"sensors": Readings(_STRAY_READINGS, force=("a_x", "a_y", "a_z"), rate=("w_x", "w_y", "w_z"))},
        video=_stray_video,
    )
)
register(
    AppFormat(
        "polycam",
        {"poses": ("cameras",)},
        Keyframes("keyframes/cameras/*.json", _polycam_frame, _polycam_picture),
    )
)
register(
    AppFormat(
        "scanner-3d-app",
        {"poses": ("frame_00000.json",)},
        Keyframes("frame_*.json", _scanner_frame, lambda file: file.with_suffix(".jpg")),
    )
)
register(FileFormat("record3d", {"metadata": tuple(_RECORD3D)}, _is_record3d, _record3d))
