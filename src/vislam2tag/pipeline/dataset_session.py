"""One labelled session to its parts of a data set's tables; runs in a worker process."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from vislam2tag.core.status import Status
from vislam2tag.dataset.fingerprints import Walk, fingerprints_of
from vislam2tag.dataset.labelled import LabelledSession
from vislam2tag.dataset.schema import FINGERPRINTS, READINGS, SESSIONS, in_schema
from vislam2tag.findings import Finding, Severity
from vislam2tag.labeling.schemas import SCHEMAS
from vislam2tag.results import SessionResult
from vislam2tag.settings import DatasetSettings
from vislam2tag.survey.corrections import session_start

RADIO_TABLES = ("ble", "wifi")
"""Tables of an output folder that become fingerprints; each is a technology."""
NAMES = "names"
"""Parts that say how often each transmitter was heard by each name; no table of the data set."""


@dataclass(frozen=True)
class SessionJob:
    """All that a worker needs to build one session's parts."""

    labelled: LabelledSession
    session: str
    """Its name in the data set."""
    building: str
    number: int
    """Its place in the data set's order."""
    parts: Path
    """Folder for the parts, ``TABLE/NUMBER.parquet``."""
    settings: DatasetSettings
    max_sigma_m: float


@dataclass(frozen=True)
class SessionOutcome:
    """What the worker tells the main process; the rows are on disk."""

    session: str
    device: str
    error: str | None
    """Why ``process`` could not map the session."""
    readings: dict[str, int]
    """Number of readings by technology."""
    findings: tuple[Finding, ...]


def build_session(job: SessionJob) -> SessionOutcome:
    """Build one session's parts of all tables; raises DatasetError where what ``process`` wrote cannot be read."""
    result = job.labelled.result()
    walk = Walk.of(job.labelled, job.session, job.building)
    findings: list[Finding] = []
    scans: list[pl.DataFrame] = []
    readings: list[pl.DataFrame] = []
    names: list[pl.DataFrame] = []
    heard: dict[str, int] = {}
    for technology in (name for name in RADIO_TABLES if job.labelled.has(name)):
        rows = job.labelled.table(technology, SCHEMAS[technology])
        made = fingerprints_of(rows, technology, walk, job.settings, job.max_sigma_m)
        scans.append(made.fingerprints)
        readings.append(made.readings)
        names.append(made.names)
        findings += made.findings
        if len(rows):
            heard[technology] = len(made.readings)
    fingerprints = pl.concat(scans).sort("start_ns", "technology", maintain_order=True)
    _write(job, FINGERPRINTS, fingerprints)
    _write(job, READINGS, _in_order(pl.concat(readings), fingerprints))
    _write(job, NAMES, pl.concat(names))
    _write(job, SESSIONS, _session_row(job, result, walk, len(fingerprints)))
    if result.error is None and not len(fingerprints):
        message = "sessions were mapped, but have no radio reading"
        findings.append(Finding(kind="session_without_scan", file="", count=1, message=message))
    return SessionOutcome(job.session, result.device, result.error, heard, tuple(findings))


def _in_order(readings: pl.DataFrame, fingerprints: pl.DataFrame) -> pl.DataFrame:
    """Put readings into the order of their fingerprints."""
    return fingerprints.select("scan_id").join(readings, on="scan_id", how="left", maintain_order="left_right")


def _session_row(job: SessionJob, result: SessionResult, walk: Walk, fingerprints: int) -> pl.DataFrame:
    seconds = result.frame_seconds
    return in_schema(
        SESSIONS,
        pl.DataFrame(
            {
                "session": job.session,
                "building": job.building,
                "floor": result.floor,
                "device": result.device,
                "name": result.session,
                "started": session_start(result.session),
                "duration_s": result.duration_s,
                "distance_m": result.distance_m,
                "labelled_s": sum(seconds.get(status.label, 0.0) for status in (Status.OK, Status.UNCERTAIN)),
                "labelled_m": round(walk.motion.labelled_m, 2),
                "fingerprints": fingerprints,
                "source": result.fingerprint,
            }
        ),
    )


def _write(job: SessionJob, table: str, rows: pl.DataFrame) -> None:
    folder = job.parts / table
    folder.mkdir(parents=True, exist_ok=True)
    rows.write_parquet(folder / f"{job.number:06d}.parquet", compression="lz4")


def survey_findings(outcomes: Sequence[SessionOutcome]) -> list[Finding]:
    """What was odd about all sessions: their findings summed, sessions without a label, devices without a reading."""
    findings = _pooled([finding for outcome in outcomes for finding in outcome.findings])
    failed = [outcome for outcome in outcomes if outcome.error is not None]
    if failed:
        message = f"sessions could not be mapped and have no label; the first: {failed[0].error}"
        findings.append(Finding(kind="session_without_label", file="", count=len(failed), message=message))
    silent = sorted({o.device for o in outcomes} - {o.device for o in outcomes if sum(o.readings.values())})
    if silent:
        message = f"devices have no radio reading in any session: {', '.join(silent)}"
        findings.append(Finding(kind="device_without_scan", file="", count=len(silent), message=message))
    return findings


def _pooled(findings: Sequence[Finding]) -> list[Finding]:
    """Sum findings of the same kind and message, in the order in which they first came."""
    counts: dict[tuple[str, str, Severity], int] = {}
    for finding in findings:
        key = (finding.kind, finding.message, finding.severity)
        counts[key] = counts.get(key, 0) + finding.count
    return [
        Finding(kind=kind, file="", count=count, message=message, severity=severity)
        for (kind, message, severity), count in counts.items()
    ]
