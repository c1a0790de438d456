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
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.receiving.app_zip import AppPlace, AppRecording, files_digest, holds_all_of, is_of_our_app, unpack_app
from vislam2tag.receiving.session_zip import SUMS_FILE, RefusedZipError, UnpackedSession, parse_checksums, unpack
from vislam2tag.sessions.phone.record import RECORD_FILE
from vislam2tag.survey.discover import floor_folders
from vislam2tag.survey.names import same_name

WORK_FOLDER = ".receiving"
"""Hidden folder of a survey that holds what is not filed yet; surveys ignore it."""
UNPACKED = "unpacked-"
"""How the names of folders begin in which zips are unpacked."""
_TAKEN = (errno.EEXIST, errno.ENOTEMPTY, errno.ENOTDIR)


@dataclass(frozen=True)
class FiledSession:
    """Where a session lies: its path relative to the survey, and whether all of it had been there before."""

    path: str
    already: bool
    sums_sha256: str
    """SHA-256 of its list of checksums, by which :func:`is_filed` knows it again."""


def file_zip(survey: Path, path: Path, max_bytes: int, place: AppPlace | None = None) -> FiledSession:
    """Check a session's zip and move the session into the survey; ``place`` is that of other apps' recordings.

    The same session again changes nothing, but brings back files of it that lack. Raises RefusedZipError for a zip that
    is no whole session (see :func:`~vislam2tag.receiving.session_zip.unpack`) nor another app's recording, or where
    another session has its place; OSError where the survey cannot be written.
    """
    work = survey / WORK_FOLDER / f"{UNPACKED}{uuid.uuid4().hex}"
    try:
        if not is_of_our_app(path):
            return _file_app(survey, unpack_app(path, work, max_bytes), place or AppPlace())
        session = unpack(path, work, max_bytes)
        target = _place(survey, session)
        sums = _digest(session.folder / SUMS_FILE) or ""
        return FiledSession(target.relative_to(survey).as_posix(), _move(session.folder, target), sums)
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _file_app(survey: Path, recording: AppRecording, place: AppPlace) -> FiledSession:
    """Move another app's recording to ``floor_K/DEVICE/NAME``."""
    floors = _floors(survey)
    if place.floor is None and len(floors) != 1:
        raise RefusedZipError(f"a recording of {recording.format} does not tell its floor: say it by --floor")
    number = place.floor if place.floor is not None else min(floors)
    device = place.device or recording.device
    floor = floors.get(number, survey / f"floor_{number}")
    target = _spelled(_spelled(floor, device), recording.name)
    filed = FiledSession(target.relative_to(survey).as_posix(), target.exists(), files_digest(recording.folder))
    if filed.already:
        if not holds_all_of(target, recording.folder):
            raise RefusedZipError(f"another session lies at {filed.path}; rename its folder and send this one again")
        return filed
    for path in recording.folder.rglob("*"):
        _to_storage(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    recording.folder.rename(target)
    _to_storage(target.parent)
    return filed


def _floors(survey: Path) -> dict[int, Path]:
    try:
        return floor_folders(survey)[0]
    except SurveyError:  # no floor yet
        return {}


def _place(survey: Path, session: UnpackedSession) -> Path:
    """The session's folder in the survey; a floor that has none yet gets one."""
    number = session.record.floor
    floor = _floors(survey).get(number, survey / f"floor_{number}")
    return _spelled(floor, session.record.device) / session.name


def _spelled(folder: Path, name: str) -> Path:
    """A folder's subfolder of a name; spelled as one that is there already if they are one folder on some systems."""
    there = sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []
    same = [other for other in there if same_name(other) == same_name(name)]
    return folder / (name if name in same or not same else same[0])


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
    return _completed(folder, target)


def _completed(folder: Path, target: Path) -> bool:
    """Bring back what lacks of a session at its place; True where nothing does.

    Raises RefusedZipError where something else lies there.
    """
    files = sorted(folder.iterdir())
    missing = [path for path in files if not (target / path.name).exists()]
    same = {path.name for path in files if path not in missing and _digest(path) == _digest(target / path.name)}
    known = {SUMS_FILE, RECORD_FILE} & same or (target.is_dir() and not any(target.iterdir()))
    if not known or len(same) + len(missing) < len(files):
        place = "/".join(target.parts[-3:])
        raise RefusedZipError(f"another session lies at {place}; rename its folder and send this one again")
    for path in missing:
        path.rename(target / path.name)
    _to_storage(target)
    return not missing


def is_filed(folder: Path, sums_sha256: str) -> bool:
    """Tell whether a session's files lie in a folder with the checksums that the phone sent.

    ``sums_sha256`` is the SHA-256 of its list of checksums; of another app's recording, of its files.
    """
    if _digest(folder / SUMS_FILE) != sums_sha256:
        return folder.is_dir() and not (folder / SUMS_FILE).exists() and files_digest(folder) == sums_sha256
    try:
        sums = parse_checksums(read_bytes(folder / SUMS_FILE))
    except (OSError, RefusedZipError):
        return False
    return all(_digest(folder / name) == said for name, said in sums.items())


def _digest(path: Path) -> str | None:
    try:
        if path.is_file():
            with path.open("rb") as file:
                return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        pass
    return None


def _to_storage(path: Path) -> None:
    if os.name == "nt" and path.is_dir():
        return  # Windows opens no folder, and writes its entries itself
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
