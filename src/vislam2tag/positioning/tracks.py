"""Tracks: the phone's positions by its tracker during walks, which connect the scans of a walk.

From a CSV file or the output of `vislam2tag process`.
CSV: ``session``, ``time_ns``, ``x``, ``y`` in metres, level, with
any origin and heading; summed steps of a step counter are also a track. A folder: the output of ``process`` or its
``trajectory`` tables, one file for each session.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError, first_line
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.files.table_files import read_csv, scan_parquet
from vislam2tag.common.folder_kinds import found_at
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.datasets.labelled import labels_in
from vislam2tag.positioning.radio_scans import RadioScans

_COLUMNS = {"session": pl.String, "time_ns": pl.Int64, "x": pl.Float64, "y": pl.Float64}
_NAMED = 3
_LONGEST_GAP_NS = 2_000_000_000
"""Longest gap between two positions of a track that is interpolated."""


class Tracks:
    """Tracks of many sessions; each is read when it is needed."""

    def __init__(self, path: AnyPath) -> None:
        """Open a CSV file or a folder; raises DatasetError if it is neither."""
        path = Path(path)
        if path.is_dir():
            path = labels_in(path)
            folder = path / "trajectory" if (path / "trajectory").is_dir() else path
            self._tables: Mapping[str, pl.LazyFrame | Path] = {file.stem: file for file in folder.glob("*.parquet")}
            if not self._tables:
                raise DatasetError(
                    f"{path}: contains no trajectory/*.parquet{found_at(path)}; pass the output folder of "
                    "`vislam2tag process` or `vislam2tag run`, or a CSV file"
                )
        else:
            table = _csv(path)
            names = table["session"].drop_nulls().unique().to_list()
            self._tables = {name: table.lazy().filter(pl.col("session") == name) for name in names}
        self._path = path

    @classmethod
    def of_walk(cls, session: str, track: pl.DataFrame) -> Tracks:
        """The track of one session: ``time_ns``, and ``x``, ``y`` in metres, level."""
        tracks = cls.__new__(cls)
        tracks._path, tracks._tables = Path(session), {session: track.lazy()}
        return tracks

    def refuse_without(self, scans: RadioScans) -> None:
        """Raise DatasetError if there is no track of the one session of the scans, or none at their times."""
        session = str(scans.session[0])
        if session not in self._tables:
            there = ", ".join(sorted(self._tables)[:_NAMED]) + (", ..." if len(self._tables) > _NAMED else "")
            raise DatasetError(
                f"--track {self._path}: contains no track of session {session}, only of {there or 'none'}; pass the "
                "labels of its survey, or leave out --track to use the recording's own poses"
            )
        if not np.isfinite(self.at(scans)).any():
            raise DatasetError(
                f"--track {self._path}: the track of session {session} has no position at the times of its scans; pass "
                "the labels of the survey with these scans, or leave out --track to use the recording's own poses"
            )

    def at(self, scans: RadioScans) -> FloatArray:
        """Return places (n, 2) at the scans' times, metres; NaN if the track has none.

        Raises DatasetError if a column is missing in a table.
        """
        place = np.full((len(scans), 2), np.nan)
        for session in np.unique(scans.session):
            if session in self._tables:
                rows = scans.session == session
                place[rows] = self._between(str(session), scans.time_ns[rows])
        return place

    def _between(self, session: str, time_ns: IntArray) -> FloatArray:
        """(n, 2) places of the session's track at times (n,), ns, in metres; NaN if it has none."""
        table = self._tables[session]
        try:
            seen = (
                (scan_parquet(table) if isinstance(table, Path) else table)
                .select(pl.col(name).cast(_COLUMNS[name]) for name in ("time_ns", "x", "y"))
                .drop_nulls("time_ns")
                .filter(pl.all_horizontal(pl.col("x", "y").is_finite()))
                .sort("time_ns")
                .collect()
            )
        except (pl.exceptions.PolarsError, OSError) as error:
            reason = first_line(error)
            raise DatasetError(f"{self._path}: cannot read the track of session {session} ({reason})") from error
        if seen.is_empty():
            return np.full((len(time_ns), 2), np.nan)
        known = seen["time_ns"].to_numpy()
        last = len(known) - 1
        after = np.searchsorted(known, time_ns)
        seen_then = known[np.minimum(after, last)] == time_ns
        gap = known[np.minimum(after, last)] - known[np.maximum(after - 1, 0)]
        between = (after > 0) & (after <= last) & (gap <= _LONGEST_GAP_NS)
        place = np.column_stack([np.interp(time_ns, known, seen[axis].to_numpy()) for axis in ("x", "y")])
        return np.where((seen_then | between)[:, None], place, np.nan)


def _csv(path: Path) -> pl.DataFrame:
    try:
        table = read_csv(path, schema_overrides=_COLUMNS, columns=list(_COLUMNS))
    except (pl.exceptions.PolarsError, OSError) as error:
        reason = first_line(error)
        raise DatasetError(f"{path}: not a track ({reason}); expected CSV with {', '.join(_COLUMNS)}") from error
    return table
