"""What only one program does at a time: a lock that the system frees when its holder ends, and an exchange of names."""

from __future__ import annotations

import ctypes
import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.common.errors import OutputError

if TYPE_CHECKING:
    from vislam2tag.common.files.folder import Folder

_EXCHANGES = {"linux": "renameat2", "darwin": "renameatx_np"}
"""By platform: the function of the C library that can exchange two names at once."""
_EXCHANGE = 2
"""The flag that asks for it (``RENAME_EXCHANGE``, ``RENAME_SWAP``)."""
_CANNOT_EXCHANGE = {errno.ENOSYS, errno.EINVAL, errno.ENOTSUP}
"""What systems and file systems answer that cannot."""
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
            f"{folder.path}: cannot be written or locked ({error.strerror}); choose a folder on a local disk that you "
            "may write to"
        ) from error
    try:
        yield
    finally:
        # A held file can be removed on POSIX, where who waits for it notices; on Windows only one that no one holds.
        with suppress(OSError):
            folder.remove(name)
        lock.release()
        with suppress(OSError):
            if _ON_WINDOWS:
                folder.remove(name)


def exchange(handle: int | None, name: str, other_handle: int | None, other_name: str, other_path: Path) -> bool:
    """Exchange two entries of open directories at once; False if the system or the file system cannot."""
    if sys.platform not in _EXCHANGES or handle is None or other_handle is None:
        return False
    function = getattr(ctypes.CDLL(None, use_errno=True), _EXCHANGES[sys.platform], None)
    if function is None:
        return False
    if function(handle, os.fsencode(name), other_handle, os.fsencode(other_name), ctypes.c_uint(_EXCHANGE)) == 0:
        return True
    number = ctypes.get_errno()
    if number in _CANNOT_EXCHANGE:
        return False
    raise OSError(number, os.strerror(number), str(other_path / other_name))
