"""A walk as tables with headers of any names: poses, landmark sightings, Wi-Fi, Bluetooth and sensors."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import SessionError, SurveyError, UsageError
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.intake.cells import LENGTHS_M
from vislam2tag.intake.columns import COLUMNS_FILE, given_column, matching_columns, missing_column, plain_name
from vislam2tag.intake.pose_conventions import PERSON_M_S
from vislam2tag.intake.pose_evidence import FAST_M_S
from vislam2tag.intake.time_units import ANY, FRAMES, READINGS, Steps
from vislam2tag.sessions.apps import in_acs, pose_series
from vislam2tag.sessions.clocks import clock_mismatch, clock_of, pose_lag_of
from vislam2tag.sessions.foreign_tables import sensors_in
from vislam2tag.sessions.formats.published import FILE_NAMES
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.pose_axes import inverse_is_plausible, offsets_apart_m, plausible_axes, speed_m_s
from vislam2tag.sessions.readings import (
    SENSOR_VALUES,
    mark_repeated,
    pressure_log,
    scan_numbers,
    sensor_rows,
    sensor_table,
    with_sensor_units,
)
from vislam2tag.sessions.registry import FORMATS, register
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.sighting_poses import at_frames, closest_places, of_offsets, of_positions
from vislam2tag.sessions.tracker_tables import camera_track, landmark_log
from vislam2tag.sessions.walk_columns import (
    SENSOR_TYPES,
    SENSORS,
)
from vislam2tag.sessions.walk_files import (
    first_lines,
    given_poses,
    has_poses,
    is_wide,
    nearest_columns_file,
    partly_poses,
    tables_in,
)
from vislam2tag.sessions.walk_tables import WalkTable, WalkTables
from vislam2tag.sessions.without_poses import no_landmarks
from vislam2tag.site.model import SessionRef

NAME = "csv-walk"
_MAX_APART_NS = 100_000_000
"""Sightings belong to the frame that is closest in time, if it is not further away."""
_TOGETHER, _APART_M = 3.0, 0.2
"""Under the right reading the sightings of a landmark are closer together by this factor and distance."""
_NEW_VISIT_NS = 10_000_000_000
"""Trackers drift little while a landmark is in view, but may do so until it is seen again."""
_LOGGED_SHARE = 0.9
"""A landmark with rows at more of the frames behind its first one is logged at every frame, not only when seen."""
_VALUES = ("v1", "v2", "v3")
_BRACKETS = re.compile(r"[\[(](.*?)[\])]\s*$")


class CsvWalk:
    """Reads session folders with tables that have headers."""

    name = NAME

    def recognises(self, folder: Path) -> bool:
        """Whether a table has the columns of poses, and no other format but the published one knows the folder.

        Without published poses a part of the columns is enough, so that reading reports what is missing.
        """
        if not folder.is_dir():
            return False
        tables, given = {path.name: first_lines(path) for path in tables_in(folder)}, given_poses(folder)
        published = set(FILE_NAMES["poses"]) & tables.keys()
        if not any(has_poses(file, lines, given) for file, lines in tables.items()) and (
            published or not any(partly_poses(file, line) for file, lines in tables.items() for line in lines)
        ):
            return False
        others = (known for name, known in FORMATS.all().items() if name not in (NAME, "published"))
        return not any(known.recognises(folder) for known in others)

    def input_files(self, folder: Path) -> list[Path]:
        """All tables, and the nearest ``columns.toml``."""
        own = nearest_columns_file(folder)
        return [*tables_in(folder), *([] if own is None else [own])]

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read a session whole; raises SessionError if a column that is needed cannot be recognised."""
        try:
            return _Reader(ref.folder, ref.beside).session(ref, settings)
        except (UsageError, SurveyError) as error:
            raise SessionError(str(error)) from error


class _Reader:
    """Reads one session."""

    def __init__(self, folder: Path, beside: Path | None) -> None:
        self.tables = WalkTables(folder, beside)
        self.files = self.tables.files
        self.turned_back = False

    def session(self, ref: SessionRef, settings: FindingSettings) -> Session:
        camera = self._camera(settings)
        if "sightings" in self.tables.by_kind:
            landmarks = self._landmarks(camera)
        else:
            self._refuse_inverse()
            landmarks = no_landmarks()
        sensors = self._sensors(camera)
        clock_ns = clock_of(camera, sensors)
        tables = {"sensors": sensors, "wifi": self._wifi(clock_ns, camera, sensors, settings)}
        if "ble" in self.tables.by_kind:
            tables["ble"] = self._ble(clock_ns, camera)
        camera = replace(camera, pressure=pressure_log(sensors), pose_lag_s=pose_lag_of(camera, sensors))
        self.tables.report()
        return replace(self.files.session(ref.key, camera, landmarks, tables), columns=self.tables.text)

    def _camera(self, settings: FindingSettings) -> CameraTrack:
        table = self.tables.times(self.tables.only("poses"), FRAMES)
        turn = table.numbers(("qx", "qy", "qz", "qw"), self.files.findings)
        poses = np.column_stack((table.lengths(("x", "y", "z"), self.files.findings), turn))
        given = table.given
        cameras = (given.camera,) if given.camera else ("y-up", "y-down")
        frames = (given.frame,) if given.frame else ("y-up", "z-up")
        if units := _other_units(table, poses):
            raise UsageError(f"{table.file}: {_in_other_units(units)}")
        axes: Sequence[object] | None = (*cameras, *frames)
        if len(cameras) + len(frames) > 2:
            axes = plausible_axes(table.time_ns, poses, cameras=cameras, frames=frames)
            self.turned_back = inverse_is_plausible(table.time_ns, poses, cameras, frames)
        if axes is None:
            raise UsageError(f"{table.file}: {_INVERSE if self.turned_back else _UNKNOWN_AXES}")
        self.poses = table.time_ns, poses
        self.axes = str(axes[0]), str(axes[1])
        self.tables.noted(table, camera=self.axes[0], frame=self.axes[1])
        rows = table.rows.select("row", "time_ns").with_columns(pose_series(in_acs(poses, *self.axes)))
        return self.files.noted(camera_track(rows, table.file, settings))

    def _landmarks(self, camera: CameraTrack) -> LandmarkLog:
        table = self.tables.times(self.tables.only("sightings"), FRAMES, clock_of(camera))
        findings = self.files.findings
        findings += clock_mismatch(table.time_ns, table.file, camera)
        time_ns = table.time_ns
        if {"dx", "dy", "dz"} <= table.roles.keys():
            offset = table.lengths(("dx", "dy", "dz"), findings)
            poses = of_offsets(offset, time_ns, camera, self._axes_of_offsets(table, offset))
        else:
            self._refuse_inverse()
            turned = {"qx", "qy", "qz", "qw"} <= table.roles.keys()
            turn = table.numbers(("qx", "qy", "qz", "qw"), findings) if turned else None
            poses = of_positions(table.lengths(("x", "y", "z"), findings), turn, self.axes[1])
        rows = table.rows.select(
            "row",
            id=table.text("id").fill_null("").str.strip_chars(),
            time_ns=at_frames(camera, time_ns, _MAX_APART_NS),
        )
        log = self.files.noted(landmark_log(rows.with_columns(pose_series(poses)), table.file, camera))
        frames = np.flatnonzero(camera.usable)
        first = np.full(len(log.ids), len(camera.time_ns))
        np.minimum.at(first, log.landmark, log.frame)
        expected = sum(int((frames >= each).sum()) for each in first)
        logged = len(log.landmark) >= _LOGGED_SHARE * max(expected, 1)
        return log if logged else replace(log, seen=np.ones(len(log.landmark), dtype=bool))

    def _axes_of_offsets(self, table: WalkTable, offsets: FloatArray) -> str:
        """The camera's axes of offsets (n, 3): those by which the sightings of a landmark fall together.

        Raises UsageError if they do so with the inverse of the rotations.
        """
        order = np.argsort(self.poses[0], kind="stable")
        poses = self.poses[1][order[closest_places(self.poses[0][order], table.time_ns)]]
        known = np.isfinite(np.column_stack((offsets, poses))).all(axis=1) & (np.abs(poses[:, 3:]).sum(axis=1) > 0)
        apart = offsets_apart_m(poses[known], offsets[known], _visits(table)[known])
        direct, inverse = apart.min(axis=1)
        if _clearly_less(inverse, direct):
            raise UsageError(
                f"{self.tables.only('poses').file}: {_INVERTED}. Only then do the sightings of a landmark in "
                f"{table.file} fall together"
            )
        if not _clearly_less(direct, inverse):
            self._refuse_inverse()
        own = table.given.camera or self.axes[0]
        if table.given.camera is None and _clearly_less(apart[0, 1], apart[0, 0]):
            own = {"y-up": "y-down", "y-down": "y-up"}[own]
            self.tables.noted(table, camera=own)
        return own

    def _refuse_inverse(self) -> None:
        if self.turned_back:
            raise UsageError(f"{self.tables.only('poses').file}: {_INVERSE}")

    def _wifi(
        self, clock_ns: IntArray, camera: CameraTrack, sensors: pl.DataFrame, settings: FindingSettings
    ) -> pl.DataFrame:
        if "wifi" not in self.tables.by_kind:
            return mark_repeated(pl.DataFrame(schema=_WIFI), "bssid")
        table = self.tables.of_technology(self.tables.only("wifi"))
        table = self.tables.times(table, Steps(0.0, 600.0), clock_ns)
        frequency: pl.Series | pl.Expr = pl.lit(None, dtype=pl.Float32)
        if "frequency" in table.roles:
            frequency = pl.Series(table.numbers(("frequency",), self.files.findings)[:, 0]).cast(pl.Float32)
            frequency = frequency.fill_nan(None)
        address = table.text("address").fill_null("").str.strip_chars()
        said = table.rows[table.roles["scan"].name] if "scan" in table.roles else None
        rows = table.rows.select(
            "row",
            "time_ns",
            scan=scan_numbers(table.rows["time_ns"], table.rows.select(address).to_series(), said),
            bssid=address,
            ssid=table.text("ssid").fill_null(""),
            rssi_dbm=table.level(self.files.findings),
            frequency_mhz=frequency,
        )
        self.files.names = {**self.files.names, "wifi": (table.file,)}
        wifi = self.files.wifi(rows.drop_nulls("rssi_dbm"), settings)
        return self.files.on_clock("wifi", wifi, camera, sensors)

    def _ble(self, clock_ns: IntArray, camera: CameraTrack) -> pl.DataFrame:
        table = self.tables.times(self.tables.of_technology(self.tables.only("ble")), ANY, clock_ns)
        rows = table.rows.select(
            "row",
            "time_ns",
            table.text("name").alias("name"),
            table.text("uuid").alias("uuid"),
            address=table.text("address").fill_null("").str.strip_chars(),
            major=table.text("major").cast(pl.Int32, strict=False),
            minor=table.text("minor").cast(pl.Int32, strict=False),
            rssi_dbm=table.level(self.files.findings),
        )
        self.files.names = {**self.files.names, "ble": (table.file,)}
        return self.files.on_clock("ble", self.files.ble(rows.drop_nulls("rssi_dbm")), camera)

    def _sensors(self, camera: CameraTrack) -> pl.DataFrame:
        """The table ``sensors`` of all tables of sensors, in units of Android."""
        parts = [sensor_rows(pl.DataFrame(schema={"row": pl.Int64, "time_ns": pl.Int64}), "", [])]
        for file, rows in self.tables.by_kind.get("sensors", []):
            if is_wide(rows.columns):
                parts += self._of_wide(file, rows, camera)
            else:
                parts += self._of_long(self.tables.table("sensors", file, rows), camera)
        for kind in SENSORS:
            if kind in self.tables.by_kind:
                parts += self._of_sensor(
                    self.tables.times(self.tables.only(kind), READINGS, clock_of(camera)), kind, camera
                )
        return self.files.noted(sensor_table(pl.concat(parts), "sensors"))

    def _of_wide(self, file: str, rows: pl.DataFrame, camera: CameraTrack) -> list[pl.DataFrame]:
        """The readings of a table with a column for each axis of each sensor, such as ``acc_x``."""
        given, columns = self.tables.columns.sensors, rows.columns[1:]
        matched = matching_columns(columns, "time")
        if given.time:
            matched = [given_column("time", given.time, columns, "sensors", file)]
        if not matched:
            raise UsageError(f"{file}: {missing_column(columns, ('time',), 'sensors')}")
        table = WalkTable("sensors", file, rows, {"time": matched[0]}, given)
        self.tables.noted(table, time=matched[0].name)
        table = self.tables.times(table, READINGS, clock_of(camera))
        return self._in_units(table.rows, file, camera)

    def _of_long(self, table: WalkTable, camera: CameraTrack) -> list[pl.DataFrame]:
        """The readings of a table with a row for each sensor and time, such as ``ACC`` with ``v1`` to ``v3``."""
        table = self.tables.times(table, READINGS, clock_of(camera), table.roles["type"].name)
        said = table.rows.select(table.text("type").fill_null("")).to_series()
        types = {text: SENSOR_TYPES.get(_sensor_word(text), text.upper()) for text in set(said)}
        sensor = said.replace_strict(types, return_dtype=pl.String)
        parts = []
        for kind, name in SENSORS.items():
            if (sensor == name).any():
                parts += self._of_sensor(replace(table, rows=table.rows.filter(sensor == name)), kind, camera)
        others = replace(table, rows=table.rows.filter(~sensor.is_in(list(SENSORS.values()))))
        values = others.numbers([role for role in SENSOR_VALUES if role in table.roles], self.files.findings)
        rows = sensor_rows(others.rows, "", [pl.Series(column).fill_nan(0.0) for column in values.T])
        rows = rows.with_columns(sensor=sensor.filter(~sensor.is_in(list(SENSORS.values()))))
        parts.append(self.files.noted(with_sensor_units(rows, table.file)))
        return [pl.concat(parts).sort("row", maintain_order=True)]

    def _of_sensor(self, table: WalkTable, kind: str, camera: CameraTrack) -> list[pl.DataFrame]:
        """The readings of one sensor, whose columns get the names that they have in tables of several."""
        roles = [role for role in _VALUES if role in table.roles][: 1 if kind == "pressure" else 3]
        if kind != "pressure" and len(roles) < len(_VALUES):
            missing = [role for role in _VALUES if role not in roles]
            found = [each.name for each in table.roles.values()]
            names = {role: f"value_{axis}" for role, axis in zip(_VALUES, "xyz", strict=True) if role in missing}
            raise UsageError(f"{table.file}: {missing_column(found, names, table.kind)}")
        columns = {}
        for role, axis in zip(roles, "xyz", strict=False):
            unit = _BRACKETS.search(table.roles[role].name)
            name = kind if kind == "pressure" else f"{kind}_{axis}"
            columns[name + (f" [{unit[1]}]" if unit else "")] = pl.col(table.roles[role].name)
        return self._in_units(table.rows.select("row", "time_ns", **columns), table.file, camera)

    def _in_units(self, rows: pl.DataFrame, file: str, camera: CameraTrack) -> list[pl.DataFrame]:
        """Readings in units of Android; reported if their times do not meet the frames."""
        sensors = self.files.noted(sensors_in(rows, file))
        self.files.findings += clock_mismatch(sensors["time_ns"].to_numpy(), file, camera)
        return [sensors.select("row", "time_ns", "sensor", *SENSOR_VALUES)]


_UNKNOWN_AXES = (
    f"the path does not show the axes of camera and frame; write them to {COLUMNS_FILE}: "
    '[poses] camera = "y-up" or "y-down", frame = "y-up" or "z-up"'
)
_INVERTED = (
    "the rotations seem to map the world to the camera, but camera to world is expected: change the signs of qx, qy "
    "and qz in the file"
)
_INVERSE = (
    f"{_INVERTED}. The path looks the same if an axis of the positions is mirrored: then change its sign. If all is "
    f'right as it is, write the axes to {COLUMNS_FILE}: [poses] camera = "y-up" or "y-down", frame = "y-up" or "z-up"'
)


def _other_units(table: WalkTable, poses: FloatArray) -> list[str]:
    """Units in which positions that are too fast for a person in metres are those of one; none if the unit is known."""
    speed = speed_m_s(table.time_ns, poses)
    if speed <= FAST_M_S or table.given.length_unit or table.roles["x"].metres:
        return []
    least, greatest = PERSON_M_S
    return [unit for unit in ("mm", "cm", "ft") if least <= speed * LENGTHS_M[unit] <= greatest]


def _in_other_units(units: Sequence[str]) -> str:
    """Say that lengths are in another unit."""
    written = " or ".join(f'length_unit = "{unit}"' for unit in units)
    return (
        f"the positions are not those of a walking person in metres, but in {' or '.join(units)}; write that to "
        f'{COLUMNS_FILE}: {written} in [poses], and in [sightings] if it is right there. If they are metres, write "m"'
    )


def _sensor_word(text: str) -> str:
    """The normal form of a sensor's name, as in ``android.sensor.accelerometer``."""
    return re.sub(r"^(?:android)?sensor(?=.)", "", plain_name(text))


_WIFI = {
    **dict.fromkeys(("row", "time_ns"), pl.Int64),
    "scan": pl.Int32,
    **dict.fromkeys(("bssid", "ssid"), pl.String),
    **dict.fromkeys(("rssi_dbm", "frequency_mhz"), pl.Float32),
}


def _clearly_less(apart_m: float, other_m: float) -> bool:
    """Whether sightings are so much closer together than by another reading that this one is right."""
    return apart_m * _TOGETHER < other_m and other_m - apart_m > _APART_M


def _visits(table: WalkTable) -> IntArray:
    """Numbers (n,) of the visits of sightings: sightings of one landmark without a long gap."""
    by_id = pl.int_range(pl.len()).over("id")
    rows = table.rows.select("time_ns", id=table.text("id"), at=pl.int_range(pl.len())).sort("id", "time_ns")
    gap = pl.col("time_ns").diff().fill_null(0) > _NEW_VISIT_NS
    return rows.with_columns(visit=((by_id == 0) | gap).cum_sum()).sort("at")["visit"].to_numpy()


register(CsvWalk())
