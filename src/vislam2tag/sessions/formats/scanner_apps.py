"""Scanner apps for iOS, one description each."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.core.arrays import FloatArray
from vislam2tag.sessions.apps import (
    AppFormat,
    Keyframe,
    KeyframeFormat,
    Pictures,
    app_rows,
    inertial_rows,
    other_camera,
    pose_rows,
    poses_of_matrices,
)
from vislam2tag.sessions.model import FindingSettings, Session
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.session_files import SessionFiles
from vislam2tag.sessions.text_tables import RawTable, delimited, header_of, ns_of_seconds
from vislam2tag.survey.model import SessionRef
from vislam2tag.survey.site_table import is_file

_ENTRIES = [f"m{row}{column}" for row in range(3) for column in range(4)]
_ARKIT_SCHEMA = {"time_ns": pl.Int64, **dict.fromkeys(_ENTRIES, pl.Float64)}


class ArkitDataLoggerFormat(AppFormat):
    """Reads the folders of ARKit Data Logger."""

    name = "arkit-data-logger"
    files = {"poses": ("ARKit_camera_pose.txt",)}

    def poses(self, reading: SessionFiles) -> pl.DataFrame:
        """Poses of all frames."""
        rows = app_rows(reading, "poses", _ARKIT_SCHEMA, blanks=True)
        return pose_rows(rows, poses_of_matrices(np.reshape(rows.select(_ENTRIES).to_numpy(), (-1, 3, 4))))


register(ArkitDataLoggerFormat())


_IOS_POSES = dict.fromkeys(("time_s", "tx", "ty", "tz", "qw", "qx", "qy", "qz"), pl.Float64)
_FRAMES = {"time_s": pl.Float64, "number": pl.Int64, **dict.fromkeys(("fx", "fy", "cx", "cy"), pl.Float64)}
_READINGS = dict.fromkeys(("time_s", "x", "y", "z"), pl.Float64)
SAME_FRAME_S = 0.005
"""A pose this near to a picture is of the same frame: they come 60 times a second at most."""


class IosLoggerFormat(AppFormat):
    """Reads the folders of ios_logger."""

    name = "ios-logger"
    files = {"poses": ("ARposes.txt",), "sensors": ("Accel.txt",), "rates": ("Gyro.txt",), "frames": ("Frames.txt",)}

    def poses(self, reading: SessionFiles) -> pl.DataFrame:
        """Poses of all frames."""
        rows = app_rows(reading, "poses", _IOS_POSES).with_columns(ns_of_seconds("time_s"))
        return pose_rows(rows, rows.select("tx", "ty", "tz", "qx", "qy", "qz", "qw").to_numpy())

    def sensors(self, reading: SessionFiles) -> pl.DataFrame:
        """Accelerometer and gyroscope, as far as they were logged."""
        tables = [super().sensors(reading)]
        for role, force, rate in (("sensors", ("x", "y", "z"), ()), ("rates", (), ("x", "y", "z"))):
            if reading.has(role):
                rows = app_rows(reading, role, _READINGS).with_columns(ns_of_seconds("time_s"))
                table, findings = inertial_rows(rows, force, rate, self.files[role][0])
                tables.append(table)
                reading.findings += findings
        return pl.concat(tables)

    def pictures(self, folder: Path) -> Pictures | None:
        """The video's frames, each with the pose of the same moment."""
        video = folder / "Frames.m4v"
        if not is_file(video):
            return None
        try:
            data = read_bytes(folder / "Frames.txt")
        except OSError as error:
            raise SessionError(f"{folder / 'Frames.txt'}: the camera's lens is not known without it") from error
        frames = delimited(data, "Frames.txt", _FRAMES).rows.sort("time_s")
        poses = delimited(read_bytes(folder / "ARposes.txt"), "ARposes.txt", _IOS_POSES).rows
        of_pose = poses.select("time_s", ns_of_seconds("time_s")).sort("time_s")
        both = frames.join_asof(of_pose, on="time_s", strategy="nearest", tolerance=SAME_FRAME_S).drop_nulls("time_ns")
        lens = both.select("fx", "fy", "cx", "cy").to_numpy()
        return Pictures(both["time_ns"].to_numpy(), np.asarray(lens), video, both["number"].to_numpy())


register(IosLoggerFormat())


POSES = ("timestamp", "frame", "x", "y", "z", "qx", "qy", "qz", "qw")
LENS = ("fx", "fy", "cx", "cy")
READINGS = ("timestamp", "a_x", "a_y", "a_z", "alpha_x", "alpha_y", "alpha_z")


class StrayScannerFormat(AppFormat):
    """Reads the folders of Stray Scanner."""

    name = "stray-scanner"
    files = {"poses": ("odometry.csv",), "sensors": ("imu.csv",), "lens": ("camera_matrix.csv",)}

    def poses(self, reading: SessionFiles) -> pl.DataFrame:
        """Poses of all frames."""
        file, data = reading.load("poses")
        rows = reading.account("poses", data, _poses(data, file)).with_columns(ns_of_seconds("timestamp"))
        values = rows.select(POSES[2:]).to_numpy()
        return pose_rows(rows, np.column_stack((values[:, :3], other_camera(values[:, 3:]))))

    def sensors(self, reading: SessionFiles) -> pl.DataFrame:
        """Accelerometer and gyroscope, each row of the file as one reading of both."""
        if not reading.has("sensors"):
            return super().sensors(reading)
        file, data = reading.load("sensors")
        rows = reading.account("sensors", data, delimited(data, file, dict.fromkeys(READINGS, pl.Float64), header=True))
        values = rows.with_columns(ns_of_seconds("timestamp"))
        table, findings = inertial_rows(values, READINGS[1:4], READINGS[4:], file)
        reading.findings += findings
        return table

    def pictures(self, folder: Path) -> Pictures | None:
        """The video's frames, by the number that each pose gives."""
        video = folder / "rgb.mp4"
        if not is_file(video):
            return None
        rows = _poses(read_bytes(folder / "odometry.csv"), "odometry.csv").rows.with_columns(ns_of_seconds("timestamp"))
        own = set(LENS) <= set(rows.columns)
        lens = rows.select(LENS).to_numpy() if own else np.tile(_lens(folder / "camera_matrix.csv"), (rows.height, 1))
        return Pictures(rows["time_ns"].to_numpy(), lens, video, rows["frame"].to_numpy())


def _poses(data: bytes, file: str) -> RawTable:
    """The columns that the file has: newer versions of the app add the lens, and what may follow it."""
    kinds: dict[str, type[pl.DataType]] = dict.fromkeys(POSES, pl.Float64) | {"frame": pl.Int64}
    return delimited(data, file, kinds | dict.fromkeys(header_of(data)[len(POSES) :], pl.Float64), header=True)


def _lens(path: Path) -> FloatArray:
    """Focal lengths and principal point (4,), pixels; raises SessionError where the file holds no 3 x 3 numbers."""
    try:
        matrix = np.array(
            [line.split(",") for line in read_bytes(path).decode().split("\n") if line.strip()], dtype=np.float64
        ).reshape(3, 3)
    except (OSError, ValueError) as error:
        raise SessionError(
            f"{path}: expected the camera's 3 x 3 matrix, without which no landmark can be placed"
        ) from error
    return matrix[(0, 1, 0, 1), (0, 1, 2, 2)]


register(StrayScannerFormat())


class PolycamFormat(KeyframeFormat):
    """Reads the folders of Polycam's raw data."""

    name = "polycam"
    files = {"poses": ("cameras",)}

    def frame_files(self, folder: Path) -> list[Path]:
        """The files of all frames."""
        return sorted(folder.glob("keyframes/cameras/*.json"))

    def keyframe(self, values: Mapping[str, Any]) -> Keyframe:
        """Make a frame of its file's content."""
        matrix = np.array([[float(values[f"t_{row}{column}"]) for column in range(4)] for row in range(3)])
        lens = np.array([float(values[name]) for name in ("fx", "fy", "cx", "cy")])
        return Keyframe(int(values["timestamp"]) * 1000, matrix, lens)

    def picture(self, file: Path) -> Path:
        """The picture of the same name."""
        return file.parent.parent / "images" / f"{file.stem}.jpg"


register(PolycamFormat())


class Scanner3dAppFormat(KeyframeFormat):
    """Reads the folders of 3D Scanner App."""

    name = "scanner-3d-app"
    files = {"poses": ("frame_00000.json",)}

    def frame_files(self, folder: Path) -> list[Path]:
        """The files of all frames."""
        return sorted(folder.glob("frame_*.json"))

    def keyframe(self, values: Mapping[str, Any]) -> Keyframe:
        """Make a frame of its file's content."""
        matrix = np.reshape(np.asarray(values["cameraPoseARFrame"], dtype=np.float64), (4, 4))[:3]
        lens = np.reshape(np.asarray(values["intrinsics"], dtype=np.float64), (3, 3))
        return Keyframe(round(float(values["time"]) * 1e9), matrix, lens[(0, 1, 0, 1), (0, 1, 2, 2)])

    def picture(self, file: Path) -> Path:
        """The picture of the same name."""
        return file.with_suffix(".jpg")


register(Scanner3dAppFormat())


_METADATA = ("metadata", "metadata.json", "EXR_RGBD/metadata.json")
_PICTURES = ("rgbd", "rgb", "EXR_RGBD/rgb")


class Record3dFormat:
    """Recognises what Record3D exports, so that it is named."""

    name = "record3d"

    def recognises(self, folder: Path) -> bool:
        """Its metadata lie beside its pictures."""
        return any(
            is_file(folder / metadata) and (folder / pictures).is_dir()
            for metadata, pictures in zip(_METADATA, _PICTURES, strict=True)
        )

    def input_files(self, folder: Path) -> list[Path]:
        """The metadata."""
        return [folder / name for name in _METADATA if is_file(folder / name)]

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Raise SessionError: nothing tells which way is up."""
        del settings
        raise SessionError(
            f"{ref.key}: Record3D does not level its frame by gravity and logs no accelerometer to level it by: "
            "nothing tells where the floor is: record with Stray Scanner or another app of docs/how-to/iphone.md"
        )


register(Record3dFormat())
