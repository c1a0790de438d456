"""Runs the command line as its users do: as a process of its own."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path


def vislam2tag(*arguments: str | Path, before: Callable[[], None] | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command to its end; ``before`` is called in its process first."""
    command = [sys.executable, "-m", "vislam2tag", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, preexec_fn=before)


def the_error(done: subprocess.CompletedProcess[str], code: int = 2) -> str:
    """The one line on standard error of a command that ended with ``code``."""
    assert done.returncode == code, (done.stdout, done.stderr)
    assert done.stdout == ""
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    return lines[0]
