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

    Raises OutputError where the output folder cannot be written or a worker is ended from outside. Whatever is raised,
    an interrupt included, the workers are gone then.
    """
    report = progress or _silent
    if workers <= 1:
        for job in todo:
            report(process_session(job), len(todo))
        return
    with _pool(min(workers, max(len(todo), 1))) as pool:
        with _interrupts_held_back():
            futures: list[Future[Outcome]] = [pool.submit(process_session, job) for job in todo]
        try:
            for future in as_completed(futures):
                report(future.result(), len(todo))
        except BrokenProcessPool as error:
            raise OutputError(
                "a worker process was ended from outside (out of memory?); "
                "run again with fewer --jobs, what is done is kept"
            ) from error


def _silent(_outcome: Outcome, _total: int) -> None:
    """Report nothing."""


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Worker processes of one thread each, so that they do not compete for the cores; ended at once on errors."""
    before = os.environ.get("POLARS_MAX_THREADS")
    os.environ["POLARS_MAX_THREADS"] = "1"
    others = set(multiprocessing.active_children())
    try:
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(workers, mp_context=context, initializer=_start_worker) as pool:
            try:
                yield pool
            except BaseException:
                for worker in set(multiprocessing.active_children()) - others:
                    worker.terminate()
                raise
    finally:
        if before is None:
            del os.environ["POLARS_MAX_THREADS"]
        else:
            os.environ["POLARS_MAX_THREADS"] = before


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Let an interrupt wait until this is over.

    Processes started meanwhile hold interrupts back for good, as they must: one that comes while a worker is still
    importing would end it with a traceback.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _start_worker() -> None:
    """End at once when the main process dies (it may be killed)."""
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
