from __future__ import annotations

from vislam2tag.common.findings import Finding, Severity, pooled


def finding(kind: str, count: int, message: str = "m") -> Finding:
    return Finding(kind=kind, file="", count=count, message=message, severity=Severity.INFO)


def test_findings_of_one_kind_and_message_are_summed_in_order() -> None:
    found = [finding("b", 1), finding("a", 2), finding("b", 3), finding("b", 4, "other")]
    assert pooled(found) == [finding("b", 4), finding("a", 2), finding("b", 4, "other")]
    assert pooled([]) == []
