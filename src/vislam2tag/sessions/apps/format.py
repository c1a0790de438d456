"""What formats of other apps share: a session of poses and readings, with the landmarks found in its pictures."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.orientation import multiply, rotated
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.sessions.apps.pictures import Pictures
from vislam2tag.sessions.apps.units import tilt_findings
from vislam2tag.sessions.clock import pose_lag_of
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.session_files import SessionFiles, existing_files
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.tables.camera import POSE_COLUMNS, camera_track
from vislam2tag.sessions.tables.landmark_log import LANDMARK_SCHEMA, landmark_log
from vislam2tag.sessions.tables.raw_table import parse_table
from vislam2tag.sessions.tables.sensor_table import SENSOR_SCHEMA, sensor_table
from vislam2tag.sessions.tables.wifi_table import mark_repeated, parse_wifi
from vislam2tag.sessions.without_poses import no_landmarks
from vislam2tag.site.model import SessionRef

SIGHTINGS_FILE = "sightings.csv"
"""Landmarks found in pictures: ``id; t; tx; ty; tz; qx; qy; qz; qw; sigma``, poses in the camera's frame, metres."""
SIGHTING_SCHEMA = {**LANDMARK_SCHEMA, "sigma_m": pl.Float64}


class AppFormat(ABC):
    """Reads the folders of one app; ``files`` are the names of the roles' files, ``poses`` among them."""

    name: str
    files: ClassVar[Mapping[str, tuple[str, ...]]]

    def recognises(self, folder: Path) -> bool:
        """The app's file of poses has a name of its own."""
        return bool(existing_files(folder, {"poses": self.files["poses"]}))

    def input_files(self, folder: Path) -> list[Path]:
        """The files that :meth:`read` looks at, as far as they are there; pictures are not among them."""
        return existing_files(folder, {**self.files, "landmarks": (SIGHTINGS_FILE,)})

    @abstractmethod
    def poses(self, reading: SessionFiles) -> pl.DataFrame:
        """Poses of the camera (x right, y up, z back) in a frame with y up, metres, with ``row`` and ``time_ns``."""

    def sensors(self, reading: SessionFiles) -> pl.DataFrame:
        """Inertial readings as ``row`` and the columns of a sensor table, in the units of Android."""
        del reading
        return pl.DataFrame(schema={"row": pl.Int64, **SENSOR_SCHEMA})

    def pictures(self, folder: Path) -> Pictures | None:
        """Which pictures a session has; None where it has none. Raises SessionError where they cannot be used."""
        del folder
        return None

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read a session whole; problems are findings."""
        reading = SessionFiles(ref.folder, {**self.files, "landmarks": (SIGHTINGS_FILE,)})
        file = self.files["poses"][0]
        camera, found = camera_track(self.poses(reading), file, settings)
        readings, odd = sensor_table(self.sensors(reading), self.files.get("sensors", ("",))[0])
        reading.findings += [*found, *odd, *tilt_findings(camera, readings, file)]
        landmarks = _landmarks(reading, camera)
        no_scans = mark_repeated(parse_wifi(b"\n", "").rows)
        return Session(
            key=ref.key,
            camera=replace(camera, pose_lag_s=pose_lag_of(camera, readings)),
            landmarks=landmarks,
            presses_ns=np.empty(0, dtype=np.int64),
            tables={"wifi": no_scans, "sensors": readings},
            files=tuple(reading.files),
            findings=tuple(reading.findings),
        )


def _landmarks(reading: SessionFiles, camera: CameraTrack) -> LandmarkLog:
    if not reading.has("landmarks"):
        message = (
            "no landmarks are known: find them in the session's pictures with `vislam2tag sightings SURVEY`; until "
            "then it cannot be mapped"
        )
        reading.findings.append(
            Finding(kind="no_sightings", file=SIGHTINGS_FILE, count=1, message=message, severity=Severity.ERROR)
        )
        return no_landmarks()
    file, data = reading.load("landmarks")
    rows = reading.account("landmarks", data, parse_table(data, file, SIGHTING_SCHEMA))
    log, findings = landmark_log(_in_acs(rows, camera), file, camera)
    reading.findings += findings
    return replace(log, seen=np.ones(len(log.landmark), dtype=bool))


def _in_acs(rows: pl.DataFrame, camera: CameraTrack) -> pl.DataFrame:
    """Rows with poses in the camera's frame, turned into the ACS by the camera's pose at the same time."""
    usable = np.flatnonzero(camera.usable)
    if not len(usable):
        return rows
    at = np.searchsorted(camera.time_ns[usable], rows["time_ns"].to_numpy()).clip(max=len(usable) - 1)
    frame = usable[at]
    poses = rows.select(list(POSE_COLUMNS)).to_numpy()
    position = camera.position_acs[frame] + rotated(camera.orientation_acs[frame], poses[:, :3])
    orientation = multiply(camera.orientation_acs[frame], poses[:, 3:])
    turned = np.column_stack((position, orientation))
    return rows.with_columns(pl.Series(name, turned[:, i]) for i, name in enumerate(POSE_COLUMNS))
