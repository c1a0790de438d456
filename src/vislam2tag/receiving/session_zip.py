"""The zip of a session: looked at, unpacked and checked, trusting nothing that stands in it.

docs/reference/phone-handover.md tells more.
"""

from __future__ import annotations

import hashlib
import re
import stat
import struct
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.errors import SessionError, first_line
from vislam2tag.common.files.archives import BoundedFile
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.plain_files import plain
from vislam2tag.sessions.formats.phone import FILE_NAMES
from vislam2tag.sessions.phone.record import RECORD_FILE, SESSION_NAME, PhoneRecord, parse_record
from vislam2tag.survey.names import is_portable

SUMS_FILE = "SHA256SUMS"
KNOWN_FILES = frozenset(name for names in FILE_NAMES.values() for name in names) | {SUMS_FILE}
_SUMS_LINE = re.compile(r"([0-9a-f]{64})  ([A-Za-z0-9._]+)")
_BLOCK = 1 << 20
_ENCRYPTED = 0x1
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_MOST_SUMS, _MOST_RECORD = 10_000, 1_000_000
"""Bytes that SHA256SUMS and session.json are expected to stay below."""
_MOST_DIRECTORY = 100_000
"""Bytes of the directory of entries, and of the search for it: some thousand names, a session has ten."""
_OF_FLOOR = re.compile(r"(?i:tachymeter|.*\.(csv|jpe?g|png))")
"""A floor's own files and folders: as a device's folder they would stand in their place."""


class RefusedZipError(SessionError):
    """A zip that is no whole session, or holds what a session does not."""


@dataclass(frozen=True)
class UnpackedSession:
    """A session's files in a folder of their own."""

    name: str
    record: PhoneRecord
    folder: Path


def unpack(path: Path, folder: Folder, max_bytes: int) -> UnpackedSession:
    """Unpack a session's zip into the new folder ``folder``, at most ``max_bytes`` in all, and check every file.

    Raises RefusedZipError, one sentence for the collector, for a file that is no zip, damaged or encrypted, for names
    that no session has (paths included), links, doubles, too many bytes, missing or wrong checksums, and for a record
    that is missing, wrong or not ended. What was unpacked by then is the caller's to remove.
    """
    too_many = RefusedZipError("the zip is not whole, or holds more files than a session has")
    try:
        with (
            plain(path).open("rb") as opened,
            zipfile.ZipFile(reads := BoundedFile(opened, _MOST_DIRECTORY, too_many)) as archive,
        ):
            name, entries = _entries(archive, max_bytes, path.stat().st_size)
            reads.most = 2 * _BLOCK
            folder.make_new()
            left = max_bytes
            sums = {}
            for file, info in entries.items():
                sums[file], size = _extract(archive, info, folder, file, left)
                left -= size
    except (
        zipfile.BadZipFile,
        zlib.error,
        struct.error,
        NotImplementedError,
        EOFError,
        ValueError,
        OverflowError,
    ) as error:
        raise RefusedZipError(f"the zip is damaged ({first_line(error)}); send it again") from error
    _check_sums(folder.path, sums)
    return UnpackedSession(name, _record(folder.path, name), folder.path)


def _entries(archive: zipfile.ZipFile, max_bytes: int, length: int) -> tuple[str, dict[str, zipfile.ZipInfo]]:
    """The session's name and its files by name; nothing is unpacked yet."""
    folders, files = set[str](), dict[str, zipfile.ZipInfo]()
    for info in archive.infolist():
        top, slash, file = info.orig_filename.partition("/")
        folders.add(top)
        if slash and not file:
            continue
        if not slash or file not in KNOWN_FILES or file in files:
            raise RefusedZipError(
                f"the zip holds {info.orig_filename!a:.80}, which no session has, or has twice: give the zip as the "
                "phone wrote it, not packed again"
            )
        if not 0 <= info.header_offset < length:
            raise RefusedZipError("the zip is not whole; send it again")
        if info.flag_bits & _ENCRYPTED or info.compress_type not in _METHODS or _is_special(info):
            raise RefusedZipError(f"{file} is encrypted, a link, or packed in a way that sessions are not")
        files[file] = info
    if len(folders) != 1 or not SESSION_NAME.fullmatch(min(folders)):
        raise RefusedZipError("the zip must hold one folder, named by the session's start (2021-12-20T132523)")
    if sum(info.file_size for info in files.values()) > max_bytes:
        raise RefusedZipError(
            f"the zip unpacks to more than {max_bytes / 1e6:,.0f} MB; raise --max-size-mb if that is right"
        )
    missing = {SUMS_FILE, RECORD_FILE} - files.keys()
    if missing:
        raise RefusedZipError(f"the zip holds no {' and no '.join(sorted(missing))}")
    return min(folders), files


def _is_special(info: zipfile.ZipInfo) -> bool:
    kind = stat.S_IFMT(info.external_attr >> 16)
    return kind not in (0, stat.S_IFREG)


def _extract(archive: zipfile.ZipFile, info: zipfile.ZipInfo, folder: Folder, name: str, left: int) -> tuple[str, int]:
    """Unpack one file; returns its SHA-256 and size. Counts what really comes, whatever the zip says of it."""
    digest, size = hashlib.sha256(), 0
    with archive.open(info) as source, folder.writing(name) as file:
        while block := source.read(_BLOCK):
            size += len(block)
            if size > left:
                raise RefusedZipError("the zip unpacks to more than it says, or more than --max-size-mb allows")
            digest.update(block)
            file.write(block)
    return digest.hexdigest(), size


def _check_sums(folder: Path, sums: dict[str, str]) -> None:
    """Compare the files unpacked with ``SHA256SUMS``: each other file is in it once, with its sum."""
    said = parse_checksums(_small(folder / SUMS_FILE, _MOST_SUMS))
    if said.keys() != sums.keys() - {SUMS_FILE}:
        raise RefusedZipError(f"{SUMS_FILE} does not list the files of the zip, each once")
    wrong = [name for name in sorted(said) if said[name] != sums[name]]
    if wrong:
        raise RefusedZipError(
            f"the checksum of {', '.join(wrong)} is wrong: the file is damaged; send the session again"
        )


def is_device_name(name: str) -> bool:
    """Whether a device's folder may have a name: on every system, and beside the floor's own files."""
    return is_portable(name) and not _OF_FLOOR.fullmatch(name)


def parse_checksums(data: bytes) -> dict[str, str]:
    """SHA-256 by file of a ``SHA256SUMS``; raises RefusedZipError where it has another form or names a file twice."""
    lines = [_SUMS_LINE.fullmatch(line) for line in data.decode("utf-8", errors="replace").splitlines()]
    said = {match.group(2): match.group(1) for match in lines if match}
    if None in lines or len(said) < len(lines):
        raise RefusedZipError(f"{SUMS_FILE} does not list the files of the zip, each once")
    return said


def _record(folder: Path, name: str) -> PhoneRecord:
    try:
        record = parse_record(_small(folder / RECORD_FILE, _MOST_RECORD), RECORD_FILE)
    except ValueError as error:
        raise RefusedZipError(f"{RECORD_FILE}: {error}") from error
    except SessionError as error:
        raise RefusedZipError(str(error)) from error
    if not is_device_name(record.device):
        raise RefusedZipError(
            f"the device is called {record.device}, which is a file of the floor or a name that Windows does not "
            "take: give it another name"
        )
    if record.session != name:
        raise RefusedZipError(f"{RECORD_FILE} is of session {record.session}, the zip of {name}")
    if record.end is None:
        raise RefusedZipError(
            "the session is still being recorded, or was killed and not yet closed by the app: open it"
        )
    return record


def _small(path: Path, most: int) -> bytes:
    with plain(path).open("rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise RefusedZipError(f"{path.name} is too long")
    return data
