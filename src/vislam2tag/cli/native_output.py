"""What compiled libraries write to standard error by themselves, kept apart from what a command says."""

from __future__ import annotations

import contextlib
import faulthandler
import os
import sys
import tempfile
from collections.abc import Iterator
from typing import IO

_STANDARD_ERROR = 2
_PANIC = b"panicked at"


@contextlib.contextmanager
def native_output_last() -> Iterator[None]:
    """Hold back what libraries write to standard error, and print it where the block ends.

    Polars tells of damage that its own checks miss in a dozen lines before the command's one message: these are
    dropped, with all that was held back. A crash that ends the process is still told, with where it was.
    """
    with tempfile.TemporaryFile() as held, _ours_apart():
        shown = os.dup(_STANDARD_ERROR)
        os.dup2(held.fileno(), _STANDARD_ERROR)
        try:
            yield
        finally:
            os.dup2(shown, _STANDARD_ERROR)
            os.close(shown)
            _print_unless_panic(held)


@contextlib.contextmanager
def _ours_apart() -> Iterator[None]:
    """Give Python's own standard error a handle of its own, where it shares the libraries'."""
    ours = sys.stderr
    if _handle(ours) != _STANDARD_ERROR:
        yield
        return
    ours.flush()
    with os.fdopen(os.dup(_STANDARD_ERROR), "w", 1, encoding=ours.encoding, errors=ours.errors) as apart:
        sys.stderr = apart
        faulthandler.enable(apart)
        try:
            yield
        finally:
            faulthandler.disable()
            sys.stderr = ours


def _handle(stream: object) -> int | None:
    """A stream's number in the system; None for what is no stream of it."""
    try:
        return int(stream.fileno())  # type: ignore[attr-defined]
    except (AttributeError, OSError, ValueError):
        return None


def _print_unless_panic(held: IO[bytes]) -> None:
    held.seek(0)
    text = held.read()
    if text and _PANIC not in text:
        os.write(_STANDARD_ERROR, text)
