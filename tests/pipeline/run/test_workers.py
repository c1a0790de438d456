"""Jobs handed out: never more asked for than can be worked at, and those that follow from others before the rest."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from vislam2tag.pipeline.run.workers import AHEAD, process_all


def same(job: str) -> str:
    return job


@pytest.mark.parametrize("workers", [1, 2])
def test_jobs_are_asked_for_as_they_are_worked_at(workers: int) -> None:
    asked, done = 0, 0
    most = 0

    def todo() -> Iterator[str]:
        nonlocal asked
        for number in range(20):
            asked += 1
            yield str(number)

    def report(_: str) -> None:
        nonlocal done, most
        most = max(most, asked - done)
        done += 1

    process_all(same, todo(), workers, report)
    assert done == 20
    assert most <= workers + (workers - 1) * AHEAD


@pytest.mark.parametrize("workers", [1, 2])
def test_what_follows_from_a_job_is_worked_too(workers: int) -> None:
    done = []

    def report(outcome: str) -> list[str]:
        done.append(outcome)
        return [f"{outcome} follows"] if outcome in ("a", "c") else []

    process_all(same, ["a", "b", "c"], workers, report)
    assert sorted(done) == ["a", "a follows", "b", "c", "c follows"]
    if workers == 1:
        assert done == ["a", "a follows", "b", "c", "c follows"]
