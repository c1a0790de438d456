"""Faults that their owner ignores."""

from __future__ import annotations

from vislam2tag.common.findings import Answer, FaultKind, Judgement
from vislam2tag.quality.diagnosis.record import Diagnosis, Fault, answered, proposed
from vislam2tag.site.corrections.file import IgnoreFault

SWAPPED = Fault(
    kind=FaultKind.SWAPPED,
    floor=1,
    landmarks=["2", "9"],
    summary="swapped",
    evidence="",
    corrections=[proposed("swap_landmarks", ids=["2", "9"], floor=1)],
)
MOVED = Fault(kind=FaultKind.MOVED, floor=1, landmarks=["4"], summary="moved", evidence="")
WRONG = Judgement(answer=Answer.WRONG, looked_at="12 landmarks in 9 walks")


def ignored(**values: object) -> IgnoreFault:
    return IgnoreFault.model_validate({"kind": "swapped", "reason": "known", **values})


def test_an_ignored_fault_keeps_its_reason_and_makes_nothing_wrong() -> None:
    faults, judgement = answered([SWAPPED, MOVED], WRONG, [ignored(floor=1, landmarks=["9", "2"])])
    assert [fault.ignored for fault in faults] == ["known", ""]
    assert judgement.answer is Answer.WRONG
    found = Diagnosis(faults=faults, judgement=judgement)
    assert (found.open, found.correctable) == ([faults[1]], False)
    faults, judgement = answered([SWAPPED], WRONG, [ignored()])
    assert judgement == Judgement(answer=Answer.NOTHING_WRONG, looked_at="12 landmarks in 9 walks")
    assert not Diagnosis(faults=faults, judgement=judgement).open


def test_an_entry_ignores_only_the_faults_that_it_selects() -> None:
    for other in (
        ignored(floor=2),
        ignored(landmarks=["2"]),
        ignored(sessions=["floor 1 / LG / a"]),
        ignored(kind="moved"),
    ):
        assert answered([SWAPPED], WRONG, [other])[0] == [SWAPPED]
