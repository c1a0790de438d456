"""Walks that other apps recorded: axes and units of their trackers, and a session with landmarks found in pictures."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.given_files import json_values, read_bytes
from vislam2tag.common.findings import Finding, Severity, at_lines_if
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.core.transforms import multiply, rotated
from vislam2tag.intake.sensor_units import in_sensor_unit
from vislam2tag.intake.time_units import FRAMES, READINGS, Steps, ns_of_seconds
from vislam2tag.sessions.clocks import pose_lag_of
from vislam2tag.sessions.model import FileRecord, Session
from vislam2tag.sessions.readings import SENSOR_SCHEMA, WIFI_LINES, mark_repeated, sensor_rows, sensor_table
from vislam2tag.sessions.session_files import SessionFiles, existing_files, unread_files
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.text_tables import FieldTable, Parser
from vislam2tag.sessions.tracker_tables import LANDMARK_SCHEMA, POSE_COLUMNS, camera_track, landmark_log
from vislam2tag.sessions.without_poses import no_landmarks
from vislam2tag.site.model import SessionRef
from vislam2tag.site.site_table import is_file

HALF_TURN_ABOUT_X = np.array((1.0, 0.0, 0.0, 0.0))
"""Quaternion (x, y, z, w) between the two conventions of a camera, either way."""
_ACS_Q_Z_UP = np.array((-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))
"""Quaternion from a frame with z up to one with y up: (x, y, z) becomes (x, z, -y)."""
ALMOST_UNIT = 0.01
"""Rows of a rotation that were printed with few digits are unit vectors to within this."""


def in_acs(poses: FloatArray, camera: str, frame: str = "y-up") -> FloatArray:
    """Poses (n, 7), position and quaternion (x, y, z, w), of a camera with ``y-up`` or ``y-down`` in a frame with
    ``y-up`` or ``z-up``, as poses of ours.
    """
    position, orientation = poses[:, :3], poses[:, 3:]
    if camera == "y-down":
        orientation = multiply(orientation, np.broadcast_to(HALF_TURN_ABOUT_X, orientation.shape))
    if frame == "z-up":
        position = np.stack((position[:, 0], position[:, 2], -position[:, 1]), axis=1)
        orientation = multiply(np.broadcast_to(_ACS_Q_Z_UP, orientation.shape), orientation)
    return np.column_stack((position, orientation))


def poses_of_matrices(matrices: FloatArray) -> FloatArray:
    """Poses (n, 7), position and quaternion (x, y, z, w), of matrices (n, 3, 4) from the camera's frame to the ACS.

    A matrix that is not a rotation, or not finite, gives NaN.
    """
    from scipy.spatial.transform import Rotation  # a tenth of a second, which other formats do without

    rotation = matrices[:, :, :3]
    with np.errstate(invalid="ignore", over="ignore"):
        unit = np.abs(rotation @ rotation.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2)) < ALMOST_UNIT
        sound = unit & (np.linalg.det(np.where(unit[:, None, None], rotation, np.eye(3))) > 0)
    poses = np.full((len(matrices), 7), np.nan)
    if sound.any():
        poses[sound, 3:] = Rotation.from_matrix(rotation[sound]).as_quat()
        poses[sound, :3] = matrices[sound, :, 3]
    return poses


def pose_rows(rows: pl.DataFrame, poses: FloatArray) -> pl.DataFrame:
    """Put poses (n, 7) beside ``row`` and ``time_ns`` of ``rows``."""
    return rows.select("row", "time_ns").hstack(pose_series(poses))


def pose_series(poses: FloatArray) -> list[pl.Series]:
    """Poses (n, 7) as the columns of tables."""
    return [pl.Series(name, poses[:, i]) for i, name in enumerate(POSE_COLUMNS)]


TILT_DEG = 5.0
"""A frame tilted by more is not held level by its tracker: walkers' accelerations average out to a tenth of it."""
CAMERA_Q_PHONE = np.array((0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)))
"""Of an iPhone: quaternion (x, y, z, w) from the phone's axes (x right, y to the top, z out of the screen) to those of
its rear camera. Its pictures are rotated: x of a picture is the phone's -y, its y the phone's x."""


def specific_force(readings: FloatArray, file: str) -> tuple[FloatArray, list[Finding]]:
    """Readings (k, 3) of an iPhone's accelerometer in m/s^2 as Android has them, upwards at rest.

    iOS counts in g, and downwards at rest. Neither g nor m/s^2: NaN, and a finding.
    """
    converted, odd = in_sensor_unit(readings, "ACC", None, file)
    return (np.full(readings.shape, np.nan), odd) if converted is None else (-converted, [])


def tilt_findings(camera: CameraTrack, sensors: pl.DataFrame, file: str) -> list[Finding]:
    """Report poses in a frame that is not level, by the mean of an iPhone's accelerations in it.

    :mod:`vislam2tag.intake.pose_conventions` compares gravity, too, but does not replace this. It searches another
    convention, and needs a gyroscope and a turning phone to estimate the rotation between phone and camera. It only
    warns of a tilt that no convention explains. Here that rotation is known, so a few degrees show, and the session is
    refused.
    """
    from scipy.spatial.transform import Rotation

    usable = camera.usable
    rows = sensors.filter(pl.col("sensor") == "ACC").select("time_ns", "v1", "v2", "v3").drop_nans()
    if not rows.height or not usable.any():
        return []
    frames_ns = camera.time_ns[usable]
    at = np.searchsorted(frames_ns, rows["time_ns"].to_numpy())
    inside = (at > 0) & (at < len(frames_ns))
    if not inside.any():
        return []
    turned = Rotation.from_quat(camera.orientation_acs[usable][at[inside]]) * Rotation.from_quat(CAMERA_Q_PHONE)
    up = turned.apply(rows.select("v1", "v2", "v3").to_numpy()[inside]).mean(axis=0)
    tilt_deg = float(np.degrees(np.arccos(up[1] / np.linalg.norm(up))))
    if tilt_deg <= TILT_DEG:
        return []
    message = (
        f"the frame of these poses is tilted by {tilt_deg:.0f} degrees against gravity: the app does not level it, "
        "or its axes differ from those expected; positions on a floor cannot be computed from it. Choose gravity as "
        "the app's world alignment"
    )
    return [Finding(kind="not_level", file=file, count=1, message=message, severity=Severity.ERROR)]


@dataclass(frozen=True)
class Pictures:
    """Pictures of a session, ``k`` of them, in order of time.

    ``video`` holds them all, its frames numbered by ``frame`` (k,), or each is a file of its own. ``time_ns`` (k,) are
    the times of their poses; ``lens_px`` (k, 4) focal lengths and principal point fx, fy, cx, cy, pixels.
    """

    time_ns: IntArray
    lens_px: FloatArray
    video: Path | None = None
    frame: IntArray | None = None
    files: tuple[Path, ...] = ()


SIGHTINGS_FILE = "sightings.csv"
"""Landmarks found in pictures: ``id; t; tx; ty; tz; qx; qy; qz; qw; sigma``, poses in the camera's frame, metres."""
_SIGHTINGS = {"landmarks": (SIGHTINGS_FILE,)}
MATRIX = tuple(f"m{row}{column}" for row in range(3) for column in range(4))
"""Columns of a matrix (3, 4) from the camera's frame to the ACS, by rows."""


@dataclass(frozen=True)
class Readings:
    """A file of an iPhone's accelerations (``force``, in g or m/s^2) and turn rates (``rate``, rad/s), or of one."""

    table: FieldTable
    force: tuple[str, ...] = ()
    rate: tuple[str, ...] = ()


Keyframe = tuple[int, FloatArray, FloatArray]
"""One frame: time, ns; matrix (3, 4) from the camera's frame to the ACS; fx, fy, cx, cy (4,) of the lens, pixels."""


@dataclass(frozen=True)
class Keyframes:
    """A file of JSON for each frame, and perhaps a picture."""

    files: str
    """Pattern of the files' paths within a session."""
    frame: Callable[[Mapping[str, Any]], Keyframe]
    """Makes a frame of a file's content; raises KeyError, TypeError or ValueError if that is something else."""
    picture: Callable[[Path], Path]
    """Where the picture of a frame's file would be."""

    def of(self, contents: Iterable[bytes]) -> dict[int, Keyframe]:
        """Frames by the number of their file; those that are not understood are left out."""
        found = {}
        for number, content in enumerate(contents):
            with suppress(ValueError, KeyError, TypeError, OverflowError, AttributeError):
                found[number] = self.frame(json_values(content))
        return found


@dataclass(frozen=True)
class AppFormat:
    """Describes what one app records, and reads its folders."""

    name: str
    files: Mapping[str, tuple[str, ...]]
    """Names of the roles' files, ``poses`` among them."""
    poses: Keyframes | Callable[[SessionFiles], pl.DataFrame]
    """Files of frames, or what reads rows of poses in our axes, such as a :func:`pose_table`."""
    readings: Mapping[str, Readings] = field(default_factory=dict)
    """By role."""
    unused: re.Pattern[str] = re.compile("")
    """As in :func:`~.session_files.unread_files`."""
    video: Callable[[Path], Pictures | None] | None = None
    """The frames of a session's video; raises SessionError if they cannot be used."""

    def recognises(self, folder: Path) -> bool:
        """The app's file of poses has a name of its own, or a session has at least one frame."""
        if isinstance(self.poses, Keyframes):
            return any(folder.glob(self.poses.files))
        return bool(existing_files(folder, {"poses": self.files["poses"]}))

    def input_files(self, folder: Path) -> list[Path]:
        """The files that :meth:`read` looks at, as far as they are there; pictures are not among them."""
        if isinstance(self.poses, Keyframes):
            return [*sorted(folder.glob(self.poses.files)), *existing_files(folder, _SIGHTINGS)]
        return existing_files(folder, {**self.files, **_SIGHTINGS})

    def pictures(self, folder: Path) -> Pictures | None:
        """Which pictures a session has; None if it has none. Raises SessionError if they cannot be used."""
        if isinstance(self.poses, Keyframes):
            return _pictures_of(self.poses, sorted(folder.glob(self.poses.files)))
        return self.video(folder) if self.video else None

    def _may_have_pictures(self, ref: SessionRef) -> bool:
        """Whether there may be pictures to search for landmarks; those in a zip are not unpacked for reading."""
        if self.video is None and not isinstance(self.poses, Keyframes):
            return False
        if ref.beside is not None:
            return True
        try:
            return self.pictures(ref.folder) is not None
        except SessionError:
            return True

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read a session whole; problems are findings."""
        reading = SessionFiles(ref.folder, {**self.files, **_SIGHTINGS})
        file = self.files["poses"][0]
        poses = _keyframe_rows(self.poses, reading) if isinstance(self.poses, Keyframes) else self.poses(reading)
        camera, found = camera_track(poses, file, settings)
        sensors, odd = sensor_table(self._sensor_rows(reading), self.files.get("sensors", ("",))[0])
        reading.findings += [*found, *odd, *tilt_findings(camera, sensors, file)]
        if not isinstance(self.poses, Keyframes):
            reading.findings += unread_files(
                ref.folder, [path.name for path in self.input_files(ref.folder)], self.unused
            )
        landmarks = _landmarks(reading, camera, lambda: self._may_have_pictures(ref))
        tables = {"wifi": mark_repeated(WIFI_LINES.read(b"", "").rows, "bssid"), "sensors": sensors}
        return reading.session(ref.key, replace(camera, pose_lag_s=pose_lag_of(camera, sensors)), landmarks, tables)

    def _sensor_rows(self, reading: SessionFiles) -> pl.DataFrame:
        """Inertial readings as rows of a sensor table, in the units of Android."""
        tables = [pl.DataFrame(schema={"row": pl.Int64, **SENSOR_SCHEMA})]
        for role, readings in self.readings.items():
            if reading.has(role):
                file, both = self.files[role][0], list[pl.DataFrame]()
                rows = reading.noted(timed(reading.rows(role, readings.table.read), READINGS, file))
                if readings.force:
                    forces = reading.noted(specific_force(rows.select(readings.force).to_numpy(), file))
                    both.append(sensor_rows(rows, "ACC", [pl.Series(axis) for axis in forces.T]))
                if readings.rate:
                    both.append(sensor_rows(rows, "GYRO", [pl.col(axis) for axis in readings.rate]))
                tables.append(pl.concat(both).sort("row", maintain_order=True))
        return pl.concat(tables)


def timed(rows: pl.DataFrame, steps: Steps, file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """Rows with ``time_ns``, of seconds in their first column behind ``row`` if they have none.

    Reports seconds that are in another unit; ``steps`` limit how fast rows come.
    """
    if "time_ns" in rows.columns:
        return rows, []
    time_ns, odd = ns_of_seconds(rows.to_series(1).to_numpy(), steps, file)
    return rows.with_columns(time_ns=time_ns), odd


def pose_table(parse: Parser, camera: str = "y-up", frame: str = "y-up") -> Callable[[SessionFiles], pl.DataFrame]:
    """What reads a table of positions and quaternions, in axes as :func:`in_acs` has them, or of a :data:`MATRIX`.

    Its first column are times: nanoseconds if it is called ``time_ns``, else seconds.
    """

    def poses(reading: SessionFiles) -> pl.DataFrame:
        rows = reading.noted(timed(reading.rows("poses", parse), FRAMES, reading.name_of("poses")))
        if MATRIX[0] in rows.columns:
            return pose_rows(rows, poses_of_matrices(np.reshape(rows.select(MATRIX).to_numpy(), (-1, 3, 4))))
        return pose_rows(rows, in_acs(rows.select(list(POSE_COLUMNS)).to_numpy(), camera, frame))

    return poses


def _keyframe_rows(keyframes: Keyframes, reading: SessionFiles) -> pl.DataFrame:
    """Poses of all frames in order of time."""
    files = sorted(reading.folder.glob(keyframes.files))
    contents = [read_bytes(path) for path in files]
    found = keyframes.of(contents)
    name = files[0].name if files else ""
    reading.files.append(FileRecord.of(name, "poses", b"".join(contents), len(files), len(found)))
    message = "files of frames do not contain the expected pose; they are skipped. Line numbers count these files"
    odd = [number + 1 for number in range(len(files)) if number not in found]
    reading.findings += at_lines_if("malformed_lines", name, odd, message)
    times = [(number + 1, time_ns) for number, (time_ns, _, _) in found.items()]
    rows = pl.DataFrame(times, schema={"row": pl.Int64, "time_ns": pl.Int64}, orient="row")
    matrices = np.array([matrix for _, matrix, _ in found.values()]).reshape(-1, 3, 4)
    return pose_rows(rows, poses_of_matrices(matrices)).sort("time_ns", maintain_order=True)


def _pictures_of(keyframes: Keyframes, files: list[Path]) -> Pictures | None:
    """The frames that kept their picture."""
    found = keyframes.of(read_bytes(path) for path in files)
    kept = [
        (time_ns, lens_px, picture)
        for number, (time_ns, _, lens_px) in found.items()
        if is_file(picture := keyframes.picture(files[number]))
    ]
    if not kept:
        return None
    times, lenses, pictures = zip(*sorted(kept, key=lambda one: one[0]), strict=True)
    return Pictures(np.array(times), np.array(lenses), files=pictures)


def _landmarks(reading: SessionFiles, camera: CameraTrack, may_have_pictures: Callable[[], bool]) -> LandmarkLog:
    if not reading.has("landmarks"):
        message = (
            "the session's landmarks are unknown: only a plan of its floor can place it. To find landmarks in its "
            "pictures, run `vislam2tag sightings SURVEY`"
            if may_have_pictures()
            else "the session has neither landmarks nor pictures to find them in: only a plan of its floor can place it"
        )
        reading.note("no_sightings", SIGHTINGS_FILE, message)
        return no_landmarks()
    rows = reading.rows("landmarks", FieldTable({**LANDMARK_SCHEMA, "sigma_m": pl.Float64}).read)
    log = reading.noted(landmark_log(_turned_into_acs(rows, camera), SIGHTINGS_FILE, camera))
    return replace(log, seen=np.ones(len(log.landmark), dtype=bool))


def _turned_into_acs(rows: pl.DataFrame, camera: CameraTrack) -> pl.DataFrame:
    """Rows with poses in the camera's frame, turned into the ACS by the camera's pose at the same time."""
    usable = np.flatnonzero(camera.usable)
    if not len(usable):
        return rows
    at = np.searchsorted(camera.time_ns[usable], rows["time_ns"].to_numpy()).clip(max=len(usable) - 1)
    frame = usable[at]
    poses = rows.select(list(POSE_COLUMNS)).to_numpy()
    position = camera.position_acs[frame] + rotated(camera.orientation_acs[frame], poses[:, :3])
    orientation = multiply(camera.orientation_acs[frame], poses[:, 3:])
    return rows.with_columns(pose_series(np.column_stack((position, orientation))))
