"""The faults that explain best what does not fit: the best hypothesis first, then the best with that corrected."""

from __future__ import annotations

from math import inf

from vislam2tag.quality.diagnosis.evidence import Evidence, Mark
from vislam2tag.quality.diagnosis.faults import displaced, frames, other_floor, swapped
from vislam2tag.quality.diagnosis.hypothesis import Hypothesis, Propose
from vislam2tag.quality.diagnosis.record import Fault, FaultKind
from vislam2tag.quality.diagnosis.turned_table import turned_tables

FAULTS: tuple[Propose, ...] = (frames.propose, other_floor.propose, swapped.propose, displaced.propose)
"""In the order of their extent."""
LEAST_GAIN = 9.0
"""A hypothesis is believed where the squared residuals fall by more than its price and this."""
MOST_FAULTS = 12
SETTLES = 0.4
"""What explains so much of all that its walks are off by needs no comparison with faults of less extent."""


def found_faults(evidence: Evidence) -> tuple[list[Fault], Evidence]:
    """Name the faults, the most certain first, and give the evidence with them corrected."""
    faults: list[Fault] = []
    done: set[tuple[object, ...]] = set()
    while len(faults) < MOST_FAULTS and evidence.suspects:
        best, gain = _best(evidence, done)
        if best is None or gain < LEAST_GAIN:
            break
        evidence = evidence.with_targets(best.targets, best.place)
        fault = best.describe(evidence, gain)
        faults = [*(one for one in faults if not _replaced(one, fault)), fault]
        done.add(best.key)
        if fault.kind is FaultKind.SWAPPED and fault.floor is not None:
            done |= {("displaced", Mark(fault.floor, landmark)) for landmark in fault.landmarks}
    return [*faults, *turned_tables(evidence.table)], evidence


def _replaced(fault: Fault, by: Fault) -> bool:
    """Whether an exchange says better where a single landmark hangs."""
    single = fault.kind in (FaultKind.MIS_SURVEYED, FaultKind.MOVED, FaultKind.TWO_PLACES)
    return (
        single
        and by.kind is FaultKind.SWAPPED
        and fault.floor == by.floor
        and set(fault.landmarks) <= set(by.landmarks)
    )


def _best(evidence: Evidence, done: set[tuple[object, ...]]) -> tuple[Hypothesis | None, float]:
    best, most = None, 0.0
    for propose in FAULTS:
        for hypothesis in propose(evidence):
            if hypothesis.key not in done and (gain := gain_of(evidence, hypothesis, most)) > most:
                best, most = hypothesis, gain
        if best is not None and most > SETTLES * sum(evidence.walks[i].alignment.cost for i in best.targets):
            break
    return best, most


def gain_of(evidence: Evidence, hypothesis: Hypothesis, least: float = -inf) -> float:
    """By how much the squared residuals fall with a hypothesis, its price deducted; at most ``least`` where less."""
    changed = evidence.with_targets(hypothesis.targets)
    gain = sum(evidence.walks[i].alignment.cost for i in hypothesis.targets) - hypothesis.price
    for i in hypothesis.targets:
        if gain <= least:
            return least
        gain -= changed.walks[i].alignment.cost
    return gain
