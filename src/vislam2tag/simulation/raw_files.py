"""Simulated sessions in the published raw layout (docs/reference/session-files.md), with their truth and site files.

The site's files are floors, landmarks with survey errors, and control points.
"""

from __future__ import annotations

import io
from collections.abc import Sequence

import numpy as np
import polars as pl

from vislam2tag.core.arrays import AnyArray, FloatArray, IntArray
from vislam2tag.core.transforms import wrapped
from vislam2tag.simulation.imu import SENSOR_TYPES, ImuLog
from vislam2tag.simulation.model import SimulatedBuilding, SimulatedFloor, TrackerLog, floor_at, position_at
from vislam2tag.simulation.phones import SimulatedSession
from vislam2tag.simulation.radio import BleLog, WifiLog
from vislam2tag.simulation.settings import SiteColumn, stream
from vislam2tag.site.settings import SurveySettings

PUBLISHED_NAMES = {
    "poses": "poses.csv",
    "landmarks": "initPoses.csv",
    "sensors": "sensors.csv",
    "wifi": "wifi.csv",
    "ble": "ble.csv",
    "presses": "refMarker.csv",
    "station": "tachy.csv",
    "fixes": "fixes.csv",
    "truth": "truth.csv",
}
"""File name of each role, as the phone app writes it."""
PAPER_NAMES = PUBLISHED_NAMES | {
    "poses": "CameraPose.csv",
    "landmarks": "LandmarkPose.csv",
    "sensors": "Sensors.csv",
    "wifi": "WiFi.csv",
}
"""File name of each role, as in the paper's text."""
DECIMALS = 6

_Columns = dict[str, AnyArray | pl.Series | str]

SessionText = dict[str, bytes]
"""Content of each file of a session, by role."""


def session_text(session: SimulatedSession) -> SessionText:
    """Return every file of a session; roles without data (BLE, presses, station) are skipped."""
    text = {
        "poses": _poses(session.tracker, session.marks.poses),
        "landmarks": _landmarks(session.tracker, session.marks.poses),
        "sensors": _sensors(session.imu, session.marks.sensors),
        "wifi": _wifi(session.wifi, session.building),
        "truth": _truth(session),
    }
    if not any(floor.landmark_ids for floor in session.building.floors):
        del text["landmarks"]
    if session.ble is not None:
        text["ble"] = _ble(session.ble)
    if len(session.presses_ns):
        presses: _Columns = {"n": np.arange(len(session.presses_ns)), "t": session.presses_ns}
        text["presses"] = _csv(presses, ".")
    if session.fixes is not None:
        x, y = session.fixes.position.T
        text["fixes"] = _csv({"t": session.fixes.time_ns, "x": x, "y": y}, ".")
    if session.station is not None:
        time_ns = session.station.time_ns + session.station_offset_ns
        text["station"] = station_table(time_ns, session.station.position)
    return text


def station_table(wall_time_ns: IntArray, position: FloatArray) -> bytes:
    """Text of ``tachy.csv``: wall-clock time (k,) in Unix ns, position (k, 2) in the station's frame, metres."""
    frame = pl.DataFrame({"time": wall_time_ns, "X": position[:, 0], "Y": position[:, 1]})
    wall_time = pl.col("time").cast(pl.Datetime("ns")).dt.to_string("%Y-%m-%d %H:%M:%S%.3f")
    return _text(frame.with_columns(wall_time), separator=";", precision=4, header=True)


def comma_separated(frame: pl.DataFrame, header: bool) -> bytes:
    """Text of a table of the site: commas, points, four decimals."""
    return _text(frame, precision=4, header=header)


def _poses(tracker: TrackerLog, mark: str) -> bytes:
    columns: _Columns = {"t": tracker.time_ns}
    return _csv(columns | _pose_columns(tracker.position_acs, tracker.orientation_acs), mark)


def _landmarks(tracker: TrackerLog, mark: str) -> bytes:
    """Rows by frame, with landmarks in the order of their first sighting."""
    log = tracker.landmarks
    order = np.lexsort((log.landmark, log.frame))
    columns: _Columns = {"id": chosen(log.ids, log.landmark[order]), "t": tracker.time_ns[log.frame[order]]}
    return _csv(columns | _pose_columns(log.position_acs[order], log.orientation_acs[order]), mark)


def _pose_columns(position: FloatArray, orientation: FloatArray) -> _Columns:
    """Columns of positions (n, 3) and quaternions (n, 4)."""
    values = np.column_stack((position, orientation))
    names = ("tx", "ty", "tz", "qx", "qy", "qz", "qw")
    return {name: values[:, column] for column, name in enumerate(names)}


def _sensors(imu: ImuLog, mark: str) -> bytes:
    columns: _Columns = {"t": imu.time_ns, "type": chosen(SENSOR_TYPES, imu.sensor)}
    values: _Columns = {f"v{column + 1}": imu.values[:, column] for column in range(imu.values.shape[1])}
    return _csv(columns | values, mark)


def _wifi(wifi: WifiLog, building: SimulatedBuilding) -> bytes:
    columns: _Columns = {
        "scan": wifi.scan,
        "t": wifi.time_us,
        "kind": "WLAN",
        "ssid": chosen(building.ap_ssid, wifi.access_point),
        "bssid": chosen(building.ap_bssid, wifi.access_point),
        "rss": wifi.rss_dbm,
    }
    return _csv(columns, ".")


def _ble(ble: BleLog) -> bytes:
    beacons, building = ble.beacons, ble.beacons.environment.building
    columns: _Columns = {
        "t": ble.time_ns,
        "address": chosen(building.ap_bssid, ble.beacon),
        "name": chosen(building.ap_ssid, ble.beacon),
        "rss": ble.rss_dbm,
        "uuid": beacons.uuid,
        "major": beacons.major[ble.beacon],
        "minor": beacons.minor[ble.beacon],
    }
    return _csv(columns, ".")


def _truth(session: SimulatedSession) -> bytes:
    """The camera's true position at each frame's stamp; z above the building's zero."""
    time_ns = np.unique(session.tracker.time_ns)
    position = position_at(session.walk, time_ns)
    columns = {"time_ns": time_ns, "x": position[:, 0], "y": position[:, 1]}
    frame = pl.DataFrame(columns | {"z": position[:, 2] + session.floor.elevation_m})
    return _text(frame.with_columns(floor=floor_at(session.walk, time_ns)), precision=4, header=True)


def chosen(names: Sequence[str], index: IntArray) -> pl.Series:
    """The names at these indices (k,)."""
    return pl.Series(names, dtype=pl.String).gather(index)


def _csv(columns: _Columns, mark: str) -> bytes:
    """Rows as the phone app writes them: ``"; "`` between, no header, six decimals with the locale's mark."""
    text = _text(pl.DataFrame(columns), separator=";").replace(b";", b"; ")
    return text if mark == "." else text.replace(b".", mark.encode())


def _text(frame: pl.DataFrame, separator: str = ",", precision: int = DECIMALS, header: bool = False) -> bytes:
    buffer = io.BytesIO()
    frame.write_csv(buffer, include_header=header, separator=separator, float_precision=precision, quote_style="never")
    return buffer.getvalue()


HEIGHT_SIGMA_M = 0.02
SIGMA_RANGE_M = (0.01, 0.1)
HEADING_SIGMA_RAD = 0.02


def site_text(
    building: SimulatedBuilding, control_points: bool, columns: frozenset[SiteColumn] = frozenset(), seed: int = 0
) -> dict[str, bytes]:
    """Text of the site's own files by path relative to the survey, except the plan images.

    Without ``columns`` positions are exact; ``seed`` is for the surveyor's errors.
    """
    files = {"floor_dimensions.csv": _dimensions(building, SiteColumn.ELEVATION in columns)}
    for floor in building.floors:
        if floor.landmark_ids:
            files[f"floor_{floor.number}/marker_dict.csv"] = _marker_dict(floor, columns, seed)
        if control_points:
            points = {"x": floor.control_points[:, 0], "y": floor.control_points[:, 1]}
            files[f"floor_{floor.number}/refmarker.csv"] = comma_separated(pl.DataFrame(points), header=False)
    return files


def _dimensions(building: SimulatedBuilding, elevations: bool) -> bytes:
    rows = ["id,width,height" + (",elevation" if elevations else "")]
    for floor in building.floors:
        elevation = f",{floor.elevation_m}" if elevations else ""
        rows.append(f"{floor.number},{floor.width_m},{floor.height_m}{elevation}")
    return "".join(f"{row}\n" for row in rows).encode()


def _marker_dict(floor: SimulatedFloor, columns: frozenset[SiteColumn], seed: int) -> bytes:
    """Landmarks as surveyed. Each column has its own random numbers, so additional columns do not change the others."""
    place, count = floor.landmark_position, len(floor.landmark_ids)
    rng = {column: stream(seed, "surveyor", floor.number, column.value) for column in columns}
    xy, further = place[:, :2], {}
    if SiteColumn.Z in columns:
        further["z"] = place[:, 2] + HEIGHT_SIGMA_M * rng[SiteColumn.Z].standard_normal(count)
    if SiteColumn.SIGMA in columns:
        further["sigma_m"] = rng[SiteColumn.SIGMA].uniform(*SIGMA_RANGE_M, count).round(3)
        xy = xy + further["sigma_m"][:, None] * rng[SiteColumn.SIGMA].standard_normal((count, 2))
    if SiteColumn.HEADING in columns:
        off = HEADING_SIGMA_RAD * rng[SiteColumn.HEADING].standard_normal(count)
        further["heading_rad"] = wrapped(floor.landmark_heading_rad + off)
        further["heading_sigma_rad"] = np.full(count, HEADING_SIGMA_RAD)
    if floor.surveyed_z_m is not None and np.isfinite(floor.surveyed_z_m).any():
        further.setdefault("z", floor.surveyed_z_m)
    if floor.surveyed_sigma_m is not None and (floor.surveyed_sigma_m != SurveySettings().landmark_sigma_m).any():
        further.setdefault("sigma_m", floor.surveyed_sigma_m)
    frame = pl.DataFrame({"id": floor.landmark_ids, "x": xy[:, 0], "y": xy[:, 1], **further}, nan_to_null=True)
    return comma_separated(frame, header=True)
