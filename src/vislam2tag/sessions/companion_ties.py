"""The tie of a companion: a file in the session's folder that says which recording, and how its clock runs."""

from __future__ import annotations

import hashlib
import math
import os
from contextlib import suppress
from pathlib import Path

from pydantic import Field, ValidationError

from vislam2tag.common.errors import SessionError, first_line
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath, read_bytes
from vislam2tag.common.records import FiniteRecord
from vislam2tag.core.clocks import ClockAlignment
from vislam2tag.site.links import survey_output
from vislam2tag.site.model import COMPANIONS
from vislam2tag.site.site_table import is_file

FOLDER = COMPANIONS
"""Folder of a session that contains the ties, and may contain the recordings themselves."""
_LARGEST_NS = 2**62


class TableColumns(FiniteRecord):
    """How the times of a table are to be read, where the recording is one."""

    time_column: str
    unit: str | None = None
    zone: str | None = None


class Tie(FiniteRecord):
    """Content of ``companions/NAME.json``."""

    recording: str
    """Path of the recording, from the session's folder where it is within the survey, else from the root."""
    sha256: str
    """Of its file; of a folder: of the names and SHA-256 of its files."""
    table: TableColumns | None = None
    """None: a folder or zip that a session format reads."""
    by: str
    """What showed the offset."""
    figures: str
    offset_ns: int = Field(ge=-_LARGEST_NS, le=_LARGEST_NS)
    """By how much its clock is ahead of the session's at ``at_ns`` of the session's."""
    at_ns: int = Field(ge=-_LARGEST_NS, le=_LARGEST_NS)
    rate: float = Field(gt=-0.01, lt=0.01)
    """Seconds that its clock gains in each second of the session's."""
    sigma_s: float = Field(ge=0)
    lever_arm_m: float = Field(ge=0)
    """How far apart the two devices were carried: added to the sigma of its readings' positions."""

    @property
    def clock(self) -> ClockAlignment:
        """Its clock against the session's."""
        return ClockAlignment(self.offset_ns, self.sigma_s, self.rate, self.at_ns, self.figures)

    def path(self, session: AnyPath) -> Path:
        """Where the recording is, from the folder of its session."""
        session = Path(session)
        return Path(os.path.normpath(session / self.recording))


def tie_file(session: Path, name: str) -> Path:
    """The file of a companion's tie."""
    return session / FOLDER / f"{name}.json"


def write_tie(session: Folder, name: str, tie: Tie) -> None:
    """Write a tie into the folder of its session; raises OutputError if it cannot be written."""
    path = tie_file(session.path, name)
    with survey_output(path):
        session.folder(FOLDER).write(path.name, tie.model_dump_json(indent=1) + "\n")


def tie_files(session: Path) -> list[Path]:
    """The ties of a session, sorted by name; raises OSError where they cannot be looked at."""
    return [path for path in sorted((session / FOLDER).glob("*.json")) if is_file(path)]


def read_tie(path: Path) -> Tie:
    """Read a tie; raises SessionError where the file contains something else or cannot be read."""
    try:
        return Tie.model_validate_json(read_bytes(path))
    except (OSError, ValidationError) as error:
        raise SessionError(
            f"{path}: is not a valid link to an attached recording ({first_line(error)}): remove it, and attach the "
            "recording again"
        ) from error


def recording_sha256(path: Path) -> str:
    """SHA-256 of a recording, as a tie has it; raises OSError where it cannot be read."""
    if not path.is_dir():
        return hashlib.sha256(read_bytes(path)).hexdigest()
    files = [file for file in sorted(path.rglob("*")) if is_file(file)]
    lines = (f"{hashlib.sha256(read_bytes(file)).hexdigest()}  {file.relative_to(path).as_posix()}\n" for file in files)
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def companion_hashes(session: Path) -> dict[str, str]:
    """SHA-256 of a session's ties and of what they tie, by name; a recording that is gone has none.

    Raises OSError where a tie cannot be read.
    """
    found = {}
    for path in tie_files(session):
        found[f"{FOLDER}/{path.name}"] = hashlib.sha256(read_bytes(path)).hexdigest()
        try:
            found[f"{FOLDER}/{path.stem}"] = recording_sha256(read_tie(path).path(session))
        except (OSError, SessionError):
            continue
    return found


def tied_recordings(session: Path) -> list[Path]:
    """Where the recordings lie that are tied to a session; errors of reading are reported with the session."""
    found: list[Path] = []
    with suppress(PermissionError):
        for path in tie_files(session):
            with suppress(SessionError):
                found.append(read_tie(path).path(session))
    return found


def is_usable_lever_arm(metres: float) -> bool:
    """Whether two devices of one walk may have been so far apart."""
    return math.isfinite(metres) and 0 <= metres <= 10
