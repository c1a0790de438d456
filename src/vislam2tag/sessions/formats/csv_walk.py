"""A walk as tables with headers of any names: poses, landmark sightings, Wi-Fi, Bluetooth and sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
import polars as pl

from vislam2tag.common.errors import SessionError, SurveyError, UsageError
from vislam2tag.common.files.given_files import plain, read_bytes
from vislam2tag.common.files.toml_file import read_toml
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.core.transforms import rotated
from vislam2tag.intake.cells import length_unit, with_numbers
from vislam2tag.intake.foreign_table import read_foreign_table
from vislam2tag.intake.time_units import ANY, FRAMES, NS_OF, READINGS, Steps, ns_of_seconds, recognised_ns
from vislam2tag.sessions.apps import in_acs
from vislam2tag.sessions.clocks import clock_of, pose_lag_of
from vislam2tag.sessions.foreign_tables import (
    MOTION_COLUMNS,
    sensor_columns,
    session_tables,
    table_times,
)
from vislam2tag.sessions.model import FileRecord, Session
from vislam2tag.sessions.pose_axes import plausible_axes
from vislam2tag.sessions.readings import SENSOR_VALUES, mark_repeated, pressure_log, sensor_rows, sensor_table
from vislam2tag.sessions.registry import FORMATS, register
from vislam2tag.sessions.session_files import SessionFiles
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.tracker_tables import POSE_COLUMNS, camera_track, landmark_log
from vislam2tag.sessions.walk_columns import (
    COLUMNS_FILE,
    Header,
    TableColumns,
    WalkColumns,
    candidates,
    missing_columns,
    named_as_poses,
    resolved,
    shown,
    time_unit,
)
from vislam2tag.sessions.without_poses import no_landmarks
from vislam2tag.site.model import SessionRef
from vislam2tag.site.site_table import is_file

NAME = "csv-walk"
_SUFFIXES = frozenset({".csv", ".tsv", ".txt"})
_UNITS = {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}
_MAX_APART_NS = 100_000_000
"""Sightings belong to the frame that is closest in time, if it is not further away."""
_NEW_SCAN_NS = 1_000_000_000
_MOST_FILES = 100
_FIRST_BYTES = 2000
_LOGGED_SHARE = 0.9
"""A landmark with rows at more of the frames behind its first one is logged at every frame, not only when seen."""
_UNUSED = frozenset({"truth.csv", "fixes.csv", "tachy.csv", "refMarker.csv", "ControlPoint.csv"})


def _tables(folder: Path) -> list[Path]:
    return [
        path
        for path in sorted(folder.iterdir())
        if path.suffix.lower() in _SUFFIXES
        and path.name not in _UNUSED
        and not path.name.startswith(".")
        and is_file(path)
    ][:_MOST_FILES]


def _has_poses(path: Path) -> bool:
    """Whether the first lines of a file name the columns of poses, or its name says so and they name others."""
    try:
        with plain(path).open("rb") as file:
            text = file.read(_FIRST_BYTES).decode("utf-8-sig", errors="replace")
    except OSError:  # reading it reports that
        return False
    for line in text.split("\n")[:20]:
        mark = max((";", "\t", "|", ","), key=line.count)
        columns = [name.strip(' "\r') for name in line.lstrip("# ").split(mark)]
        if Header(path.name, tuple(columns)).kinds == ("poses",):
            return True
        letters = [name for name in columns if name[:1].isalpha() and name.lower() not in ("nan", "inf")]
        if named_as_poses(path.name) and len(columns) >= 4 and len(letters) > len(columns) / 2:
            return True
    return False


def _columns_file(folder: Path) -> Path | None:
    """The nearest ``columns.toml``: of the session, its device, its floor or the survey."""
    return next((each / COLUMNS_FILE for each in (folder, *folder.parents[:3]) if is_file(each / COLUMNS_FILE)), None)


class CsvWalk:
    """Reads session folders with tables that have headers."""

    name = NAME

    def recognises(self, folder: Path) -> bool:
        """One of the tables has the columns of poses, and no other format but the published one knows the folder."""
        if not folder.is_dir() or not any(map(_has_poses, _tables(folder))):
            return False
        others = (known for name, known in FORMATS.all().items() if name not in (NAME, "published"))
        return not any(known.recognises(folder) for known in others)

    def input_files(self, folder: Path) -> list[Path]:
        """All tables, and the nearest ``columns.toml``."""
        own = _columns_file(folder)
        return [*_tables(folder), *([] if own is None else [own])]

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read a session whole; raises SessionError if a column that is needed cannot be recognised."""
        try:
            return _Reader(ref.folder).session(ref, settings)
        except (UsageError, SurveyError) as error:
            raise SessionError(str(error)) from error


@dataclass
class _Table:
    """A table: its rows behind ``row``, its columns by role, and their section."""

    file: str
    rows: pl.DataFrame
    roles: dict[str, str]
    given: TableColumns

    def numbers(self, roles: Sequence[str], findings: list[Finding]) -> FloatArray:
        """Columns (n, k) as numbers; NaN for cells that are none."""
        table, odd = with_numbers(self.rows, list(dict.fromkeys(self.roles[role] for role in roles)), self.file)
        findings += odd
        return np.column_stack([table[self.roles[role]].fill_null(np.nan).to_numpy() for role in roles])

    def metres(self) -> float:
        """Metres in the unit of its lengths."""
        unit = self.given.length_unit
        if unit is not None and length_unit(unit) is None:
            raise UsageError(f"{COLUMNS_FILE}: length_unit = {unit!r} is unknown; use one such as m, cm or ft")
        return 1.0 if unit is None else length_unit(unit) or 1.0


_Found: TypeAlias = dict[str, list[tuple[str, pl.DataFrame]]]
"""Files and their rows, by kind of table."""


class _Reader:
    """Reads one session, and keeps how its columns were resolved."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.files = SessionFiles(folder, {})
        self.path = _columns_file(folder)
        self.columns = WalkColumns() if self.path is None else read_toml(self.path, WalkColumns)
        self.found: dict[str, TableColumns] = {}

    def session(self, ref: SessionRef, settings: FindingSettings) -> Session:
        by_kind: _Found = {}
        for path in _tables(self.folder):
            table = read_foreign_table(path)
            rows = table.rows
            numbered = rows.select(table.lines, pl.all())
            kinds = self._kinds(path.name, rows.columns)
            data = read_bytes(path)
            for kind in kinds:
                by_kind.setdefault(kind, []).append((path.name, numbered))
            if kinds:
                self.files.files.append(FileRecord.of(path.name, kinds[0], data, rows.height, rows.height))
            else:
                message = (
                    f"its columns {shown(rows.columns)} were not recognised; name them in {COLUMNS_FILE} or remove the "
                    "file"
                )
                self.files.note("unread_file", path.name, message)
        camera = self._camera(by_kind, settings)
        landmarks = (
            no_landmarks() if "sightings" not in by_kind else self._landmarks(self._table("sightings", by_kind), camera)
        )
        if "sightings" not in by_kind:
            self.files.note(
                "missing_file",
                "sightings.csv",
                "there are no landmark sightings: only a plan of its floor can place the session",
            )
        sensors = self._sensors(by_kind, camera)
        clock_ns = clock_of(camera, sensors)
        tables = {"sensors": sensors, "wifi": self._wifi(by_kind, clock_ns, settings)}
        if "ble" in by_kind:
            tables["ble"] = self._ble(by_kind, clock_ns)
        camera = replace(camera, pressure=pressure_log(sensors), pose_lag_s=pose_lag_of(camera, sensors))
        self._report()
        resolved_columns = self.columns.model_copy(update=self.found).text
        return replace(self.files.session(ref.key, camera, landmarks, tables), columns=resolved_columns)

    def _kinds(self, file: str, columns: Sequence[str]) -> tuple[str, ...]:
        named = [
            kind for kind in ("poses", "sightings", "wifi", "ble", "sensors") if self.columns.of(kind).file == file
        ]
        if named:
            return tuple(named)
        kinds = Header(file, tuple(columns)).kinds
        if not kinds and any(sensor_columns(columns, sensor)[0] for sensor in MOTION_COLUMNS):
            kinds = ("sensors",)
        if not kinds and named_as_poses(file):
            kinds = ("poses",)
        return tuple(kind for kind in kinds if self.columns.of(kind).file is None)

    def _table(self, kind: str, by_kind: _Found) -> _Table:
        files = by_kind.get(kind, [])
        if not files:
            there = ", ".join(path.name for path in _tables(self.folder))
            raise UsageError(
                f"{self.folder}: no table has the columns of {kind}; found the files {there}; "
                f'name one in {COLUMNS_FILE}: [{kind}] file = "NAME"'
            )
        if len(files) > 1:
            names = " and ".join(name for name, _ in files)
            raise UsageError(
                f"{self.folder}: the files {names} may all be {kind}; choose one in {COLUMNS_FILE}: "
                f'[{kind}] file = "{files[0][0]}"'
            )
        (file, rows), given = files[0], self.columns.of(kind)
        roles = resolved(rows.columns[1:], kind, given, file)
        self.found[kind] = TableColumns(**{**given.model_dump(), **roles, "file": file})
        return _Table(file, rows, roles, given)

    def _times(self, table: _Table, kind: str, steps: Steps, clock_ns: IntArray | None = None) -> _Table:
        """The table with ``time_ns``; rows without a time are left out and reported."""
        name = table.roles["time"]
        texts = table.rows[name].cast(pl.String).str.strip_chars()
        unit = table.given.time_unit or time_unit(name)
        if (texts.head(20).str.contains(r"^\d{4}-\d\d-\d\d[T ]").sum() or 0) > min(20, len(texts)) / 2:
            dates = table_times(
                texts.alias(name), np.empty((0, 2), dtype=np.int64), clock=None, unit=None, zone=table.given.zone
            )
            known = pl.Series(dates.usable)
            return replace(table, rows=table.rows.with_columns(time_ns=dates.time_ns).filter(known))
        exact = texts.cast(pl.Int64, strict=False)
        numbers, odd = with_numbers(table.rows.with_columns(texts.alias(name)), [name], table.file)
        self.files.findings += odd
        known = numbers[name].is_not_null() & numbers[name].is_finite()
        whole = bool(exact.filter(known).is_not_null().all())
        rows = table.rows.filter(known)
        if unit is not None:
            factor = NS_OF[_UNITS[unit]]
            time_ns = (
                exact.filter(known) * factor if whole else (numbers[name].filter(known) * factor).round().cast(pl.Int64)
            )
        elif whole:
            read_ns = exact.filter(known).to_numpy()
            found_ns, other = recognised_ns(read_ns, read_ns, steps, table.file, "nanoseconds", clock_ns)
            unit = next((each for each, words in _UNITS.items() if other and other[0].message.endswith(words)), "ns")
            time_ns = pl.Series(found_ns)
        else:
            found_ns, other = ns_of_seconds(numbers[name].filter(known).to_numpy(), steps, table.file)
            unit = next((each for each, words in _UNITS.items() if other and other[0].message.endswith(words)), "s")
            time_ns = pl.Series(found_ns)
        self.found[kind] = self.found[kind].model_copy(update={"time_unit": unit})
        return replace(table, rows=rows.with_columns(time_ns=time_ns))

    def _camera(self, by_kind: _Found, settings: FindingSettings) -> CameraTrack:
        table = self._times(self._table("poses", by_kind), "poses", FRAMES)
        poses = table.numbers(("x", "y", "z", "qx", "qy", "qz", "qw"), self.files.findings)
        poses[:, :3] *= table.metres()
        given = table.given
        cameras, frames = (
            (given.camera,) if given.camera else ("y-up", "y-down"),
            (given.frame,) if given.frame else ("y-up", "z-up"),
        )
        axes = (
            (*cameras, *frames)
            if len(cameras) == len(frames) == 1
            else plausible_axes(table.rows["time_ns"].to_numpy(), poses, cameras=cameras, frames=frames)
        )
        if axes is None:
            raise UsageError(
                f"{table.file}: the path does not show the axes of camera and frame; write them to {COLUMNS_FILE}: "
                '[poses] camera = "y-up" or "y-down", frame = "y-up" or "z-up"'
            )
        self.axes = axes[0], axes[1]
        self.found["poses"] = self.found["poses"].model_copy(update={"camera": axes[0], "frame": axes[1]})
        rows = table.rows.select("row", "time_ns").with_columns(_pose_series(in_acs(poses, *self.axes)))
        camera, findings = camera_track(rows, table.file, settings)
        self.files.findings += findings
        return camera

    def _landmarks(self, table: _Table, camera: CameraTrack) -> LandmarkLog:
        table = self._times(table, "sightings", FRAMES, clock_of(camera))
        count, findings = table.rows.height, self.files.findings
        turned = {"qx", "qy", "qz", "qw"} <= table.roles.keys()
        at_rest = np.tile((0.0, 0.0, 0.0, 1.0), (count, 1))
        turn = table.numbers(("qx", "qy", "qz", "qw"), findings) if turned else at_rest
        frames = np.flatnonzero(camera.usable)
        frame_ns, time_ns = camera.time_ns[frames], table.rows["time_ns"].to_numpy()
        nearest = _nearest(frame_ns, time_ns)
        if {"dx", "dy", "dz"} <= table.roles.keys():
            offset = table.numbers(("dx", "dy", "dz"), findings) * table.metres()
            if self.axes[0] == "y-down":
                offset = offset * (1.0, -1.0, -1.0)
            at = np.column_stack([np.interp(time_ns, frame_ns, axis) for axis in camera.position_acs[frames].T])
            poses = np.column_stack((at + rotated(camera.orientation_acs[frames[nearest]], offset), at_rest))
        else:
            position = table.numbers(("x", "y", "z"), findings) * table.metres()
            poses = in_acs(np.column_stack((position, turn)), "y-up", self.axes[1])
        close = np.abs(frame_ns[nearest] - time_ns) <= _MAX_APART_NS
        rows = table.rows.select(
            "row",
            id=pl.col(table.roles["id"]).cast(pl.String).str.strip_chars(),
            time_ns=np.where(close, frame_ns[nearest], time_ns),
        )
        log, odd = landmark_log(rows.with_columns(_pose_series(poses)), table.file, camera)
        findings += odd
        first = np.full(len(log.ids), len(camera.time_ns))
        np.minimum.at(first, log.landmark, log.frame)
        expected = sum(int((frames >= each).sum()) for each in first)
        logged = len(log.landmark) >= _LOGGED_SHARE * max(expected, 1)
        return log if logged else replace(log, seen=np.ones(len(log.landmark), dtype=bool))

    def _wifi(self, by_kind: _Found, clock_ns: IntArray, settings: FindingSettings) -> pl.DataFrame:
        if "wifi" not in by_kind:
            self.files.note("missing_file", "wifi.csv", "there are no Wi-Fi scans; the session has no Wi-Fi labels")
            return mark_repeated(pl.DataFrame(schema=_WIFI), "bssid")
        self.files.names = {**self.files.names, "wifi": (by_kind["wifi"][0][0],)}
        table = self._times(self._table("wifi", by_kind), "wifi", Steps(0.0, 600.0), clock_ns)
        rows = table.rows.select(
            "row",
            "time_ns",
            scan=_scans(table),
            bssid=pl.col(table.roles["address"]).cast(pl.String).fill_null("").str.strip_chars(),
            ssid=pl.col(table.roles["ssid"]).cast(pl.String) if "ssid" in table.roles else pl.lit(""),
            rssi_dbm=pl.Series(table.numbers(("level",), self.files.findings)[:, 0]).cast(pl.Float32).fill_nan(None),
            frequency_mhz=pl.Series(table.numbers(("frequency",), self.files.findings)[:, 0])
            .cast(pl.Float32)
            .fill_nan(None)
            if "frequency" in table.roles
            else pl.lit(None, dtype=pl.Float32),
        )
        return self.files.wifi(rows.drop_nulls("rssi_dbm"), settings)

    def _ble(self, by_kind: _Found, clock_ns: IntArray) -> pl.DataFrame:
        self.files.names = {**self.files.names, "ble": (by_kind["ble"][0][0],)}
        table = self._times(self._table("ble", by_kind), "ble", ANY, clock_ns)

        def text(role: str) -> pl.Expr:
            return pl.col(table.roles[role]).cast(pl.String) if role in table.roles else pl.lit(None, dtype=pl.String)

        rows = table.rows.select(
            "row",
            "time_ns",
            address=text("address").fill_null("").str.strip_chars(),
            name=text("name"),
            uuid=text("uuid"),
            major=text("major").cast(pl.Int32, strict=False),
            minor=text("minor").cast(pl.Int32, strict=False),
            rssi_dbm=pl.Series(table.numbers(("level",), self.files.findings)[:, 0]).cast(pl.Float32).fill_nan(None),
        )
        return self.files.ble(rows.drop_nulls("rssi_dbm"))

    def _sensors(self, by_kind: _Found, camera: CameraTrack) -> pl.DataFrame:
        parts = [sensor_rows(pl.DataFrame(schema={"row": pl.Int64, "time_ns": pl.Int64}), "", [])]
        for file, rows in by_kind.get("sensors", []):
            given = self.columns.sensors
            if any(sensor_columns(rows.columns, sensor)[0] for sensor in MOTION_COLUMNS):
                name = resolved_time(rows.columns[1:], given, file)
                self.found["sensors"] = TableColumns(file=file, time=name)
                table = self._times(_Table(file, rows, {"time": name}, given), "sensors", READINGS, clock_of(camera))
                made, odd = session_tables(table.rows.drop(name) if name != "time_ns" else table.rows, "sensors", file)
                self.files.findings += odd
                parts.append(made["sensors"].select("row", "time_ns", "sensor", *SENSOR_VALUES))
            else:
                table = self._times(
                    self._table("sensors", {"sensors": [(file, rows)]}), "sensors", ANY, clock_of(camera)
                )
                values = [role for role in ("v1", "v2", "v3") if role in table.roles]
                numbers = table.numbers(values, self.files.findings)
                long = sensor_rows(table.rows, "", [pl.Series(column).fill_nan(0.0) for column in numbers.T])
                kind = table.rows[table.roles["type"]].cast(pl.String).str.to_uppercase().replace({**_SENSOR_WORDS})
                parts.append(long.with_columns(sensor=kind))
        sensors, odd = sensor_table(pl.concat(parts), "sensors")
        self.files.findings += odd
        return sensors

    def _report(self) -> None:
        """Say how the columns were read."""
        for kind, section in self.found.items():
            named = self.columns.of(kind)
            entries = {
                key: value
                for key, value in section.model_dump().items()
                if value is not None and key != "file" and getattr(named, key) != value
            }
            if entries:
                words = ", ".join(f'{key} = "{value}"' for key, value in entries.items())
                message = (
                    f"read as {kind} with {words}. If that is wrong, write the right ones to {COLUMNS_FILE}: [{kind}]"
                )
                self.files.note("columns_guessed", section.file or "", message, Severity.INFO)


_WIFI = {
    **dict.fromkeys(("row", "time_ns"), pl.Int64),
    "scan": pl.Int32,
    **dict.fromkeys(("bssid", "ssid"), pl.String),
    **dict.fromkeys(("rssi_dbm", "frequency_mhz"), pl.Float32),
}
_SENSOR_WORDS = {
    **dict.fromkeys(("ACCELEROMETER", "ACCE", "ACCELERATION"), "ACC"),
    **dict.fromkeys(("GYROSCOPE", "GYR"), "GYRO"),
    **dict.fromkeys(("MAGNETOMETER", "MAGN", "MAGNETIC"), "MAG"),
    **dict.fromkeys(("BAROMETER", "PRES", "BARO"), "PRESSURE"),
}


def resolved_time(columns: Sequence[str], given: TableColumns, file: str) -> str:
    """The column of times of a table of sensors; raises UsageError if there is none."""
    found = [given.time] if given.time else candidates(columns, "sensors")["time"]
    if not found or found[0] not in columns:
        raise UsageError(missing_columns(file, "sensors", ["time"], [], columns))
    return str(found[0])


def _pose_series(poses: FloatArray) -> list[pl.Series]:
    return [pl.Series(name, poses[:, i]) for i, name in enumerate(POSE_COLUMNS)]


def _nearest(sorted_ns: IntArray, time_ns: IntArray) -> IntArray:
    """Places (k,) of the times that are closest to ``time_ns`` (k,)."""
    if not len(sorted_ns):
        raise UsageError("no pose is usable")
    after = np.searchsorted(sorted_ns, time_ns).clip(1, max(len(sorted_ns) - 1, 1)).clip(max=len(sorted_ns) - 1)
    before = np.maximum(after - 1, 0)
    return np.where(np.abs(sorted_ns[before] - time_ns) <= np.abs(sorted_ns[after] - time_ns), before, after)


def _scans(table: _Table) -> pl.Series:
    """Numbers of scans: by their column, else rows of one time, else rows without a gap of a second."""
    time = table.rows["time_ns"]
    if "scan" in table.roles:
        return (
            table.rows[table.roles["scan"]].cast(pl.String).rank("dense").cast(pl.Int32)
            if not table.rows[table.roles["scan"]].cast(pl.Int32, strict=False).is_not_null().all()
            else table.rows[table.roles["scan"]].cast(pl.Int32)
        )
    if time.n_unique() * 2 <= len(time):
        return time.rank("dense").cast(pl.Int32)
    order = time.arg_sort()
    gap = (time.gather(order).diff().fill_null(0) > _NEW_SCAN_NS).cum_sum()
    return pl.DataFrame({"at": order, "scan": gap}).sort("at")["scan"].cast(pl.Int32)


register(CsvWalk())
