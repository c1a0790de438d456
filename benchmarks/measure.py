"""Running the command line and watching the time and memory it takes."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, ParamSpec

import psutil

SAMPLING_S = 0.02
UNIQUE_EVERY = 10
"""Unique memory is looked at this much less often: the system has to walk all pages for it."""


ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
"""An installed program has its bytecode; without it every process would compile it anew."""

_Arguments = ParamSpec("_Arguments")


class Measured(NamedTuple):
    """Memory that a call needed: all child processes together, at its peak."""

    resident_mb: float
    """What several processes share is counted for each."""
    unique_mb: float
    """What each process has to itself."""


def vislam2tag(*arguments: str) -> None:
    """Run the command line in a process of its own; raises CalledProcessError where it fails.

    Short walks may pass too few landmarks to be mapped, which is exit code 1 and no failure here.
    """
    command = [sys.executable, "-m", "vislam2tag", *arguments]
    done = subprocess.run(command, check=False, capture_output=True, env=ENVIRONMENT)
    if done.returncode not in (0, 1):
        raise subprocess.CalledProcessError(done.returncode, command, done.stdout, done.stderr)


def process(survey: Path, out: Path, jobs: int = 2, strategy: str = "smoother") -> None:
    """Process a survey into a new folder."""
    shutil.rmtree(out, ignore_errors=True)
    vislam2tag("process", str(survey), "--out", str(out), "--jobs", str(jobs), "--strategy", strategy)


def seconds(work: Callable[_Arguments, None], *args: _Arguments.args, **kwargs: _Arguments.kwargs) -> float:
    """Seconds that a call takes, with nobody watching."""
    start = time.perf_counter()
    work(*args, **kwargs)
    return time.perf_counter() - start


def watched(work: Callable[_Arguments, None], *args: _Arguments.args, **kwargs: _Arguments.kwargs) -> Measured:
    """Peak memory of a call that runs subprocesses (watching costs time, so its time means nothing)."""
    peak = PeakMemory()
    with peak:
        work(*args, **kwargs)
    return Measured(peak.megabytes, peak.unique_megabytes)


class PeakMemory:
    """Samples the memory of all child processes together, in a thread."""

    def __init__(self) -> None:
        self.megabytes = 0.0
        self.unique_megabytes = 0.0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch)

    def __enter__(self) -> PeakMemory:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _watch(self) -> None:
        sample = 0
        while not self._stop.wait(SAMPLING_S):
            children = psutil.Process().children(recursive=True)
            self.megabytes = max(self.megabytes, sum(map(_resident, children)) / 1e6)
            if sample % UNIQUE_EVERY == 0:
                self.unique_megabytes = max(self.unique_megabytes, sum(map(_unique, children)) / 1e6)
            sample += 1


def _resident(process: psutil.Process) -> int:
    try:
        return int(process.memory_info().rss)
    except psutil.Error:
        return 0


def _unique(process: psutil.Process) -> int:
    try:
        return int(process.memory_full_info().uss)
    except psutil.Error:
        return 0
