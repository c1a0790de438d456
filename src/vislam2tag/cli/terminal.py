"""Output of all commands. Control characters in text from files are escaped.

What compiled libraries write to standard error by themselves is kept apart from what a command prints.
"""

from __future__ import annotations

import contextlib
import faulthandler
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from typing import IO, TYPE_CHECKING, Any

import typer

from vislam2tag.cli.exit_codes import ExitCode
from vislam2tag.common.files.stored_folder import with_addresses
from vislam2tag.common.visible_text import visible

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.segment import Segment


_shown = {"progress": True}
"""What the options of this command line request."""


def hide_progress() -> None:
    """Hide progress bars from now on."""
    _shown["progress"] = False


def progress_is_shown() -> bool:
    """Whether progress is shown, that is without ``--quiet``."""
    return _shown["progress"]


def say(text: str, *, err: bool = False) -> None:
    """Print a line on standard output, or on standard error."""
    typer.echo(visible(with_addresses(text)), err=err)


def say_json(result: object) -> None:
    """Print a result as one JSON document: records and dataclasses by their fields, arrays as lists, NaN as null."""
    from pydantic_core import to_json

    say(to_json(result, indent=1, inf_nan_mode="null", fallback=_plain).decode())


def answer(
    result: object, as_json: bool, show: Callable[[], None], *, failed: bool = False, nothing: bool = False
) -> None:
    """End a command: print its result as JSON or let ``show`` print it, and exit.

    ``failed`` says that a part failed, ``nothing`` that nothing useful was done.
    """
    if as_json:
        say_json(result)
    else:
        show()
    raise typer.Exit(ExitCode.NOTHING if nothing else ExitCode.FAILURES if failed else ExitCode.DONE)


def _plain(value: Any) -> Any:
    """A NumPy array or number for JSON; raises TypeError for other values."""
    if not hasattr(value, "tolist"):
        raise TypeError(f"{type(value).__name__} cannot be written as JSON")
    return value.tolist()


def print_line(what: str, style: str, text: str, console: Console | None = None) -> None:
    """Print a line that begins with a styled word."""
    from rich.text import Text

    (console or visible_console()).print(Text(f"{what} ", style) + Text(text), soft_wrap=True)


def visible_console(
    *, stderr: bool = False, file: IO[str] | None = None, width: int | None = None, force_terminal: bool | None = None
) -> Console:
    """Rich's console, which escapes control characters in the printed text."""
    from rich.console import Console

    class Visible(Console):
        def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
            for segment in super().render(renderable, options):
                yield segment if segment.control else segment._replace(text=visible(with_addresses(segment.text)))

    if stderr and not _shown["progress"]:
        force_terminal = False
    return Visible(stderr=stderr, file=file, width=width, force_terminal=force_terminal, highlight=False)


_STANDARD_ERROR = 2
_PANIC = b"panicked at"


@contextlib.contextmanager
def native_output_last() -> Iterator[None]:
    """Collect what libraries write to standard error, and print it at the end of the block.

    Polars reports damage that its checks miss with a dozen lines before our message. These are dropped. A crash that
    ends the process is still printed, with its location.
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
    """Give Python's standard error its own handle if it shares the libraries' one."""
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
    """File descriptor of a stream, or None."""
    try:
        return int(stream.fileno())  # type: ignore[attr-defined]
    except (AttributeError, OSError, ValueError):
        return None


def _print_unless_panic(held: IO[bytes]) -> None:
    held.seek(0)
    text = held.read()
    if text and _PANIC not in text:
        os.write(_STANDARD_ERROR, text)
