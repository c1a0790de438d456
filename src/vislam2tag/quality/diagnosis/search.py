"""The faults that explain best what does not fit: the best hypothesis first, then the best with that corrected."""

from __future__ import annotations

from math import inf

import numpy as np

from vislam2tag.common.findings import Answer, FaultKind, Judgement, counted, none_mapped
from vislam2tag.quality.diagnosis.evidence import MIN_OTHERS, Evidence, Hypothesis, Mark, Propose
from vislam2tag.quality.diagnosis.record import Fault
from vislam2tag.quality.diagnosis.table_faults import (
    changed_tables,
    displaced_landmarks,
    exchanged_sheets,
    walks_on_other_floors,
)
from vislam2tag.quality.diagnosis.turned_tables import turned_tables

FAULTS: tuple[Propose, ...] = (changed_tables, walks_on_other_floors, exchanged_sheets, displaced_landmarks)
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
        fault = best.describe(evidence).model_copy(update={"odds": round(gain, 1)})
        faults = [*(one for one in faults if not _replaced(one, fault)), fault]
        done.add(best.key)
        if fault.kind is FaultKind.SWAPPED and fault.floor is not None:
            done |= {("displaced", Mark(fault.floor, landmark)) for landmark in fault.landmarks}
    return [*faults, *turned_tables(evidence.table)], evidence


def _replaced(fault: Fault, by: Fault) -> bool:
    """Whether an exchange says better where a single landmark hangs."""
    if by.kind is not FaultKind.SWAPPED or fault.floor != by.floor:
        return False
    single = fault.kind in (FaultKind.MIS_SURVEYED, FaultKind.MOVED, FaultKind.TWO_PLACES)
    return single and set(fault.landmarks) <= set(by.landmarks)


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


NO_SESSION = "all sessions of the survey are excluded"
MIN_FIXES = 3
"""Known positions of a walk without poses: of fewer the others do not show which one is wrong."""
_TOO_FEW = f"no walk passes {MIN_OTHERS + 1} surveyed landmarks, and a landmark can only be checked against others"


def judgement_of(evidence: Evidence, sessions: int, failed: int, faults: int, fixes: int = 0) -> Judgement:
    """The answer of a diagnosis of so many sessions; ``fixes`` are known positions compared in walks without poses."""
    if not sessions:
        return Judgement(answer=Answer.NOT_LOOKED_AT, why=NO_SESSION)
    marks = [known for walk in evidence.walks if len(known := _known(walk.marks, walk.target)) > MIN_OTHERS]
    judged = {mark for known in marks for mark in known}
    parts = [f"{counted(len(judged), 'landmark')} in {counted(len(marks), 'walk')}"] if judged else []
    parts += [counted(fixes, "known position")] if fixes else []
    if not parts:
        return Judgement.of(faults, 0, "", none_mapped(sessions) if failed == sessions else _TOO_FEW)
    return Judgement.of(faults, len(parts), " and ".join(parts), _rest(evidence, judged, failed))


def _known(marks: tuple[Mark, ...], target: np.ndarray[tuple[int], np.dtype[np.complex128]]) -> set[Mark]:
    return {marks[i] for i in np.flatnonzero(np.isfinite(target)).tolist()}


def _rest(evidence: Evidence, judged: set[Mark], failed: int) -> str:
    """What is left out of the answer."""
    missed = len(evidence.table.place.keys() - judged)
    parts = (
        [f"{counted(missed, 'landmark')} could not be judged, because no walk passes enough others there"]
        if missed
        else []
    )
    parts += [f"{counted(failed, 'session')} cannot be read or mapped"] if failed else []
    return "; ".join(parts)
