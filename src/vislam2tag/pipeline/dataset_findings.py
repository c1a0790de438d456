"""What was odd about the sessions that a data set is made of, counted over all of them."""

from __future__ import annotations

from collections.abc import Sequence

from vislam2tag.findings import Finding, pooled
from vislam2tag.pipeline.dataset_session import SessionOutcome

FAILED = "session_without_label"
"""Kind of the finding that counts sessions which could not be mapped."""


def survey_findings(outcomes: Sequence[SessionOutcome]) -> list[Finding]:
    """Sum the sessions' findings; count sessions without a label, devices without a reading, and no reading at all."""
    findings = pooled(finding for outcome in outcomes for finding in outcome.findings)
    failed = [outcome for outcome in outcomes if outcome.error is not None]
    if failed:
        message = f"sessions could not be mapped and have no label; the first: {failed[0].error}"
        findings.append(Finding(kind=FAILED, file="", count=len(failed), message=message))
    devices = {outcome.device for outcome in outcomes}
    silent = sorted(devices - {outcome.device for outcome in outcomes if outcome.readings})
    if len(silent) == len(devices):
        message = "sessions, but no radio reading in any: the data set has no fingerprint"
        findings.append(Finding(kind="no_radio_reading", file="", count=len(outcomes), message=message))
    elif silent:
        message = f"devices have no radio reading in any session: {', '.join(silent)}"
        findings.append(Finding(kind="device_without_scan", file="", count=len(silent), message=message))
    return findings
