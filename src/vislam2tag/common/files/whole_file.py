"""Files at paths that the user gave: there whole or not at all."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.folder import Folder


def write_file(target: Path, content: bytes | str) -> None:
    """Write a file, text as UTF-8; raises OutputError if it cannot be written."""
    with file_to_write(target) as file:
        file.write(content.encode() if isinstance(content, str) else content)


@contextmanager
def file_to_write(target: Path) -> Iterator[BinaryIO]:
    """Yield an open file, which becomes ``target`` when the block ends without an exception.

    Links on the way to it, and the file itself if it is one, are followed. Raises OutputError if it cannot be written.
    """
    real = target.resolve()
    with output_errors(target):
        if not real.parent.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, f"{target.parent} is not a folder")
        with Folder(real.parent).writing(real.name) as file:
            yield file


@contextmanager
def output_errors(target: Path) -> Iterator[None]:
    """Raise OutputError, which names ``target``, for what the system refuses in the block."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"{target}: cannot be written ({error.strerror}); choose another name") from error
