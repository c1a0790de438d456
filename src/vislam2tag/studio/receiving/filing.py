"""Where a received session goes: ``floor_K/DEVICE/SESSION`` of the survey, whole, never over another one."""

from __future__ import annotations

import errno
import hashlib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.sessions.formats.phone import RECORD_FILE, PhoneRecord
from vislam2tag.site.discover import floor_folders
from vislam2tag.site.model import same_name
from vislam2tag.studio.receiving.zips import (
    SUMS_FILE,
    AppPlace,
    AppRecording,
    RefusedZipError,
    files_digest,
    holds_all_of,
    is_of_our_app,
    parse_checksums,
    unpack,
    unpack_app,
)

WORK_FOLDER = ".receiving"
"""Hidden folder of a survey that holds what is not filed yet; surveys ignore it."""
_SESSION = "session"
"""What a session's folder is called until it is filed."""
_TAKEN = (errno.EEXIST, errno.ENOTEMPTY)


@dataclass(frozen=True)
class FiledSession:
    """Where a session lies: its path relative to the survey, and whether all of it had been there before."""

    path: str
    already: bool
    sums_sha256: str
    """SHA-256 of its list of checksums, by which :func:`is_filed` knows it again."""


def file_zip(survey: Path, path: Path, max_bytes: int, place: AppPlace | None = None) -> FiledSession:
    """Check a session's zip and move the session into the survey; ``place`` is that of other apps' recordings.

    The same session again changes nothing, but brings back missing files of it. Raises RefusedZipError for a zip that
    is neither a whole session (see :func:`.unpack`) nor another app's recording, or if
    another session has its place; OSError if the survey cannot be written, or a link leads out of it.
    """
    root = Folder.at(survey)
    with scratch_folder(root.folder(WORK_FOLDER)) as work:
        if not is_of_our_app(path):
            return _file_app(root, work, unpack_app(path, work, max_bytes), place or AppPlace())
        session = work.folder(_SESSION)
        target = _place(root.path, *unpack(path, session, max_bytes))
        sums = _digest(session / SUMS_FILE) or ""
        return FiledSession(target, _move(work, root, target), sums)


def _file_app(root: Folder, work: Folder, recording: AppRecording, place: AppPlace) -> FiledSession:
    """Move another app's recording to ``floor_K/DEVICE/NAME``."""
    floors = _floors(root.path)
    if place.floor is None and len(floors) != 1:
        raise RefusedZipError(f"a recording of {recording.format} does not name its floor: give it by --floor")
    number = place.floor if place.floor is not None else min(floors)
    device = place.device or recording.device
    floor = floors.get(number, root / f"floor_{number}")
    target = _spelled(_spelled(floor, device), recording.name).relative_to(root.path).as_posix()
    filed = FiledSession(target, (root / target).exists(), files_digest(recording.folder))
    if filed.already:
        if not holds_all_of(root / target, recording.folder):
            raise RefusedZipError(f"another session is at {filed.path}; rename its folder and send this one again")
        return filed
    for path in recording.folder.rglob("*"):
        work.sync(path.relative_to(work.path).as_posix())
    _filed(work, recording.folder.relative_to(work.path).as_posix(), root, target)
    return filed


def _floors(survey: Path) -> dict[int, Path]:
    try:
        return floor_folders(survey)[0]
    except SurveyError:  # no floor yet
        return {}


def _place(survey: Path, name: str, record: PhoneRecord) -> str:
    """The session's folder, relative to the survey; a floor that has none yet gets one."""
    number = record.floor
    floor = _floors(survey).get(number, survey / f"floor_{number}")
    return (_spelled(floor, record.device) / name).relative_to(survey).as_posix()


def _spelled(folder: Path, name: str) -> Path:
    """A folder's subfolder of a name; spelled as one that is there already if they are one folder on some systems."""
    there = sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []
    same = [other for other in there if same_name(other) == same_name(name)]
    return folder / (name if name in same or not same else same[0])


def _move(work: Folder, root: Folder, target: str) -> bool:
    """Move a session to its place; True if it was there already."""
    for name in work.folder(_SESSION).names():
        work.sync(f"{_SESSION}/{name}")
    try:
        _filed(work, _SESSION, root, target)
    except OSError as error:
        if error.errno not in _TAKEN:
            raise
        return _completed(work.folder(_SESSION), root, target)
    return False


def _filed(work: Folder, name: str, root: Folder, target: str) -> None:
    """Move a folder into the survey and have that put on the disk."""
    work.move(name, root, target)
    root.sync(PurePosixPath(target).parent.as_posix())


def _completed(session: Folder, root: Folder, target: str) -> bool:
    """Bring back missing files of a session at its place; True if none is missing.

    Raises RefusedZipError if something else is there.
    """
    there, names = root / target, session.names()
    missing = [name for name in names if not (there / name).exists()]
    same = {name for name in names if name not in missing and _digest(session / name) == _digest(there / name)}
    known = {SUMS_FILE, RECORD_FILE} & same or (there.is_dir() and not any(there.iterdir()))
    if not known or len(same) + len(missing) < len(names):
        raise RefusedZipError(f"another session is at {target}; rename its folder and send this one again")
    for name in missing:
        session.move(name, root, f"{target}/{name}")
    root.sync(target)
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
