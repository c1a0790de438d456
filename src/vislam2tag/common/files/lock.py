"""One program at a time: a lock file that the system frees when its holder ends, however it ends."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from vislam2tag.common.errors import OutputError

_ON_WINDOWS = os.name == "nt"


@contextmanager
def only_one(file: Path, refusal: str) -> Iterator[None]:
    """Hold the lock file, which is gone afterwards; its folder must be there.

    Raises OutputError with ``refusal`` where another program, or another part of this one, holds it, and where the file
    system cannot lock.
    """
    from filelock import FileLock, Timeout

    lock = FileLock(file, blocking=False)
    try:
        lock.acquire()
    except (Timeout, FileNotFoundError) as error:  # the holder may just be removing file and folder
        raise OutputError(refusal) from error
    except OSError as error:
        raise OutputError(
            f"{file.parent}: cannot be written or locked ({error.strerror}); choose a folder of yours on a local disk"
        ) from error
    try:
        yield
    finally:
        # A held file can be removed on POSIX, where who waits for it notices; on Windows only one that nobody holds.
        with suppress(OSError):
            file.unlink()
        lock.release()
        with suppress(OSError):
            if _ON_WINDOWS:
                file.unlink()
