"""A walk as tables with headers of any names: poses, landmark sightings, Wi-Fi, Bluetooth and sensors."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
import polars as pl

from vislam2tag.common.errors import SessionError, SurveyError, UsageError
from vislam2tag.common.files.given_files import plain, read_bytes
from vislam2tag.common.files.toml_file import read_toml, toml_value
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.core.transforms import rotated
from vislam2tag.intake.cells import LENGTHS_M, length_unit, unreadable_cells, with_numbers
from vislam2tag.intake.columns import Column, given_column, matching_columns, missing_column, plain_name, shown
from vislam2tag.intake.foreign_table import read_foreign_table
from vislam2tag.intake.time_units import (
    ANY,
    FRAMES,
    MAX_STEP_S,
    NS_OF,
    READINGS,
    ROUNDED,
    Steps,
    ns_of_seconds,
    recognised_ns,
    rounded_step,
)
from vislam2tag.sessions.apps import in_acs
from vislam2tag.sessions.clocks import clock_mismatch, clock_of, pose_lag_of
from vislam2tag.sessions.foreign_tables import (
    MOST_NS,
    SENSOR_COLUMNS,
    sensor_columns,
    sensors_in,
    table_times,
    time_zone,
)
from vislam2tag.sessions.model import FileRecord, Session
from vislam2tag.sessions.pose_axes import plausible_axes
from vislam2tag.sessions.readings import (
    SENSOR_VALUES,
    mark_repeated,
    pressure_log,
    sensor_rows,
    sensor_table,
    with_sensor_units,
)
from vislam2tag.sessions.registry import FORMATS, HEAD_BYTES, TABLE_SUFFIXES, register
from vislam2tag.sessions.session_files import MISSING, SessionFiles
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.tracker_tables import POSE_COLUMNS, camera_track, landmark_log
from vislam2tag.sessions.walk_columns import (
    COLUMNS_FILE,
    SENSOR_TYPES,
    SENSORS,
    TableColumns,
    WalkColumns,
    fits,
    kind_of,
    named_as_poses,
    resolved,
    sensor_of_file,
    unknown_kind,
)
from vislam2tag.sessions.without_poses import no_landmarks
from vislam2tag.site.model import SessionRef
from vislam2tag.site.site_table import is_file

NAME = "csv-walk"
_UNITS = {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}
_MAX_APART_NS = 100_000_000
"""Sightings belong to the frame that is closest in time, if it is not further away."""
_NEW_SCAN_NS = 1_000_000_000
_MOST_FILES = 100
_LOGGED_SHARE = 0.9
"""A landmark with rows at more of the frames behind its first one is logged at every frame, not only when seen."""
_UNUSED = frozenset({"truth.csv", "fixes.csv", "tachy.csv", "refMarker.csv", "ControlPoint.csv"})


def _tables(folder: Path) -> list[Path]:
    return [
        path
        for path in sorted(folder.iterdir())
        if path.suffix.lower() in TABLE_SUFFIXES
        and path.name not in _UNUSED
        and not path.name.startswith(".")
        and is_file(path)
    ][:_MOST_FILES]


def _has_poses(path: Path) -> bool:
    """Whether the first lines of a file name the columns of poses, or its name says so and they name others."""
    with plain(path).open("rb") as file:
        text = file.read(HEAD_BYTES).decode("utf-8-sig", errors="replace")
    for line in text.split("\n")[:20]:
        mark = max((";", "\t", "|", ","), key=line.count)
        fields = line.lstrip("# ").split(mark if mark in line else None)
        columns = [name.strip(' "\r') for name in fields]
        if kind_of(path.name, columns) == "poses":
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
            return _Reader(ref.folder, ref.beside).session(ref, settings)
        except (UsageError, SurveyError) as error:
            raise SessionError(str(error)) from error


@dataclass
class _Table:
    """A table: its rows behind ``row``, its columns by role, and their section of ``columns.toml``."""

    kind: str
    file: str
    rows: pl.DataFrame
    roles: dict[str, Column]
    given: TableColumns

    @property
    def time_ns(self) -> IntArray:
        """Times (n,), ns."""
        return self.rows["time_ns"].to_numpy()

    def numbers(self, roles: Sequence[str], findings: list[Finding]) -> FloatArray:
        """Columns (n, k) as numbers; NaN for cells that are none."""
        names = [self.roles[role].name for role in roles]
        table, odd = with_numbers(self.rows, list(dict.fromkeys(names)), self.file)
        findings += odd
        return np.column_stack([table[name].fill_null(np.nan).to_numpy() for name in names])

    def lengths(self, roles: Sequence[str], findings: list[Finding]) -> FloatArray:
        """Columns (n, k) of lengths, m."""
        unit = self.given.length_unit
        metres = None if unit is None else length_unit(unit)
        if unit is not None and metres is None:
            raise UsageError(
                f"{COLUMNS_FILE}: [{self.kind}] length_unit = {unit!r} is unknown; use m, cm, ft or the like"
            )
        factors = [metres or self.roles[role].metres or 1.0 for role in roles]
        return self.numbers(roles, findings) * factors

    def level(self, findings: list[Finding]) -> pl.Series:
        """Levels (n,), dBm; null for cells that are none."""
        return pl.Series(self.numbers(("level",), findings)[:, 0]).cast(pl.Float32).fill_nan(None)

    def text(self, role: str) -> pl.Expr:
        """A column as text; null if the table has none."""
        if role not in self.roles:
            return pl.lit(None, dtype=pl.String)
        return pl.col(self.roles[role].name).cast(pl.String)


_Found: TypeAlias = dict[str, list[tuple[str, pl.DataFrame]]]
"""Files and their rows, by kind of table."""


class _Reader:
    """Reads one session, and keeps how its columns were resolved."""

    def __init__(self, folder: Path, beside: Path | None) -> None:
        self.folder = folder
        self.files = SessionFiles(folder, {})
        path = _columns_file(folder) or (None if beside is None else _columns_file(beside))
        self.columns = WalkColumns() if path is None else read_toml(path, WalkColumns)
        self.found: dict[tuple[str, str], TableColumns] = {}
        self.by_kind: _Found = {}
        self.unread: list[str] = []

    def session(self, ref: SessionRef, settings: FindingSettings) -> Session:
        self._sort_tables()
        self.local = self._all_are_local_dates()
        camera = self._camera(settings)
        landmarks = self._landmarks(camera) if "sightings" in self.by_kind else no_landmarks()
        sensors = self._sensors(camera)
        clock_ns = clock_of(camera, sensors)
        tables = {"sensors": sensors, "wifi": self._wifi(clock_ns, camera, sensors, settings)}
        if "ble" in self.by_kind:
            tables["ble"] = self._ble(clock_ns, camera)
        camera = replace(camera, pressure=pressure_log(sensors), pose_lag_s=pose_lag_of(camera, sensors))
        self._report()
        resolved_columns = self.columns.model_copy(update=self._sections()).text
        return replace(self.files.session(ref.key, camera, landmarks, tables), columns=resolved_columns)

    def _sort_tables(self) -> None:
        """Find the kind of each table, and report those without one and those that are missing."""
        for path in _tables(self.folder):
            try:
                self._sort(path)
            except UsageError as error:
                self.unread.append(str(error))
                why = str(error).removeprefix(f"{path}: ")
                self.files.note("unread_file", path.name, f"this file was not read: {why}")
        for kind, role in (("sightings", "landmarks"), ("wifi", "wifi"), ("sensors", "sensors")):
            alike = {"sensors", *SENSORS} if kind == "sensors" else {kind}
            if not alike & self.by_kind.keys():
                self.files.note("missing_file", self.columns.of(kind).file or f"{kind}.csv", *MISSING[role])

    def _sort(self, path: Path) -> None:
        """Find the kind of a table; raises UsageError if it cannot be read or is empty."""
        table = read_foreign_table(path)
        rows = table.rows
        if rows.is_empty():
            raise UsageError(f"{path}: the table has no rows; found the columns {shown(rows.columns)}")
        kinds = self._kinds(path.name, rows.head(_SAMPLE))
        if kinds == ["wifi"] and self.columns.ble == TableColumns() and _has_beacons(rows):
            kinds.append("ble")
            alike = {key: getattr(self.columns.wifi, key) for key in _OF_BOTH_RADIOS}
            self.columns = self.columns.model_copy(update={"ble": TableColumns(**alike)})
        for kind in kinds:
            numbered = rows.select(table.lines, pl.all().exclude("row"))
            self.by_kind.setdefault(kind, []).append((path.name, numbered))
        if kinds:
            role = "sensors" if kinds[0] in SENSORS else kinds[0]
            self.files.files.append(FileRecord.of(path.name, role, read_bytes(path), rows.height, rows.height))
            return
        own = self._kind(path.name, rows.head(_SAMPLE))
        if own is None:
            message = f"the kind of this table was not recognised; {unknown_kind(rows.columns)}; or remove the file"
        else:
            entry = f"[{own}] file = {toml_value(self.columns.of(own).file)}"
            message = (
                f"{COLUMNS_FILE} names another file as {own} ({entry}), so this one is not read. Correct the entry or "
                "remove the file"
            )
        self.files.note("unread_file", path.name, message)

    def _kinds(self, file: str, sample: pl.DataFrame) -> list[str]:
        """The kinds of a table: as columns.toml says, else by its columns and the file's name."""
        named = [kind for kind in WalkColumns.model_fields if self.columns.of(kind).file == file]
        kind = self._kind(file, sample)
        return named or ([] if kind is None or self.columns.of(kind).file is not None else [kind])

    def _kind(self, file: str, sample: pl.DataFrame) -> str | None:
        """The kind of a table by its columns, the entries of columns.toml and the file's name; None if unknown."""
        columns = sample.columns
        kind = kind_of(file, columns, sample)
        if kind is None and _is_wide(columns):
            return "sensors"
        named = (each for each in WalkColumns.model_fields if fits(columns, each, self.columns.of(each)))
        return kind or next(named, "poses" if named_as_poses(file) else sensor_of_file(file, columns))

    def _only(self, kind: str) -> _Table:
        """The table of a kind; raises UsageError if there is none, or several."""
        files = self.by_kind.get(kind, [])
        if not files and self.unread:
            raise UsageError(self.unread[0])
        if not files:
            there = ", ".join(path.name for path in _tables(self.folder))
            entry = self.columns.of(kind).file
            missing = f"has the columns of {kind}" if entry is None else f"has the name {entry} of [{kind}]"
            raise UsageError(
                f"{self.folder}: no table {missing}; found the files {there}; name one in {COLUMNS_FILE}: "
                f'[{kind}] file = "NAME"'
            )
        if len(files) > 1:
            names = " and ".join(name for name, _ in files)
            raise UsageError(
                f"{self.folder}: the files {names} may be {kind}; choose one in {COLUMNS_FILE}: "
                f'[{kind}] file = "{files[0][0]}"'
            )
        return self._table(kind, *files[0])

    def _table(self, kind: str, file: str, rows: pl.DataFrame) -> _Table:
        """A table with its columns by role; raises UsageError if one is missing or ambiguous."""
        given, cells = self.columns.of(kind), rows.drop("row")
        roles = resolved(cells.columns, kind, given, file, cells.head(_SAMPLE))
        names = {role: column.name for role, column in roles.items()}
        table = _Table(kind, file, rows, roles, given)
        self._noted(table, **(given.model_dump() | names | {"file": file}))
        return table

    def _noted(self, table: _Table, **entries: str) -> None:
        """Keep what was found out about a table."""
        place = table.kind, table.file
        known = self.found.get(place, TableColumns(file=table.file))
        self.found[place] = known.model_copy(update=entries)

    def _times(self, table: _Table, steps: Steps, clock_ns: IntArray | None = None, alike: str | None = None) -> _Table:
        """The table with ``time_ns``; rows without a time are left out and reported.

        ``steps`` limit the intervals between rows, if given between those with the most frequent value in ``alike``.
        """
        column = table.roles["time"]
        texts = table.rows[column.name].cast(pl.String).str.strip_chars()
        if _are_dates(texts):
            return self._with_dates(table, texts)
        step, example = rounded_step(texts)
        numbers, odd = with_numbers(table.rows.with_columns(texts), [column.name], table.file)
        self.files.findings += odd
        known = numbers[column.name].is_not_null() & numbers[column.name].is_finite()
        rows, exact = table.rows.filter(known), texts.filter(known).cast(pl.Int64, strict=False)
        values = numbers[column.name].filter(known).to_numpy()
        if not len(values):
            raise UsageError(
                f"{table.file}: column {column.name} contains no time; expected numbers, or dates such as "
                "2021-12-20T09:14:05+01:00"
            )
        whole = exact.null_count() == 0
        stated = table.given.time_unit or column.unit
        if stated is not None and np.abs(values).max() * NS_OF[_UNITS[stated]] >= MOST_NS:
            raise UsageError(
                f"{table.file}: column {column.name}: {values[0]:.15g} is not a time in {_UNITS[stated]}; write the "
                f'unit to {COLUMNS_FILE}: [{table.kind}] time_unit = "ns"'
            )
        factor = NS_OF[_UNITS[stated or ("ns" if whole else "s")]]
        read_ns = (
            (exact * factor).to_numpy() if whole else np.round(values * factor).clip(-MOST_NS, MOST_NS).astype(int)
        )
        if table.given.time_unit is not None:
            time_ns = read_ns
        elif stated is None and not whole:
            time_ns, _ = ns_of_seconds(values, steps, table.file)
        else:
            rate_ns = read_ns if alike is None else read_ns[(rows[alike] == rows[alike].mode()[0]).to_numpy()]
            words = _UNITS[stated or "ns"]
            time_ns, other = recognised_ns(read_ns, rate_ns, steps, table.file, words, clock_ns)
            self.files.findings += [] if stated is None else other
        unit = _unit_of(values, time_ns) or stated or "ns"
        if step * NS_OF[_UNITS[unit]] / 1e9 > MAX_STEP_S:
            raise UsageError(f"{table.file}: column {column.name}: times such as {example} are rounded; {ROUNDED}")
        self._noted(table, time_unit=unit)
        return replace(table, rows=rows.with_columns(time_ns=pl.Series(time_ns)))

    def _with_dates(self, table: _Table, texts: pl.Series) -> _Table:
        """The table with ``time_ns`` of dates; raises UsageError if their time zone is unknown."""
        zone, entry = table.given.zone, f"{COLUMNS_FILE}: [{table.kind}] zone ="
        if zone is not None:
            time_zone(zone, entry)
        elif _are_local(texts):
            if not self.local:
                example = texts.drop_nulls()[0]
                raise UsageError(
                    f"{table.file}: column {texts.name}: '{example}' has no time zone, and other tables of this walk "
                    f'have times with one, or numbers; write it to {entry} "Europe/Berlin"'
                )
            zone = "UTC"
            self._noted(table, zone=zone)
        try:
            times = table_times(texts, np.empty((0, 2), dtype=int), clock=None, unit=None, zone=zone)
        except UsageError as error:
            raise UsageError(f"{table.file}: {error}") from error
        usable = pl.Series(times.usable)
        self.files.findings += unreadable_cells(
            table.rows, texts.name, ~usable & (texts != ""), table.file, "and their rows are left out"
        )
        return replace(table, rows=table.rows.with_columns(time_ns=pl.Series(times.time_ns)).filter(usable))

    def _all_are_local_dates(self) -> bool:
        """Whether the times of all tables are dates without a time zone: then all are read as those of one clock."""
        return all(
            _are_local(rows[column].cast(pl.String).str.strip_chars())
            for kind, files in self.by_kind.items()
            for _, rows in files
            if (column := _time_column(rows, self.columns.of(kind))) is not None
        )

    def _camera(self, settings: FindingSettings) -> CameraTrack:
        table = self._times(self._only("poses"), FRAMES)
        turn = table.numbers(("qx", "qy", "qz", "qw"), self.files.findings)
        poses = np.column_stack((table.lengths(("x", "y", "z"), self.files.findings), turn))
        given = table.given
        cameras = (given.camera,) if given.camera else ("y-up", "y-down")
        frames = (given.frame,) if given.frame else ("y-up", "z-up")
        axes: Sequence[object] | None = (*cameras, *frames)
        if len(cameras) + len(frames) > 2:
            axes = plausible_axes(table.time_ns, poses, cameras=cameras, frames=frames)
        if axes is None:
            raise UsageError(f"{table.file}: {_unknown_axes(table, poses, cameras, frames)}")
        self.axes = str(axes[0]), str(axes[1])
        self._noted(table, camera=self.axes[0], frame=self.axes[1])
        rows = table.rows.select("row", "time_ns").with_columns(_pose_series(in_acs(poses, *self.axes)))
        return self.files.noted(camera_track(rows, table.file, settings))

    def _landmarks(self, camera: CameraTrack) -> LandmarkLog:
        table, findings = self._times(self._only("sightings"), FRAMES, clock_of(camera)), self.files.findings
        findings += clock_mismatch(table.time_ns, table.file, camera)
        at_rest = np.tile((0.0, 0.0, 0.0, 1.0), (table.rows.height, 1))
        frames = np.flatnonzero(camera.usable)
        frame_ns, time_ns = camera.time_ns[frames], table.time_ns
        nearest = _nearest(frame_ns, time_ns)
        if {"dx", "dy", "dz"} <= table.roles.keys():
            offset = table.lengths(("dx", "dy", "dz"), findings)
            if self.axes[0] == "y-down":
                offset = offset * (1.0, -1.0, -1.0)
            at = np.column_stack([np.interp(time_ns, frame_ns, axis) for axis in camera.position_acs[frames].T])
            poses = np.column_stack((at + rotated(camera.orientation_acs[frames[nearest]], offset), at_rest))
        else:
            turned = {"qx", "qy", "qz", "qw"} <= table.roles.keys()
            turn = table.numbers(("qx", "qy", "qz", "qw"), findings) if turned else at_rest
            poses = in_acs(np.column_stack((table.lengths(("x", "y", "z"), findings), turn)), "y-up", self.axes[1])
        close = np.abs(frame_ns[nearest] - time_ns) <= _MAX_APART_NS
        rows = table.rows.select(
            "row", id=table.text("id").str.strip_chars(), time_ns=np.where(close, frame_ns[nearest], time_ns)
        )
        log = self.files.noted(landmark_log(rows.with_columns(_pose_series(poses)), table.file, camera))
        first = np.full(len(log.ids), len(camera.time_ns))
        np.minimum.at(first, log.landmark, log.frame)
        expected = sum(int((frames >= each).sum()) for each in first)
        logged = len(log.landmark) >= _LOGGED_SHARE * max(expected, 1)
        return log if logged else replace(log, seen=np.ones(len(log.landmark), dtype=bool))

    def _wifi(
        self, clock_ns: IntArray, camera: CameraTrack, sensors: pl.DataFrame, settings: FindingSettings
    ) -> pl.DataFrame:
        if "wifi" not in self.by_kind:
            return mark_repeated(pl.DataFrame(schema=_WIFI), "bssid")
        table = self._of_technology(self._only("wifi"))
        table = self._times(table, Steps(0.0, 600.0), clock_ns)
        frequency: pl.Series | pl.Expr = pl.lit(None, dtype=pl.Float32)
        if "frequency" in table.roles:
            frequency = pl.Series(table.numbers(("frequency",), self.files.findings)[:, 0]).cast(pl.Float32)
            frequency = frequency.fill_nan(None)
        rows = table.rows.select(
            "row",
            "time_ns",
            scan=_scans(table),
            bssid=table.text("address").fill_null("").str.strip_chars(),
            ssid=table.text("ssid").fill_null(""),
            rssi_dbm=table.level(self.files.findings),
            frequency_mhz=frequency,
        )
        self.files.names = {**self.files.names, "wifi": (table.file,)}
        wifi = self.files.wifi(rows.drop_nulls("rssi_dbm"), settings)
        return self.files.on_clock("wifi", wifi, camera, sensors)

    def _ble(self, clock_ns: IntArray, camera: CameraTrack) -> pl.DataFrame:
        table = self._times(self._of_technology(self._only("ble")), ANY, clock_ns)
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

    def _of_technology(self, table: _Table) -> _Table:
        """The rows of the radio technology of a table's kind, if a column states it; rows of others are reported."""
        if "technology" not in table.roles:
            return table
        said = table.rows.select(table.text("technology").fill_null("").str.to_lowercase()).to_series()
        kinds = [kind for kind in _RADIO if any(file == table.file for file, _ in self.by_kind.get(kind, ()))]
        read = said.str.contains("|".join(_RADIO[kind] for kind in kinds))
        if kinds[0] == table.kind and not read.all():
            others = ", ".join(sorted(set(said.filter(~read)))[:_SHOWN])
            message = f"rows of other technologies ({others}) are not read. No action needed if that is right"
            lines = table.rows.filter(~read)["row"].to_list()
            self.files.findings.append(
                Finding.at_lines("technology_left_out", table.file, lines, message, severity=Severity.INFO)
            )
        return replace(table, rows=table.rows.filter(said.str.contains(_RADIO[table.kind])))

    def _sensors(self, camera: CameraTrack) -> pl.DataFrame:
        """The table ``sensors`` of all tables of sensors, in units of Android."""
        parts = [sensor_rows(pl.DataFrame(schema={"row": pl.Int64, "time_ns": pl.Int64}), "", [])]
        for file, rows in self.by_kind.get("sensors", []):
            if _is_wide(rows.columns):
                parts += self._of_wide(file, rows, camera)
            else:
                parts += self._of_long(self._table("sensors", file, rows), camera)
        for kind in SENSORS:
            if kind in self.by_kind:
                parts += self._of_sensor(self._times(self._only(kind), READINGS, clock_of(camera)), kind, camera)
        return self.files.noted(sensor_table(pl.concat(parts), "sensors"))

    def _of_wide(self, file: str, rows: pl.DataFrame, camera: CameraTrack) -> list[pl.DataFrame]:
        """The readings of a table with a column for each axis of each sensor, such as ``acc_x``."""
        given, columns = self.columns.sensors, rows.columns[1:]
        matched = matching_columns(columns, "time")
        if given.time:
            matched = [given_column("time", given.time, columns, "sensors", file)]
        if not matched:
            raise UsageError(f"{file}: {missing_column(columns, ('time',), 'sensors')}")
        table = _Table("sensors", file, rows, {"time": matched[0]}, given)
        self._noted(table, time=matched[0].name)
        table = self._times(table, READINGS, clock_of(camera))
        return self._in_units(table.rows, file, camera)

    def _of_long(self, table: _Table, camera: CameraTrack) -> list[pl.DataFrame]:
        """The readings of a table with a row for each sensor and time, such as ``ACC`` with ``v1`` to ``v3``."""
        table = self._times(table, READINGS, clock_of(camera), table.roles["type"].name)
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

    def _of_sensor(self, table: _Table, kind: str, camera: CameraTrack) -> list[pl.DataFrame]:
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

    def _sections(self) -> dict[str, TableColumns]:
        """How the tables were read, for columns.toml; kinds of several files are found again without it."""
        return {kind: section for (kind, _), section in self.found.items() if len(self.by_kind[kind]) == 1}

    def _report(self) -> None:
        """Say how the columns were read."""
        for (kind, file), section in self.found.items():
            given = self.columns.of(kind)
            entries = {
                key: value
                for key, value in section.model_dump().items()
                if value is not None and key != "file" and getattr(given, key) != value
            }
            if entries:
                words = ", ".join(f"{key} = {toml_value(value)}" for key, value in entries.items())
                rows = next(rows for name, rows in self.by_kind[kind] if name == file)
                others = [each.name for each in matching_columns(rows.columns, "time") if each.name != section.time]
                if others and given.time is None:
                    words += f" (not {' or '.join(others)})"
                message = f"read as {kind}: {words}. If that is wrong, write the right ones to {COLUMNS_FILE}: [{kind}]"
                self.files.note("columns_guessed", file, message, Severity.INFO)


_VALUES = ("v1", "v2", "v3")
_SAMPLE, _SHOWN = 50, 5
_RADIO = {"wifi": r"^\s*wi-?fi|^\s*wlan", "ble": r"^\s*bl|^\s*bt\b"}
"""Words for technologies, by the kind of table that has their readings."""
_OF_BOTH_RADIOS = ("time", "time_unit", "zone", "address", "level", "technology")
_BRACKETS = re.compile(r"[\[(](.*?)[\])]\s*$")
_DATE, _ZONE = r"^\d{4}[-/]\d\d[-/]\d\d[T _-]", r"(?:[Zz]|[+-]\d\d:?(?:\d\d)?)$"


def _unknown_axes(table: _Table, poses: FloatArray, cameras: Sequence[str], frames: Sequence[str]) -> str:
    """Say that a path does not show its axes, or shows that its lengths are in another unit."""
    for unit in ("cm", "mm"):
        metres = poses * np.array([LENGTHS_M[unit]] * 3 + [1.0] * 4)
        if table.given.length_unit is None and plausible_axes(table.time_ns, metres, cameras=cameras, frames=frames):
            return (
                f"the positions are not those of a walking person in metres, but in {unit}; write that to "
                f'{COLUMNS_FILE}: length_unit = "{unit}" in [poses], and in [sightings] if it is right there'
            )
    return (
        f"the path does not show the axes of camera and frame; write them to {COLUMNS_FILE}: "
        '[poses] camera = "y-up" or "y-down", frame = "y-up" or "z-up"'
    )


def _is_wide(columns: Sequence[str]) -> bool:
    return any(sensor_columns(columns, sensor)[0] for sensor in SENSOR_COLUMNS)


def _has_beacons(rows: pl.DataFrame) -> bool:
    """Whether a column of technologies has some that are Bluetooth, as in a log of both radios."""
    return any(
        rows[column.name].cast(pl.String).str.to_lowercase().str.contains(_RADIO["ble"]).any()
        for column in matching_columns(rows.columns, "technology")[:1]
    )


def _sensor_word(text: str) -> str:
    """The normal form of a sensor's name, as in ``android.sensor.accelerometer``."""
    return re.sub(r"^(?:android)?sensor(?=.)", "", plain_name(text))


def _are_dates(texts: pl.Series) -> bool:
    return (texts.str.contains(_DATE).sum() or 0) > len(texts) / 2


def _are_local(texts: pl.Series) -> bool:
    """Whether times are dates without a time zone."""
    return _are_dates(texts) and not texts.str.contains(_ZONE).any()


def _time_column(rows: pl.DataFrame, given: TableColumns) -> str | None:
    if given.time in rows.columns:
        return given.time
    return next((column.name for column in matching_columns(rows.columns, "time")), None)


def _unit_of(values: FloatArray, time_ns: IntArray) -> str | None:
    """The unit in which values (n,) were read as times (n,), ns; None if all are 0."""
    greatest = int(np.argmax(np.abs(values)))
    if values[greatest] == 0 or time_ns[greatest] == 0:
        return None
    factor = time_ns[greatest] / values[greatest]
    return min(_UNITS, key=lambda unit: abs(np.log(NS_OF[_UNITS[unit]] / factor)))


_WIFI = {
    **dict.fromkeys(("row", "time_ns"), pl.Int64),
    "scan": pl.Int32,
    **dict.fromkeys(("bssid", "ssid"), pl.String),
    **dict.fromkeys(("rssi_dbm", "frequency_mhz"), pl.Float32),
}


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
        said = table.rows[table.roles["scan"].name].cast(pl.String)
        numbers = said.cast(pl.Int32, strict=False)
        return said.rank("dense").cast(pl.Int32) if numbers.has_nulls() else numbers
    if time.n_unique() * 2 <= len(time):
        return time.rank("dense").cast(pl.Int32)
    order = time.arg_sort()
    gap = (time.gather(order).diff().fill_null(0) > _NEW_SCAN_NS).cum_sum()
    return pl.DataFrame({"at": order, "scan": gap}).sort("at")["scan"].cast(pl.Int32)


register(CsvWalk())
