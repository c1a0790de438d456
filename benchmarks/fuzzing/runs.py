"""One run: a child process with limits does what a target says with a damaged copy; what must not happen is told."""

from __future__ import annotations

import io
import os
import resource
import signal
import sys
import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.errors import Vislam2tagError

HANG_S = 60
"""Processor time that a run may take; on a busy machine it may wait ten times as long."""
MOST_MB = 2000
_FAULT = 3
_WORDS = ("Traceback (most recent", "unexpected ", "please report", "panicked at", "Segmentation fault")
"""What no output holds, whatever the input."""


@dataclass(frozen=True)
class Outcome:
    """How a run ended: nothing wrong, or what."""

    fault: str
    output: str
    seconds: float
    megabytes: float


def run_apart(work: Callable[[], object], codes: Iterable[int], output: Path) -> Outcome:
    """Run something in a forked process; ``codes`` are the exit codes that it may end with by itself."""
    child = os.fork()
    if not child:
        _work(work, output)
    _, status, used = os.wait4(child, 0)
    text = output.read_text(encoding="utf-8", errors="replace")
    megabytes = used.ru_maxrss / 1000
    seconds = used.ru_utime + used.ru_stime
    return Outcome(_fault(status, set(codes), text, megabytes), text, seconds, megabytes)


def _work(work: Callable[[], object], output: Path) -> None:
    """Do the work in this child and end it; never returns."""
    handle = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    for stream in (1, 2):
        os.dup2(handle, stream)
    sys.stdout, sys.stderr = (io.TextIOWrapper(os.fdopen(stream, "wb", closefd=False)) for stream in (1, 2))
    resource.setrlimit(resource.RLIMIT_CPU, (HANG_S, HANG_S + 5))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.alarm(10 * HANG_S)
    code = _FAULT
    try:
        work()
        code = 0
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else 0
    except (Vislam2tagError, OSError) as error:
        code = 0 if "\n" not in str(error) or not isinstance(error, Vislam2tagError) else _FAULT
    except BaseException:
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def _fault(status: int, codes: set[int], text: str, megabytes: float) -> str:
    if os.WIFSIGNALED(status):
        number = signal.Signals(os.WTERMSIG(status))
        return "hangs" if number in (signal.SIGXCPU, signal.SIGKILL, signal.SIGALRM) else f"ends by {number.name}"
    if found := next((words for words in _WORDS if words in text), None):
        return f"says '{found.strip()}'"
    if os.WEXITSTATUS(status) not in codes:
        return f"ends with {os.WEXITSTATUS(status)}"
    if megabytes > MOST_MB:
        return f"takes {megabytes:.0f} MB"
    return ""
