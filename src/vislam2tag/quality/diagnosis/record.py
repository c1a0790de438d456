"""What a diagnosis finds, as JSON (``diagnosis.json``, ``conflicts.json``) and as entries of ``corrections.toml``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from vislam2tag.common.files.toml_file import toml_value
from vislam2tag.common.findings import NOT_RUN, Answer, FaultKind, Judgement
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result
from vislam2tag.estimation.landmark_survey.comparison import Verdict
from vislam2tag.site.corrections.file import IgnoreFault


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
    place_sigma_m: float | None = None
    """How sure that place is, one standard deviation per axis."""
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


class PlaceByWalks(Record):
    """Where walks have a landmark, metres, BCS; ``sigma_m`` is one standard deviation per axis."""

    x_m: float
    y_m: float
    sigma_m: float

    @classmethod
    def at(cls, place: complex, sigma_m: float) -> PlaceByWalks:
        """A place (x + iy) to the centimetre, and its sigma to the millimetre, which is the smallest."""
        return cls(x_m=round(place.real, 2), y_m=round(place.imag, 2), sigma_m=max(round(sigma_m, 3), 0.001))

    @property
    def correction(self) -> dict[str, float]:
        """Values of a ``move_landmark`` entry that puts the landmark there."""
        return {"x": self.x_m, "y": self.y_m, "sigma_m": self.sigma_m}


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
    by_walks: PlaceByWalks | None = None
    """Where walks have its landmark, if they agree on one place."""
    observed_m: tuple[float, float] | None = None
    """Where the only walk of ``sessions`` observed its only landmark, metres, BCS, if other walks have it elsewhere."""
    ignored: str = ""
    """Why its owner ignores it; empty if it is open."""

    @property
    def lines(self) -> str:
        """The lines for ``corrections.toml``."""
        return "\n\n".join(entry.lines() for entry in self.corrections)


def answered(
    faults: Sequence[Fault], judgement: Judgement, entries: Sequence[IgnoreFault]
) -> tuple[list[Fault], Judgement]:
    """Faults with the reasons of the entries that ignore them, and the answer that the open ones give."""
    found = [fault.model_copy(update={"ignored": _reason(fault, entries)}) for fault in faults]
    if judgement.answer is Answer.NOT_LOOKED_AT:
        return found, judgement
    left = sum(not fault.ignored for fault in found)
    looked_at, why = judgement.looked_at, judgement.why
    return found, Judgement.of(left, bool(looked_at), looked_at, why, judgement.warnings)


def _reason(fault: Fault, entries: Sequence[IgnoreFault]) -> str:
    """The reason of the first entry that selects a fault; what an entry leaves out is true of any fault."""
    return next(
        (
            entry.reason
            for entry in entries
            if entry.kind is fault.kind
            and entry.floor in (None, fault.floor)
            and (not entry.landmarks or set(entry.landmarks) == set(fault.landmarks))
            and (not entry.sessions or set(entry.sessions) == set(fault.sessions))
        ),
        "",
    )


class Diagnosis(Result):
    """A whole survey (``diagnosis.json``)."""

    main_table: ClassVar[str] = "faults"

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
    def open(self) -> list[Fault]:
        """Faults that are not ignored."""
        return [fault for fault in self.faults if not fault.ignored]

    @property
    def needs_landmarks(self) -> bool:
        """Whether nothing could be judged only because no walk is mapped by landmarks; the rest was checked."""
        return self.judgement.answer is Answer.NOT_JUDGED and 0 < self.on_plan == self.sessions

    @property
    def correctable(self) -> bool:
        """Whether to add the lines for ``corrections.toml`` first: there are some, and nothing to correct before."""
        by_hand = any(fault.kind in BY_HAND for fault in self.open)
        return not by_hand and any(fault.corrections for fault in self.open)
