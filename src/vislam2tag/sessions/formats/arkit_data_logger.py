"""ARKit Data Logger for iOS: ``ARKit_camera_pose.txt``, nanoseconds and a 3 x 4 matrix by rows, ARKit's axes.

It records neither pictures nor readings: landmarks must come from elsewhere (``sightings.csv``).
"""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.sessions.apps.axes import pose_rows, poses_of_matrices
from vislam2tag.sessions.apps.format import AppFormat
from vislam2tag.sessions.apps.text import app_rows
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.session_files import SessionFiles

_ENTRIES = [f"m{row}{column}" for row in range(3) for column in range(4)]
_SCHEMA = {"time_ns": pl.Int64, **dict.fromkeys(_ENTRIES, pl.Float64)}


class ArkitDataLoggerFormat(AppFormat):
    """Reads the folders of ARKit Data Logger."""

    name = "arkit-data-logger"
    files = {"poses": ("ARKit_camera_pose.txt",)}

    def poses(self, reading: SessionFiles) -> pl.DataFrame:
        """Poses of all frames."""
        rows = app_rows(reading, "poses", _SCHEMA, blanks=True)
        return pose_rows(rows, poses_of_matrices(np.reshape(rows.select(_ENTRIES).to_numpy(), (-1, 3, 4))))


register(ArkitDataLoggerFormat())
