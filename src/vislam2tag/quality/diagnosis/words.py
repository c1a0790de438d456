"""Numbers put into sentences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vislam2tag.quality.diagnosis.evidence import Evidence, Mark

REASON = "vislam2tag diagnose"
"""Reason of the entries that diagnosis proposes."""


def listed(names: Sequence[str]) -> str:
    """Names as a sentence has them: a, b and c."""
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def told_by_passes(evidence: Evidence, marks: Sequence[Mark]) -> str:
    """How the walks' other passes speak for the new places of some landmarks, and against those of the table."""
    from_table, from_new, walks = [], [], set()
    for mark in marks:
        for sight in evidence.sights(mark):
            target = evidence.walks[sight.walk].target[sight.row]
            if target != evidence.table.place[mark]:
                from_table.append(abs(sight.place - evidence.table.place[mark]))
                from_new.append(abs(sight.place - target))
                walks.add(sight.walk)
    if not from_table:
        return "no other landmark of these walks fits without it"
    return (
        f"{len(from_table)} passes in {len(walks)} walks put them {np.median(from_new):.1f} m (median) from there and "
        f"{np.median(from_table):.1f} m from the places that the table gives"
    )
