"""Where a received session goes: ``floor_K/DEVICE/SESSION`` of the survey, whole, never over another one."""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
import uuid
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.errors import SurveyError
from vislam2tag.receiving.session_zip import RefusedZipError, UnpackedSession, unpack
from vislam2tag.survey.discover import floor_folders

WORK_FOLDER = ".receiving"
"""Hidden folder of a survey that holds what is not filed yet; surveys ignore it."""
UNPACKED = "unpacked-"
"""How the names of folders begin in which zips are unpacked."""
_TAKEN = (errno.EEXIST, errno.ENOTEMPTY, errno.ENOTDIR)


@dataclass(frozen=True)
class Filed:
    """Where a session lies: its path relative to the survey, and whether it had been there before."""

    path: str
    already: bool


def file_zip(survey: Path, path: Path, max_bytes: int) -> Filed:
    """Check a session's zip and move the session into the survey.

    The same session again changes nothing. Raises RefusedZipError for a zip that is no whole session (see
    :func:`~vislam2tag.receiving.session_zip.unpack`), or where another session has its place; OSError where the survey
    cannot be written.
    """
    work = survey / WORK_FOLDER / f"{UNPACKED}{uuid.uuid4().hex}"
    try:
        session = unpack(path, work, max_bytes)
        target = _place(survey, session)
        return Filed(str(target.relative_to(survey)), _move(session.folder, target))
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _place(survey: Path, session: UnpackedSession) -> Path:
    """The session's folder in the survey; a floor that has none yet gets one."""
    try:
        floors = floor_folders(survey)[0]
    except SurveyError:  # no floor yet
        floors = {}
    number = session.record.floor
    floor = floors.get(number, survey / f"floor_{number}")
    return floor / session.record.device / session.name


def _move(folder: Path, target: Path) -> bool:
    """Move a session to its place; True where it was there already."""
    for path in folder.iterdir():
        _to_storage(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        if not target.exists():
            folder.rename(target)
            _to_storage(target.parent)
            return False
    except OSError as error:
        if error.errno not in _TAKEN:
            raise
    if _same(folder, target):
        return True
    place = "/".join(target.parts[-3:])
    raise RefusedZipError(f"another session lies at {place}; rename its folder and send this one again")


def _same(folder: Path, target: Path) -> bool:
    """Tell whether every file of a session is in another folder, byte by byte."""
    return all(_digest(path) == _digest(target / path.name) for path in folder.iterdir())


def _digest(path: Path) -> str | None:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return None


def _to_storage(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
