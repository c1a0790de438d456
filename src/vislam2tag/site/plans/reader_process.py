"""Plans are read in a process of its own, with limits: what a damaged or hostile drawing does there is one message.

The libraries that read drawings recurse, loop and allocate as a file makes them. One child serves all plans of a
command; small images, whose reader has limits of its own, are read here.
"""

from __future__ import annotations

import atexit
import math
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO, ParamSpec, TypeVar, cast

from PIL import Image

from vislam2tag.common.errors import first_line
from vislam2tag.site.plans.drawing import FORMATS

CPU_S = 20
"""Processor time that reading one plan may take, seconds."""
WALL_S = 120.0
"""Time that it may take in all on a busy machine, seconds; without a limit of processor time (Windows) too."""
MEMORY_BYTES = 1_000_000_000
"""Memory that reading one plan may take (Linux)."""
MOST_BYTES = 200_000_000
"""Of a plan's file."""
READ_HERE_PIXELS = 25_000_000
"""Images up to this size are decoded in this process: 100 MB, and a second at most."""
_START_S = 120.0
_IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".gif", ".webp")
_BOOT = "import pickle, sys; sys.path[:] = pickle.load(sys.stdin.buffer); from {0} import serve; serve()"
Answer = tuple[str | None, object]
"""Why a plan cannot be read, None if it can, and what was read."""
P = ParamSpec("P")
R = TypeVar("R")


def read_guarded(path: Path, function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
    """Return what a module's function reads of a plan's file.

    Raises OSError, whose text completes a sentence about the file, for whatever reading it leads to.
    """
    if path.is_file() and path.stat().st_size > MOST_BYTES:
        raise OSError(f"is larger than {MOST_BYTES // 1_000_000} MB; make a smaller one")
    if _is_small_image(path):
        failure, value = _answer(function, args, kwargs)
    else:
        request = pickle.dumps((CPU_S, str(Path.cwd()), function, args, kwargs))
        asked = (request, path.stat().st_mtime_ns if path.is_file() else None)
        failure, value = (_refused[asked], None) if asked in _refused else _child.answer(request)
        if failure is not None and path.is_file():
            _refused[asked] = failure
    if failure is not None:
        raise OSError(failure)
    return cast(R, value)


def _is_small_image(path: Path) -> bool:
    if path.suffix.lower() not in _IMAGE_SUFFIXES or not path.is_file():
        return False
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(path) as image:
                return image.width * image.height <= READ_HERE_PIXELS
    except Exception:  # the reader reports the error
        return True


class _Child:
    """The process that reads, started when it is first needed and again when a plan ended it."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._owner = 0
        self._one_at_a_time = threading.Lock()

    def answer(self, request: bytes) -> Answer:
        """Let it answer a request."""
        with self._one_at_a_time:
            process = self._running()
            if process is None:
                return "cannot be read, because the process that reads plans does not start", None
            answer: Answer | None = _exchange(process, request, WALL_S)
            return (_cause(self.end()), None) if answer is None else answer

    def end(self) -> int:
        """End the child, where this process has one; returns its exit code."""
        process, self._process = self._process, None
        if process is None or self._owner != os.getpid():
            return 0
        with suppress(OSError), process:  # what it did not take any more is lost
            process.kill()
        return process.wait()

    def _running(self) -> subprocess.Popen[bytes] | None:
        if self._process is None or self._owner != os.getpid():
            threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
            command = [sys.executable, "-c", _BOOT.format(__name__)]
            pipes: dict[str, int] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
            self._process = subprocess.Popen(command, env={**os.environ, **threads}, **pipes)  # type: ignore[call-overload]
            self._owner = os.getpid()
            if _exchange(self._process, pickle.dumps(sys.path), _START_S) is None:
                self.end()
        return self._process


def _exchange(process: subprocess.Popen[bytes], request: bytes, limit_s: float) -> Any:
    """Send a request and wait for its answer; None where the process ended before, or had to be ended."""
    assert process.stdin is not None
    assert process.stdout is not None
    watchdog = threading.Timer(limit_s, process.kill)
    watchdog.daemon = True
    watchdog.start()
    try:
        process.stdin.write(request)
        process.stdin.flush()
        return pickle.load(process.stdout)  # noqa: S301 - of our own child
    except (EOFError, OSError, pickle.UnpicklingError):
        return None
    finally:
        watchdog.cancel()


def _cause(code: int) -> str:
    if code in (-getattr(signal, "SIGXCPU", 0), -getattr(signal, "SIGKILL", 0)):
        return f"takes longer than {CPU_S} s or too much memory to be read; make a simpler one"
    return "cannot be read, because its reader crashed: the file is damaged or nested too deep"


_child = _Child()
_refused: dict[tuple[bytes, int | None], str] = {}
"""Why a plan could not be read, by request and time of change: a command that draws it again does not wait again."""
atexit.register(_child.end)


def serve() -> None:
    """Answer the requests of a parent until it ends; the child's main function."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what libraries print is not an answer
    FORMATS.all()  # the modules of formats; that of the function is imported when the first request is unpickled
    _send(answers, "ready")
    while True:
        try:
            request = pickle.load(sys.stdin.buffer)  # noqa: S301 - of our own parent
        except EOFError:
            return
        cpu_s, folder, *call = request
        os.chdir(folder)  # the parent may have gone elsewhere since: paths may be relative
        _limit_resources(cpu_s)
        _send(answers, _answer(*call))


def _answer(function: Callable[..., object], args: tuple[object, ...], kwargs: dict[str, object]) -> Answer:
    try:
        return None, function(*args, **kwargs)
    except OSError as error:
        return str(error), None
    except MemoryError:
        return f"needs more than {MEMORY_BYTES / 1e9:g} GB of memory to be read; make a simpler one", None
    except RecursionError:
        return "is nested too deep to be read", None
    except Exception as error:  # readers of many formats, each with errors of its own
        return f"cannot be read ({type(error).__name__}: {first_line(error)})", None


def _send(answers: BinaryIO, answer: object) -> None:
    pickle.dump(answer, answers)
    answers.flush()


def _limit_resources(cpu_s: int) -> None:
    """Allow this process what one plan may take more than is taken already; does nothing where there are no limits."""
    try:
        import resource
    except ModuleNotFoundError:  # Windows
        return
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    _, hardest = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(time.process_time()) + cpu_s, hardest))
    pages = Path("/proc/self/statm")
    if pages.is_file():
        taken = int(pages.read_text().split()[0]) * resource.getpagesize()
        _, hardest = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (taken + MEMORY_BYTES, hardest))
