"""Relates a second recording of a walk to the one with poses."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vislam2tag.common.documentation import page_of
from vislam2tag.common.errors import DatasetError, OutputError, SessionError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.findings import Finding
from vislam2tag.common.tabular import TabularResult
from vislam2tag.core.arrays import IntArray
from vislam2tag.core.clocks import ClockAlignment
from vislam2tag.intake.time_units import other_day, unix_span
from vislam2tag.sessions.clocks import WAYS, first_clear, possible_alignments
from vislam2tag.sessions.companion_ties import (
    FOLDER,
    TableColumns,
    Tie,
    is_usable_lever_arm,
    recording_sha256,
    tie_file,
    write_tie,
)
from vislam2tag.sessions.companions import OtherRecording, read_recording
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import UNKNOWN_FORMAT, format_in_zip, format_of, read_session
from vislam2tag.site.discover import zip_of
from vislam2tag.site.model import SessionKey, SessionRef, unique_slugs

LEVER_ARM_M = 0.3
"""Assumed distance between two devices that one person carries."""


@dataclass(frozen=True, repr=False)
class Attached(TabularResult):
    """A written tie: its file, and the recording's tables with the number of rows within the walk."""

    written: Path
    tie: Tie
    taken_for: str
    rows: dict[str, int]
    inside: dict[str, int]
    refused: tuple[str, ...]
    """Methods that could not estimate the offset, with their figures."""
    findings: tuple[Finding, ...] = ()
    """Findings about addresses and levels of the recording."""

    def _facts(self) -> dict[str, object]:
        return {"written": self.written, "taken for": self.taken_for, "tables": ", ".join(self.rows)}


def attach(
    walk: AnyPath,
    other: AnyPath,
    *,
    by: str | None = None,
    lever_arm_m: float = LEVER_ARM_M,
    name: str | None = None,
    replace: bool = False,
    columns: TableColumns | None = None,
    zone: str | None = None,
) -> Attached:
    """Tie a second recording of a walk to its session: estimate and store the clock's offset and drift.

    ``walk`` is the session's folder, or the zip that it is read from; ``other`` the folder or zip of an app, or a table
    (``columns`` and ``zone`` say how its times are to be read). ``by`` selects the method for the offset: ``motion``,
    ``levels`` or ``taps``. The tie is ``companions/NAME.json`` in the walk's folder; neither recording is changed.
    Raises SessionError if one of them cannot be read, UsageError, with the figures, if no method gives a clear offset,
    OutputError if a tie of that name exists (unless ``replace``) or cannot be written.
    """
    walk, other = Path(walk), Path(other)
    folder = Folder.at(walk)
    if walk.suffix == ".zip" and walk.is_file():
        walk = walk.with_suffix("")  # what is tied to it is kept beside
        folder = Folder.at(walk.parent).folder(walk.name)
    if by is not None and by not in WAYS:
        raise UsageError(f"--by {by}: unknown method; choose one of {', '.join(WAYS)}")
    if not is_usable_lever_arm(lever_arm_m):
        raise UsageError(f"--lever-arm-m {lever_arm_m:g}: expected 0 to 10 m between two devices of one walk")
    (called,) = unique_slugs([name or other.stem])
    if tie_file(walk, called).exists() and not replace:
        raise OutputError(f"{tie_file(walk, called)}: the tie already exists; use --replace, or choose another --name")
    session = _session(walk)
    recording = read_recording(other, columns, zone)
    rows = {table: content.height for table, content in recording.tables.items()}

    def matched(clock: ClockAlignment) -> float:
        return sum(_inside(session, recording, clock).values()) / max(sum(rows.values()), 1)

    how, clock, refused = first_clear(possible_alignments(session, recording, by), matched)
    if clock is None:
        ahead_ns = None if session.recording is None else session.recording.unix_ahead_ns
        ours = unix_span(session.camera.time_ns[session.camera.usable], ahead_ns)
        elsewhere = other_day(str(other), recording.unix_span, "the walk", ours)
        raise UsageError(elsewhere or _nothing_tells(other, refused, by, recording.findings))
    inside = _inside(session, recording, clock)
    tie = Tie(
        recording=_path_from(walk, other),
        sha256=recording_sha256(other),
        table=recording.columns,
        by=how,
        figures=clock.figures,
        offset_ns=clock.offset_ns or 0,
        at_ns=clock.at_ns,
        rate=clock.rate,
        sigma_s=clock.sigma_s,
        lever_arm_m=lever_arm_m,
    )
    write_tie(folder, called, tie)
    return Attached(tie_file(walk, called), tie, recording.told, rows, inside, tuple(refused), recording.findings)


def _session(walk: Path) -> Session:
    """The session in a folder, or in the zip of the same name next to it."""
    packed = zip_of(walk)
    try:
        name = format_of(walk) if walk.is_dir() else None
        if name is not None:
            packed = None
        elif packed is not None:
            name = format_in_zip(packed.parent, packed)
    except (DatasetError, OSError) as error:
        raise SessionError(f"{packed or walk}: cannot be read ({error}); copy or send it again") from error
    if name is None or name == UNKNOWN_FORMAT:
        raise SessionError(
            f"{walk}: not a session folder; expected survey/floor_K/DEVICE/SESSION of the walk with poses"
        )
    key = SessionKey(0, walk.parent.name, walk.name)
    session = read_session(SessionRef(key, walk, name, "walk", packed=packed))
    if not session.camera.usable.any():
        raise SessionError(
            f"{walk}: the session has no poses; swap the two recordings, or check the session with vislam2tag inspect"
        )
    return session


def _inside(session: Session, recording: OtherRecording, clock: ClockAlignment) -> dict[str, int]:
    """Rows of each table that were taken within the walk's frames."""
    frames_ns = session.camera.time_ns[session.camera.usable]

    def count(their_ns: IntArray) -> int:
        ours = clock.ours(their_ns)
        return int(np.count_nonzero((ours >= frames_ns[0]) & (ours <= frames_ns[-1])))

    return {name: count(table["time_ns"].to_numpy()) for name, table in recording.tables.items()}


def _path_from(walk: Path, other: Path) -> str:
    """The recording's path relative to the walk's folder if it is within the survey, so that both can be moved."""
    walk, other = walk.resolve(), other.resolve()
    survey = walk.parents[2] if len(walk.parents) > 2 else walk
    return Path(os.path.relpath(other, walk)).as_posix() if survey in other.parents else other.as_posix()


def _nothing_tells(other: Path, refused: list[str], by: str | None, findings: Sequence[Finding]) -> str:
    odd = "".join(f". {each.kind} {each.count}: {each.message}" for each in findings)
    if refused:
        return (
            f"{other}: the clock offset between the two recordings is not clear ({'; '.join(refused)}). Carry both "
            "devices on one body, walk for at least a minute, turn at corners, and cut a longer recording to the walk"
            f"{odd}"
        )
    what = "" if by is None else f" by {by}"
    return (
        f"{other}: the recording has nothing to compare{what} with the walk. Both need a gyroscope or accelerometer, "
        f"common access points, or taps; see the folder {FOLDER} in {page_of('how-to/iphone')}{odd}"
    )
