"""Work that waits for files before it computes and after it: one job's waiting is done beside another's computing."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from logging import LogRecord
from typing import Any, Generic, TypeAlias, TypeVar, cast

from vislam2tag.pipeline.run.failures import LOG, recorded

_Job = TypeVar("_Job")
_Outcome = TypeVar("_Outcome")
Steps: TypeAlias = Generator[None, None, _Outcome]
"""A job being done: it yields when it has its files, and again when it has computed; or ends before either."""
Worked: TypeAlias = tuple[_Outcome, list[LogRecord]]
"""A job's outcome and what it logged."""


@dataclass(frozen=True)
class InSteps(Generic[_Job, _Outcome]):
    """A module's generator function that works at a job in :data:`Steps`; called as a function, it does all of them."""

    steps: Callable[[_Job], Steps[_Outcome]]

    def __call__(self, job: _Job) -> _Outcome:
        """Work at a job from its first step to its last."""
        outcome, records = worked(self, job)
        for record in records:
            LOG.handle(record)
        return outcome


def worked(
    work: Callable[[_Job], _Outcome], job: _Job, alone: Callable[[], AbstractContextManager[object]] = nullcontext
) -> Worked[_Outcome]:
    """Work at a job; what it logs is not logged yet. Whoever computes holds what ``alone`` gives."""
    if not isinstance(work, InSteps):
        with alone():
            return recorded(work, job)
    begun = _Begun(0, work.steps(job))
    try:
        begun.step()
        with alone():
            begun.compute()
        return begun.step().result()
    finally:
        begun.steps.close()


def overlapped(
    work: InSteps[_Job, _Outcome], take: Callable[[], tuple[int, _Job] | None]
) -> Iterator[tuple[int, Worked[_Outcome]]]:
    """Do the jobs that ``take`` gives until it has none, computing one after the other in this thread.

    Meanwhile the next job is begun and the one before is ended, no more. Yields each one's number, outcome and what it
    logged, in order. Raises what the work raises.
    """
    now: _Begun[_Outcome] | None = None
    coming: _Begun[_Outcome] | None = None
    before: _Begun[_Outcome] | None = None
    threads = ThreadPoolExecutor(2, thread_name_prefix="steps")

    def begun() -> _Begun[_Outcome] | None:
        taken = take()
        return None if taken is None else _Begun(taken[0], work.steps(taken[1])).step_in(threads)

    try:
        while (now := coming or begun()) or before:
            coming = begun() if now else None
            if now:
                now.waiting.result()
                now.compute()
            if before:
                yield before.number, before.waiting.result().result()
            before = now and now.step_in(threads)
    finally:
        threads.shutdown(cancel_futures=True)
        for each in (now, coming, before):
            if each:
                each.steps.close()


@dataclass
class _Begun(Generic[_Outcome]):
    """A job that is being done."""

    number: int
    steps: Steps[_Outcome]
    waiting: Future[Any] = field(default_factory=Future)
    """For the step that a thread does; its result is this."""
    records: list[LogRecord] = field(default_factory=list)
    outcomes: list[_Outcome] = field(default_factory=list)
    """The job's one, once it has ended."""

    def step(self) -> _Begun[_Outcome]:
        """Do the next step, if there is one."""
        if not self.outcomes:
            try:
                next(self.steps)
            except StopIteration as end:
                self.outcomes.append(cast(_Outcome, end.value))
        return self

    def step_in(self, threads: ThreadPoolExecutor) -> _Begun[_Outcome]:
        """Let a thread do the next step."""
        self.waiting = threads.submit(self.step)
        return self

    def compute(self) -> None:
        """Do the next step, and keep what it logs."""
        _, records = recorded(lambda begun: begun.step(), self)
        self.records += records

    def result(self) -> Worked[_Outcome]:
        """What came of the job."""
        return self.outcomes[0], self.records
