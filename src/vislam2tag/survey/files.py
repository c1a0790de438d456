"""Looking for files where the operating system may refuse to."""

from __future__ import annotations

import errno
import stat
from pathlib import Path

_ABSENT = (errno.ENOENT, errno.ENOTDIR, errno.ELOOP)


def is_file(path: Path) -> bool:
    """Tell whether a file is there; raises OSError where that cannot be known.

    ``Path.is_file`` answers False or raises there, depending on Python's version.
    """
    try:
        return stat.S_ISREG(path.stat().st_mode)
    except OSError as error:
        if error.errno in _ABSENT:
            return False
        raise
