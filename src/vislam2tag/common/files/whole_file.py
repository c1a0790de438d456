"""Files at paths that the user gave: there whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.folder import Folder


def place_of(target: Path) -> tuple[Folder, str]:
    """The folder and the name of a file that the user named; links on the way to it, and it itself, are followed."""
    real = target.resolve()
    return Folder(real.parent), real.name


def write_file(target: Path, content: bytes | str) -> None:
    """Write a file, text as UTF-8; raises OutputError if it cannot be written."""
    folder, name = place_of(target)
    with output_errors(target):
        folder.write(name, content)


@contextmanager
def file_to_write(target: Path) -> Iterator[BinaryIO]:
    """Yield an open file, which becomes ``target`` when the block ends without an exception.

    Raises OutputError if it cannot be written.
    """
    folder, name = place_of(target)
    with output_errors(target), folder.writing(name) as file:
        yield file


@contextmanager
def output_errors(target: Path) -> Iterator[None]:
    """Raise OutputError, which names ``target``, for what the system refuses in the block."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"{target}: cannot be written ({error.strerror}); choose another name") from error
