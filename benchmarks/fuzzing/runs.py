"""Runs something in processes of its own and judges it: what happened, and what must not happen, on damaged input."""

from __future__ import annotations

import io
import json
import os
import resource
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from vislam2tag.common.errors import Vislam2tagError

HANG_S = 60
"""Processor time that a run may take; on a busy machine it may wait ten times as long."""
MOST_MB = 2000
_LIMIT_BYTES = 8 << 30
"""Of a run's own memory, so that one that takes too much fails, not the machine."""
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


def run_apart(works: Sequence[Callable[[], object]], codes: Sequence[int], scratch: Path) -> Iterator[Outcome]:
    """Run one after the other in a forked process, in a further one after each that ends it or takes too much memory.

    ``codes`` are the exit codes that a run may end with by itself; ``scratch`` is an empty folder. The calling process
    must not use Polars, whose threads a fork does not take along.
    """
    notes = scratch / "ended.jsonl"
    done = 0
    while done < len(works):
        child = os.fork()
        if not child:
            _run_all(works, done, scratch)
        status = os.waitpid(child, 0)[1]
        lines = notes.read_text().splitlines() if notes.exists() else []
        for number in range(done, len(lines)):
            code, seconds, megabytes = json.loads(lines[number])
            said = _said(scratch, number)
            yield Outcome(_fault(code, codes, said, megabytes), said, seconds, megabytes)
        done = len(lines)
        if os.WIFSIGNALED(status):
            number = signal.Signals(os.WTERMSIG(status))
            hangs = number in (signal.SIGPROF, signal.SIGKILL, signal.SIGALRM)
            yield Outcome("hangs" if hangs else f"ends by {number.name}", _said(scratch, done), 0.0, 0.0)
            with notes.open("a") as file:
                file.write("[0, 0, 0]\n")
            done += 1


def _run_all(works: Sequence[Callable[[], object]], first: int, scratch: Path) -> NoReturn:
    """In the child: run what is left, and note how each ended."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_DATA, (_LIMIT_BYTES, _LIMIT_BYTES))
    for stream in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    for number in range(first, len(works)):
        begun = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, HANG_S)
        signal.alarm(10 * HANG_S)
        code = _code_of(works[number], scratch / f"{number}.txt")
        used = (
            resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
            resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss,
        )
        megabytes = max(used) / 1000
        with (scratch / "ended.jsonl").open("a") as file:
            file.write(json.dumps([code, time.process_time() - begun, megabytes]) + "\n")
        if megabytes > MOST_MB:
            break
    os._exit(0)


def _code_of(work: Callable[[], object], output: Path) -> int:
    """Do the work with all that it prints in a file, and return the code that a command would end with."""
    handle = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    for stream in (1, 2):
        os.dup2(handle, stream)
    os.close(handle)
    sys.stdout, sys.stderr = (io.TextIOWrapper(os.fdopen(stream, "wb", closefd=False)) for stream in (1, 2))
    try:
        work()
        code = 0
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else 0
    except (Vislam2tagError, OSError) as error:
        code = 0 if "\n" not in str(error) or not isinstance(error, Vislam2tagError) else _FAULT
    except BaseException:
        traceback.print_exc()
        code = _FAULT
    sys.stdout.flush()
    sys.stderr.flush()
    return code


def _said(scratch: Path, number: int) -> str:
    output = scratch / f"{number}.txt"
    return output.read_text(encoding="utf-8", errors="replace") if output.exists() else ""


def _fault(code: int, codes: Sequence[int], text: str, megabytes: float) -> str:
    if found := next((words for words in _WORDS if words in text), None):
        return f"says '{found.strip()}'"
    if code not in codes:
        return f"ends with {code}"
    if code == 2 and "rror" not in text:
        return "ends with 2 without a message"
    if megabytes > MOST_MB:
        return f"takes {megabytes:.0f} MB"
    return ""
