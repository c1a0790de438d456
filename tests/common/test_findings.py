from __future__ import annotations

from vislam2tag.common.findings import Finding, FindingKind, Severity, pooled


def finding(kind: FindingKind, count: int, message: str = "m") -> Finding:
    return Finding(kind=kind, file="", count=count, message=message, severity=Severity.INFO)


def test_findings_of_one_kind_and_message_are_summed_in_order() -> None:
    found = [
        finding("frame_gap", 1),
        finding("empty_file", 2),
        finding("frame_gap", 3),
        finding("frame_gap", 4, "n"),
    ]
    assert pooled(found) == [finding("frame_gap", 4), finding("empty_file", 2), finding("frame_gap", 4, "n")]
    assert pooled([]) == []
