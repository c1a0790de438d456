"""Zips that other apps share: unpacked within bounds, recognised by the files' names, filed as a session."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.files.archives import folder_of, names_in
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.sessions.apps.format import AppFormat
from vislam2tag.sessions.phone.record import RECORD_FILE
from vislam2tag.sessions.registry import FORMATS, UNKNOWN_FORMAT, format_of, recorded_folder
from vislam2tag.studio.receiving.session_zip import RefusedZipError, is_device_name
from vislam2tag.survey.names import is_portable, portable_name, same_name
from vislam2tag.survey.site_table import is_file

_UNSAFE = re.compile(r"[^\w. -]+")
_ANY_TRACKER = ("mcap", "tum")


@dataclass(frozen=True)
class AppPlace:
    """Where recordings of other apps are filed, which know neither floor nor device of a survey."""

    floor: int | None = None
    """None: the only floor that the survey has."""
    device: str | None = None
    """None: ``iPhone`` for apps of iOS, else the format's name."""


def app_place(floor: int | None, device: str | None) -> AppPlace:
    """Make a place; raises UsageError where the device's name is none of a folder."""
    if device is not None and (_UNSAFE.search(device) or not is_device_name(device)):
        raise UsageError(
            f"--device {device!a}: is no name of a folder for a device: use letters, digits, blanks, ., - and _, "
            "no blank or dot at the end, no name of a floor's files, and none that Windows reserves (CON, NUL)"
        )
    return AppPlace(floor, device)


@dataclass(frozen=True)
class AppRecording:
    """An app's recording, unpacked: its format, its folder, and what to call the session."""

    format: str
    folder: Path
    name: str

    @property
    def device(self) -> str:
        """Device that its folder goes under where nobody says."""
        of_ios = isinstance(FORMATS.named(self.format), AppFormat) and self.format not in _ANY_TRACKER
        return "iPhone" if of_ios else self.format


def is_of_our_app(path: Path) -> bool:
    """Whether a zip holds what our app's do; one that cannot be listed is taken for one, to be refused as such."""
    names = list(names_in(path)) if path.suffix.lower() == ".zip" else []
    return not names or any(name.name.rpartition("\\")[2] == RECORD_FILE for name in names)


def unpack_app(path: Path, folder: Folder, max_bytes: int) -> AppRecording:
    """Unpack a zip into ``folder``, at most ``max_bytes`` in all, and tell which app it is of.

    Raises RefusedZipError, one sentence, where it cannot be unpacked, or no app that is known wrote it.
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
            "the zip is no session of the vislam2tag app, nor a recording of another app that is known "
            "(docs/how-to/iphone.md names them)"
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
                f"the zip has {str(name)!a:.80}, which some systems do not take or which is there twice in other "
                "letters: pack the recording again with another name"
            )
        seen.add(same_name(str(name)))


def files_digest(folder: Path) -> str:
    """SHA-256 over names and contents of a recording's files, by which it is known again."""
    whole = hashlib.sha256(b"a recording without a list of checksums\n")  # no digest of such a list
    for file in _files(folder):
        whole.update(f"{hashlib.sha256(read_bytes(file)).hexdigest()}  {file.relative_to(folder)}\n".encode())
    return whole.hexdigest()


def holds_all_of(target: Path, folder: Path) -> bool:
    """Whether every file of a recording lies in the target, too, with the same content; more may lie there."""
    try:
        return all(read_bytes(target / file.relative_to(folder)) == read_bytes(file) for file in _files(folder))
    except OSError:
        return False


def _files(folder: Path) -> list[Path]:
    return [file for file in sorted(folder.rglob("*")) if is_file(file)]
