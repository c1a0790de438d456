"""Where a phone's tracker saw itself during walks, read from a CSV or from what `vislam2tag process` wrote.

CSV: ``session``, ``time_ns``, ``x``, ``y`` in metres, level, with any origin and heading; steps of a step counter,
summed up, are such a track. A folder: ``process``' output or its ``trajectory`` tables, one session a file.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.table_files import read_csv, scan_parquet
from vislam2tag.common.text_paths import AnyPath
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.positioning.scans.radio_scans import RadioScans

_COLUMNS = {"session": pl.String, "time_ns": pl.Int64, "x": pl.Float64, "y": pl.Float64}
_LONGEST_GAP_NS = 2_000_000_000
"""Between two sightings this far apart nothing is known."""


class Tracks:
    """Tracks of many sessions; each is read when it is asked for."""

    def __init__(self, path: AnyPath) -> None:
        """Open a CSV or a folder; raises DatasetError where it is neither."""
        path = Path(path)
        if path.is_dir():
            folder = path / "trajectory" if (path / "trajectory").is_dir() else path
            self._tables: Mapping[str, pl.LazyFrame | Path] = {file.stem: file for file in folder.glob("*.parquet")}
            if not self._tables:
                raise DatasetError(f"{path}: holds no trajectory/*.parquet; give what process wrote, or a CSV")
        else:
            table = _csv(path)
            names = table["session"].drop_nulls().unique().to_list()
            self._tables = {name: table.lazy().filter(pl.col("session") == name) for name in names}
        self._path = path

    def at(self, scans: RadioScans) -> FloatArray:
        """Return places (n, 2) at the scans' times, metres; NaN where the track has none.

        Raises DatasetError where a table lacks a column.
        """
        place = np.full((len(scans), 2), np.nan)
        for session in np.unique(scans.session):
            if session in self._tables:
                rows = scans.session == session
                place[rows] = self._between(str(session), scans.time_ns[rows])
        return place

    def _between(self, session: str, time_ns: IntArray) -> FloatArray:
        """(n, 2) places of the session's track at times (n,), ns, in metres; NaN where it has none."""
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
            reason = str(error).splitlines()[0]
            raise DatasetError(f"{self._path}: no track of session {session} ({reason})") from error
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
        reason = str(error).splitlines()[0]
        raise DatasetError(f"{path}: is no track ({reason}); expected CSV with {', '.join(_COLUMNS)}") from error
    return table
