"""What a diagnosis finds, as JSON (``diagnosis.json``, ``conflicts.json``) and as entries of ``corrections.toml``."""

from __future__ import annotations

from enum import StrEnum
from typing import Any

from vislam2tag.common.files.toml_file import toml_value
from vislam2tag.common.findings import NOT_RUN, Answer, Judgement
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


class FaultKind(StrEnum):
    """What is wrong."""

    SWAPPED = "swapped"
    """Two sheets are interchanged, or three in a circle."""
    MIS_SURVEYED = "mis_surveyed"
    """A landmark is not where the table says."""
    MOVED = "moved"
    """... since a date."""
    TWO_PLACES = "two_places"
    """Two sheets with one id."""
    TWO_FLOORS = "two_floors"
    """Sheets on two floors with one id, in one walk."""
    OTHER_IDS = "other_ids"
    """Walks logged other ids than the landmark table has."""
    SHIFTED_IDS = "shifted_ids"
    """... that differ by a constant."""
    PLANNED = "planned"
    """Positions of landmarks that were only planned."""
    WRONG_FLOOR = "wrong_floor"
    """A session is in another floor's folder."""
    MIRRORED = "mirrored"
    TURNED = "turned"
    UNITS = "units"
    """A floor's landmark table is mirrored, turned, or in another unit than metres."""
    CLOCK = "clock"
    """A stream of a session runs on another clock than its poses."""
    REPEATED_SCANS = "repeated_scans"
    """A phone delivers old scans as new ones."""
    OTHER_DEVICE = "other_device"
    """A session is in another device's folder."""
    DOUBTFUL_FIX = "doubtful_fix"
    """A known position of a walk without poses that the others contradict."""
    ODD_REFERENCE = "odd_reference"
    """A surveyed place, what a walk or all of a day saw of a landmark, or a device's metre, that all others contradict.

    No correction is known.
    """


BY_HAND = frozenset({FaultKind.OTHER_IDS, FaultKind.SHIFTED_IDS, FaultKind.PLANNED})
"""What no lines of ``corrections.toml`` correct, and what comes before the other faults."""


REASON = "vislam2tag diagnose"


class CorrectionEntry(Record):
    """One entry of ``corrections.toml``: the name of its table and its values."""

    table: str
    values: dict[str, Any]

    def lines(self) -> str:
        """As the file has it."""
        return "\n".join([f"[[{self.table}]]", *(f"{name} = {toml_value(of)}" for name, of in self.values.items())])


def proposed(table: str, /, **values: object) -> CorrectionEntry:
    """An entry with the reason of those that diagnosis proposes."""
    return CorrectionEntry(table=table, values={**values, "reason": REASON})


class Gain(Record):
    """What a correction is expected to bring: shares of frames labelled, and mean errors to expect, metres."""

    labelled_before: float
    labelled_after: float
    expected_before_m: float | None
    expected_after_m: float | None


class Fault(Record):
    """A fault that the data name."""

    kind: FaultKind
    floor: int | None = None
    landmarks: list[str] = []
    sessions: list[str] = []
    """Of which sessions this is said, where not of all: floor / device / session."""
    summary: str
    """One sentence: what is wrong."""
    evidence: str
    """By which numbers that is known."""
    odds: float | None = None
    """By how much the walks fit better with the correction: the fall of the squared residuals in sigmas squared, the
    price of the correction's own freedom deducted."""
    corrections: list[CorrectionEntry] = []
    gain: Gain | None = None

    @property
    def lines(self) -> str:
        """The lines for ``corrections.toml``."""
        return "\n\n".join(entry.lines() for entry in self.corrections)


class Diagnosis(Record):
    """A whole survey (``diagnosis.json``)."""

    version: str = ""
    sessions: int = 0
    """How many were looked at: of a floor with very many walks, some evenly among them."""
    left_aside: int = 0
    """How many were not."""
    landmarks: str = ""
    """How many the survey has, by what is known of them: ``9 landmarks: 4 measured, 5 planned``."""
    on_plan: int = 0
    """Sessions without landmarks that connect them to the building, on floors with a plan that may place them."""
    failed: list[str] = []
    faults: list[Fault] = []
    judgement: Judgement = NOT_RUN
    """Whether the walks could show faults at all: an empty list of faults is not an answer."""
    references: References = References()
    """Every surveyed place, and what every walk saw of it, against all others."""

    @property
    def needs_landmarks(self) -> bool:
        """Whether nothing could be judged only because no walk is mapped by landmarks; the rest was checked."""
        return self.judgement.answer is Answer.NOT_JUDGED and 0 < self.on_plan == self.sessions

    @property
    def correctable(self) -> bool:
        """Whether to add the lines for ``corrections.toml`` first: there are some, and nothing to correct before."""
        by_hand = any(fault.kind in BY_HAND for fault in self.faults)
        return not by_hand and any(fault.corrections for fault in self.faults)
