"""Commands that a signal strikes at a given step of what they write, never at a time."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from subprocess import CompletedProcess
from tempfile import TemporaryFile

import psutil
import pytest
from _pytest.mark.structures import ParameterSet

ROOT = str(Path(__file__).parents[1])
HUNG_S = 300.0
"""What has not ended after so long never will."""
WATCHED = """
import os, signal, sys
from pathlib import Path
from tests.watched import watched
folder, text, step, sent = sys.argv[1:5]
sys.argv[:5] = ["vislam2tag"]
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job starts deaf to it

def strike(seen):
    if seen == int(step):
        os.killpg(0, signal.SIGINT) if int(sent) == signal.SIGINT else os.kill(os.getpid(), int(sent))

watching = watched(Path(folder), text, strike)  # kept, else it ends
watch = watching.__enter__()
"""
MAIN = "from vislam2tag.cli import main\nmain()\n"


@dataclass(frozen=True)
class Strike:
    """A signal that comes just before the ``step``-th file is opened for writing, made, renamed, linked or removed.

    Counted are those that the main process touches below the output folder, with ``text`` in their path. As a terminal
    does, SIGINT reaches all processes of the command; any other only the main one.
    """

    step: int
    text: str = ""
    sent: signal.Signals = signal.SIGKILL


def struck(out: Path, strike: Strike, *arguments: str | Path, main: str = MAIN) -> CompletedProcess[str]:
    """Run the program ``main``, which writes to ``out``, until it is struck; none of its processes is left then."""
    watched = [str(out), strike.text, str(strike.step), str(int(strike.sent))]
    command = [sys.executable, "-c", WATCHED + main, *watched, *map(str, arguments)]
    with TemporaryFile("w+") as stdout, TemporaryFile("w+") as stderr:
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join([ROOT, *filter(None, [os.environ.get("PYTHONPATH")])]),
        }
        with subprocess.Popen(
            command, stdout=stdout, stderr=stderr, start_new_session=True, env=environment
        ) as process:
            code = process.wait(HUNG_S)
        _, alive = psutil.wait_procs(list(_of_session(process.pid)), timeout=HUNG_S)
        assert not alive, "worker processes outlived the main process"
        stdout.seek(0)
        stderr.seek(0)
        return CompletedProcess(command, code, stdout.read(), stderr.read())


def _of_session(leader: int) -> Iterator[psutil.Process]:
    """Processes of the session that a process began."""
    for process in psutil.process_iter():
        with suppress(ProcessLookupError, PermissionError):
            if os.getsid(process.pid) == leader:
                yield process


def moments(count: int) -> list[ParameterSet]:
    """Numbers 1 to ``count`` of moments spread over a run; all but the middle and the last one are for the campaign."""
    quick = (count // 2 + 1, count)
    return [pytest.param(n, marks=() if n in quick else pytest.mark.campaign) for n in range(1, count + 1)]
