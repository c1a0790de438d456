"""A session in another floor's folder: its landmarks lie as those of the same ids do there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from functools import partial

import numpy as np

from vislam2tag.quality.diagnosis.evidence import Evidence, Mark
from vislam2tag.quality.diagnosis.hypothesis import Hypothesis, choices
from vislam2tag.quality.diagnosis.record import CorrectionEntry, Fault, FaultKind
from vislam2tag.quality.diagnosis.words import REASON


def propose(evidence: Evidence) -> Iterator[Hypothesis]:
    """Put every walk that fits badly onto every other floor."""
    floors = sorted(evidence.table.floors)
    for number, walk in enumerate(evidence.walks):
        known = np.isfinite(walk.target)
        if known.all() and walk.alignment.fits.sum() == known.sum():
            continue
        for floor in floors:
            there = [evidence.table.place.get(Mark(floor, mark.landmark), np.nan) for mark in walk.marks]
            target = np.array(there, dtype=np.complex128)
            if floor != walk.passes.key.floor and np.isfinite(target).sum() >= known.sum():
                price = choices(len(evidence.walks) * (len(floors) - 1))
                yield Hypothesis({number: target}, price, partial(_fault, number, floor), key=("floor", number))


def _fault(number: int, floor: int, evidence: Evidence, gain: float) -> Fault:
    walk = evidence.walks[number]
    key = walk.passes.key
    fits, known = int(walk.alignment.fits.sum()), int(np.isfinite(walk.target).sum())
    values = {**asdict(key), "to": floor, "reason": REASON}
    return Fault(
        kind=FaultKind.WRONG_FLOOR,
        floor=key.floor,
        sessions=[str(key)],
        summary=f"session {key} was walked on floor {floor}",
        evidence=f"{fits} of {known} passes fit the landmarks of floor {floor}, and hardly any those of its own",
        odds=round(gain, 1),
        corrections=[CorrectionEntry(table="set_floor", values=values)],
    )
