"""A walk whose tables are in memory: checked, and made into what reading its files would make of it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.common.given_tables import GivenTable, frame_of
from vislam2tag.core.arrays import IntArray
from vislam2tag.core.tracks import CameraTrack, Landmarks
from vislam2tag.intake.columns import find_columns, shown
from vislam2tag.intake.time_units import FRAMES, NS_IN
from vislam2tag.sessions.apps import in_acs, pose_series
from vislam2tag.sessions.clocks import clock_mismatch, clock_of, pose_lag_of, with_times
from vislam2tag.sessions.given_times import GivenTimes, given_times, refuse_mixed_dates
from vislam2tag.sessions.model import FileRecord, Session
from vislam2tag.sessions.pose_axes import plausible_axes
from vislam2tag.sessions.readings import SENSOR_SCHEMA, pressure_log, sensor_table
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.sighting_poses import at_frames, of_offsets, of_positions
from vislam2tag.sessions.tracker_tables import (
    CAMERA_SCHEMA,
    LANDMARK_SCHEMA,
    POSE_COLUMNS,
    camera_track,
    landmark_log,
)
from vislam2tag.site.landmark_file import landmarks_from, landmarks_in
from vislam2tag.site.model import SessionKey, landmark_id
from vislam2tag.site.site_table import SiteTable

Schema: TypeAlias = Mapping[str, type[pl.DataType]]

LANDMARK_COLUMNS: Schema = {
    "id": pl.String,
    "floor": pl.Int64,
    **dict.fromkeys(("x", "y", "z", "sigma_m", "heading_rad", "heading_sigma_rad"), pl.Float64),
}
_OPTIONAL = LANDMARK_COLUMNS.keys() - {"id", "x", "y"}
_KINDS = {pl.String: "text or whole numbers", pl.Int64: "integers", pl.Float64: "numbers"}
_UNITS = {
    "id": ", the landmark's name",
    **dict.fromkeys(("tx", "ty", "tz", "dx", "dy", "dz", "x", "y", "z", "sigma_m"), ", metres"),
    **dict.fromkeys(("qx", "qy", "qz", "qw"), ", a unit quaternion's"),
    **dict.fromkeys(("heading_rad", "heading_sigma_rad"), ", radians"),
}


_ROLES = {
    "id": "landmark",
    "floor": "floor",
    **{f"t{axis}": axis for axis in "xyz"},
    **{name: name for name in ("x", "y", "z", "qx", "qy", "qz", "qw")},
}
"""The role in the names of headers that each of our columns has."""


def recognised(frame: pl.DataFrame, wanted: Iterable[str], roles: Mapping[str, str] = _ROLES) -> pl.DataFrame:
    """Give columns their names of ours by their headers, with lengths in metres if these say the unit.

    A column that has its name already stays as it is. ``roles`` are those of our names.
    """
    missing = {roles[name]: name for name in wanted if name in roles and name not in frame.columns}
    others = [name for name in frame.columns if name not in wanted]
    made = []
    for role, column in find_columns(others, missing).items():
        values = frame[column.name]
        if values.dtype.is_numeric() and column.metres not in (None, 1.0):
            values = values * column.metres
        made.append(values.alias(missing[role]))
    return frame.with_columns(made)


def checked_column(frame: pl.DataFrame, name: str, column: str, kind: type[pl.DataType]) -> pl.Series:
    """One column of a table in its type; raises UsageError, with the first row, for values of another kind.

    Text must be in every row. A number that is missing becomes NaN.
    """
    values = frame[column]
    typed = values.cast(kind, strict=False) if _fits(values.dtype, kind) else _nulls(column, kind, len(values))
    wrong = typed.is_null() & values.is_not_null()
    if kind is pl.String:
        wrong = ~typed.is_in([text for text in typed.unique().drop_nulls() if landmark_id(text)]).fill_null(value=False)
    if wrong.any():
        row = int(wrong.arg_max() or 0)
        expected = f"{_KINDS[kind]}{_UNITS.get(column, '')}"
        raise UsageError(f"{name}, column {column}, row {row + 1}: expected {expected}; found {values[row]!r}")
    return typed.fill_null(math.nan) if kind is pl.Float64 else typed


def _fits(given: pl.DataType, kind: type[pl.DataType]) -> bool:
    if kind is pl.String:
        return given.is_numeric() or given in (pl.String, pl.Categorical, pl.Enum)
    return given.is_integer() if kind is pl.Int64 else given.is_numeric()


def _nulls(column: str, kind: type[pl.DataType], count: int) -> pl.Series:
    return pl.Series(column, [None], dtype=kind).new_from_index(0, count)


def _checked(
    frame: pl.DataFrame, name: str, schema: Schema, roles: Mapping[str, str] = _ROLES, or_else: str = ""
) -> pl.DataFrame:
    """The columns of a schema, except times, in their types, behind ``row``, which counts from 1."""
    wanted = {column: kind for column, kind in schema.items() if column != "time_ns"}
    known = recognised(frame, wanted, roles)
    missing = [column for column in wanted if column not in known.columns and column not in _OPTIONAL]
    if missing:
        raise UsageError(
            f"{name}: the column {', '.join(missing)} is missing; expected {', '.join(schema)}{or_else}; found "
            f"{shown(frame.columns) or 'none'}"
        )
    columns = [
        checked_column(known, name, column, kind) if column in known.columns else _nulls(column, kind, known.height)
        for column, kind in wanted.items()
    ]
    return pl.DataFrame([pl.Series("row", np.arange(1, known.height + 1)), *columns])


@dataclass(frozen=True)
class _Timed:
    """A table's rows with a time, ``rows`` of a schema behind ``row``, and findings on those without."""

    rows: pl.DataFrame
    times: GivenTimes
    findings: list[Finding]

    @classmethod
    def of(cls, frame: pl.DataFrame, name: str, schema: Schema, span_ns: IntArray | None = None) -> _Timed:
        times = given_times(frame, name, span_ns=span_ns)
        if schema is LANDMARK_SCHEMA:
            schema, roles = _sighting_columns(frame)
            or_else = " (or cam_x, cam_y, cam_z, from the camera; a quaternion may be left out)"
            rows = _checked(frame, name, schema, roles, or_else).with_columns(times.ns)
        else:
            rows = _checked(frame, name, schema).with_columns(times.ns)
        return cls(rows.drop_nulls("time_ns"), times, times.missing(name))

    def refuse_unit(self, name: str, clock_ns: IntArray | None = None) -> None:
        """Raise UsageError if the times fit only in another unit, and name it."""
        given_ns = self.rows["time_ns"]
        made, findings = with_times(self.rows, name, FRAMES, clock_ns)
        if findings:
            row = int(given_ns.abs().arg_max() or 0)
            factor = made["time_ns"][row] / given_ns[row]
            unit = next((unit for unit, ns in NS_IN.items() if ns == round(factor)), None)
            rename = f"; rename the column to time_{unit}" if unit else "; correct the unit in the column's name"
            message = findings[0].message.partition(";")[0]
            raise UsageError(f"{name}, column {self.times.column}: {message}{rename}")


_POSITION, _OFFSET, _TURN = ("tx", "ty", "tz"), ("dx", "dy", "dz"), ("qx", "qy", "qz", "qw")


def _sighting_columns(frame: pl.DataFrame) -> tuple[Schema, Mapping[str, str]]:
    """The columns of sightings by what their headers say, and their roles: positions, or offsets from the camera."""
    turned = any(name in recognised(frame, _TURN).columns for name in _TURN)
    for names, role in ((_POSITION, None), (_OFFSET, "offset_{}"), (_POSITION, "landmark_{}"), (_POSITION, "{}")):
        roles = {name: role.format(name[-1]) for name in names} if role else {}
        if set(names) <= set(recognised(frame, names, roles).columns):
            break
    turn = _TURN if turned and names == _POSITION else ()
    columns = {"id": pl.String, "time_ns": pl.Int64, **dict.fromkeys((*names, *turn), pl.Float64)}
    return columns, {**_ROLES, **roles}


def _in_our_axes(rows: pl.DataFrame) -> tuple[pl.DataFrame, tuple[str, str], list[Finding]]:
    """Poses of a walking person in our axes, those they had (camera, frame), and a finding if these were others.

    Poses stay as they are if they may be in our axes, or if no others are clearly those of a walking person.
    """
    poses, time_ns = rows.select(list(POSE_COLUMNS)).to_numpy(), rows["time_ns"].to_numpy()
    ours = plausible_axes(time_ns, poses, cameras=("y-up",), frames=("y-up",))
    found = None if ours else plausible_axes(time_ns, poses)
    if found is None:
        return rows, ("y-up", "y-up"), []
    camera, frame, _ = found
    message = f"read as poses of a camera with {camera} in a frame with {frame}, because the path shows it"
    finding = Finding(kind="columns_guessed", file="poses", count=1, message=message, severity=Severity.INFO)
    return rows.with_columns(pose_series(in_acs(poses, camera, frame))), (camera, frame), [finding]


def _with_poses(rows: pl.DataFrame, camera: CameraTrack, axes: tuple[str, str]) -> pl.DataFrame:
    """Sightings with poses in our axes, at the times of frames if these differ only by rounding."""
    if not camera.usable.any():
        return rows.with_columns(pose_series(np.full((rows.height, 7), np.nan)))
    time_ns = rows["time_ns"].to_numpy()
    if _OFFSET[0] in rows.columns:
        poses = of_offsets(rows.select(_OFFSET).to_numpy(), time_ns, camera, axes[0])
    else:
        turn = rows.select(_TURN).to_numpy() if _TURN[0] in rows.columns else None
        poses = of_positions(rows.select(_POSITION).to_numpy(), turn, axes[1])
    return rows.with_columns(pose_series(poses), time_ns=at_frames(camera, time_ns, _ROUNDING_NS))


_ROUNDING_NS = 1_000_000
"""Times of sightings in other units than those of poses differ by so much; frames are further apart."""


def landmarks_in_memory(
    table: GivenTable, floor: int | None, default_sigma_m: float
) -> tuple[Landmarks, int, list[Finding]]:
    """The landmarks of a table, the floor on which the walk starts, and findings on rows that cannot be used.

    ``floor`` may be None unless the table has several. Raises UsageError for wrong columns, or if it is missing.
    """
    rows = _checked(frame_of(table, "landmarks"), "landmarks", LANDMARK_COLUMNS)
    floors = rows["floor"].drop_nulls().unique().sort().to_list()
    if floor is None and len(floors) > 1:
        there = ", ".join(map(str, floors))
        raise UsageError(
            f"landmarks, column floor: there are {there}; pass floor=... to specify on which of them the walk starts"
        )
    own = int(floors[0]) if floor is None and floors else floor or 0
    cells = rows.select("row", *LANDMARK_COLUMNS).fill_nan(None).rows()
    texts = tuple((row, tuple("" if cell is None else str(cell) for cell in cells)) for row, *cells in cells)
    found, findings = landmarks_in(SiteTable("landmarks", tuple(LANDMARK_COLUMNS), texts), own, default_sigma_m, set())
    return landmarks_from(found), own, findings


def session_in_memory(
    key: SessionKey, poses: GivenTable, sightings: GivenTable, sensors: GivenTable | None, settings: FindingSettings
) -> tuple[Session, GivenTimes]:
    """Make a session of its tables, as reading its files would, and return it with the times of its poses.

    Raises UsageError for tables that are none of it.
    """
    posed = _Timed.of(frame_of(poses, "poses"), "poses", CAMERA_SCHEMA)
    posed.refuse_unit("poses")
    rows, axes, findings = _in_our_axes(posed.rows)
    camera, camera_findings = camera_track(rows, "poses", settings)
    seen = _Timed.of(frame_of(sightings, "sightings"), "sightings", LANDMARK_SCHEMA, clock_of(camera))
    seen.refuse_unit("sightings", clock_of(camera))
    log, log_findings = landmark_log(_with_poses(seen.rows, camera, axes), "sightings", camera)
    findings += [*camera_findings, *posed.findings, *seen.findings, *log_findings]
    given = [("poses", posed.times), ("sightings", seen.times)]
    tables = {}
    if sensors is not None:
        read = _Timed.of(frame_of(sensors, "sensors"), "sensors", SENSOR_SCHEMA, clock_of(camera))
        readings, reading_findings = sensor_table(read.rows, "sensors")
        findings += [*read.findings, *reading_findings]
        findings += clock_mismatch(read.rows["time_ns"].to_numpy(), "sensors", camera)
        camera = replace(camera, pressure=pressure_log(readings), pose_lag_s=pose_lag_of(camera, readings))
        tables["sensors"] = readings
        given.append(("sensors", read.times))
    refuse_mixed_dates(given)
    count = posed.times.ns.len()
    files = (FileRecord("poses", "poses", 0, "", count, posed.rows.height),)
    return Session(key, camera, log, np.empty(0, dtype=np.int64), tables, files, tuple(findings)), posed.times
