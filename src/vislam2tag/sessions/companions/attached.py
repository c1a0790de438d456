"""A session with the tables of its companions, on its own clock, as if one phone had recorded them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import polars as pl

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.sessions.companions.recording import read_recording
from vislam2tag.sessions.companions.tie import FOLDER, Tie, companion_hashes, read_tie, recording_sha256, tie_files
from vislam2tag.sessions.model import Attachment, FileRecord, Session
from vislam2tag.sessions.tables.sensor_table import pressure_log

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
            message = f"{error}; its readings are missing"
            problem = Finding(
                kind="companion_missing",
                file=f"{FOLDER}/{path.name}",
                count=1,
                message=message,
                severity=Severity.ERROR,
            )
            session = replace(session, findings=(*session.findings, problem))
    return replace(session, files=(*session.files, *_records(folder)))


def _attached(session: Session, name: str, tie: Tie, path: Path) -> Session:
    try:
        changed = recording_sha256(path) != tie.sha256
    except OSError as error:
        raise SessionError(f"{path}: cannot be read ({error.strerror}): put it back, or attach it again") from error
    if changed:
        raise SessionError(f"{path}: is not what was attached: put that back, or attach it again")
    other = read_recording(path, tie.table)
    tables, attached = dict(session.tables), dict(session.attached)
    for kind, table in other.tables.items():
        own = kind in _TABLES_OF_PHONES and (kind not in tables or not tables[kind].height)
        called = kind if own else (kind if kind == name else f"{kind}_{name}")
        clock = tie.clock
        tables[called] = table.with_columns(pl.Series("time_ns", clock.ours(table["time_ns"].to_numpy())))
        attached[called] = Attachment(clock.sigma_s, tie.lever_arm_m)
    camera = session.camera
    if camera.pressure is None and "sensors" in other.tables:
        theirs = other.tables["sensors"]
        on_our_clock = theirs.with_columns(pl.Series("time_ns", tie.clock.ours(theirs["time_ns"].to_numpy())))
        camera = replace(camera, pressure=pressure_log(on_our_clock))
    odd = (each.model_copy(update={"file": f"{FOLDER}/{name}/{each.file}"}) for each in other.findings)
    findings = (*session.findings, *odd)
    return replace(session, camera=camera, tables=tables, attached=attached, findings=findings)


def _records(folder: Path) -> list[FileRecord]:
    """Account of the ties and the recordings, by the names that :func:`companion_hashes` gives them."""
    records = []
    for name, sha256 in companion_hashes(folder).items():
        is_tie = name.endswith(".json")
        size = len(read_bytes(folder / name)) if is_tie else 0
        records.append(FileRecord(name, "companion", size, sha256, int(is_tie), int(is_tie)))
    return records
