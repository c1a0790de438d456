"""What an app's accelerometer says of its own unit and of the frame that poses are in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.sessions.tables.sensor_table import SENSOR_VALUES

GRAVITY_M_S2 = 9.80665
TILT_DEG = 5.0
"""A frame tilted by more is not held level by its tracker: walkers' accelerations average out to a tenth of it."""
CAMERA_Q_PHONE = np.array((0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)))
"""Of an iPhone, quaternion (x, y, z, w) from the phone's axes (x right, y to the top, z out of the screen) to those of
its rear camera, whose pictures lie on the phone's left side: x of a picture is the phone's -y, its y the phone's x."""
_UNITS = {"g": (0.8, 1.25), "m/s2": (7.8, 12.3)}


def specific_force(readings: FloatArray, file: str) -> tuple[FloatArray, list[Finding]]:
    """Readings (k, 3) of an iPhone's accelerometer in m/s^2 as Android has them, upwards at rest.

    iOS counts in g, and downwards at rest. Neither g nor m/s^2: NaN, and a finding.
    """
    usual = float(np.median(np.linalg.norm(readings, axis=1))) if len(readings) else np.nan
    if _UNITS["g"][0] <= usual <= _UNITS["g"][1]:
        return -GRAVITY_M_S2 * readings, []
    if _UNITS["m/s2"][0] <= usual <= _UNITS["m/s2"][1]:
        return -readings, []
    if not len(readings):
        return readings, []
    message = (
        f"accelerations are usually {usual:.3g}, and gravity alone is 1 g or 9.81 m/s2: their unit is not known, or "
        "gravity was taken out of them; they are not used"
    )
    problem = Finding(kind="unknown_unit", file=file, count=len(readings), message=message)
    return np.full(readings.shape, np.nan), [problem]


def inertial_rows(
    rows: pl.DataFrame, force: Sequence[str], rate: Sequence[str], file: str
) -> tuple[pl.DataFrame, list[Finding]]:
    """Make the rows of a sensor table of an iPhone's ``row``, ``time_ns`` and the columns of its accelerations (in g or
    m/s^2, told from the readings) and turn rates (rad/s); one of the two may be missing.
    """
    parts: list[pl.DataFrame] = []
    findings: list[Finding] = []
    for sensor, names in (("ACC", force), ("GYRO", rate)):
        if names:
            values = rows.select(names).to_numpy()
            if sensor == "ACC":
                values, findings = specific_force(values, file)
            parts.append(_readings(rows, sensor, values))
    return pl.concat(parts).sort("row", maintain_order=True), findings


def _readings(rows: pl.DataFrame, sensor: str, values: FloatArray) -> pl.DataFrame:
    empty = np.zeros(len(values))
    columns = [pl.Series(name, values[:, i] if i < 3 else empty) for i, name in enumerate(SENSOR_VALUES)]
    return rows.select("row", "time_ns", pl.lit(sensor).alias("sensor")).hstack(columns)


def tilt_findings(camera: CameraTrack, sensors: pl.DataFrame, file: str) -> list[Finding]:
    """Report poses in a frame that is not level, by the mean of an iPhone's accelerations in it.

    :mod:`vislam2tag.intake.poses` compares gravity, too, but does not replace this: it looks for another convention,
    needs a gyroscope and a turning phone because it estimates the rotation between phone and camera, and only warns of
    a tilt that no convention explains. Here that rotation is known, so a few degrees show, and the session is refused.
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
        "or its axes are others than expected; positions on a floor cannot be told from it"
    )
    return [Finding(kind="not_level", file=file, count=1, message=message, severity=Severity.ERROR)]
