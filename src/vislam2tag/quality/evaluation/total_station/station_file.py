"""Files of a total station: the track of a session (``tachy.csv``) and its shots of fixed points."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import SurveyError, first_line
from vislam2tag.common.files.table_files import read_csv
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.limits import of_one_recording

TRACK_FILE = "tachy.csv"
SHOTS_FOLDER = "tachymeter"
"""Folder of a floor with the station's shots of fixed points."""


@dataclass(frozen=True)
class StationTrack:
    """Measured positions (k, 2) in the station's frame, metres, at its wall clock (k,), Unix ns, rising strictly."""

    time_ns: IntArray
    position: FloatArray
    left_out: int = 0
    """Further rows: without a finite position, not later than one before them, or at a time of another recording."""


@dataclass(frozen=True)
class Shots:
    """Shots of fixed points (k, 2) in the station's frame, metres, in the file's order.

    ``landmark`` and ``point`` (k,) name the landmark or the control point shot; empty where the file has no such
    column or the row no name.
    """

    position: FloatArray
    landmark: tuple[str, ...]
    point: tuple[str, ...]


def read_station_track(path: Path) -> StationTrack:
    """Read ``tachy.csv`` (``;``, header ``time;X;Y``, date-times in ISO form); raises SurveyError where it is none."""
    table = _read(path, ("time", "X", "Y"))
    try:
        time = table["time"].str.to_datetime(time_unit="ns").cast(pl.Int64)
    except pl.exceptions.PolarsError as error:
        raise SurveyError(
            f"{path}: expected date-times like 2022-01-14 16:01:04.25 in column time ({first_line(error)})"
        ) from error
    rows = table.select("X", "Y").with_columns(time=time)
    finite = rows.filter(pl.all_horizontal(pl.all().is_not_null() & pl.all().is_finite()))
    later = finite.filter(pl.col("time") > pl.col("time").cum_max().shift(1).fill_null(np.iinfo(np.int64).min))
    later = later.filter(of_one_recording(later["time"].to_numpy()))
    if len(later) < 2:
        raise SurveyError(f"{path}: expected a track of two points at least; found {len(later)}")
    return StationTrack(later["time"].to_numpy(), later.select("X", "Y").to_numpy(), len(rows) - len(later))


def read_shots(path: Path) -> Shots:
    """Read a file of single shots: ``;``, header with ``X`` and ``Y``, optional columns ``landmark`` and ``point``.

    Raises SurveyError where it is none.
    """
    table = _read(path, ("X", "Y"))
    names = [_names(table, column) for column in ("landmark", "point")]
    return Shots(table.select(pl.col("X", "Y").fill_null(np.nan)).to_numpy(), *names)


def _names(table: pl.DataFrame, column: str) -> tuple[str, ...]:
    if column not in table.columns:
        return ("",) * len(table)
    return tuple(table[column].fill_null("").str.strip_chars())


def _read(path: Path, columns: tuple[str, ...]) -> pl.DataFrame:
    """Read a table with at least these columns; X and Y are numbers, all else text."""
    numbers = {"X": pl.Float64, "Y": pl.Float64}
    try:
        header = read_csv(path, separator=";", n_rows=0).columns
        schema = {name: numbers.get(name, pl.String) for name in header}
        return read_csv(path, separator=";", schema=schema).select(*columns, pl.exclude(columns))
    except (OSError, pl.exceptions.PolarsError) as error:
        wanted = f"{', '.join(columns[:-1])} and {columns[-1]}"
        raise SurveyError(f"{path}: expected columns {wanted} separated by ';' ({first_line(error)})") from error
