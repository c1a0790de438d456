"""Zips with recordings of our app or another app, which are unpacked within limits and fully checked.

docs/reference/phone-handover.md describes the zip of our app.
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

from vislam2tag.common.documentation import page_of
from vislam2tag.common.errors import DatasetError, SessionError, UsageError, first_line
from vislam2tag.common.files.archives import BoundedFile, folder_of, names_in
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import plain, read_bytes
from vislam2tag.sessions.apps import AppFormat
from vislam2tag.sessions.formats.phone import FILE_NAMES, RECORD_FILE, SESSION_NAME, PhoneRecord, parse_record
from vislam2tag.sessions.registry import FORMATS, UNKNOWN_FORMAT, format_of, recorded_folder
from vislam2tag.site.model import is_portable, portable_name, same_name
from vislam2tag.site.site_table import is_file

SUMS_FILE = "SHA256SUMS"
KNOWN_FILES = frozenset(name for names in FILE_NAMES.values() for name in names) | {SUMS_FILE}
_SUMS_LINE = re.compile(r"([0-9a-f]{64})  ([A-Za-z0-9._]+)")
_BLOCK = 1 << 20
_ENCRYPTED = 0x1
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_MOST_SUMS, _MOST_RECORD = 10_000, 1_000_000
"""Bytes that SHA256SUMS and session.json are expected to stay below."""
_MOST_DIRECTORY = 100_000
"""Maximum bytes of the directory of entries, and of the search for it: some thousand names; a session has ten."""
_OF_FLOOR = re.compile(r"(?i:tachymeter|.*\.(csv|jpe?g|png))")
"""A floor's own files and folders, which cannot be names of devices."""


class RefusedZipError(SessionError):
    """A zip that is not a complete session, or contains other files."""


def unpack(path: Path, folder: Folder, max_bytes: int) -> tuple[str, PhoneRecord]:
    """Unpack a session's zip into the new folder ``folder``, at most ``max_bytes`` in all, and check every file.

    Returns the session's name and its record.

    Raises RefusedZipError, with a sentence for the user, for a file that is not a zip, damaged or encrypted. The same
    holds for names that sessions do not have (including paths), links, duplicates, too many bytes, missing or wrong
    checksums, and a record that is missing, wrong or not ended. The caller removes unpacked files.
    """
    too_many = RefusedZipError("the zip is incomplete, or has more files than a session")
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
    return name, _record(folder.path, name)


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
                f"the zip contains {info.orig_filename!a:.80}, which is not a file of a session, or is there twice; "
                "send the original zip from the phone"
            )
        if not 0 <= info.header_offset < length:
            raise RefusedZipError("the zip is incomplete; send it again")
        if info.flag_bits & _ENCRYPTED or info.compress_type not in _METHODS or _is_special(info):
            raise RefusedZipError(
                f"{file} is encrypted, a link, or packed by another method; send the original zip from the phone"
            )
        files[file] = info
    if len(folders) != 1 or not SESSION_NAME.fullmatch(min(folders)):
        raise RefusedZipError(
            "the zip must contain one folder, named after the start of the session (2021-12-20T132523)"
        )
    if sum(info.file_size for info in files.values()) > max_bytes:
        raise RefusedZipError(
            f"the zip unpacks to more than {max_bytes / 1e6:,.0f} MB; "
            "if that is correct, use vislam2tag receive with a larger --max-size-mb"
        )
    missing = {SUMS_FILE, RECORD_FILE} - files.keys()
    if missing:
        raise RefusedZipError(f"the zip does not contain {' and '.join(sorted(missing))}")
    return min(folders), files


def _is_special(info: zipfile.ZipInfo) -> bool:
    kind = stat.S_IFMT(info.external_attr >> 16)
    return kind not in (0, stat.S_IFREG)


def _extract(archive: zipfile.ZipFile, info: zipfile.ZipInfo, folder: Folder, name: str, left: int) -> tuple[str, int]:
    """Unpack one file; returns its SHA-256 and size. Counts the real bytes, because sizes in the zip may be wrong."""
    digest, size = hashlib.sha256(), 0
    with archive.open(info) as source, folder.writing(name) as file:
        while block := source.read(_BLOCK):
            size += len(block)
            if size > left:
                raise RefusedZipError("the zip unpacks to more bytes than it declares, or than --max-size-mb allows")
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
            f"the checksum of {', '.join(wrong)} is wrong, so the file is damaged; send the session again"
        )


def is_device_name(name: str) -> bool:
    """Whether a name is valid for a device's folder: on every system, and different from the floor's own files."""
    return is_portable(name) and not _OF_FLOOR.fullmatch(name)


def parse_checksums(data: bytes) -> dict[str, str]:
    """SHA-256 by file of a ``SHA256SUMS``; raises RefusedZipError if it has another form or names a file twice."""
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
            f"the name of the device, {record.device}, is a file of the floor or not valid on Windows; choose another "
            "name"
        )
    if record.session != name:
        raise RefusedZipError(f"{RECORD_FILE} belongs to session {record.session}, but the zip to {name}")
    if record.end is None:
        raise RefusedZipError(
            "the session is still being recorded, or the app was killed; open the app to close the session"
        )
    return record


def _small(path: Path, most: int) -> bytes:
    with plain(path).open("rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise RefusedZipError(f"{path.name} is too long")
    return data


_UNSAFE = re.compile(r"[^\w. -]+")
_ANY_TRACKER = ("mcap", "tum")


@dataclass(frozen=True)
class AppPlace:
    """Place of recordings from other apps, which contain neither floor nor device of a survey."""

    floor: int | None = None
    """None: the only floor of the survey."""
    device: str | None = None
    """None: ``iPhone`` for apps of iOS, else the format's name."""


def app_place(floor: int | None, device: str | None) -> AppPlace:
    """Create a place; raises UsageError if the device's name is not valid for a folder."""
    if device is not None and (_UNSAFE.search(device) or not is_device_name(device)):
        raise UsageError(
            f"--device {device!a}: not a valid name for a device's folder. Use letters, digits, spaces, '.', '-' and "
            "'_', without a space or dot at the end; names of a floor's files and reserved names of Windows (CON, NUL) "
            "are not allowed"
        )
    return AppPlace(floor, device)


@dataclass(frozen=True)
class AppRecording:
    """An app's unpacked recording: its format, its folder, and the name of the session."""

    format: str
    folder: Path
    name: str

    @property
    def device(self) -> str:
        """Default device for its folder."""
        of_ios = isinstance(FORMATS.named(self.format), AppFormat) and self.format not in _ANY_TRACKER
        return "iPhone" if of_ios else self.format


def is_of_our_app(path: Path) -> bool:
    """Whether a zip is from our app; an unreadable zip counts as one and is refused as such."""
    names = list(names_in(path)) if path.suffix.lower() == ".zip" else []
    return not names or any(name.name.rpartition("\\")[2] == RECORD_FILE for name in names)


def unpack_app(path: Path, folder: Folder, max_bytes: int) -> AppRecording:
    """Unpack a zip into ``folder``, at most ``max_bytes`` in total, and detect its app.

    Raises RefusedZipError, one sentence, if it cannot be unpacked, or its app is unknown.
    """
    _refuse_unportable(path)
    try:
        unpacked = folder_of(path, folder, max_bytes)
    except DatasetError as error:
        reason = str(error).partition(": ")[2].replace("--max-unpacked-gb", "--max-size-mb")
        raise RefusedZipError(reason) from error
    inner = recorded_folder(unpacked)
    found = format_of(inner)
    if found is None or found == UNKNOWN_FORMAT:
        raise RefusedZipError(
            "the zip is neither a session of the vislam2tag app nor a recording of another known app "
            f"({page_of('how-to/iphone')} lists them)"
        )
    name = portable_name(_UNSAFE.sub("-", path.stem if inner == unpacked else inner.name))
    return AppRecording(found, inner, name or found)


def _refuse_unportable(path: Path) -> None:
    """Refuse a zip with a file that some system would not take, or two that are one file there."""
    seen = set[str]()
    for name in names_in(path):
        if name.is_absolute() or ".." in name.parts:  # is not unpacked
            continue
        if not all(is_portable(part) for part in name.parts) or same_name(str(name)) in seen:
            raise RefusedZipError(
                f"the zip contains {str(name)!a:.80}, which is not a valid name on some systems or differs from "
                "another name only in case; pack the recording again with another name"
            )
        seen.add(same_name(str(name)))


def files_digest(folder: Path) -> str:
    """SHA-256 over names and contents of a recording's files, to recognise it."""
    whole = hashlib.sha256(b"a recording without a list of checksums\n")  # no digest of such a list
    for file in _files(folder):
        whole.update(f"{hashlib.sha256(read_bytes(file)).hexdigest()}  {file.relative_to(folder)}\n".encode())
    return whole.hexdigest()


def holds_all_of(target: Path, folder: Path) -> bool:
    """Whether the target contains every file of a recording with the same content, and maybe more."""
    try:
        return all(read_bytes(target / file.relative_to(folder)) == read_bytes(file) for file in _files(folder))
    except OSError:
        return False


def _files(folder: Path) -> list[Path]:
    return [file for file in sorted(folder.rglob("*")) if is_file(file)]
