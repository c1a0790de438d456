"""Any table of readings, CSV or Parquet: which of its columns are motion and levels, and the tables they make."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import polars as pl

from vislam2tag.common.errors import UsageError, first_line
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.files.table_files import read_csv, read_parquet
from vislam2tag.sessions.tables.sensor_table import SENSOR_VALUES, sensor_table
from vislam2tag.sessions.tables.wifi_table import mark_repeated
from vislam2tag.site.site_table import decoded

PARQUET = (".parquet", ".pq")
_SEPARATORS = (";", "\t", ",")
_AXIS = r"[ _.]?(?:\([^)]*\)|\[[^]]*\])?[ _.]?([xyz])(?:[ _.]?[\[(].*[\])])?"
MOTION_COLUMNS = {
    "GYRO": re.compile(r"(?:gyro(?:scope)?|gyr|rotation_?rate|angular_?velocity|omega|w)" + _AXIS),
    "ACC": re.compile(r"(?:acc|accel|acceleration|accelerometer|a)" + _AXIS),
}
"""Columns of three axes, by what the table ``sensors`` calls them."""
_LEVELS = ("rssi_dbm", "rssi", "rss", "level", "dbm", "signal")
_OF_LABELS = frozenset(("row", "time_ns", "repeated", "floor", "device", "session", "x", "y", "z", "sigma", "status"))


def read_table(path: Path) -> pl.DataFrame:
    """Read a CSV file, all columns as text, or a Parquet file; raises UsageError where it cannot be read."""
    try:
        if path.suffix.lower() in PARQUET:
            return read_parquet(path)
        raw = read_bytes(path)
        if raw.startswith(b"PK"):
            raise UsageError(f"{path}: is a spreadsheet (XLSX) or a zip; save the table as CSV and give that")
        text, _ = decoded(raw)
        head = text.partition("\n")[0]
        separator = max(_SEPARATORS, key=head.count)
        return read_csv(text.encode(), separator=separator, infer_schema=False)
    except (OSError, pl.exceptions.PolarsError) as error:
        why = error.strerror if isinstance(error, OSError) and error.strerror else first_line(error)
        raise UsageError(f"{path}: cannot be read as CSV or Parquet ({why})") from error


def three_axes(columns: Sequence[str], sensor: str) -> list[str]:
    """The columns of a sensor's x, y and z; none where the table lacks one."""
    pattern = MOTION_COLUMNS[sensor]
    axes = {match.group(1): name for name in reversed(columns) if (match := pattern.fullmatch(name.strip().lower()))}
    return [axes[axis] for axis in "xyz"] if len(axes) == 3 else []


def level_columns(columns: Sequence[str]) -> tuple[str, str] | None:
    """The columns of access points and their levels; None where the table lacks one."""
    plain = {name.strip().lower(): name for name in columns}
    level = next((plain[name] for name in _LEVELS if name in plain), None)
    return None if level is None or "bssid" not in plain else (plain["bssid"], level)


def numbers(name: str) -> pl.Expr:
    """A column as numbers, with either decimal mark; null where it holds none."""
    return pl.col(name).cast(pl.String).str.replace(",", ".", literal=True).cast(pl.Float64, strict=False)


def session_tables(rows: pl.DataFrame, name: str) -> dict[str, pl.DataFrame]:
    """Turn a table with ``row`` and ``time_ns`` into those of a session: ``wifi``, ``sensors``, or one called ``name``.

    Raises UsageError where a column of the last has a name that labels take.
    """
    columns = [column for column in rows.columns if column not in ("row", "time_ns")]
    levels = level_columns(columns)
    if levels is not None:
        return {"wifi": _wifi(rows, *levels)}
    sensors = {sensor: axes for sensor in MOTION_COLUMNS if (axes := three_axes(columns, sensor))}
    if sensors:
        return {"sensors": _sensors(rows, sensors)}
    if taken := sorted(_OF_LABELS & set(columns)):
        raise UsageError(f"the table has a column {' and '.join(taken)}, as labels have; rename it")
    first = pl.struct("time_ns", *columns).is_first_distinct()
    return {name: rows.select("row", "time_ns", first.not_().alias("repeated"), *columns)}


def _wifi(rows: pl.DataFrame, bssid: str, level: str) -> pl.DataFrame:
    """Readings of access points; those of one time are a scan."""
    table = rows.select(
        "row",
        "time_ns",
        pl.col("time_ns").rank("dense").cast(pl.Int32).alias("scan"),
        pl.col(bssid).cast(pl.String).str.strip_chars().alias("bssid"),
        pl.lit("").alias("ssid"),
        numbers(level).cast(pl.Float32).alias("rssi_dbm"),
        pl.lit(None, dtype=pl.Float32).alias("frequency_mhz"),
    )
    return mark_repeated(table.drop_nulls("rssi_dbm"))


def _sensors(rows: pl.DataFrame, sensors: dict[str, list[str]]) -> pl.DataFrame:
    parts = []
    for sensor, axes in sensors.items():
        values = [numbers(axis).fill_null(float("nan")).alias(f"v{i}") for i, axis in enumerate(axes, 1)]
        rest = [pl.lit(0.0).alias(value) for value in SENSOR_VALUES[3:]]
        parts.append(rows.select("row", "time_ns", pl.lit(sensor).alias("sensor"), *values, *rest))
    return sensor_table(pl.concat(parts), "")[0]
