"""The ``vislam2tag`` command: finds the subcommands and turns our errors into one line and an exit code."""

from __future__ import annotations

import importlib
import re
import signal
import sys
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from textwrap import fill
from typing import Annotated, Any, TypeAlias

import typer
from typer.core import TyperCommand, TyperGroup

import vislam2tag
from vislam2tag.cli.addresses import take_addresses
from vislam2tag.cli.exit_codes import ExitCode, code_of_error
from vislam2tag.cli.records import help_of
from vislam2tag.cli.terminal import hide_progress, native_output_last, say
from vislam2tag.common.commit import commit_of_package
from vislam2tag.common.documentation import page_of
from vislam2tag.common.errors import UsageError, Vislam2tagError, first_line, missing_extra
from vislam2tag.common.garbage import search_seldom

COMMANDS = {
    "Prepare": {
        "site": "Describe the building: floors, plans, coordinate frames.",
        "plan": "Plan where to hang landmarks.",
        "sheets": "Make landmark sheets to print.",
        "register": "Compute landmark positions from measurements.",
    },
    "Collect": {
        "receive": "Receive sessions from phones.",
        "inspect": "List what a survey contains and its problems.",
        "attach": "Add a second phone's recording to a walk.",
        "sightings": "Find landmarks in the images of iPhone walks.",
        "simulate": "Simulate a survey with known true positions.",
    },
    "Map and label": {
        "run": "Label, check and build a data set in one go.",
        "process": "Map all sessions of a survey and label readings.",
        "fleet": "Process many surveys, also on a cluster.",
        "label": "Add positions to any time-stamped table.",
        "survey-landmarks": "Estimate positions of unsurveyed landmarks.",
        "studio": "View and correct a survey in the browser.",
        "diagnose": "Find mistakes in a survey and their corrections.",
        "check": "Estimate label accuracy without ground truth.",
        "evaluate": "Measure label accuracy against ground truth.",
    },
    "Data sets": {
        "dataset": "Build a data set from surveys or labels.",
        "split": "Split a data set into training and test sets.",
        "import": "Convert public data to a data set.",
        "export": "Write a data set or labels in other formats.",
        "join": "Add a later survey and report what changed.",
        "verify": "Compare two data sets or outputs.",
        "figures": "Make print figures and tables of a data set.",
        "radio-maps": "Map the signal strength of each access point.",
    },
    "Positioning": {
        "train": "Train a positioning model on a data set.",
        "locate": "Estimate where scans were taken, with a model.",
        "benchmark": "Train, test and compare positioning models.",
    },
    "More": {
        "paper": "Reproduce the paper's tables and figures.",
        "demo": "Simulate, label and score a small survey.",
        "docs": "Show a page of the documentation.",
    },
}
"""Every command, by purpose; ``--help`` shows this without importing any of them."""
MODULES = {
    "benchmark": ("benchmark", "paper"),
    "collection": ("receive", "inspect"),
    "comparison": ("split", "join", "verify"),
    "datasets": ("dataset", "figures", "radio-maps"),
    "diagnosis": ("diagnose", "survey-landmarks"),
    "fleet": ("fleet",),
    "formats": ("import", "export"),
    "landmarks": ("plan", "sheets"),
    "models": ("train", "locate"),
    "process": ("process", "run", "demo"),
    "quality": ("check", "evaluate"),
    "recordings": ("label", "attach", "sightings"),
    "register": ("register",),
    "simulate": ("simulate",),
    "site": ("site",),
    "studio": ("studio", "docs"),
}
"""The commands in each module ``commands_NAME``."""
OLD_NAMES = {
    "site init": {"--measure": "--click", "--layer": "--walls"},
    "plan": {"--sheet": "--paper", "--anew": "--restart"},
    "sightings": {"--again": "--replace"},
    "simulate": {"--landmark-file": "--landmarks"},
    "label": {"--align": "--by"},
}
"""Old names of options, by command. They still work."""


class _Commands(TyperGroup):
    """Imports the module of a command when that is asked for; it has a function ``NAME_command``."""

    # Any: it depends on the version of Typer whether the classes are those of the package Click or its own.

    def list_commands(self, ctx: Any) -> list[str]:
        del ctx
        return [name for group in COMMANDS.values() for name in group]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        known = self.list_commands(ctx)
        if cmd_name not in known:
            self.commands = {name: TyperCommand(name) for name in known}  # a misspelt name is compared with them
            return None
        single = typer.Typer(rich_markup_mode=None)
        single.callback()(lambda: None)  # a group, so that the command keeps its name
        name = next(name for name, commands in MODULES.items() if cmd_name in commands)
        module = importlib.import_module(f"vislam2tag.cli.commands_{name}")
        work = getattr(module, f"{cmd_name.replace('-', '_')}_command")
        if isinstance(work, typer.Typer):
            single.add_typer(work, name=cmd_name)
        else:
            single.command(cmd_name, help=help_of(work), epilog=getattr(module, "EPILOG", None))(work)
        return take_addresses(_with_switches(typer.main.get_group(single).commands[cmd_name], cmd_name), cmd_name)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        del ctx
        for title, commands in COMMANDS.items():
            with formatter.section(title):
                formatter.write_dl(list(commands.items()))


_TYPE = re.compile(r"<(?:list\[)?(?:(int|float)|(str)|(path)|([^]>]+))(?: range)?]?>", re.IGNORECASE)
_ARGUMENT = re.compile(r"[{[]+(\w+)[^ ]*?(\.\.\.)?[]}.]*")


def _in_plain_words(command: Any) -> None:
    """Let a command's help name its arguments in capitals, and say NUMBER, TEXT and PATH instead of Python's types."""
    format_options, collect_usage_pieces = command.format_options, command.collect_usage_pieces

    def plain(term: str) -> str:
        words = _TYPE.sub(lambda found: found[4] or ("", "NUMBER", "TEXT", "PATH")[found.lastindex or 0], term)
        return words if words.startswith("-") else words.upper()

    def plain_options(ctx: Any, formatter: Any) -> None:
        write = formatter.write_dl
        formatter.write_dl = lambda rows: write([(plain(term), text) for term, text in rows])
        format_options(ctx, formatter)
        formatter.write_dl = write
        if rare := [max(each.opts, key=len) for each in command.params if each.hidden and each.expose_value]:
            text = f"Rarely needed, see {page_of('reference/settings')}: {', '.join(rare)}."
            formatter.write(f"\n{fill(text, formatter.width, break_on_hyphens=False)}\n")

    def plain_usage(piece: str) -> str:
        argument = _ARGUMENT.fullmatch(piece)
        if argument is None:
            return piece
        name = argument[1].upper()
        return (name if piece.startswith("{") else f"[{name}]") + ("..." if "..." in piece else "")

    command.format_options = plain_options
    command.collect_usage_pieces = lambda ctx: [plain_usage(piece) for piece in collect_usage_pieces(ctx)]


def _take_old_names(command: Any, names: Mapping[str, str]) -> None:
    parse = command.parse_args

    def renamed(word: str) -> str:
        name, equals, value = word.partition("=")
        return names.get(name, name) + equals + value

    def parsed(ctx: Any, words: list[str]) -> Any:
        words = [renamed(word) for word in words]
        given, _, order = command.make_parser(ctx).parse_args(list(words))
        _refuse_repeated(order)
        try:
            return parse(ctx, words)
        except typer.BadParameter as error:
            if found := _NOT_A_NUMBER.search(error.message):
                error.message = _about_a_number(given.get(getattr(error.param, "name", None)), found[1])
            raise

    command.parse_args = parsed


_NOT_A_NUMBER = re.compile("unable to parse string as an? (number|integer)")


def _refuse_repeated(order: list[Any]) -> None:
    """Raise UsageError if an option with one value is given twice, because all but the last would not count."""
    options = [each for each in order if each.param_type_name == "option"]
    single = [each for each in options if not (each.multiple or each.is_flag or each.count)]
    if repeated := [each for each in single if single.count(each) > 1]:
        raise UsageError(f"{repeated[0].opts[-1]} is given {single.count(repeated[0])} times: pass it once")


def _about_a_number(given: Any, kind: str) -> str:
    """The message about a value, or several, of which one is not a number."""
    values = [given] if isinstance(given, str) else [str(each) for each in given or ()]
    value = next((each for each in values if not _is_number(each, kind)), "the value")
    advice = ""
    if kind == "number" and re.fullmatch(r"[-+]?\d+,\d+", value):
        advice = f"; write a decimal point: {value.replace(',', '.')}"
    return f"'{value}' is not a {'whole ' if kind == 'integer' else ''}number{advice}"


def _is_number(text: str, kind: str) -> bool:
    try:
        (int if kind == "integer" else float)(text)
    except ValueError:
        return False
    return True


def _with_switches(command: Any, name: str) -> Any:
    """Give a command, or all of a group, the switches of all commands, and options their old and short names."""
    for sub_name, each in getattr(command, "commands", {}).items():
        _with_switches(each, f"{name} {sub_name}")
    _in_plain_words(command)
    _take_old_names(command, OLD_NAMES.get(name, {}))
    command.params += _options_of(_switches)
    if any(param.name == "out" and param.param_type_name == "argument" for param in command.params):
        command.params += _options_of(_out_without_its_name)
    for option in command.params:
        if "--out" in option.opts:
            option.opts = ["-o", *option.opts]
    return command


def _options_of(holder: Callable[..., None]) -> list[Any]:
    probe = typer.Typer(add_completion=False)
    probe.command()(holder)
    return list(typer.main.get_command(probe).params)


def _say_where_out_stands(ctx: typer.Context, folder: str | None) -> None:
    if folder is not None:
        raise typer.BadParameter(
            f"this command takes the folder as an argument: vislam2tag {ctx.command.name} {folder}"
        )


def _out_without_its_name(
    misplaced: Annotated[
        str | None, typer.Option("--out", callback=_say_where_out_stands, expose_value=False, hidden=True)
    ] = None,
) -> None:
    """Define ``--out`` for commands whose folder is an argument, to explain the mistake."""


def _show_log(wanted: bool) -> None:
    if wanted:
        import logging

        from vislam2tag.common.visible_text import VisibleFormatter

        shown = logging.StreamHandler()
        shown.setFormatter(VisibleFormatter("%(levelname)s %(message)s"))
        logging.basicConfig(level=logging.INFO, handlers=[shown], force=True)


def _hide_progress(wanted: bool) -> None:
    if wanted:
        hide_progress()


Verbose: TypeAlias = Annotated[
    bool,
    typer.Option("--verbose", "-v", callback=_show_log, expose_value=False, help="Print log messages and tracebacks."),
]
Quiet: TypeAlias = Annotated[
    bool, typer.Option("--quiet", "-q", callback=_hide_progress, expose_value=False, help="Hide progress bars.")
]


def _switches(verbose: Verbose = False, quiet: Quiet = False) -> None:
    """Define the options of all commands."""


app = typer.Typer(
    cls=_Commands,
    name="vislam2tag",
    help="Label Wi-Fi and sensor readings with the place where they were taken.",
    epilog="Run `vislam2tag COMMAND --help` for details and examples.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        commit = commit_of_package(Path(vislam2tag.__file__).parent)
        say(f"{vislam2tag.__version__} (commit {commit})" if commit else vislam2tag.__version__)
        raise typer.Exit


@app.callback()
def _options(
    version: bool = typer.Option(
        False, "--version", "-V", callback=_print_version, is_eager=True, help="Print the version and the commit."
    ),
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Define the options before a command."""


_DAMAGED_TABLE = "an input table is damaged; create it again or copy it again"


def main() -> None:
    """Run the command line; errors of ours end it with one message on standard error."""
    search_seldom()
    with native_output_last():
        _run()


def _run() -> None:
    try:
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGTERM, signal.default_int_handler)  # it ends as by Ctrl-C, with nothing left over
        app()
    except KeyboardInterrupt:
        say("interrupted", err=True)
        sys.exit(ExitCode.INTERRUPTED)
    except ModuleNotFoundError as error:
        if (needed := missing_extra(error)) is None:
            raise
        say(f"error: this {needed}", err=True)
        sys.exit(ExitCode.USAGE)
    except Vislam2tagError as error:
        say(f"error: {error}", err=True)
        sys.exit(code_of_error(error))
    except Exception as error:  # its traceback is logged, or shown here
        from vislam2tag.common.plugins import foreign_failure

        if said := foreign_failure(error) or _about_a_file(error) or _about_a_table(error):
            say(f"error: {said}", err=True)
            sys.exit(code_of_error(error))
        _print_unexpected(error)
        sys.exit(ExitCode.FAILURES)
    except BaseException as error:
        if type(error).__name__ != "PanicException":  # Polars', over damage that its own checks miss
            raise
        say(f"error: {_DAMAGED_TABLE}", err=True)
        sys.exit(ExitCode.USAGE)


def _about_a_file(error: Exception) -> str | None:
    """The operating system's message about a file; None for other errors."""
    if isinstance(error, OSError) and error.filename and error.strerror:
        return f"{error.filename}: {error.strerror}"
    if isinstance(error, OSError) and "(os error " in str(error):  # Polars', of a file that went while it was read
        return first_line(error)
    if isinstance(error, RuntimeError) and str(error).startswith("Symlink loop"):  # Path.resolve before Python 3.13
        return f"{error}: the symbolic links form a loop"
    if isinstance(error, RecursionError):
        return "an input is nested too deeply: folders within folders, or values within values"
    return None


def _about_a_table(error: Exception) -> str | None:
    """The message about a Parquet file that Polars cannot read; None for other errors."""
    if type(error).__name__ == "ComputeError" and type(error).__module__.startswith("polars"):
        return f"{_DAMAGED_TABLE} ({first_line(error)})"
    return None


def _print_unexpected(error: Exception) -> None:
    """Print an unexpected exception in one line, with its traceback unless a log file contains it."""
    import traceback

    from vislam2tag.pipeline.run.failures import log_of

    file = log_of(error)
    if file is None:
        say("".join(traceback.format_exception(error)), err=True)
    kept = "the traceback above" if file is None else file
    say(f"error: unexpected {type(error).__name__}: {error}; please report this with {kept}", err=True)
