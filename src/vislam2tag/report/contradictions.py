"""Landmarks that contradict the rest, tallied over sessions."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from vislam2tag.results import ContradictionMark, LandmarkContradiction, SessionResult

_Key = tuple[int, str]
"""Floor and landmark."""


@dataclass
class LandmarkTally:
    """Counts sessions by landmark; its size grows with the landmarks alone."""

    _seen: Counter[_Key] = field(default_factory=Counter)
    _found: dict[_Key, LandmarkContradiction] = field(default_factory=dict)

    def add(self, result: SessionResult) -> None:
        """Add what one session says."""
        said = {mark.landmark: mark for mark in result.contradictions}
        for landmark in result.landmarks_logged:
            floor = said[landmark].floor if landmark in said else result.floor
            self._seen[floor, landmark] += 1
        for mark in said.values():
            self._found[mark.floor, mark.landmark] = _joined(self._found.get((mark.floor, mark.landmark)), mark)

    def all(self) -> list[LandmarkContradiction]:
        """Return all contradictions, those that most sessions speak of first, then the greatest."""
        complete = [found.model_copy(update={"seen": self._seen[key]}) for key, found in sorted(self._found.items())]
        return sorted(complete, key=lambda found: (-found.sessions, -found.greatest_m))


def _joined(before: LandmarkContradiction | None, mark: ContradictionMark) -> LandmarkContradiction:
    """Take one more session into the mean offset."""
    sessions = 1 + (before.sessions if before else 0)
    x, y = before.offset_m if before else (0.0, 0.0)
    return LandmarkContradiction(
        floor=mark.floor,
        landmark=mark.landmark,
        sessions=sessions,
        seen=0,
        greatest_m=max(mark.size_m, before.greatest_m if before else 0.0),
        surveyed_m=before.surveyed_m if before else mark.surveyed_m,
        offset_m=(
            round(x + (mark.offset_m[0] - x) / sessions, 4),
            round(y + (mark.offset_m[1] - y) / sessions, 4),
        ),
    )
