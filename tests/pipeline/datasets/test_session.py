"""What sessions' findings add up to."""

from __future__ import annotations

import numpy as np

from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.pipeline.datasets.session import SessionOutcome, survey_findings
from vislam2tag.pipeline.labels.checking.walked_floors import WalkPlaces

NOWHERE = WalkPlaces(np.empty((0, 2)), np.empty(0, np.int64), np.empty((0, 2)), np.empty(0, np.int64))


def finding(kind: FindingKind, count: int, message: str = "m", severity: Severity = Severity.INFO) -> Finding:
    return Finding(kind=kind, file="", count=count, message=message, severity=severity)


def outcome(device: str, readings: int, error: str | None = None, *found: Finding) -> SessionOutcome:
    return SessionOutcome("s", device, error, {"wifi": readings} if readings else {}, found, NOWHERE)


def test_what_sessions_lack_is_counted() -> None:
    fine = survey_findings(
        [
            outcome("LG", 5, None, finding("encoding", 1)),
            outcome("Pixel", 2, None, finding("encoding", 2)),
        ]
    )
    assert fine == [finding("encoding", 3)]
    outcomes = [outcome("LG", 5), outcome("LG", 0, "no frame"), outcome("Pixel", 0), outcome("Pixel", 0, "lost")]
    found = {each.kind: each for each in survey_findings(outcomes)}
    assert (found["session_without_label"].count, found["device_without_scan"].count) == (2, 1)
    assert "the first: no frame" in found["session_without_label"].message
    assert found["device_without_scan"].message.endswith(": Pixel")
    (nothing,) = survey_findings([outcome("LG", 0), outcome("Pixel", 0)])
    assert (nothing.kind, nothing.count, nothing.severity) == ("no_radio_reading", 2, Severity.WARNING)
