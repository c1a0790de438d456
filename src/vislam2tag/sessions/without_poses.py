"""Sessions that no tracker took part in: their inertial readings, their fixes, and frames that stand for moments."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import polars as pl

from vislam2tag.common.errors import SessionError
from vislam2tag.common.findings import Finding, Severity, at_lines_if
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import FixLog, InertialLog
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.intake.time_units import ANY
from vislam2tag.sessions.clocks import clock_of
from vislam2tag.sessions.model import FileRecord, Session, too_few_fixes
from vislam2tag.sessions.readings import pressure_log, readings_of
from vislam2tag.sessions.session_files import SessionFiles
from vislam2tag.sessions.text_tables import FieldTable
from vislam2tag.site.model import ControlPoints, SessionKey

FIXES_FILE = "fixes.csv"
"""Where the walker was at which moments: ``t; x; y``, boot-clock ns and metres in the BCS of the session's floor."""
_FIXES = FieldTable({"time_ns": pl.Int64, "x": pl.Float64, "y": pl.Float64})
FILES_OF_POSES = ("poses.csv", "CameraPose.csv")
_FILES_OF_TRACKERS = (*FILES_OF_POSES, "initPoses.csv", "LandmarkPose.csv", "AnchorPose.csv")
_ABSENCE = frozenset({"missing_file", "empty_file", "no_frames"})
FRAME_NS = 200_000_000
"""Frames without poses are this far apart: a walk is straight for so long."""
FEWEST_READINGS = 20


def inertial_log(sensors: pl.DataFrame) -> InertialLog | None:
    """Take the inertial readings out of a ``sensors`` table; None if accelerometer or gyroscope is missing."""
    force_ns, force = _readings(sensors, "ACC")
    rate_ns, rate = _readings(sensors, "GYRO")
    if min(len(force_ns), len(rate_ns)) < FEWEST_READINGS:
        return None
    orientation_ns, vector = _readings(sensors, "ROT")
    # A rotation vector is a unit quaternion whose fourth part need not be written, nor is it by the competition's app.
    real = np.sqrt(np.clip(1 - np.einsum("ni,ni->n", vector, vector), 0, 1))
    return InertialLog(force_ns, force, rate_ns, rate, orientation_ns, np.column_stack((vector, real)))


def track_without_poses(inertial: InertialLog, sensors: pl.DataFrame, fixes: FixLog | None) -> CameraTrack:
    """Make frames, five a second, none of which has a pose, over the time of the inertial readings."""
    first = max(int(inertial.force_ns[0]), int(inertial.rate_ns[0]))
    last = min(int(inertial.force_ns[-1]), int(inertial.rate_ns[-1]))
    time_ns = np.unique(np.append(np.arange(first, last, FRAME_NS), max(first, last)))
    n = len(time_ns)
    return CameraTrack(
        time_ns,
        np.full((n, 3), np.nan),
        np.tile((0.0, 0.0, 0.0, 1.0), (n, 1)),
        np.full(n, Status.OK, dtype=np.int8),
        pressure=pressure_log(sensors),
        inertial=inertial,
        fixes=fixes,
    )


def track_of_log(sensors: pl.DataFrame, fixes: FixLog | None, refused: str) -> CameraTrack:
    """The frames of a log without poses; raises SessionError, with these words, if it has no inertial readings."""
    if (inertial := inertial_log(sensors)) is None:
        raise SessionError(refused)
    return track_without_poses(inertial, sensors, fixes)


def session_of_log(
    key: SessionKey,
    camera: CameraTrack,
    tables: dict[str, pl.DataFrame],
    record: FileRecord,
    findings: Iterable[Finding],
) -> Session:
    """The session of a log that is one file without poses; an empty table ``ble`` is left out."""
    kept = {name: table for name, table in tables.items() if name != "ble" or table.height}
    none = np.empty(0, dtype=np.int64)
    return Session(key, camera, no_landmarks(), none, kept, (record,), tuple(findings))


def with_fixes(session: Session, reading: SessionFiles) -> Session:
    """Give a session without poses that has a file of fixes the frames and sensors that dead reckoning needs.

    It is then no fault that the tracker's files are missing. Any other session stays as it is.
    """
    if session.camera.usable.any() or not reading.has("fixes"):
        return session
    rows = reading.rows("fixes", _FIXES.read, ANY, clock_of(session.camera, session.tables["sensors"]))
    return _without_tracker(session, reading, rows, FIXES_FILE, "t; x; y")


def with_taps(session: Session, reading: SessionFiles, taps: pl.DataFrame, file: str) -> Session:
    """Give a session without poses those fixes that its taps on the plan are: ``row``, ``time_ns``, ``x``, ``y``,
    ``sigma_m``.

    A session stays as it is that has poses or a file of fixes, or no tap.
    """
    if session.camera.usable.any() or reading.has("fixes") or not taps.height:
        return session
    return _without_tracker(session, reading, taps, file, "taps on the plan")


def _without_tracker(session: Session, reading: SessionFiles, rows: pl.DataFrame, file: str, what: str) -> Session:
    """Give a session frames, inertial readings and its fixes, the ``rows`` of ``file``; ``what`` says one there."""
    fixes, found = _fixes(rows, file, what)
    session = replace(session, files=tuple(reading.files), findings=tuple(reading.findings))
    made = without_tracker(session, fixes)
    if made is None:
        message = (
            "there are no usable poses, and accelerometer or gyroscope readings are missing or too few; the session "
            "cannot be mapped"
        )
        found = [*found, Finding(kind="no_frames", file=file, count=1, message=message, severity=Severity.ERROR)]
        made = replace(session, findings=_without_absence(session.findings))
    return replace(made, findings=(*made.findings, *found))


def with_presses_as_fixes(session: Session, points: ControlPoints) -> Session:
    """Give a session without poses and fixes those that its presses make: the k-th at the floor's k-th control point.

    They are then no presses any more. A session stays as it is that has poses, fewer than two presses or more than
    there are points, or no inertial readings.
    """
    presses = len(session.presses_ns)
    if session.camera.tracked or session.camera.inertial is not None or not 1 < presses <= len(points.ids):
        return session
    time_ns = np.unique(session.presses_ns)
    names = tuple(f"press {k + 1}, {name}" for k, name in enumerate(points.ids[:presses]))
    if len(time_ns) < presses:
        return session
    made = without_tracker(session, FixLog(time_ns, points.position_bcs[:presses], names))
    return session if made is None else replace(made, presses_ns=time_ns[:0])


def without_tracker(session: Session, fixes: FixLog) -> Session | None:
    """A session whose tracker's files are missing as one that had none, with fixes; None without inertial readings."""
    inertial = inertial_log(session.tables["sensors"]) if "sensors" in session.tables else None
    if inertial is None:
        return None
    return replace(
        session,
        camera=track_without_poses(inertial, session.tables["sensors"], fixes),
        landmarks=no_landmarks(),
        findings=_without_absence(session.findings),
    )


def _without_absence(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Findings except those that files of trackers are missing or empty."""
    return tuple(each for each in findings if not (each.kind in _ABSENCE and each.file in _FILES_OF_TRACKERS))


def _fixes(rows: pl.DataFrame, file: str, what: str) -> tuple[FixLog, list[Finding]]:
    """Fixes in time order, each time once, and what is wrong with the rows of their file; ``what`` says one there."""
    finite = pl.all_horizontal(pl.col("x", "y").is_finite())
    odd = rows.filter(~finite)["row"].to_list()
    message = "coordinates must be finite numbers, metres; these fixes are not used"
    findings = at_lines_if("non_finite_values", file, odd, message)
    kept = rows.filter(finite).unique("time_ns", keep="first").sort("time_ns")
    if kept.height < 2:
        findings.append(too_few_fixes(file, what))
    names = tuple(f"line {row}" for row in kept["row"].to_list())
    sigma_m = None
    if "sigma_m" in kept.columns:
        sound = pl.col("sigma_m").is_finite() & (pl.col("sigma_m") > 0)
        sigma_m = kept.select(pl.when(sound).then("sigma_m").fill_null(np.nan))["sigma_m"].to_numpy()
    return FixLog(kept["time_ns"].to_numpy(), kept.select("x", "y").to_numpy(), names, sigma_m), findings


def no_landmarks() -> LandmarkLog:
    """A log in which no landmark was ever seen."""
    none, empty = np.empty(0, dtype=np.int64), np.empty((0, 3))
    return LandmarkLog((), none, none, empty, np.empty((0, 4)), np.empty(0, dtype=bool))


def _readings(sensors: pl.DataFrame, sensor: str) -> tuple[IntArray, FloatArray]:
    """Times (k,), increasing strictly, and the first three values (k, 3) of a sensor's sound readings."""
    time_ns, values = readings_of(sensors, sensor, ("v1", "v2", "v3"))
    sound = np.isfinite(values).all(axis=1)
    return time_ns[sound], values[sound]
