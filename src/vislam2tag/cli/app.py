"""The ``vislam2tag`` command: registers the subcommands and turns our errors into one line and an exit code."""

from __future__ import annotations

import importlib
import pkgutil
import sys

import typer

import vislam2tag
from vislam2tag import cli
from vislam2tag.common.errors import Vislam2tagError

app = typer.Typer(
    name="vislam2tag",
    help="Label Wi-Fi and sensor readings with where they were taken.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(vislam2tag.__version__)
        raise typer.Exit


@app.callback()
def _options(
    version: bool = typer.Option(False, "--version", callback=_print_version, is_eager=True, help="Print the version."),
) -> None:
    del version


def _register_commands(asked: str) -> None:
    """Import the ``command_*`` module of the command asked for, or all (for help and for unknown commands).

    Each holds a function ``register(app)``; importing only one, and none for the version, keeps start-up quick.
    """
    if asked == "--version":
        return
    modules = sorted(info.name for info in pkgutil.iter_modules(cli.__path__) if info.name.startswith("command_"))
    wanted = f"command_{asked.replace('-', '_')}"
    for module in [wanted] if wanted in modules else modules:
        importlib.import_module(f"{cli.__name__}.{module}").register(app)


def main() -> None:
    """Run the command line; errors of ours end it with exit code 2 and one message on standard error."""
    try:
        _register_commands((*sys.argv, "")[1])
        app()
    except KeyboardInterrupt:
        typer.echo("interrupted", err=True)
        sys.exit(130)
    except Vislam2tagError as error:
        typer.echo(f"error: {error}", err=True)
        sys.exit(2)
