"""Memory tidied up seldom: nearly all that a program imports stays until it ends, and sessions need alike much."""

from __future__ import annotations

import atexit
import ctypes
import gc
import sys

NEW_OBJECTS = 50_000
"""Between two searches; Python's own 700 make them a tenth of the time that imports take."""
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
"""Numbers of glibc's ``mallopt``. The first: from how many free bytes on the end of the heap goes back to the system.
The second: from how many bytes on a block is outside the heap and goes back as soon as it is freed."""
_KEPT_BYTES = {_TRIM_THRESHOLD: 256 << 20, _MMAP_THRESHOLD: 32 << 20}


def search_seldom() -> None:
    """Search for garbage seldom from now on, and not at all at the end of the process: that takes a quarter second."""
    gc.set_threshold(NEW_OBJECTS)
    atexit.register(gc.freeze)


def keep_freed_memory() -> None:
    """Let freed memory serve what is allocated next, where the C library can: the system would zero each page again."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if mallopt is not None:
        for option, size in _KEPT_BYTES.items():
            mallopt(option, size)
