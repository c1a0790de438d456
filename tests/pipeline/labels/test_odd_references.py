"""The odd one out, as findings and faults."""

from __future__ import annotations

from vislam2tag.common.findings import FaultKind
from vislam2tag.estimation.landmark_survey.comparison import Verdict
from vislam2tag.pipeline.labels.odd_references import odd_faults, odd_findings
from vislam2tag.quality.diagnosis.record import Fault, OddReference, Reference, References

SESSIONS = ("0 / LG / a", "0 / LG / b")
FOUND = References(odd=(OddReference(culprit="device LG", summary="too far apart", sessions=SESSIONS, off_m=0.6),))


def test_a_device_is_a_fault_of_its_sessions_with_its_size() -> None:
    [fault] = odd_faults(FOUND, [])
    assert (fault.kind, fault.sessions, fault.evidence) == (
        FaultKind.ODD_REFERENCE,
        list(SESSIONS),
        "0.60 m at most",
    )
    assert [(one.count, one.message) for one in odd_findings(FOUND)] == [(1, "too far apart")]


def test_a_fault_of_one_walk_says_where_that_walk_has_the_landmark() -> None:
    row = Reference(
        floor=0, landmark="7", session=SESSIONS[0], verdict=Verdict.CONTRADICTS, x_m=3, y_m=4,
        offset_m=(0.5, -1), size_m=1.1, sigma_m=0.1,
    )  # fmt: skip
    found = References(odd=(OddReference(culprit="7", summary="elsewhere", references=(row,)),))
    [fault] = odd_faults(found, [])
    assert (fault.observed_m, fault.by_walks) == ((3.5, 3.0), None)


def test_a_fault_of_one_of_its_sessions_does_not_explain_a_device_but_one_of_all_does() -> None:
    one, both = (
        Fault(kind=FaultKind.OTHER_DEVICE, sessions=list(of), summary="", evidence="")
        for of in (SESSIONS[:1], SESSIONS)
    )
    assert odd_faults(FOUND, [both]) == []
    assert len(odd_faults(FOUND, [one])) == 1
