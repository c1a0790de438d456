"""A fault that may be: what the walks' places would be without it, and what it costs to believe in it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from math import log
from typing import TypeAlias

from vislam2tag.core.arrays import ComplexArray
from vislam2tag.quality.diagnosis.evidence import Evidence, Mark
from vislam2tag.quality.diagnosis.record import Fault


@dataclass(frozen=True)
class Hypothesis:
    """``targets`` by number of the walk, in place of those it changes; ``price``: twice the logarithm of how many
    others like it there are, plus what its own freedom is worth (as in Schwarz's criterion).
    """

    targets: Mapping[int, ComplexArray]
    price: float
    describe: Callable[[Evidence, float], Fault]
    """Tells it, given the evidence as it is with it, and what it gains."""
    place: Mapping[Mark, complex] = field(default_factory=dict)
    """Places of the table that the fault changes for all."""
    key: tuple[object, ...] = ()
    """Tells hypotheses apart; a fault that is corrected is not proposed again."""


Propose: TypeAlias = Callable[[Evidence], Iterable[Hypothesis]]


def choices(count: int) -> float:
    """Price of choosing one among so many."""
    return 2 * log(max(count, 1))
