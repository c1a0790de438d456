"""Runs a command as its user would, now and then with an odd option, or as a process of its own."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import typer

from fuzzing.mutations import ODD_VALUES
from fuzzing.runs import HANG_S
from fuzzing.targets import Run
from vislam2tag.cli import main
from vislam2tag.cli.app import app
from vislam2tag.common.files.toml_file import toml_value
from vislam2tag.settings import part_of, setting_fields

_ODD_SHARE = 0.15
"""Of all runs, which have one odd option more."""
_APART_SHARE = 0.01
"""Which are a process of their own from the start, not one forked from this that has everything imported."""
_KEPT = {"out", "jobs", "host", "port", "seeds", "measure", "click", "write", "help", "config", "replace"}
"""Options that are left as they are: they ask for much work, a server, a browser or another place."""
_NUMBERS = ("nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "-1", "0", "1", "2.5", "9" * 20, "x", "", "0x7f", "１")
_TEXTS = ("", "x", "-", "é" * 300, "[1]*?", "../x", "1e400", "nan", "a,b", "1,2", "1=2", "a\nb", "\x1b[31m", "\udcff")


def cli(*arguments: str | Path) -> None:
    """Run a command in this process; raises SystemExit with its code."""
    sys.argv = ["vislam2tag", *map(str, arguments)]
    main()


def invoke(line: str, run: Run) -> None:
    """Run a command line, ``{base}``, ``{all}``, ``{out}`` and ``{walk}`` in it for folders; ends as :func:`cli`."""
    folders = {"base": run.base, "all": run.bases, "out": run.out, "walk": first_walk(run.base)}
    arguments = [part.format(**folders) for part in line.split()]
    if run.rng.random() < _ODD_SHARE:
        arguments += odd_option(arguments, run)
        print("with", *map(ascii, arguments[len(line.split()) :]), flush=True)
    if run.rng.random() < _APART_SHARE:
        _apart(arguments)
    cli(*arguments)


def first_walk(survey: Path) -> Path:
    """The folder of a survey's first walk; one that is not there where it has none."""
    return min(survey.glob("floor_0/*/*/"), default=survey / "gone")


def _apart(arguments: list[str]) -> None:
    ended = subprocess.run(
        [sys.executable, "-m", "vislam2tag", *arguments],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (HANG_S, HANG_S)),
        check=False,
    )
    if ended.returncode < 0:
        os.kill(os.getpid(), signal.SIGKILL if ended.returncode == -signal.SIGXCPU else -ended.returncode)
    raise SystemExit(ended.returncode)


def odd_option(arguments: list[str], run: Run) -> list[str]:
    """An option of the command with a value that few would give; a file of settings most of the time."""
    command = _command_of(arguments)
    options = [each for each in command.params if each.param_type_name == "option"]
    if any(each.name == "config" for each in options) and run.rng.random() < 0.6:
        return ["--config", str(_odd_settings(run))]
    options = [each for each in options if each.name not in _KEPT and each.name.isidentifier()]
    option = options[run.rng.integers(len(options))]
    name = option.opts[-1]
    if option.is_flag:
        return [name]
    return [name, *(_odd_value(run) for _ in range(option.nargs))]


def _command_of(arguments: list[str]) -> Any:
    context: Any = None  # of Typer's own or Click's class, by version
    command: Any = typer.main.get_group(app)
    for name in arguments:
        if not hasattr(command, "get_command"):
            break
        command = command.get_command(context, name)
    return command


def _odd_value(run: Run) -> str:
    """Of any type: which one an option takes is told differently by the versions of Typer."""
    files = sorted(path for path in run.bases.glob("small/*/*") if path.is_file())
    places = ("/dev/null", "/dev/zero", "nowhere", str(run.base), str(run.out), *map(str, files))
    return _picked((_NUMBERS, _NUMBERS, _TEXTS, places)[run.rng.integers(4)], run.rng)


def _odd_settings(run: Run) -> Path:
    """A file with one to three settings of other values, types or sizes."""
    names = [name for name, field in setting_fields() if part_of(field) is None]
    file = run.out / "settings.toml"
    lines = []
    for name in run.rng.choice(names, size=int(run.rng.integers(1, 4)), replace=False):
        odd = ODD_VALUES[run.rng.integers(len(ODD_VALUES))]
        number = _picked(("nan", "inf", "-inf", "1e308", "1e-308", "-1.0", "0", "0.001", "3", "1000000"), run.rng)
        lines.append(f"{name} = {number if odd is None or run.rng.random() < 0.6 else toml_value(odd)}")
    file.write_text("\n".join(lines), encoding="utf-8")
    print(*map(ascii, lines), flush=True)
    return file


def _picked(values: tuple[str, ...], rng: np.random.Generator) -> str:
    return values[rng.integers(len(values))]
