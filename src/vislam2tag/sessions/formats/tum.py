"""Poses as TUM and EuRoC write them, of any tracker: ``poses.tum`` or ``poses.csv`` with ``poses.toml`` beside it.

TUM: seconds, tx ty tz, qx qy qz qw. EuRoC (header ``#timestamp [ns], ...``): nanoseconds, position, then qw qx qy qz.
Neither tells the camera's axes nor which way is up, so that ``poses.toml`` must: ``camera = "y-up"`` (OpenGL, ARKit) or
``"y-down"`` (computer vision), ``frame = "y-up"`` or ``"z-up"``.
"""

from __future__ import annotations

from typing import Literal

import polars as pl
from pydantic import ValidationError

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.plain_files import toml_values
from vislam2tag.common.records import Record
from vislam2tag.sessions.apps.axes import in_acs, pose_rows
from vislam2tag.sessions.apps.format import AppFormat
from vislam2tag.sessions.apps.text import delimited
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.session_files import SessionFiles
from vislam2tag.sessions.tables.camera import POSE_COLUMNS
from vislam2tag.sessions.tables.raw_table import ns_of_seconds

_TUM = {"time_s": pl.Float64, **POSE_COLUMNS}
_EUROC = {"time_ns": pl.Int64, **dict.fromkeys(("tx", "ty", "tz", "qw", "qx", "qy", "qz"), pl.Float64)}


class PoseAxes(Record):
    """What ``poses.toml`` says of the camera's axes and of the frame that poses are in."""

    camera: Literal["y-up", "y-down"]
    frame: Literal["y-up", "z-up"]
    topic: str | None = None
    """Of an MCAP file, whose poses are meant where it has several."""


class TumFormat(AppFormat):
    """Reads folders with poses of an unnamed tracker."""

    name = "tum"
    files = {"poses": ("poses.tum", "poses_euroc.csv"), "axes": ("poses.toml",)}

    def poses(self, reading: SessionFiles) -> pl.DataFrame:
        """Poses of all frames. Raises SessionError where ``poses.toml`` does not say in which axes they are."""
        axes = pose_axes(reading)
        file, data = reading.load("poses")
        tum = file.endswith(".tum")
        rows = reading.account("poses", data, delimited(data, file, _TUM if tum else _EUROC, blanks=tum))
        rows = rows.with_columns(ns_of_seconds("time_s")) if tum else rows
        values = rows.select(list(POSE_COLUMNS)).to_numpy()
        return pose_rows(rows, in_acs(values, axes.camera, axes.frame))


def pose_axes(reading: SessionFiles) -> PoseAxes:
    """Read ``poses.toml``; raises SessionError where it is not there or says something else."""
    expected = 'write camera = "y-up" or "y-down" and frame = "y-up" or "z-up" into it (docs/reference/formats.md)'
    if not reading.has("axes"):
        raise SessionError(
            f"{reading.folder}: no poses.toml, without which the axes of poses are not known; {expected}"
        )
    file, data = reading.load("axes")
    try:
        return PoseAxes.model_validate(toml_values(data))
    except (ValueError, ValidationError) as error:
        raise SessionError(f"{reading.folder / file}: not understood; {expected}") from error


register(TumFormat())
