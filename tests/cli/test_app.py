from __future__ import annotations

import importlib
import io
import logging
import pkgutil
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import polars as pl
import pytest
import typer
from typer.testing import CliRunner

from tests.cli.command import the_error, vislam2tag
from tests.surveys import make_survey
from vislam2tag import cli
from vislam2tag.cli import terminal
from vislam2tag.cli.app import COMMANDS, MODULES, app

NAMES = [name for group in COMMANDS.values() for name in group]
OF_SITE = ("init", "show", "write", "rebase", "walkable")
HELPS = [("--help",), *((name, "--help") for name in NAMES), *(("site", name, "--help") for name in OF_SITE)]
AT_START = {
    *("typer", "annotated_doc", "shellingham", "click", "_sysconfigdata__linux_x86_64-linux-gnu"),
    *("pydantic", "pydantic_core", "annotated_types", "typing_extensions", "typing_inspection"),
}
"""What is loaded, besides Python's own modules and ours, before a command does anything."""


def others_loaded(code: str) -> set[str]:
    """Top-level packages that are neither Python's nor ours, loaded by ``code`` in a process of its own."""
    report = (
        f"import sys; before = set(sys.modules)\n{code}\n"
        "new = {name.split('.')[0] for name in set(sys.modules) - before} - set(sys.stdlib_module_names)\n"
        "new = {name for name in new if not name.startswith('_sysconfigdata_')}\n"
        "print(*(new - {'vislam2tag', '__mp_main__'}), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", report], capture_output=True, text=True, check=True)
    return set(done.stderr.split())


def test_every_module_of_commands_is_listed() -> None:
    modules = [module.name for module in pkgutil.walk_packages(cli.__path__) if module.name.startswith("commands_")]
    assert sorted(modules) == [f"commands_{name}" for name in MODULES]
    assert sorted(NAMES) == sorted(name for commands in MODULES.values() for name in commands)


def test_help_loads_nothing_that_only_work_needs() -> None:
    run = "from vislam2tag.cli.app import app\nfor words in {}:\n    app(words, standalone_mode=False)"
    assert others_loaded(run.format([*HELPS, ("--version",)])) <= AT_START
    assert others_loaded(run.format([("--help",), ("--version",)])) <= {
        "typer",
        "annotated_doc",
        "shellingham",
        "click",
    }


def test_the_interface_of_python_loads_what_is_asked_for_only() -> None:
    assert others_loaded("import vislam2tag.api") == set()


@pytest.mark.parametrize("words", HELPS, ids=" ".join)
def test_help_fits_80_columns(words: tuple[str, ...]) -> None:
    shown = CliRunner().invoke(app, words, terminal_width=80, max_content_width=80)
    assert shown.exit_code == 0
    assert [line for line in shown.stdout.splitlines() if len(line) > 80] == []
    assert "..." not in shown.stdout.partition("\nCommands:")[2], "no sentence is cut"
    assert "\nCommands:" in shown.stdout or "Example" in shown.stdout or words == ("--help",)
    assert ("--out" in shown.stdout) == ("-o, --out" in shown.stdout) or words[0] == "--help"
    assert re.findall(r"<[a-zA-Z].*|[{}]", shown.stdout) == [], "no types of Python, no marks of the parser"
    shown_ones = [option for option in command_of(words[:-1]).params if not getattr(option, "hidden", False)]
    names = {name for option in shown_ones for name in (*option.opts, *option.secondary_opts)}
    whole = set(re.findall(r"--?[a-z][a-z0-9-]*[a-z0-9]|-[a-zA-Z]\b", shown.stdout))
    assert {name for name in names if name.startswith("-")} - whole == set(), "no option's name is cut"


def command_of(words: tuple[str, ...]) -> Any:
    """The command or group that these words call."""
    command: Any = typer.main.get_command(app)
    for word in words:
        command = command.get_command(None, word)
    return command


def test_a_misspelt_command_is_told_what_it_may_mean() -> None:
    done = vislam2tag("proces", "--help")
    assert done.returncode == 2
    assert "No such command 'proces'. Did you mean 'process'" in done.stderr


def boom(*_: object, **__: object) -> None:
    raise ZeroDivisionError("by nothing")


def test_what_nobody_expected_is_one_line_that_names_its_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    survey = make_survey(tmp_path / "survey", devices=("LG",), seconds=5.0)
    for name in ("labels.process", "fleet.process"):  # imported later, they would keep what is replaced below
        importlib.import_module(f"vislam2tag.pipeline.{name}")
    monkeypatch.setattr("vislam2tag.pipeline.labels.process.jobs_of", boom)
    done = vislam2tag("process", survey, "--out", tmp_path / "out")
    log = tmp_path / "out" / "log.txt"
    assert the_error(done, 1) == f"error: unexpected ZeroDivisionError: by nothing; please report this with {log}"
    assert "boom" in log.read_text()
    monkeypatch.setattr("vislam2tag.api.inspect", boom)
    done = vislam2tag("inspect", survey)
    assert done.returncode == 1
    assert done.stderr.startswith("Traceback")
    assert done.stderr.endswith("ZeroDivisionError: by nothing; please report this with the traceback above\n")


class PanicException(BaseException):
    """As Polars raises."""


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (PermissionError(13, "Permission denied", "x.csv"), "error: x.csv: Permission denied"),
        (
            FileNotFoundError("No such file or directory (os error 2): x.parquet"),
            "error: No such file or directory (os error 2): x.parquet",
        ),
        (RuntimeError("Symlink loop from 'x'"), "error: Symlink loop from 'x': the symbolic links form a loop"),
        (
            RecursionError("maximum recursion depth exceeded"),
            "error: an input is nested too deeply: folders within folders, or values within values",
        ),
        (
            PanicException("assertion failed"),
            "error: an input table is damaged; create it again or copy it again",
        ),
        (
            pl.exceptions.ComputeError("parquet: invalid snappy data\nmore"),
            "error: an input table is damaged; create it again or copy it again (parquet: invalid snappy data)",
        ),
    ],
)
def test_what_is_wrong_with_files_is_one_line(
    error: BaseException, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr("vislam2tag.api.inspect", fails)
    assert the_error(vislam2tag("inspect", tmp_path)) == said


def test_verbose_shows_the_traceback_of_a_session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    survey = make_survey(tmp_path / "survey", devices=("LG",), seconds=5.0)
    monkeypatch.setattr("vislam2tag.pipeline.labels.check._check", boom)
    root = logging.getLogger()
    monkeypatch.setattr(root, "handlers", list(root.handlers))
    assert "Traceback" not in vislam2tag("check", survey, "--jobs", "1").stderr
    for words in (("-v", "check"), ("check", "--verbose")):
        monkeypatch.setattr(root, "handlers", [])
        said = vislam2tag(*words, survey, "--jobs", "1").stderr
        assert 'in boom\n    raise ZeroDivisionError("by nothing")' in said


class Terminal(io.StringIO):
    """A stream that says it is one."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("words", [("-q", "inspect"), ("inspect", "--quiet")])
def test_quiet_shows_no_progress(words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(terminal._shown, "progress", True)
    assert terminal.visible_console(stderr=True, file=Terminal()).is_terminal
    vislam2tag(*words, tmp_path)
    assert not terminal.visible_console(stderr=True, file=Terminal()).is_terminal


def test_the_version_has_a_short_name() -> None:
    assert vislam2tag("-V").stdout == vislam2tag("--version").stdout
