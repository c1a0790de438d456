"""Work in steps: what waits for a store is done beside what computes, in order, and nothing stays open."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from threading import Event, current_thread, main_thread

import pytest

from vislam2tag.pipeline.run.failures import LOG
from vislam2tag.pipeline.run.steps import InSteps, Steps, overlapped, worked
from vislam2tag.pipeline.run.workers import Supply, process_all

_LONG_S = 60.0


class Jobs:
    """Jobs by number that note what happens to them."""

    def __init__(self) -> None:
        self.open: set[int] = set()
        self.most_open = 0
        self.computed: list[int] = []
        self.begun = [Event() for _ in range(5)]

    def steps(self, job: int) -> Steps[str]:
        self.open.add(job)
        self.most_open = max(self.most_open, len(self.open))
        try:
            self.begun[job].set()
            yield
            assert current_thread() is main_thread()
            if job < 4:
                assert self.begun[job + 1].wait(_LONG_S), "the next one is begun before this one has computed"
            self.computed.append(job)
            LOG.warning("of job %d", job)
            yield
            assert current_thread() is not main_thread()
            return f"done {job}"
        finally:
            self.open.remove(job)


def test_the_next_job_is_begun_while_one_computes() -> None:
    jobs = Jobs()
    found = list(overlapped(InSteps(jobs.steps), Supply(range(5)).take))
    assert [(number, outcome) for number, (outcome, _) in found] == [(job, f"done {job}") for job in range(5)]
    assert [record.getMessage() for _, (_, records) in found for record in records] == [f"of job {n}" for n in range(5)]
    assert jobs.computed == list(range(5))
    assert jobs.most_open <= 3
    assert not jobs.open


def test_one_process_overlaps_and_does_what_follows_from_the_last(caplog: pytest.LogCaptureFixture) -> None:
    jobs, told = Jobs(), list[str]()
    for event in jobs.begun:
        event.set()

    def report(outcome: str) -> list[int]:
        told.append(outcome)
        return [4] if outcome == "done 1" else []

    with caplog.at_level(logging.WARNING, LOG.name):
        process_all(InSteps(jobs.steps), [0, 1], 1, report)
    assert told == ["done 0", "done 1", "done 4"]
    assert [record.getMessage() for record in caplog.records] == ["of job 0", "of job 1", "of job 4"]


@pytest.mark.parametrize("at", ["begin", "compute", "end"])
def test_what_a_job_raises_is_raised_and_nothing_stays_open(at: str) -> None:
    opened: list[int] = []

    def steps(job: int, when: str) -> Steps[int]:
        opened.append(job)
        try:
            for step in ("begin", "compute", "end"):
                if job == 1 and step == when:
                    raise ValueError(step)
                if step != "end":
                    yield
            return job
        finally:
            opened.remove(job)

    supply = Supply(range(4))
    with pytest.raises(ValueError, match=at):
        list(overlapped(InSteps(partial(steps, when=at)), supply.take))
    assert not opened
    with suppress(ValueError):
        worked(InSteps(partial(steps, when=at)), 1)
    assert not opened


def test_a_job_may_end_before_it_computes() -> None:
    def steps(job: int) -> Steps[int]:
        if job % 2:
            return job
        yield
        return job

    assert [outcome for _, (outcome, _) in overlapped(InSteps(steps), Supply(range(4)).take)] == [0, 1, 2, 3]
    assert [InSteps(steps)(job) for job in range(2)] == [0, 1]


def test_only_what_computes_is_alone() -> None:
    happened: list[str] = []

    def steps(job: int) -> Steps[int]:
        happened.append("files")
        yield
        happened.append("computed")
        yield
        happened.append("put")
        return job

    @contextmanager
    def alone() -> Iterator[None]:
        happened.append("alone")
        yield
        happened.append("not alone")

    assert worked(InSteps(steps), 7, alone) == (7, [])
    assert happened == ["files", "alone", "computed", "not alone", "put"]
