"""Python's search for garbage in cycles, done seldom: nearly all that a program imports stays until it ends."""

from __future__ import annotations

import atexit
import gc

NEW_OBJECTS = 50_000
"""Between two searches; Python's own 700 make them a tenth of the time that imports take."""


def search_seldom() -> None:
    """Search for garbage seldom from now on, and not at all at the end of the process: that takes a quarter second."""
    gc.set_threshold(NEW_OBJECTS)
    atexit.register(gc.freeze)
