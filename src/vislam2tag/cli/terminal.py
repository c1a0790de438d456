"""All that commands print goes through here: what files hold reaches the terminal as text that it does not obey."""

from __future__ import annotations

import shlex
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from vislam2tag.common.visible_text import visible

if TYPE_CHECKING:
    from rich.console import Console
    from rich.segment import Segment


_shown = {"progress": True}
"""What the options of this command line ask for."""


def hide_progress() -> None:
    """Let consoles on standard error show no bars from now on, as where it is no terminal."""
    _shown["progress"] = False


def say(text: str, *, err: bool = False) -> None:
    """Print a line on standard output, or on standard error."""
    typer.echo(visible(text), err=err)


def next_step(*words: str | Path) -> None:
    """End a command with the one of ours to go on with, ready to copy."""
    say(f"next: {shlex.join(['vislam2tag', *map(str, words)])}")


def visible_console(**options: Any) -> Console:
    """Return Rich's console with its own options; only what Rich itself adds is obeyed by the terminal."""
    from rich.console import Console

    class Visible(Console):
        def render(self, *arguments: Any, **options: Any) -> Iterable[Segment]:
            for segment in super().render(*arguments, **options):
                yield segment if segment.control else segment._replace(text=visible(segment.text))

    if options.get("stderr") and not _shown["progress"]:
        options["force_terminal"] = False
    return Visible(**options)
