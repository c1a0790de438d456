"""A walk whose tables are in memory: checked, and made into what reading its files would make of it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np
import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.common.findings import Finding
from vislam2tag.common.given_tables import GivenTable, frame_of, unix_ns
from vislam2tag.core.tracks import Landmarks
from vislam2tag.intake.columns import find_columns
from vislam2tag.intake.time_units import FRAMES
from vislam2tag.sessions.clocks import clock_mismatch, clock_of, pose_lag_of, with_times
from vislam2tag.sessions.model import FileRecord, Session
from vislam2tag.sessions.readings import SENSOR_SCHEMA, pressure_log, sensor_table
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.tracker_tables import CAMERA_SCHEMA, LANDMARK_SCHEMA, camera_track, landmark_log
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
    "time_ns": ", nanoseconds",
    "id": ", the landmark's name",
    **dict.fromkeys(("tx", "ty", "tz", "x", "y", "z", "sigma_m"), ", metres"),
    **dict.fromkeys(("qx", "qy", "qz", "qw"), ", a unit quaternion's"),
    **dict.fromkeys(("heading_rad", "heading_sigma_rad"), ", radians"),
}


_ROLES = {
    "time_ns": "time",
    "id": "landmark",
    "floor": "floor",
    **{f"t{axis}": axis for axis in "xyz"},
    **{name: name for name in ("x", "y", "z", "qx", "qy", "qz", "qw")},
}
"""The role in the names of headers that each of our columns has."""
_NS_OF = {"ns": 1, "us": 10**3, "ms": 10**6, "s": 10**9}


def recognised(frame: pl.DataFrame, wanted: Iterable[str]) -> pl.DataFrame:
    """Give columns their names of ours by their headers, with times in ns and lengths in metres if these say the unit.

    A column that has its name already stays as it is.
    """
    missing = {_ROLES[name]: name for name in wanted if name in _ROLES and name not in frame.columns}
    others = [name for name in frame.columns if name not in wanted]
    made = []
    for role, column in find_columns(others, missing).items():
        values = frame[column.name]
        if values.dtype.is_numeric() and column.unit not in (None, "ns"):
            values = (values * _NS_OF[column.unit or "ns"]).round().cast(pl.Int64)
        elif values.dtype.is_numeric() and column.metres not in (None, 1.0):
            values = values * column.metres
        made.append(values.alias(missing[role]))
    return frame.with_columns(made)


def checked_column(frame: pl.DataFrame, name: str, column: str, kind: type[pl.DataType]) -> pl.Series:
    """One column of a table in its type; raises UsageError, with the first row, for values of another kind.

    Times and text must be in every row, and times must not be negative. A number that is missing becomes NaN.
    """
    values = unix_ns(frame[column]) if kind is pl.Int64 else frame[column]
    typed = values.cast(kind, strict=False) if _fits(values.dtype, kind) else _nulls(column, kind, len(values))
    wrong = typed.is_null() & values.is_not_null()
    if kind is pl.String:
        wrong = ~typed.is_in([text for text in typed.unique().drop_nulls() if landmark_id(text)]).fill_null(value=False)
    elif column not in _OPTIONAL and kind is pl.Int64:
        wrong = (typed < 0).fill_null(value=True)
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


def _checked(table: GivenTable, name: str, schema: Schema) -> pl.DataFrame:
    """The columns of a schema in their types, behind ``row``, which counts from 1; other columns are left out."""
    frame = recognised(frame_of(table, name), schema)
    missing = [column for column in schema if column not in frame.columns and column not in _OPTIONAL]
    if missing:
        there = ", ".join(frame.columns) or "none"
        raise UsageError(
            f"{name}: the column {', '.join(missing)} is missing; expected {', '.join(schema)}; found {there}"
        )
    columns = [
        checked_column(frame, name, column, kind) if column in frame.columns else _nulls(column, kind, frame.height)
        for column, kind in schema.items()
    ]
    return pl.DataFrame([pl.Series("row", np.arange(1, frame.height + 1)), *columns])


def landmarks_in_memory(
    table: GivenTable, floor: int | None, default_sigma_m: float
) -> tuple[Landmarks, int, list[Finding]]:
    """The landmarks of a table, the floor on which the walk starts, and findings on rows that cannot be used.

    ``floor`` may be None unless the table has several. Raises UsageError for wrong columns, or if it is missing.
    """
    rows = _checked(table, "landmarks", LANDMARK_COLUMNS)
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
) -> Session:
    """Make a session of its tables, as reading its files would; raises UsageError for tables that are none of it."""
    frames = _checked(poses, "poses", CAMERA_SCHEMA)
    _refuse_unit("poses", with_times(frames, "poses", FRAMES)[1])
    camera, findings = camera_track(frames, "poses", settings)
    seen = _checked(sightings, "sightings", LANDMARK_SCHEMA)
    _refuse_unit("sightings", with_times(seen, "sightings", FRAMES, clock_of(camera))[1])
    log, log_findings = landmark_log(seen, "sightings", camera)
    findings += log_findings
    tables = {}
    if sensors is not None:
        rows = _checked(sensors, "sensors", SENSOR_SCHEMA)
        readings, reading_findings = sensor_table(rows, "sensors")
        findings += [*reading_findings, *clock_mismatch(rows["time_ns"].to_numpy(), "sensors", camera)]
        camera = replace(camera, pressure=pressure_log(readings), pose_lag_s=pose_lag_of(camera, readings))
        tables["sensors"] = readings
    files = (FileRecord("poses", "poses", 0, "", frames.height, frames.height),)
    return Session(key, camera, log, np.empty(0, dtype=np.int64), tables, files, tuple(findings))


def _refuse_unit(name: str, findings: list[Finding]) -> None:
    for finding in findings:
        raise UsageError(f"{name}, column time_ns: {finding.message.partition(';')[0]}")
