"""A session's files: the account of what was opened and what is missing, and recordings in the zips that apps share."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import TypeVar

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.archives import folder_of, zip_names
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.given_files import plain, read_bytes
from vislam2tag.common.findings import Finding, FindingKind, Severity, finding_if
from vislam2tag.core.arrays import IntArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.intake.readings import admitted, normal_uuids
from vislam2tag.intake.time_units import READINGS, Steps
from vislam2tag.sessions.clocks import clock_mismatch, clock_of, late_scans, with_times
from vislam2tag.sessions.model import FileRecord, Recording, Session
from vislam2tag.sessions.readings import (
    BEACON,
    PRESSURE,
    SENSOR_VALUES,
    ble_findings,
    mark_repeated,
    mark_wifi,
    sensor_table,
    wifi_findings,
    with_sensor_units,
)
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.text_tables import Parser, RawTable
from vislam2tag.site.landmark_states import names_shown
from vislam2tag.site.model import SessionKey, SessionRef
from vislam2tag.site.site_table import is_file

Made = TypeVar("Made")
MISSING = {
    "poses": ("there are no camera poses; the session cannot be mapped", Severity.ERROR),
    "landmarks": ("there are no landmark poses: only a plan of its floor can place the session", Severity.WARNING),
    "wifi": ("there are no Wi-Fi scans; the session has no Wi-Fi labels", Severity.WARNING),
    "sensors": ("there are no sensor readings; the session has no sensor labels", Severity.WARNING),
}
"""Roles that a session should have: what it means where they are missing."""
OF_TRACK = frozenset({"record", "poses", "landmarks", "anchors", "events", "sensors"})
"""Roles that describe the tracker, of sensors the barometer alone."""
_OPTIONAL = {
    "presses": ("there are no presses", Severity.WARNING),
    "ble": ("there are no BLE readings", Severity.WARNING),
    "rtt": ("there are no ranges to access points", Severity.WARNING),
    "fixes": ("there are no known positions: a session without poses cannot be mapped", Severity.ERROR),
    "anchors": ("there are no anchors: map updates are detected at landmarks only", Severity.WARNING),
    "events": ("refused scans and warnings are unknown", Severity.WARNING),
    "record": ("how the recording ended is unknown", Severity.WARNING),
}


@dataclass
class SessionFiles:
    """The account of a session's files; ``names`` are those of each role's file, the first one the usual.

    With ``track_only`` files of roles that are not :data:`OF_TRACK` count as empty ones, and no account is kept.
    """

    folder: Path
    names: Mapping[str, tuple[str, ...]]
    track_only: bool = False
    files: list[FileRecord] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    _opened: set[str] = field(default_factory=set)

    def name_of(self, role: str) -> str:
        """Name of a role's file: the one that is there, else the usual one."""
        return next((name for name in self.names[role] if is_file(self.folder / name)), self.names[role][0])

    def has(self, role: str) -> bool:
        """Return whether a role's file is there."""
        return any(is_file(self.folder / name) for name in self.names[role])

    def load(self, role: str) -> tuple[str, bytes]:
        """Name and bytes of a role's file; no bytes where the file is missing, not wanted or cannot be opened."""
        if self.track_only and role not in OF_TRACK:
            return self.names[role][0], b""
        names = [name for name in self.names[role] if is_file(self.folder / name)]
        if not names:
            if role in MISSING:
                self.note("missing_file", self.names[role][0], *MISSING[role])
            return self.names[role][0], b""
        if len(names) > 1:
            self.note("second_file", names[1], f"{names[0]} is read instead; remove one of the two")
        try:
            data = read_bytes(self.folder / names[0])
        except OSError as error:
            consequence, severity = (MISSING | _OPTIONAL).get(role, ("its rows are skipped", Severity.WARNING))
            message = f"cannot be opened ({error.strerror}): {consequence}; check its permissions"
            self.note("unreadable_file", names[0], message, Severity.ERROR if role == "landmarks" else severity)
            return names[0], b""
        self._opened.add(names[0])
        return names[0], _of_barometer(data) if self.track_only and role == "sensors" else data

    def account(self, role: str, data: bytes, table: RawTable) -> pl.DataFrame:
        """Record a file that was opened, and return its rows."""
        if table.file in self._opened and not self.track_only:
            self.files.append(FileRecord.of(table.file, role, data, table.lines, table.rows.height))
            self.findings += table.findings
        return table.rows

    def rows(
        self,
        role: str,
        parse: Parser,
        steps: Steps | None = None,
        clock_ns: IntArray | None = None,
        stated: str = "nanoseconds",
    ) -> pl.DataFrame:
        """Load, parse and account for a role's file.

        With ``steps`` times are brought to ns whatever unit they are in: see :func:`~.clocks.with_times`.
        """
        file, data = self.load(role)
        rows = self.account(role, data, parse(data, file))
        return rows if steps is None else self.noted(with_times(rows, file, steps, clock_ns, stated))

    def noted(self, made: tuple[Made, list[Finding]]) -> Made:
        """Report what was found while something was made, and return that."""
        self.findings += made[1]
        return made[0]

    def readings(self, parse: Parser, camera: CameraTrack) -> pl.DataFrame:
        """The table ``sensors`` of a session; values that are not given are 0."""
        rows = self.rows("sensors", parse, READINGS, clock_of(camera)).with_columns(
            pl.col(SENSOR_VALUES).fill_null(0.0)
        )
        file = self.name_of("sensors")
        rows = self.noted(with_sensor_units(rows, file))
        return self.on_clock("sensors", self.noted(sensor_table(rows, file)), camera)

    def wifi(self, rows: pl.DataFrame, settings: FindingSettings) -> pl.DataFrame:
        """The table ``wifi`` of a session, of rows as their file has them."""
        file = self.name_of("wifi")
        named = self.noted(admitted(rows.with_columns(pl.col("ssid").fill_null("")), "bssid", file))
        rows = mark_wifi(mark_repeated(named, "bssid"))
        self.findings += wifi_findings(rows, file, settings)
        return rows

    def ble(self, rows: pl.DataFrame) -> pl.DataFrame:
        """The table ``ble`` of a session, of rows as their file has them."""
        file = self.name_of("ble")
        rows = rows.with_columns(pl.col("name").fill_null(""), normal_uuids(rows["uuid"]))
        rows = mark_repeated(self.noted(admitted(rows, "address", file, pl.col("uuid").is_not_null())), *BEACON)
        self.findings += ble_findings(rows, file)
        return rows

    def on_clock(
        self, role: str, rows: pl.DataFrame, camera: CameraTrack, sensors: pl.DataFrame | None = None
    ) -> pl.DataFrame:
        """The same rows; reported if their times never meet the frames, or end later than the ``sensors``."""
        time_ns, file = rows["time_ns"].to_numpy(), self.name_of(role)
        self.findings += clock_mismatch(time_ns, file, camera)
        if sensors is not None:
            self.findings += late_scans(time_ns, file, camera, sensors)
        return rows

    def session(
        self,
        key: SessionKey,
        camera: CameraTrack,
        landmarks: LandmarkLog,
        tables: dict[str, pl.DataFrame],
        *,
        presses_ns: IntArray | None = None,
        recording: Recording | None = None,
    ) -> Session:
        """The session, with the account and the findings of its files."""
        presses_ns = np.empty(0, dtype=np.int64) if presses_ns is None else presses_ns
        files, findings = tuple(self.files), tuple(self.findings)
        return Session(key, camera, landmarks, presses_ns, tables, files, findings, recording=recording)

    def note(
        self, kind: FindingKind, file: str, message: str, severity: Severity = Severity.WARNING, count: int = 1
    ) -> None:
        """Report something odd about a file."""
        self.findings.append(Finding(kind=kind, file=file, count=count, message=message, severity=severity))


def _of_barometer(data: bytes) -> bytes:
    """The lines of a sensor file that are the barometer's, after the first one, which may be a header."""
    word = PRESSURE.encode()
    if word not in data:
        return b""
    first, *lines = data.split(b"\n")
    return b"\n".join((first, *(line for line in lines if word in line), b""))


def existing_files(folder: Path, names: Mapping[str, tuple[str, ...]]) -> list[Path]:
    """Paths of all files of these names that are there."""
    paths = (folder / name for each in names.values() for name in each)
    return [path for path in paths if is_file(path)]


_TABLES = frozenset({".csv", ".db", ".json", ".sqlite", ".txt", ".xlsx"})
"""Suffixes of files that may contain readings."""
_OURS = frozenset({"truth.csv", "fixes.csv", "sightings.csv"})
"""Files that this program reads beside those of any app."""


def unread_files(folder: Path, read: Collection[str], unused: re.Pattern[str]) -> list[Finding]:
    """Report the tables in a recording's folder that its reader does not open, in one finding.

    ``unused``: names of the app's files that contain nothing that this program uses, in lower case without suffix.
    """
    found = [
        path.name
        for path in sorted(folder.iterdir())
        if path.suffix.lower() in _TABLES and path.name not in read and path.name not in _OURS
        if not path.name.startswith(".") and not unused.fullmatch(path.stem.lower()) and is_file(path)
    ]
    message = (
        f"the recording contains files that are not read: {names_shown(found)}. If they contain readings, export the "
        "recording with one table for each sensor, under the names that the app gives them. Otherwise no action needed"
    )
    return list(finding_if(len(found), "unread_file", message, severity=Severity.WARNING))


@dataclass(frozen=True)
class FileFormat:
    """A format whose sessions are folders with files of known names."""

    name: str
    files: Mapping[str, tuple[str, ...]]
    """Names of each role's file, the first one the usual."""
    recognises: Callable[[Path], bool]
    """Whether a folder is a session of this format."""
    session: Callable[[SessionFiles, SessionKey, FindingSettings], Session]
    """Reads a session."""
    further: re.Pattern[str] | None = None
    """Pattern of the names of further files, each of which is a role of its own."""
    unused: re.Pattern[str] | None = None
    """As in :func:`unread_files`; None: any further files are usual."""

    def names_in(self, folder: Path) -> Mapping[str, tuple[str, ...]]:
        """Names of each role's file, with the further files that are there."""
        if self.further is None:
            return self.files
        there = sorted(path.name for path in folder.iterdir() if self.further.fullmatch(path.name))
        return {**self.files, **{name: (name,) for name in there}}

    def input_files(self, folder: Path) -> list[Path]:
        """The files that :meth:`read` looks at, as far as they are there."""
        return existing_files(folder, self.names_in(folder))

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read a session whole; problems are findings, only a SessionError may escape."""
        names = self.names_in(ref.folder)
        session = self.session(SessionFiles(ref.folder, names), ref.key, settings)
        if self.unused is None:
            return session
        unread = unread_files(ref.folder, {name for each in names.values() for name in each}, self.unused)
        return replace(session, findings=(*session.findings, *unread))

    def read_track(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read what the tracker and the walker said; raises as :meth:`read`."""
        return self.session(SessionFiles(ref.folder, self.names_in(ref.folder), track_only=True), ref.key, settings)


@contextmanager
def named_alike(names: Iterable[PurePosixPath], heads: Mapping[PurePosixPath, bytes] | None = None) -> Iterator[Path]:
    """Yield a folder with files of these names as long as the block lasts; files without a head are empty."""
    with scratch_folder() as scratch:
        folder = scratch.folder("zip").make()
        for name in names:
            with suppress(OSError):  # a name that this system does not allow, or one that is there twice
                folder.create(name.as_posix(), (heads or {}).get(name, b""))
        yield folder.path


def unpacked(
    ref: SessionRef,
    packed: Path,
    scratch: Folder,
    inner: Callable[[Path], Path],
    read: Callable[[Path], list[Path]] | None,
) -> SessionRef:
    """A session as one folder below ``scratch``: the files of its zip, and those that lie in the folder beside.

    ``inner`` finds the recording's folder in the zip. Only the files that ``read`` lists of it are unpacked;
    None: all. Where the zip cannot be unpacked the session is as it was, and reading it reports that.
    """
    try:
        with plain(packed).open("rb") as file, named_alike(zip_names(file)) as names:
            within = inner(names).relative_to(names)
            files = None if read is None else read(names / within)
            wanted = None if files is None else {PurePosixPath(each.relative_to(names).as_posix()) for each in files}
            tables = [each.name for each in (names / within).iterdir() if each.suffix.lower() in _TABLES]
        folder = Folder.at(folder_of(packed, scratch, wanted=wanted) / within).make()
        for name in tables:
            if not (folder / name).exists():
                folder.create(name)  # empty, so that the reader can name it as not read
        for path in ref.folder.iterdir() if ref.folder.is_dir() else ():
            if path.is_file():
                folder.copy(path, path.name)
    except (DatasetError, OSError):
        return ref
    return replace(ref, folder=folder.path, packed=None, beside=ref.folder)
