"""All that commands print goes through here: what files hold reaches the terminal as text that it does not obey.

What compiled libraries write to standard error by themselves, kept apart from what a command says.
"""

from __future__ import annotations

import contextlib
import faulthandler
import os
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from typing import IO, TYPE_CHECKING, Any

import typer

from vislam2tag.common.files.stored_folder import with_addresses
from vislam2tag.common.visible_text import visible

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.segment import Segment
    from rich.table import Table


_shown = {"progress": True}
"""What the options of this command line ask for."""


def hide_progress() -> None:
    """Let consoles on standard error show no bars from now on, as where it is no terminal."""
    _shown["progress"] = False


def progress_is_shown() -> bool:
    """Whether nobody has asked for silence."""
    return _shown["progress"]


def say(text: str, *, err: bool = False) -> None:
    """Print a line on standard output, or on standard error."""
    typer.echo(visible(with_addresses(text)), err=err)


def say_json(result: object) -> None:
    """Print a result as one JSON document: records and dataclasses by their fields, arrays as lists, NaN as null."""
    from pydantic_core import to_json

    say(to_json(result, indent=1, inf_nan_mode="null", fallback=_plain).decode())


def _plain(value: Any) -> Any:
    """What JSON has for an array or a number of NumPy; raises TypeError for what has no such form."""
    if not hasattr(value, "tolist"):
        raise TypeError(f"{type(value).__name__} has no form in JSON")
    return value.tolist()


def tables_that_fit(table: Table, console: Console) -> list[Table]:
    """Split a table too wide for a console into several, each with its columns of text, so that no number is cut."""
    from rich.measure import Measurement
    from rich.table import Table

    def span(text: RenderableType) -> Measurement:
        return Measurement.get(console, console.options.update(max_width=10_000), text)

    texts = [i for i, column in enumerate(table.columns) if column.justify == "left"]
    most, least = [], []
    for i, column in enumerate(table.columns):
        head, cells = span(column.header), [span(cell) for cell in column.cells]
        most.append(max([head.maximum, *(cell.maximum for cell in cells)]))
        words = [cell.minimum if i in texts else cell.maximum for cell in cells]  # a number stays in its line
        least.append(max([head.minimum, *words]))
    beside = (span(table).maximum - sum(most)) / max(len(most), 1)

    def part(columns: Sequence[int]) -> Table:
        made = Table(title=table.title, title_justify="left", box=table.box)
        widths = _shared(
            int(console.width - beside * len(columns)), [least[i] for i in columns], [most[i] for i in columns]
        )
        for i, width in zip(columns, widths, strict=True):
            old = table.columns[i]
            made.add_column(old.header, justify=old.justify, overflow=old.overflow, width=width)
        cells = [list(table.columns[i].cells) for i in columns]
        for number, row in enumerate(zip(*cells, strict=True)):
            made.add_row(*row, end_section=table.rows[number].end_section)
        return made

    def fits(columns: Sequence[int], width: Sequence[int]) -> bool:
        return sum(width[i] + beside for i in columns) <= console.width

    count = len(table.columns)
    if fits(range(count), most):
        return [table]
    groups: list[list[int]] = [[]]
    for i in (i for i in range(count) if i not in texts):
        if groups[-1] and not fits([*texts, *groups[-1], i], least):
            groups.append([])
        groups[-1].append(i)
    return [part([*texts, *group]) for group in groups]


def _shared(width: int, least: Sequence[int], most: Sequence[int]) -> list[int]:
    """Widths of columns that share this one, each with its least where that can be, and with no more than its most.

    Where the least alone is too wide, the widest columns give.
    """
    widths = list(least)
    while sum(widths) > width and max(widths) > 1:
        widths[widths.index(max(widths))] -= 1
    while sum(widths) < width and (short := [i for i in range(len(widths)) if widths[i] < most[i]]):
        widths[min(short, key=widths.__getitem__)] += 1
    return widths


def visible_console(**options: Any) -> Console:
    """Return Rich's console with its own options; only what Rich itself adds is obeyed by the terminal."""
    from rich.console import Console
    from rich.table import Table

    class Visible(Console):
        def render(self, *arguments: Any, **options: Any) -> Iterable[Segment]:
            for segment in super().render(*arguments, **options):
                yield segment if segment.control else segment._replace(text=visible(with_addresses(segment.text)))

        def print(self, *objects: Any, **options: Any) -> None:
            for each in objects:
                parts = tables_that_fit(each, self) if isinstance(each, Table) else [each]
                for part in parts:
                    super().print(part, **options)

    if options.get("stderr") and not _shown["progress"]:
        options["force_terminal"] = False
    return Visible(**options)


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
