"""How a long function tells what it has done: one type for all that call back after each step."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import TypeAlias, TypeVar

Told = TypeVar("Told")
Progress: TypeAlias = Callable[[Told, int], None]
"""Called after each step with what came of it (a result, a name, or how many are done) and the number of all steps."""


def silent(_told: object, _total: int) -> None:
    """Tell nobody."""


def counted(progress: Progress[int]) -> Callable[[int], None]:
    """For work that tells only the number of all steps after each: counts those that are done."""
    done = count(1)
    return lambda total: progress(next(done), total)
