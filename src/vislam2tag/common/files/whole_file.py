"""A file that is there whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vislam2tag.common.errors import OutputError


@contextmanager
def whole_file(target: Path) -> Iterator[Path]:
    """Yield where to write; what is there becomes ``target`` when the block ends without an exception.

    Raises OutputError where nothing can be written.
    """
    partial = target.with_name(target.name + ".part")
    try:
        yield partial
        partial.replace(target)
    except OSError as error:
        raise OutputError(f"{target}: cannot be written ({error.strerror}); choose another name") from error
    finally:
        if partial.is_file():
            partial.unlink(missing_ok=True)
