"""ios_logger for iOS: ``ARposes.txt`` (t, tx, ty, tz, qw, qx, qy, qz), ``Frames.txt`` (t, number, fx, fy, cx, cy),
``Frames.m4v``, ``Accel.txt`` and ``Gyro.txt`` (t, x, y, z); seconds, ARKit's axes, accelerations in m/s^2 or g.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.sessions.apps.axes import pose_rows
from vislam2tag.sessions.apps.format import AppFormat
from vislam2tag.sessions.apps.pictures import Pictures
from vislam2tag.sessions.apps.text import app_rows, delimited
from vislam2tag.sessions.apps.units import inertial_rows
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.session_files import SessionFiles
from vislam2tag.sessions.tables.raw_table import ns_of_seconds
from vislam2tag.site.site_table import is_file

_POSES = dict.fromkeys(("time_s", "tx", "ty", "tz", "qw", "qx", "qy", "qz"), pl.Float64)
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
        rows = app_rows(reading, "poses", _POSES).with_columns(ns_of_seconds("time_s"))
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
        poses = delimited(read_bytes(folder / "ARposes.txt"), "ARposes.txt", _POSES).rows
        of_pose = poses.select("time_s", ns_of_seconds("time_s")).sort("time_s")
        both = frames.join_asof(of_pose, on="time_s", strategy="nearest", tolerance=SAME_FRAME_S).drop_nulls("time_ns")
        lens = both.select("fx", "fy", "cx", "cy").to_numpy()
        return Pictures(both["time_ns"].to_numpy(), np.asarray(lens), video, both["number"].to_numpy())


register(IosLoggerFormat())
