"""Runs the command line as its users do: most often here, where it is under test as a process of its own."""

from __future__ import annotations

import io
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from subprocess import CompletedProcess
from unittest.mock import patch

from vislam2tag.cli import main


def vislam2tag(*arguments: str | Path) -> CompletedProcess[str]:
    """Run a command to its end in this process; what is no error of ours is raised."""
    command = ["vislam2tag", *map(str, arguments)]
    out, error = io.StringIO(), io.StringIO()
    code: int | str | None = 0
    with redirect_stdout(out), redirect_stderr(error), patch.object(sys, "argv", command):
        try:
            main()
        except SystemExit as end:
            code = end.code
    assert isinstance(code, int)
    return CompletedProcess(command, code, out.getvalue(), error.getvalue())


def vislam2tag_process(*arguments: str | Path, before: Callable[[], None] | None = None) -> CompletedProcess[str]:
    """Run a command to its end in a process of its own, where ``before`` is called first."""
    command = [sys.executable, "-m", "vislam2tag", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=600, check=False, preexec_fn=before)


def the_error(done: CompletedProcess[str], code: int = 2) -> str:
    """The one line on standard error of a command that ended with ``code``."""
    assert done.returncode == code, (done.stdout, done.stderr)
    assert done.stdout == ""
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    return lines[0]
