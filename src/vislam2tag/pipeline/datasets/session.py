"""One labelled session to its rows of a data set's tables, in a worker process; then all sessions' findings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import polars as pl

from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import write_parquet
from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Finding, Severity, pooled
from vislam2tag.core.status import Status
from vislam2tag.dataset.fingerprints import (
    TECHNOLOGIES,
    WIFI,
    SessionFingerprints,
    SessionWalk,
    fingerprints_of,
    radio_rows,
)
from vislam2tag.dataset.labelled import LabelledSession
from vislam2tag.dataset.schema import FINGERPRINTS, IMU_WINDOWS, MAGNETIC, READINGS, RTT, SESSIONS, in_schema
from vislam2tag.dataset.sensor_windows import imu_windows, magnetic_windows
from vislam2tag.dataset.settings import DatasetSettings
from vislam2tag.intake.readings import admitted
from vislam2tag.labeling.results import SessionResult
from vislam2tag.labeling.schemas import SCHEMAS, TRAJECTORY
from vislam2tag.pipeline.labels.checking.walked_floors import WalkPlaces
from vislam2tag.walkable.walked.walked_space import RADIUS_M

NAMES = "names"
"""Parts that say how often each transmitter was heard by each name; no table of the data set."""
FAILED: FindingKind = "session_without_label"
"""Kind of the finding that counts sessions which could not be mapped."""


@dataclass(frozen=True)
class SessionJob:
    """All that a worker needs to build one session's rows."""

    labelled: LabelledSession
    session: str
    """Its name in the data set."""
    building: str
    number: int
    """Its place in the data set's order."""
    parts_folder: Folder
    """Each session's rows: ``TABLE/NUMBER.parquet``."""
    settings: DatasetSettings
    max_sigma_m: float
    own_limit: bool = True
    """Whether a session's own limit of sigma goes before that one."""


@dataclass(frozen=True)
class SessionOutcome:
    """What the worker tells the main process; the rows are on disk."""

    session: str
    device: str
    error: str | None
    """Why ``process`` could not map the session."""
    readings: dict[str, int]
    """Number of radio readings by technology, those that were logged."""
    findings: tuple[Finding, ...]
    places: WalkPlaces
    """Where the walk surely was, and its labelled Wi-Fi scans."""


def build_session(job: SessionJob) -> SessionOutcome:
    """Build one session's rows of all tables; raises DatasetError where what ``process`` wrote cannot be read."""
    with job.labelled.at_hand() as labelled:
        return _build_at_hand(replace(job, labelled=labelled))


def _build_at_hand(job: SessionJob) -> SessionOutcome:
    result = job.labelled.result()
    if job.own_limit and result.max_sigma_m is not None:
        job = replace(job, max_sigma_m=result.max_sigma_m)
    trajectory = job.labelled.table(TRAJECTORY, SCHEMAS[TRAJECTORY])
    walk = SessionWalk.of(result, trajectory, job.session, job.building)
    made = {name: _radio(job, walk, name) for name in TECHNOLOGIES if name == WIFI or job.labelled.has(name)}
    fingerprints = _write_radio(job, list(made.values()))
    _write(job, SESSIONS, _session_row(job, result, walk, fingerprints))
    findings = [finding for part in made.values() for finding in part.findings]
    findings += _write_sensors(job, trajectory)
    _write_ranges(job)
    findings += _unknown_columns(job.labelled)
    if result.error is None and not fingerprints:
        message = "sessions were mapped, but have no radio reading"
        findings.append(Finding(kind="session_without_scan", file="", count=1, message=message))
    heard = {name: len(part.readings) for name, part in made.items() if len(part.readings)}
    places = _places(trajectory, made[WIFI].fingerprints)
    return SessionOutcome(job.session, result.device, result.error, heard, tuple(findings), places)


def _places(trajectory: pl.DataFrame, scans: pl.DataFrame) -> WalkPlaces:
    """One position of each half metre that the walk came through, those as sure as what is near, and labelled scans."""
    half_metre = [(pl.col(axis) * 2).floor().alias(f"{axis}_cell") for axis in ("x", "y")]
    sure = trajectory.filter(pl.col("sigma").fill_null(0.0) <= RADIUS_M).drop_nulls(["floor", "x", "y"])
    walked = sure.unique(["floor", *half_metre], keep="first", maintain_order=True)
    scanned = scans.filter(pl.col("status") == Status.OK.label).drop_nulls(["floor", "x", "y"])
    (position, floor), (scan, scan_floor) = (
        (table.select("x", "y").to_numpy(), table["floor"].to_numpy().astype(np.int64)) for table in (walked, scanned)
    )
    return WalkPlaces(position, floor, scan, scan_floor)


def _radio(job: SessionJob, walk: SessionWalk, technology: str) -> SessionFingerprints:
    rows = radio_rows(job.labelled.table(technology, SCHEMAS[technology]), technology)
    rows, odd = admitted(rows, "bssid", technology)
    made = fingerprints_of(rows, technology, walk, job.settings, job.max_sigma_m)
    return replace(made, findings=(*odd, *made.findings))


def _write_radio(job: SessionJob, made: list[SessionFingerprints]) -> int:
    """Write what all technologies gave, in order of time; return the number of fingerprints."""
    fingerprints = pl.concat([part.fingerprints for part in made])
    fingerprints = fingerprints.sort("start_ns", "technology", maintain_order=True)
    readings = pl.concat([part.readings for part in made])
    in_order = fingerprints.select("scan_id").join(readings, on="scan_id", how="inner", maintain_order="left_right")
    _write(job, FINGERPRINTS, fingerprints)
    _write(job, READINGS, in_order)
    _write(job, NAMES, pl.concat([part.names for part in made]))
    return len(fingerprints)


def _write_ranges(job: SessionJob) -> None:
    """Write the ranges to access points where there are any; those without a label have no position."""
    if not job.labelled.has(RTT):
        return
    rows = job.labelled.table(RTT, SCHEMAS[RTT]).filter(pl.col("status") != Status.DUPLICATE.label)
    rows, _ = admitted(rows, "bssid", RTT)
    name = pl.concat_str(pl.lit(f"{job.session}/rtt/"), pl.col("row").cast(pl.String).str.zfill(7))
    table = rows.sort("time_ns", maintain_order=True).with_columns(
        range_id=name, building=pl.lit(job.building), session=pl.lit(job.session)
    )
    if len(table):
        _write(job, RTT, in_schema(RTT, table.drop("row", "status")))


def _write_sensors(job: SessionJob, trajectory: pl.DataFrame) -> list[Finding]:
    """Write the windows of magnetic and inertial readings where there are any."""
    sensors = job.labelled.table("sensors", SCHEMAS["sensors"])
    magnetic = magnetic_windows(sensors, job.session, job.building, job.settings.magnetic_window_s)
    if len(magnetic):
        _write(job, MAGNETIC, magnetic)
    inertial = imu_windows(sensors, trajectory, job.session, job.settings.imu)
    if len(inertial.table):
        _write(job, IMU_WINDOWS, inertial.table.with_columns(building=pl.lit(job.building)))
    return [
        Finding(
            kind="imu_windows_dropped",
            file="",
            count=count,
            message=f"windows of inertial readings are left out: {cause}",
            severity=Severity.INFO,
        )
        for cause, count in inertial.dropped.items()
    ]


def _unknown_columns(labelled: LabelledSession) -> list[Finding]:
    unknown = {
        f"{table}/{column}" for table in SCHEMAS if labelled.has(table) for column in labelled.unknown_columns(table)
    }
    message = "columns that `process` does not write are not read: "
    return [
        Finding(kind="unknown_columns", file="", count=1, message=message + column, severity=Severity.INFO)
        for column in sorted(unknown)
    ]


def _session_row(job: SessionJob, result: SessionResult, walk: SessionWalk, fingerprints: int) -> pl.DataFrame:
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
                "started": walk.started,
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
    write_parquet(rows, job.parts_folder, f"{table}/{job.number:06d}.parquet", compression="lz4")


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
