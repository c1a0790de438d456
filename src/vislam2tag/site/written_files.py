"""Files that commands write into a survey's folder, which may come from others, with links planted in it."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.folder import Folder


def write_in_survey(root: Path, path: Path, content: bytes | str) -> None:
    """Write a file below a survey's folder, whole; links below ``root`` are never followed.

    Raises OutputError if it cannot be written, which names the link if one is in the way.
    """
    with survey_output(path):
        Folder.at(root).write(path.relative_to(root).as_posix(), content)


@contextmanager
def survey_output(path: Path) -> Iterator[None]:
    """Raise OutputError for OSError in the block; it names the link that is in the way, or else ``path``."""
    try:
        yield
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise OutputError(f"{error.filename}: {error.strerror}") from error
        raise OutputError(f"{path}: cannot be written ({error.strerror}); check its permissions") from error
