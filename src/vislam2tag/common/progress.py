"""How long work reports its progress: one type for all that call back after each step."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import NamedTuple, TypeAlias, TypeVar

Step = TypeVar("Step")
Progress: TypeAlias = Callable[[Step, int], None]
"""Called after each step with what came of it (a result, a name, or how many are done) and the number of all steps."""


class Stage(NamedTuple):
    """How far work has come that does several things, one after the other."""

    name: str
    """What is being done."""
    done: float
    """Steps of it that are done; a part of one counts, too."""


def silent(_step: object, _total: int) -> None:
    """Report nothing."""


def counted(progress: Progress[int], total: int) -> Progress[object]:
    """For work in several parts with ``total`` steps in all: count the steps of all parts, whatever each reports."""
    done = count(1)
    return lambda _step, _of_this_part: progress(next(done), total)
