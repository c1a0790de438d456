"""Work that the benchmarks of fleets give to Dask's workers; a module of its own, so that workers import it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Nothing:
    """A task of no content."""

    slug: str
    code: str = ""


def do_nothing(job: Nothing) -> str:
    """Work at a task of no content."""
    return job.slug


def no_code(job: Nothing) -> str:
    """All sources are the same to a task of no content."""
    return job.code


def give_nothing_up(job: Nothing, error: str) -> str:
    """End a task whose workers died."""
    return f"{job.slug}: {error}"
