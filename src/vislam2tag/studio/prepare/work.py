"""What takes long while a survey is prepared, done in a process of its own: planning, and making sheets."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
from typing import ParamSpec, TypeVar

from vislam2tag.common.errors import OutputError
from vislam2tag.pipeline.run.workers import worker_pool

_Asked = ParamSpec("_Asked")
_Answer = TypeVar("_Answer")


class Worker:
    """One process, which remembers the plans that it made; it is started with the first work. Used by many threads."""

    def __init__(self) -> None:
        """Start nothing yet."""
        self._running = ExitStack()
        self._pool: ProcessPoolExecutor | None = None
        self._start, self._turn = threading.Lock(), threading.Lock()
        self._latest = 0

    def close(self) -> None:
        """End the process."""
        with self._start:
            self._pool = None
            self._running.close()

    def do(self, work: Callable[_Asked, _Answer], *args: _Asked.args, **values: _Asked.kwargs) -> _Answer:
        """Call a module's function there; raises what that raises, OutputError where the process was ended."""
        with self._start:
            if self._pool is None:
                self._pool = self._running.enter_context(worker_pool(1))
            asked = self._pool.submit(work, *args, **values)
        try:
            return asked.result()
        except BrokenProcessPool:
            self.close()
            raise OutputError("the process that plans was ended from outside; try again") from None

    def do_latest(self, work: Callable[_Asked, _Answer], *args: _Asked.args, **values: _Asked.kwargs) -> _Answer:
        """The same, but only of the last that asked so while others waited; raises OutputError for the rest."""
        self._latest += 1
        mine = self._latest
        with self._turn:
            if mine != self._latest:
                raise OutputError("a later change of the plan has come meanwhile")
            return self.do(work, *args, **values)
