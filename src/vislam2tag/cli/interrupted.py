"""What a command that was interrupted says: what is on the disk, never what should be there."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import typer

from vislam2tag.cli.options import INTERRUPTED
from vislam2tag.cli.terminal import say
from vislam2tag.common.errors import Vislam2tagError
from vislam2tag.common.files.store import shown


@contextmanager
def interrupted_with(there: Callable[[], str]) -> Iterator[None]:
    """End an interrupted block with one line, ``there()``, and the exit code of an interrupt."""
    try:
        yield
    except KeyboardInterrupt:
        say(f"interrupted: {there()}", err=True)
        raise typer.Exit(INTERRUPTED) from None


@contextmanager
def outputs_of_interrupted(*outputs: Path | None) -> Iterator[None]:
    """End an interrupted block with the names of those of its files and folders that were written until then."""
    wanted = [path for path in outputs if path is not None]
    before = [_state(path) for path in wanted]

    def there() -> str:
        written = [shown(path) for path, state in zip(wanted, before, strict=True) if _state(path) != state]
        if written:
            return f"{' and '.join(written)} written; run the same command again"
        return "nothing was written" + (f" to {' or '.join(map(shown, wanted))}" if wanted else "")

    with interrupted_with(there):
        yield


def labels_there(out: Path) -> str:
    """How many sessions an output folder for labels contains, which may be in a store."""
    from vislam2tag.pipeline.run.output import OutputFolder

    with suppress(Vislam2tagError, OSError):
        if count := len(OutputFolder(out).finished()):
            return f"{shown(out)} contains the labels of {count} sessions; run the same command again to go on"
    return f"no session was finished in {shown(out)}"


def contents_there(out: Path, parts: dict[str, str]) -> str:
    """Which parts a folder contains, named by their paths in it."""
    found = [name for path, name in parts.items() if _has_content(out / path)]
    if not found:
        return f"nothing was written to {out}"
    return f"{out} contains {', '.join(found)}; run the same command again to go on"


def _has_content(path: Path) -> bool:
    return any(path.iterdir()) if path.is_dir() else path.exists()


def _state(path: Path) -> object:
    """What changes when a file or folder is written or replaced; None if it does not exist."""
    try:
        stat = path.stat()
    except OSError:
        return None
    return stat.st_ino, stat.st_mtime_ns, stat.st_size
