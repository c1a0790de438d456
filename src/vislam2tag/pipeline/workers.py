"""Sessions in parallel: worker processes that use one core each and never outlive the main process."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.connection import wait

from vislam2tag.errors import OutputError
from vislam2tag.pipeline.session import Job, Outcome, process_session

Progress = Callable[[Outcome, int], None]
"""Called after each session with its outcome and the total number of sessions."""


def process_all(todo: list[Job], workers: int, progress: Progress | None) -> None:
    """Process all sessions in ``workers`` processes (in this one for 1), reporting each as it ends.

    Raises OutputError where the output folder cannot be written or a worker is ended from outside.
    """
    report = progress or _silent
    if workers <= 1:
        for job in todo:
            report(process_session(job), len(todo))
        return
    with _pool(min(workers, max(len(todo), 1))) as pool:
        futures: list[Future[Outcome]] = [pool.submit(process_session, job) for job in todo]
        try:
            for future in as_completed(futures):
                report(future.result(), len(todo))
        except BrokenProcessPool as error:
            raise OutputError(
                "a worker process was ended from outside (out of memory?); "
                "run again with fewer --jobs, what is done is kept"
            ) from error
        finally:
            for future in futures:
                future.cancel()


def _silent(_outcome: Outcome, _total: int) -> None:
    """Report nothing."""


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Worker processes of one thread each, so that they do not compete for the cores."""
    before = os.environ.get("POLARS_MAX_THREADS")
    os.environ["POLARS_MAX_THREADS"] = "1"
    try:
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(workers, mp_context=context, initializer=_start_worker) as pool:
            yield pool
    finally:
        if before is None:
            del os.environ["POLARS_MAX_THREADS"]
        else:
            os.environ["POLARS_MAX_THREADS"] = before


def _start_worker() -> None:
    """Leave interrupts to the main process, and end at once when it dies (it may be killed)."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
