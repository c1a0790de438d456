"""A second recording of a walk, whatever wrote it: the folder or zip of an app, or a table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError, SessionError, UsageError
from vislam2tag.common.files.archives import folder_of, is_archive
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import IntArray
from vislam2tag.intake.readings import KINDS, admitted
from vislam2tag.sessions.companions.table import read_table, session_tables
from vislam2tag.sessions.companions.tie import TableColumns
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import FORMATS, UNKNOWN_FORMAT, format_of, recorded_folder
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.tables.clocks import table_times, time_column
from vislam2tag.sessions.tables.wifi_table import mark_repeated
from vislam2tag.site.model import SessionKey, SessionRef


@dataclass(frozen=True)
class OtherRecording:
    """What another device recorded, on its own clock.

    ``tables`` are as a :class:`~vislam2tag.sessions.model.Session` has them; ``taps_ns`` (k,) when somebody tapped on
    it; ``columns`` how the times of a table were read (None: it is none); ``lines`` it has in all, ``rows`` were read.
    """

    tables: Mapping[str, pl.DataFrame]
    taps_ns: IntArray
    told: str
    """What it was taken for."""
    columns: TableColumns | None
    lines: int
    rows: int
    findings: tuple[Finding, ...] = ()
    """About its addresses and levels."""


def read_recording(path: Path, columns: TableColumns | None = None, zone: str | None = None) -> OtherRecording:
    """Read a recording; ``columns`` and ``zone`` say how the times of a table are to be read, if not as its names do.

    Raises SessionError where it is a folder or zip of no known app, cannot be read or holds no readings.
    """
    if not path.exists():
        raise SessionError(f"{path}: no such file or folder")
    try:
        with unpacked(path) as folder:
            if folder is not None:
                return _of_app(path, folder)
        return _of_table(path, columns, zone)
    except (UsageError, DatasetError) as error:
        raise SessionError(str(error)) from error


@contextmanager
def unpacked(path: Path) -> Iterator[Path | None]:
    """Yield the folder that a path is, or that its zip unpacks to while the block lasts; None for any other file."""
    if path.is_dir():
        yield path
    elif is_archive(path):
        with scratch_folder() as scratch:
            yield recorded_folder(folder_of(path, scratch))
    else:
        yield None


def _of_app(path: Path, folder: Path) -> OtherRecording:
    name = format_of(folder)
    if name is None or name == UNKNOWN_FORMAT:
        raise SessionError(
            f"{path}: holds no recording of an app that is known (docs/how-to/two-phones.md names them); give a table "
            "of its readings as CSV"
        )
    ref = SessionRef(SessionKey(0, "companion", path.stem), folder, name, "companion")
    session = FORMATS.named(name).read(ref, FindingSettings())
    tables = {name: table for name, table in session.tables.items() if table.height}
    if not tables:
        raise SessionError(f"{path}: holds no readings")
    lines, rows = (sum(getattr(file, what) for file in session.files) for what in ("lines", "rows"))
    odd = tuple(each for each in session.findings if each.kind in KINDS)
    return OtherRecording(tables, _taps(session), f"a recording of {name}", None, lines, rows, odd)


def _taps(session: Session) -> IntArray:
    """When somebody tapped: presses, or the moments of its fixes."""
    fixes = [session.presses_ns]
    if session.geographic_fixes is not None:
        fixes.append(session.geographic_fixes.time_ns)
    if session.camera.fixes is not None:
        fixes.append(session.camera.fixes.time_ns)
    return np.unique(np.concatenate(fixes))


def _of_table(path: Path, columns: TableColumns | None, zone: str | None) -> OtherRecording:
    rows = read_table(path)
    name = time_column(rows.columns, None if columns is None else columns.time_column)
    asked = columns or TableColumns(time_column=name, zone=zone)
    no_walk = np.empty((0, 2), dtype=np.int64)
    times = table_times(rows[name], no_walk, clock=None, unit=asked.unit, zone=asked.zone, aligned=True)
    timed = rows.drop(name).with_row_index("row", offset=2).with_columns(pl.col("row").cast(pl.Int64))
    timed = timed.with_columns(pl.Series("time_ns", times.time_ns)).filter(pl.Series(times.usable))
    tables, odd = session_tables(timed, path.stem), list[Finding]()
    if "wifi" in tables:
        wifi, odd = admitted(tables["wifi"], "bssid", path.name)
        tables["wifi"] = mark_repeated(wifi)
    taps = np.empty(0, dtype=np.int64)
    told = f"a table, {times.interpretation}"
    return OtherRecording(tables, taps, told, asked, rows.height, timed.height, tuple(odd))
