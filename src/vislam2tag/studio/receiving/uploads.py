"""Uploads on disk: received parts of each zip stay there until the session is saved, even if a program is killed.

A complete session is moved to ``floor_K/DEVICE/SESSION`` of the survey and never replaces another one.
"""

from __future__ import annotations

import errno
import hashlib
import io
import re
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from pydantic import ValidationError

from vislam2tag.common.errors import OutputError, SurveyError
from vislam2tag.common.files.atomic import only_one
from vislam2tag.common.files.folder import Folder, scratch_folder
from vislam2tag.common.files.given_files import plain, read_bytes
from vislam2tag.common.records import Record
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
"""Hidden folder of a survey for unfinished uploads; surveys ignore it."""
_SESSION = "session"
"""Temporary name of a session's folder."""
_TAKEN = (errno.EEXIST, errno.ENOTEMPTY)


@dataclass(frozen=True)
class FiledSession:
    """A session's path relative to the survey, and whether it was already complete."""

    path: str
    already: bool
    sums_sha256: str
    """SHA-256 of its list of checksums, for :func:`is_filed`."""


def file_zip(survey: Path, path: Path, max_bytes: int, place: AppPlace | None = None) -> FiledSession:
    """Check a session's zip and move the session into the survey; ``place`` is that of other apps' recordings.

    Sending the same session again only restores missing files.

    Raises RefusedZipError for a zip that is neither a complete session (see :func:`.unpack`) nor another app's
    recording, or if another session has its place. Raises OSError if the survey cannot be written, or a link leads out
    of it.
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
        raise RefusedZipError(
            f"recordings of {recording.format} do not contain their floor; receive them with vislam2tag receive --floor"
        )
    number = place.floor if place.floor is not None else min(floors)
    device = place.device or recording.device
    floor = floors.get(number, root / f"floor_{number}")
    target = _spelled(_spelled(floor, device), recording.name).relative_to(root.path).as_posix()
    filed = FiledSession(target, (root / target).exists(), files_digest(recording.folder))
    if filed.already:
        if not holds_all_of(root / target, recording.folder):
            raise RefusedZipError(
                f"{filed.path} already contains another session; rename its folder and send this one again"
            )
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
    """A folder's subfolder of a name, in the spelling of an existing one if some systems treat them as the same."""
    there = sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []
    same = [other for other in there if same_name(other) == same_name(name)]
    return folder / (name if name in same or not same else same[0])


def _move(work: Folder, root: Folder, target: str) -> bool:
    """Move a session to its place; True if it was already there."""
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
    """Move a folder into the survey and flush that to the disk."""
    work.move(name, root, target)
    root.sync(PurePosixPath(target).parent.as_posix())


def _completed(session: Folder, root: Folder, target: str) -> bool:
    """Restore missing files of a session at its place; True if none was missing.

    Raises RefusedZipError if something else is there.
    """
    there, names = root / target, session.names()
    missing = [name for name in names if not (there / name).exists()]
    same = {name for name in names if name not in missing and _digest(session / name) == _digest(there / name)}
    known = {SUMS_FILE, RECORD_FILE} & same or (there.is_dir() and not any(there.iterdir()))
    if not known or len(same) + len(missing) < len(names):
        raise RefusedZipError(f"{target} already contains another session; rename its folder and send this one again")
    for name in missing:
        session.move(name, root, f"{target}/{name}")
    root.sync(target)
    return not missing


def is_filed(folder: Path, sums_sha256: str) -> bool:
    """Whether a folder contains a session's files with the checksums from the phone.

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


UPLOAD_NAME = re.compile(r"[0-9a-f]{64}")
_SHORT = 12
_PART = re.compile(rf"({UPLOAD_NAME.pattern})\.(\d{{1,15}})\.part")


MOST_WAITING = 100
"""Maximum number of unfinished uploads ..."""
MOST_WAITING_SIZES = 20
"""... and of their total announced size in maximum zips, so that unfinished uploads do not fill the disk."""
BUSY_S = 3
"""Waiting time of a client whose upload is being written by another, maybe dead, connection."""
EXPIRY_S = 7 * 24 * 3600.0
"""Unfinished uploads without new bytes are removed after this time."""


class _FiledRecord(Record, extra="ignore"):
    """Place of a saved upload, and the SHA-256 of its list of checksums."""

    session: str
    sums_sha256: str


@dataclass(frozen=True)
class UploadState:
    """State of an upload: ``state`` is none, partial or filed; ``session`` is its place."""

    state: str
    received: int = 0
    length: int | None = None
    session: str | None = None


class RefusalError(Exception):
    """An answer other than 200: its message, and the upload's state if that helps."""

    def __init__(
        self, status: int, message: str, headers: dict[str, str] | None = None, state: UploadState | None = None
    ) -> None:
        super().__init__(message)
        self.status, self.message, self.headers, self.state = status, message, headers or {}, state


class Uploads:
    """The uploads of one survey, as a context manager, because only one program at a time may use them."""

    def __init__(
        self,
        survey: Path,
        max_bytes: int,
        max_unpacked_bytes: int,
        place: AppPlace | None = None,
        clock: Callable[[], float] = time.time,
    ) -> None:
        """Accept zips up to ``max_bytes``, which unpack to at most ``max_unpacked_bytes``.

        ``place`` is the place of recordings from other apps; ``clock`` gives the time in seconds since 1970.
        """
        self.survey, self._max_unpacked, self._place = survey, max_unpacked_bytes, place
        self._clock = clock
        self.max_bytes = max_bytes
        self._folder = Folder.at(survey).folder(WORK_FOLDER)
        self._busy: set[str] = set()
        self._held = ExitStack()

    def __enter__(self) -> Uploads:
        """Lock the uploads; raises OutputError if another program has locked them, or the survey cannot be written."""
        try:
            self._folder.make()
        except OSError as error:
            raise OutputError(f"{self.survey}: cannot be written: {error.strerror}") from error
        refusal = f"{self.survey}: another 'vislam2tag receive' is running for this survey; stop it first"
        self._held.enter_context(only_one(self._folder, "lock", refusal))
        self._remove_expired()
        return self

    def __exit__(self, *_: object) -> None:
        self._held.close()

    def waiting(self) -> list[UploadState]:
        """States of all unfinished uploads."""
        return [self.state(name) for _, name, _ in self._parts()]

    def state(self, name: str) -> UploadState:
        """State of an upload; ``name`` is the SHA-256 of its zip.

        The files of a saved session are read to compare their checksums.
        """
        session = self._filed(name)
        if session is not None:
            return UploadState("filed", session=session)
        part = self._part(name)
        if part is None:
            return UploadState("none")
        return UploadState("partial", part[0].stat().st_size, part[1])

    @contextmanager
    def writing(self, name: str, length: int, offset: int) -> Iterator[io.FileIO]:
        """Open an upload of ``length`` bytes to continue at ``offset``; written bytes stay, even after an exception.

        Raises RefusalError: 423 while another request writes it, 400 if it began with another length, 409 if another
        offset comes next, 507 if it would be one upload too many.
        """
        self._refuse_busy(name)
        self._remove_expired()
        part = self._part(name)
        if part is not None and part[1] != length:
            raise RefusalError(400, "Upload-Length differs from the start of the upload")
        received = part[0].stat().st_size if part else 0
        if offset != received:
            raise RefusalError(409, f"{received} bytes have been received; continue from there", state=self.state(name))
        if part is None:
            self._refuse_too_many(length)
        part_name = f"{name}.{length}.part"
        self._busy.add(name)
        try:
            with self._folder.appending(part_name) as file:
                yield file
        finally:
            self._busy.discard(name)
            path = self._folder / part_name
            if path.is_file() and not path.stat().st_size:
                self._folder.remove(part_name)

    def _refuse_busy(self, name: str) -> None:
        if name in self._busy:
            message = "another connection is writing this upload; try again"
            raise RefusalError(423, message, {"Retry-After": str(BUSY_S)})

    def _refuse_too_many(self, length: int) -> None:
        begun = self._parts()
        size = sum(announced for _, _, announced in begun)
        if len(begun) >= MOST_WAITING or size + length > MOST_WAITING_SIZES * self.max_bytes:
            message = "the computer has too many unfinished uploads; finish them, or remove .receiving there"
            raise RefusalError(507, message)

    @contextmanager
    def finishing(self, name: str) -> Iterator[None]:
        """Lock an upload while it is checked and saved; raises RefusalError while another request uses it."""
        self._refuse_busy(name)
        self._busy.add(name)
        try:
            yield
        finally:
            self._busy.discard(name)

    def finish(self, name: str) -> FiledSession:
        """Check a complete upload and save it. Raises RefusedZipError and removes it, or OSError and keeps it."""
        part = self._part(name)
        if part is None:
            raise RefusedZipError("the upload no longer exists; send it again")
        path = part[0]
        try:
            with plain(path).open("rb") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
            if digest != name:
                raise RefusedZipError("the zip was damaged during the transfer (wrong SHA-256); send it again")
            with scratch_folder(self._folder) as scratch:
                called = f"{name[:_SHORT]}.zip"  # readers check the end of the name
                scratch.link(path, called)
                filed = file_zip(self.survey, scratch / called, self._max_unpacked, self._place)
        except RefusedZipError:
            self._folder.remove(path.name)
            raise
        self._remember(name, filed)
        self._folder.remove(path.name)
        return filed

    def _part(self, name: str) -> tuple[Path, int] | None:
        return next(((path, length) for path, named, length in self._parts() if named == name), None)

    def _parts(self) -> list[tuple[Path, str, int]]:
        """Files, names and lengths of all unfinished uploads."""
        matches = ((path, _PART.fullmatch(path.name)) for path in sorted(self._folder.path.glob("*.part")))
        return [(path, match.group(1), int(match.group(2))) for path, match in matches if match]

    def _remove_expired(self) -> None:
        for path, name, _ in self._parts():
            if name not in self._busy and self._clock() - path.stat().st_mtime > EXPIRY_S:
                self._folder.remove(path.name)

    def _filed(self, name: str) -> str | None:
        """Place of a saved upload, if it is still complete."""
        try:
            filed = _FiledRecord.model_validate_json(read_bytes(self._folder / f"{name}.filed"))
        except (OSError, ValidationError):
            return None
        return filed.session if is_filed(self.survey / filed.session, filed.sums_sha256) else None

    def _remember(self, name: str, filed: FiledSession) -> None:
        record = _FiledRecord(session=filed.path, sums_sha256=filed.sums_sha256)
        self._folder.write(f"{name}.filed", record.model_dump_json() + "\n")
