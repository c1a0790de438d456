"""Companions: recordings of the same walk by other devices, read and put on the session's own clock."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.documentation import page_of
from vislam2tag.common.errors import DatasetError, SessionError, UsageError
from vislam2tag.common.files.archives import folder_of, is_archive
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.arrays import IntArray
from vislam2tag.intake.foreign_table import read_foreign_table
from vislam2tag.intake.readings import KINDS, admitted
from vislam2tag.intake.time_units import Span, unix_span
from vislam2tag.sessions.companion_ties import (
    FOLDER,
    TableColumns,
    Tie,
    companion_hashes,
    read_tie,
    recording_sha256,
    tie_files,
)
from vislam2tag.sessions.foreign_tables import session_tables, table_times, time_column, time_findings
from vislam2tag.sessions.model import Attachment, FileRecord, Session
from vislam2tag.sessions.readings import mark_repeated, mark_wifi, pressure_log, stale_scans
from vislam2tag.sessions.registry import FORMATS, UNKNOWN_FORMAT, format_of, recorded_folder
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.site.model import SessionKey, SessionRef
from vislam2tag.site.site_table import site_finding


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
    """About its cells, units, addresses and levels."""
    unix_ahead_ns: int | None = None
    """How far Unix time is ahead of its clock, if the app says so."""

    @property
    def unix_span(self) -> Span | None:
        """First and last of its times as Unix time, ns; None if unknown."""
        return unix_span(np.concatenate([table["time_ns"] for table in self.tables.values()]), self.unix_ahead_ns)


def read_recording(path: Path, columns: TableColumns | None = None, zone: str | None = None) -> OtherRecording:
    """Read a recording; ``columns`` and ``zone`` say how the times of a table are to be read, if not as its names do.

    Raises SessionError where it is a folder or zip of no known app, cannot be read or contains no readings.
    """
    if not path.exists():
        raise SessionError(f"{path}: no such file or folder")
    try:
        with unpacked(path) as folder:
            if folder is not None:
                return _of_app(path, folder)
        return _of_table(path, columns, zone)
    except (UsageError, DatasetError) as error:
        message = str(error).replace(
            "raise --max-unpacked-gb if that is right", "unpack it yourself and pass the folder"
        )
        raise SessionError(message) from error


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
    if name == UNKNOWN_FORMAT:
        raise SessionError(f"{path}: the folder cannot be opened; check its permissions")
    if name is None:
        raise SessionError(
            f"{path}: contains no recording of a known app ({page_of('how-to/iphone')} lists them); "
            "pass a table of its readings as CSV"
        )
    ref = SessionRef(SessionKey(0, "companion", path.stem), folder, name, "companion")
    session = FORMATS.named(name).read(ref, FindingSettings())
    tables = {name: table for name, table in session.tables.items() if table.height}
    if not tables:
        raise SessionError(f"{path}: contains no readings")
    lines, rows = (sum(getattr(file, what) for file in session.files) for what in ("lines", "rows"))
    odd = tuple(each for each in session.findings if each.kind in KINDS | {"unread_file"})
    ahead_ns = None if session.recording is None else session.recording.unix_ahead_ns
    return OtherRecording(tables, _taps(session), f"a recording of {name}", None, lines, rows, odd, ahead_ns)


def _taps(session: Session) -> IntArray:
    """When somebody tapped: presses, or the moments of its fixes."""
    fixes = (session.geographic_fixes, session.camera.fixes)
    return np.unique(np.concatenate([session.presses_ns, *(each.time_ns for each in fixes if each is not None)]))


def _of_table(path: Path, columns: TableColumns | None, zone: str | None) -> OtherRecording:
    table = read_foreign_table(path)
    rows, lines = table.rows, table.lines
    name = time_column(rows.columns, None if columns is None else columns.time_column)
    asked = columns or TableColumns(time_column=name, zone=zone)
    no_walk = np.empty((0, 2), dtype=np.int64)
    times = table_times(rows[name], no_walk, clock=None, unit=asked.unit, zone=asked.zone, aligned=True, lines=lines)
    odd = time_findings(rows[name], times, path.name, lines)
    timed = rows.drop(name).insert_column(0, lines)
    timed = timed.with_columns(pl.Series("time_ns", times.time_ns)).filter(pl.Series(times.usable))
    tables, about_cells = session_tables(timed, path.stem, path.name)
    odd += about_cells
    if "wifi" in tables:
        wifi, about_levels = admitted(tables["wifi"], "bssid", path.name)
        tables["wifi"] = mark_wifi(mark_repeated(wifi, "bssid"))
        odd += [*about_levels, *stale_scans(tables["wifi"], path.name)]
    taps = np.empty(0, dtype=np.int64)
    told = f"a table, {times.interpretation}"
    return OtherRecording(tables, taps, told, asked, rows.height, timed.height, tuple(odd))


_TABLES_OF_PHONES = ("wifi", "sensors", "ble")


def with_companions(session: Session, folder: Path) -> Session:
    """Add the readings of every companion that is tied to the session in ``folder``.

    A table that the session has no rows of (Wi-Fi of an iPhone) becomes its own; any other is added under the table's
    and the companion's name. A companion that is gone, or that changed since, is a finding, and adds nothing.
    """
    for path in tie_files(folder):
        try:
            tie = read_tie(path)
            session = _attached(session, path.stem, tie, tie.path(folder))
        except SessionError as error:
            message = f"{error}; its readings are not used"
            problem = site_finding("companion_missing", f"{FOLDER}/{path.name}", message, Severity.ERROR)
            session = replace(session, findings=(*session.findings, problem))
    return replace(session, files=(*session.files, *_records(folder)))


def _attached(session: Session, name: str, tie: Tie, path: Path) -> Session:
    try:
        changed = recording_sha256(path) != tie.sha256
    except OSError as error:
        raise SessionError(f"{path}: cannot be read ({error.strerror}): put it back, or attach it again") from error
    if changed:
        raise SessionError(f"{path}: was changed since it was attached: restore it, or attach it again")
    other = read_recording(path, tie.table)
    tables, attached, camera = dict(session.tables), dict(session.attached), session.camera
    for kind, theirs in other.tables.items():
        table = theirs.with_columns(pl.Series("time_ns", tie.clock.ours(theirs["time_ns"].to_numpy())))
        own = kind in _TABLES_OF_PHONES and (kind not in tables or not tables[kind].height)
        called = kind if own or kind == name else f"{kind}_{name}"
        tables[called] = table
        attached[called] = Attachment(tie.clock.sigma_s, tie.lever_arm_m)
        if kind == "sensors" and camera.pressure is None:
            camera = replace(camera, pressure=pressure_log(table))
    odd = (each.model_copy(update={"file": f"{FOLDER}/{name}/{each.file}"}) for each in other.findings)
    findings = (*session.findings, *odd)
    return replace(session, camera=camera, tables=tables, attached=attached, findings=findings)


def _records(folder: Path) -> list[FileRecord]:
    """Account of the ties and the recordings, by the names that :func:`companion_hashes` gives them."""
    records = []
    for name, sha256 in companion_hashes(folder).items():
        is_tie = int(name.endswith(".json"))
        size = len(read_bytes(folder / name)) if is_tie else 0
        records.append(FileRecord(name, "companion", size, sha256, is_tie, is_tie))
    return records
