"""Sessions in parallel: worker processes that use one core each and never outlive the main process."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent import futures
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from functools import partial
from itertools import chain, islice
from logging import LogRecord
from multiprocessing.connection import wait
from threading import RLock
from typing import Any, Generic, Protocol, TypeAlias, TypeVar

from threadpoolctl import threadpool_limits

from vislam2tag.common.errors import OutputError
from vislam2tag.common.garbage import keep_freed_memory, search_seldom
from vislam2tag.common.progress import Progress, silent
from vislam2tag.pipeline.run.failures import LogInOrder, log_again, recorded

_Job = TypeVar("_Job")
_Outcome = TypeVar("_Outcome")


Report: TypeAlias = Callable[[_Outcome], Iterable[_Job] | None]
"""Called with each outcome; returns the jobs that follow from it, if any."""
Worked: TypeAlias = tuple[_Outcome, list[LogRecord]]
"""A job's outcome and its log records, which are not logged yet."""
_Made = TypeVar("_Made", covariant=True)
_ONE_COMPUTES = RLock()


class Job(ABC, Generic[_Made]):
    """A job with three steps: it is opened with its files, computes, and is closed, which stores its results.

    A process opens and closes several jobs at once and computes one. ``code`` is the key of the source in the process
    that created it.
    """

    code: str

    @property
    @abstractmethod
    def slug(self) -> str:
        """Name of its tasks."""

    @property
    def waits(self) -> bool:
        """Whether opening or closing it waits for a store."""
        return False

    @abstractmethod
    def code_here(self) -> str:
        """Key of the source that would work at it in this process."""

    @abstractmethod
    def opened(self) -> AbstractContextManager[Callable[[], _Made]]:
        """Provide its files during the block; yields the function that computes its outcome."""

    @abstractmethod
    def given_up(self, error: str) -> _Made:
        """End it for an external cause."""


def run_job(job: Job[_Outcome]) -> _Outcome:
    """Do a complete job; executors call this for all jobs."""
    with job.opened() as compute, _ONE_COMPUTES, threadpool_limits(limits=1):
        return compute()


def worked(work: Callable[[_Job], _Outcome], job: _Job, *, limited: bool = False) -> Worked[_Outcome]:
    """Process a job. Only one thread of a process computes, because log and linear algebra belong to the process.

    ``limited``: libraries compute in one thread, because their number of threads changes the last digits of sums.
    """
    opened = job.opened() if work is run_job and isinstance(job, Job) else nullcontext(partial(work, job))
    with opened as compute, _ONE_COMPUTES, threadpool_limits(limits=1) if limited else nullcontext():
        return recorded(compute)


class Executor(Protocol):
    """Runs a module's function on all jobs, and reports each as it ends."""

    def __call__(self, work: Callable[[Any], Any], todo: Iterable[Any], *, report: Report[Any, Any]) -> None:
        """Process all of ``todo``, which is only consumed as jobs are handed out; raises errors of the work."""
        ...


def outcomes_of(
    run_all: Executor, work: Callable[[Any], _Outcome], todo: Sequence[Any], progress: Progress[_Outcome] = silent
) -> list[_Outcome]:
    """Run a module's function on all of ``todo``; return the outcomes in the order in which jobs ended."""
    found: list[_Outcome] = []

    def keep(outcome: _Outcome) -> None:
        found.append(outcome)
        progress(outcome, len(todo))

    run_all(work, todo, report=keep)
    return found


class Supply(Generic[_Job]):
    """Waiting jobs with their numbers: returned and follow-up jobs first, then the rest."""

    def __init__(self, todo: Iterable[_Job]) -> None:
        self._rest = iter(todo)
        self._first: deque[tuple[int, _Job]] = deque()
        self._numbered = 0

    def take(self) -> tuple[int, _Job] | None:
        """The next job; None if none waits now."""
        if self._first:
            return self._first.popleft()
        return next(((self._number(), job) for job in self._rest), None)

    def take_some(self, most: int) -> list[tuple[int, _Job]]:
        """The next jobs, at most ``most``."""
        return [taken for taken in (self.take() for _ in range(most)) if taken is not None]

    def give_back(self, number: int, job: _Job) -> None:
        """Let a job wait again, before all others."""
        self._first.appendleft((number, job))

    def follow(self, jobs: Iterable[_Job] | None) -> None:
        """Add the follow-up jobs of a finished one."""
        self._first.extend((self._number(), job) for job in jobs or ())

    def _number(self) -> int:
        self._numbered += 1
        return self._numbered - 1


AHEAD = 2
"""Sessions handed to each worker ahead of time, so that none waits while this process computes."""
BESIDE = 3
"""Open jobs of a single process that waits for a store: one begins, one computes, one ends."""
STOP_S = 0.1
"""Interval for checking whether to stop."""


def process_all(
    work: Callable[[_Job], _Outcome], todo: Iterable[_Job], workers: int, report: Report[_Outcome, _Job]
) -> None:
    """Run a module's function on all sessions in ``workers`` processes, including this one, and report each as it ends.

    Each process does its linear algebra in one thread: the matrices are small, and the number of threads changes the
    last digits of sums. Logs of the work are logged here, in the order of ``todo``. Raises errors of the work, and
    OutputError if a worker is killed. After any error or interrupt, the other processes have ended.
    """
    log, rest = LogInOrder(), iter(todo)
    first = list(islice(rest, workers))
    supply = Supply(chain(first, rest))
    try:
        with ExitStack() as stack:
            stack.enter_context(threadpool_limits(limits=1))
            pool, ahead = _pool_for(work, first, stack)
            for number, (outcome, records) in _outcomes(work, supply, pool, ahead):
                log.add(number, records)
                supply.follow(report(outcome))
    except BrokenProcessPool as error:
        raise OutputError(
            "a worker process was killed (maybe out of memory); run the same command again with a smaller --jobs"
        ) from error
    finally:
        log.close()


def _pool_for(work: object, first: list[_Job], stack: ExitStack) -> tuple[futures.Executor | None, int]:
    """Workers besides this process, and their number of jobs in advance: threads for jobs that wait for a store."""
    if len(first) > 1:
        return stack.enter_context(worker_pool(len(first) - 1)), AHEAD * (len(first) - 1)
    if work is run_job and any(isinstance(job, Job) and job.waits for job in first):
        threads = ThreadPoolExecutor(BESIDE, thread_name_prefix="jobs")
        stack.callback(threads.shutdown, cancel_futures=True)  # after an error they are given no more to do
        return threads, BESIDE
    return None, 0


def _outcomes(
    work: Callable[[_Job], _Outcome], supply: Supply[_Job], pool: futures.Executor | None, ahead: int
) -> Iterator[tuple[int, Worked[_Outcome]]]:
    """Keep the pool supplied, and process the next session here meanwhile, unless threads of this process do all.

    Yields each job's number and outcome as it ends.
    """
    running: dict[Future[Worked[_Outcome]], int] = {}
    here = not isinstance(pool, ThreadPoolExecutor)
    while True:
        if pool is not None:
            taken = supply.take_some(ahead - len(running))
            with _interrupts_held_back():
                running |= {pool.submit(worked, work, job): number for number, job in taken}
        mine = supply.take() if here else None
        if mine is not None:
            yield mine[0], worked(work, mine[1])
        elif not running:
            return
        ended, _ = futures.wait(running, timeout=None if mine is None else 0, return_when=FIRST_COMPLETED)
        yield from ((running.pop(future), future.result()) for future in ended)


def done_in(
    pool: ProcessPoolExecutor, work: Callable[[_Job], _Outcome], todo: list[_Job], stopped: Callable[[], bool]
) -> Iterator[_Outcome]:
    """Run a module's function on all jobs in a pool only; yield each outcome as it ends.

    Its logs are logged here. Once ``stopped`` is true, jobs that have not begun are skipped. Raises OutputError if a
    worker is killed; the pool cannot be used after that.
    """
    waiting = {pool.submit(worked, work, job) for job in todo}
    try:
        while waiting:
            ended, waiting = futures.wait(waiting, timeout=STOP_S, return_when=FIRST_COMPLETED)
            for future in ended:
                outcome, records = future.result()
                log_again(records)
                yield outcome
            if stopped():
                waiting -= {future for future in waiting if future.cancel()}
    except BrokenProcessPool as error:
        raise OutputError("a worker process was killed (maybe out of memory); start again") from error
    finally:
        for future in waiting:
            future.cancel()


@contextmanager
def worker_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
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
    """Delay interrupts until the block ends.

    Processes started meanwhile ignore interrupts, because one during the imports of a worker would end it with a
    traceback.
    """
    came: list[int] = []
    here = threading.current_thread() is threading.main_thread()
    handler = signal.signal(signal.SIGINT, lambda number, _: came.append(number)) if here else None
    masks = hasattr(signal, "pthread_sigmask")  # not on Windows; unlike a handler, a mask is inherited
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if masks else set()
    try:
        yield
    finally:
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if here:
            signal.signal(signal.SIGINT, handler)
    if came and callable(handler):
        handler(came[0], None)


def _start_worker() -> None:
    """Compute in one thread, leave interrupts to the main process, and end as soon as that dies."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    search_seldom()
    keep_freed_memory()
    threadpool_limits(limits=1)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
