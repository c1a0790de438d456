"""A folder that appears whole or not at all: filled under another name beside its place, then renamed."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import polars as pl

from vislam2tag.common.errors import OutputError


@contextmanager
def whole_folder(target: Path, replaceable: Callable[[Path], bool]) -> Iterator[Path]:
    """Yield an empty folder that becomes ``target`` when the block ends without an exception.

    What was at ``target`` stays until then; it must not exist, be empty, or be ``replaceable`` (made by the same
    command). Raises OutputError otherwise, and where nothing can be written.
    """
    _refuse_foreign(target, replaceable)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        partial = Path(tempfile.mkdtemp(prefix=f".{target.name}.", dir=target.parent))
        partial.chmod(0o777 & ~_umask())
    except OSError as error:
        raise OutputError(f"{target}: cannot be made ({error.strerror}); choose another --out") from error
    try:
        yield partial
        _put_in_place(partial, target)
    except (OSError, pl.exceptions.PolarsError) as error:
        cause = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise OutputError(f"{target}: cannot be written ({cause}); free space or choose another --out") from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def _refuse_foreign(target: Path, replaceable: Callable[[Path], bool]) -> None:
    if target.is_file():
        raise OutputError(f"{target}: is a file, not a folder; choose another --out")
    if target.is_dir() and any(target.iterdir()) and not replaceable(target):
        raise OutputError(
            f"{target}: is not empty and was not made by this command; choose an empty or new folder for --out"
        )


def _put_in_place(partial: Path, target: Path) -> None:
    """Swap the folders by renaming; what was there goes last."""
    if not target.exists():
        partial.rename(target)
        return
    old = partial.with_name(f"{partial.name}.old")
    target.rename(old)
    partial.rename(target)
    shutil.rmtree(old, ignore_errors=True)


def _umask() -> int:
    """Read the process's umask (it can only be read by setting it)."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
