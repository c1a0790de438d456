"""How references fit one another (``conflicts.json``): surveyed places, and what walks saw, each against all others."""

from __future__ import annotations

from vislam2tag.common.records import Record
from vislam2tag.estimation.landmark_survey.comparison import Verdict


class Reference(Record):
    """A landmark's survey, or what a ``session``, or all of a ``day``, saw of it, against all others; metres, BCS."""

    floor: int
    landmark: str
    session: str | None = None
    """Floor / device / session."""
    day: str | None = None
    """As ``2022-01-14``, of what all walks of that day saw of the landmark: only where that contradicts the others."""
    verdict: Verdict
    x_m: float
    y_m: float
    """Where the landmark hangs by all references but the odd ones."""
    offset_m: tuple[float, float] | None = None
    """From where the others have the landmark to where this reference has it; None where nothing can be compared."""
    size_m: float | None = None
    """Length of the offset."""
    sigma_m: float | None = None
    """How far off it should be expected to be, one standard deviation per axis."""


class OddReference(Record):
    """What to look at again."""

    culprit: str
    summary: str
    """One sentence."""
    references: tuple[Reference, ...] = ()
    """Of a device none: what it says of single landmarks may agree."""
    sessions: tuple[str, ...] = ()
    """Those of a device."""
    off_m: float = 0.0
    """By how much a device puts landmarks off, at most."""

    @property
    def size_m(self) -> float:
        """The greatest offset of what it stands for."""
        return max((one.size_m or 0.0 for one in self.references), default=self.off_m)


class References(Record):
    """All references of a survey; ``odd`` ranked by size."""

    odd: tuple[OddReference, ...] = ()
    compared: tuple[Reference, ...] = ()

    def on_floor(self, number: int) -> tuple[Reference, ...]:
        """Those of one floor."""
        return tuple(one for one in self.compared if one.floor == number)
