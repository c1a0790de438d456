"""One program at a time: a lock file that the system frees when its holder ends, however it ends."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.folder import Folder

_ON_WINDOWS = os.name == "nt"


@contextmanager
def only_one(folder: Folder, name: str, refusal: str) -> Iterator[None]:
    """Hold a lock file of a folder, which must be there; the file is gone afterwards.

    Raises OutputError with ``refusal`` if another program, or another part of this one, holds it, and OutputError if
    the file system cannot lock.
    """
    from filelock import FileLock, Timeout

    try:
        lock = FileLock(folder.without_links(name), blocking=False)
        lock.acquire()
    except (Timeout, FileNotFoundError) as error:  # the holder may just be removing file and folder
        raise OutputError(refusal) from error
    except OSError as error:
        raise OutputError(
            f"{folder.path}: cannot be written or locked ({error.strerror}); choose a folder of yours on a local disk"
        ) from error
    try:
        yield
    finally:
        # A held file can be removed on POSIX, where who waits for it notices; on Windows only one that nobody holds.
        with suppress(OSError):
            folder.remove(name)
        lock.release()
        with suppress(OSError):
            if _ON_WINDOWS:
                folder.remove(name)
