"""Adding entries to ``corrections.toml`` and taking them back, with every other byte of the file left as it is."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from pydantic import ValidationError

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.atomic import only_one
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.plain_files import read_bytes, toml_values
from vislam2tag.common.files.toml_file import first_problem
from vislam2tag.common.files.whole_file import output_errors
from vislam2tag.survey.corrections.edits import corrections_of
from vislam2tag.survey.corrections.file import CORRECTIONS_FILE, Corrections

_LOCK = f".{CORRECTIONS_FILE}.lock"
_BEGIN = "# vislam2tag diagnose --apply added from here ..."
_END = "# ... to here; vislam2tag diagnose --revert takes it out"
_BLOCK = re.compile(re.escape(f"\n{_BEGIN}\n").encode() + b".*?" + re.escape(f"\n{_END}\n").encode(), re.DOTALL)


def with_entries(root: Path, lines: str) -> Corrections:
    """The survey's corrections as they would be with further entries.

    Raises SurveyError where the file as it is, or with them, cannot be used.
    """
    return _parsed(root / CORRECTIONS_FILE, _content(root) + _block(lines))


def add_entries(root: Path, lines: str) -> None:
    """Add entries at the end of a survey's ``corrections.toml``; raises SurveyError where it could not be read then."""
    with _only_writer(root):
        with_entries(root, lines)
        _write(root, _content(root) + _block(lines))


def remove_added(root: Path) -> int:
    """Take out all that :func:`add_entries` added, and the file if nothing else is in it; returns how many blocks."""
    with _only_writer(root):
        content, blocks = _BLOCK.subn(b"", _content(root))
        if blocks:
            _write(root, content)
    return blocks


class ChangedMeanwhileError(SurveyError):
    """The file is no longer what a change of it was made from."""


def corrections_text(root: Path) -> tuple[str, str]:
    """Text of a survey's ``corrections.toml`` and its version, both empty where there is none.

    Raises SurveyError where it cannot be read or is no text.
    """
    content = _content(root)
    try:
        return content.decode(), _version(content)
    except UnicodeDecodeError as error:
        raise SurveyError(f"{root / CORRECTIONS_FILE}: not a text in UTF-8: {error}; correct it") from error


def save_text(root: Path, text: str, version: str) -> str:
    """Make ``text`` the survey's ``corrections.toml`` (no file where it is empty), and return its version.

    ``version`` is that of the text which it was made from. Raises ChangedMeanwhileError where the file is another now,
    SurveyError where the text cannot be used, OutputError where it cannot be written.
    """
    corrections_of(text)
    with _only_writer(root):
        if _version(_content(root)) != version:
            raise ChangedMeanwhileError(f"{CORRECTIONS_FILE} was changed meanwhile; look at it, then change it again")
        _write(root, text.encode())
    return _version(text.encode())


def change_text(root: Path, change: Callable[[str], str]) -> str:
    """Replace the survey's ``corrections.toml`` by what ``change`` makes of its text, and return the text before.

    No other program writes the file meanwhile. Raises what ``change`` raises, which must refuse a text that cannot be
    used, and OutputError if the file cannot be written.
    """
    with _only_writer(root):
        before, _ = corrections_text(root)
        _write(root, change(before).encode())
    return before


@contextmanager
def _only_writer(root: Path) -> Iterator[None]:
    """Let no other program change the file; raises OutputError while one does."""
    with only_one(Folder.at(root), _LOCK, f"{root / CORRECTIONS_FILE}: is being written; try again"):
        yield


def _version(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest() if content else ""


def _block(lines: str) -> bytes:
    return f"\n{_BEGIN}\n{lines}\n{_END}\n".encode()


def _content(root: Path) -> bytes:
    path = root / CORRECTIONS_FILE
    try:
        return read_bytes(path) if path.exists() else b""
    except OSError as error:
        raise SurveyError(f"{path}: cannot be read: {error.strerror}") from error


def _parsed(path: Path, content: bytes) -> Corrections:
    try:
        return Corrections.model_validate(toml_values(content))
    except ValidationError as error:
        raise SurveyError(f"{path}: {first_problem(error)}") from error
    except ValueError as error:
        raise SurveyError(
            f"{path}: entries cannot be added to it: {error}; write each entry below its name in double brackets"
        ) from error


def _write(root: Path, content: bytes) -> None:
    """Write the file; an empty one is removed."""
    with output_errors(root / CORRECTIONS_FILE):
        if content:
            Folder.at(root).write(CORRECTIONS_FILE, content)
        else:
            Folder.at(root).remove(CORRECTIONS_FILE)
