"""Stray Scanner for iOS: ``odometry.csv``, ``camera_matrix.csv``, ``rgb.mp4``, ``imu.csv`` (its docs/format.md).

Its camera has y down and z ahead, its frame y up; accelerations are in g, whatever its documentation says.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.core.arrays import FloatArray
from vislam2tag.sessions.apps.axes import other_camera, pose_rows
from vislam2tag.sessions.apps.format import AppFormat
from vislam2tag.sessions.apps.pictures import Pictures
from vislam2tag.sessions.apps.text import delimited, header_of
from vislam2tag.sessions.apps.units import inertial_rows
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.session_files import SessionFiles
from vislam2tag.sessions.tables.raw_table import RawTable, ns_of_seconds
from vislam2tag.site.site_table import is_file

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
