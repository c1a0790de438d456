"""Sources of a data set: output folders of ``process``, their buildings, floors and plans.

A worker process builds the rows of each labelled session; then the findings of all sessions are collected.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError, UsageError, missing_extra
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.findings import Finding, FindingKind, Severity, finding_if, pooled
from vislam2tag.core.status import Status
from vislam2tag.datasets.fingerprints import (
    TECHNOLOGIES,
    SessionFingerprints,
    SessionWalk,
    fingerprints_of,
    radio_parts,
    radio_rows,
    write_part,
)
from vislam2tag.datasets.labelled import LabelledSession, LabelledSurvey, open_labelled, without_sessions
from vislam2tag.datasets.model import DatasetSource, FloorInfo, RoomInfo
from vislam2tag.datasets.phone_motion import PhoneMotion
from vislam2tag.datasets.schema import FINGERPRINTS, IMU_WINDOWS, MAGNETIC, RTT, SESSIONS, in_schema
from vislam2tag.datasets.sensor_windows import imu_windows, magnetic_windows
from vislam2tag.datasets.settings import DatasetSettings
from vislam2tag.datasets.technologies import BOTH, WIFI, parts_of
from vislam2tag.intake.readings import admitted
from vislam2tag.labeling.results import RUN_FILE, FloorRecord, SessionResult
from vislam2tag.labeling.tables import SCHEMAS, TRAJECTORY
from vislam2tag.pipeline.labels.walked_floors import WalkPlaces
from vislam2tag.sessions.registry import slugs_from_outside
from vislam2tag.site.discover import read_site
from vislam2tag.site.links import left_out_of
from vislam2tag.site.model import Floor, Site, unique_slugs
from vislam2tag.site.plans.load import plan_file
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.walked import RADIUS_M

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
    """Whether a session's own limit of sigma takes precedence."""


@dataclass(frozen=True)
class SessionOutcome:
    """Result of a worker; the rows are on disk."""

    session: str
    device: str
    error: str | None
    """Why ``process`` could not map the session, or that it has no position."""
    technologies: tuple[str, ...]
    """Findings about its radio readings."""
    findings: tuple[Finding, ...]
    places: WalkPlaces
    """Reliable positions of the walk, and its labelled Wi-Fi scans."""


def build_session(job: SessionJob) -> SessionOutcome:
    """Build one session's rows of all tables; raises DatasetError if the output of ``process`` cannot be read."""
    with job.labelled.at_hand() as labelled:
        return _build_at_hand(replace(job, labelled=labelled))


def _build_at_hand(job: SessionJob) -> SessionOutcome:
    result = job.labelled.result()
    if job.own_limit and result.max_sigma_m is not None:
        job = replace(job, max_sigma_m=result.max_sigma_m)
    trajectory = job.labelled.table(TRAJECTORY, SCHEMAS[TRAJECTORY])
    walk = SessionWalk(job.session, job.building, result.device, result.session, PhoneMotion.of(trajectory))
    wanted = (BOTH,) if job.settings.ble_with_wifi else TECHNOLOGIES
    made = [_radio(job, walk, name) for name in wanted if WIFI in parts_of(name) or job.labelled.has(name)]
    tables, findings = radio_parts(made)
    fingerprints = tables[FINGERPRINTS]
    windows, dropped = _windows(job, trajectory)
    tables |= {SESSIONS: _session_row(job, result, walk, len(fingerprints)), **windows, **_ranges(job)}
    write_part(job.parts_folder, job.number, tables)
    findings += [*dropped, *_unknown_columns(job.labelled)]
    if result.error is None and fingerprints.is_empty():
        message = "sessions were mapped, but have no radio readings"
        findings.append(Finding(kind="session_without_scan", file="", count=1, message=message))
    technologies = tuple(fingerprints["technology"].unique())
    places = _places(trajectory, fingerprints.filter(pl.col("technology").is_in((WIFI, BOTH))))
    error = f"{result.slug}: no frame has a position" if result.unplaced else result.error
    return SessionOutcome(job.session, result.device, error, technologies, tuple(findings), places)


def _places(trajectory: pl.DataFrame, scans: pl.DataFrame) -> WalkPlaces:
    """One position per half metre of the walk, if sigma is small enough, and labelled scans."""
    half_metre = [(pl.col(axis) * 2).floor().alias(f"{axis}_cell") for axis in ("x", "y")]
    sure = trajectory.filter(pl.col("sigma").fill_null(0.0) <= RADIUS_M).drop_nulls(["floor", "x", "y"])
    walked = sure.unique(["floor", *half_metre], keep="first", maintain_order=True)
    scanned = scans.filter(pl.col("status") == Status.OK.label).drop_nulls(["floor", "x", "y"])
    (position, floor), (scan, scan_floor) = (
        (table.select("x", "y").to_numpy(), table["floor"].to_numpy().astype(np.int64)) for table in (walked, scanned)
    )
    return WalkPlaces(position, floor, scan, scan_floor)


def _radio(job: SessionJob, walk: SessionWalk, technology: str) -> SessionFingerprints:
    rows, odd = dict[str, pl.DataFrame](), list[Finding]()
    for name in parts_of(technology):
        if name == WIFI or job.labelled.has(name):
            rows[name], found = admitted(radio_rows(job.labelled.table(name, SCHEMAS[name]), name), "bssid", name)
            odd += found
    made = fingerprints_of(rows, technology, walk, job.settings, job.max_sigma_m)
    return replace(made, findings=(*odd, *made.findings))


def _ranges(job: SessionJob) -> dict[str, pl.DataFrame]:
    """The ranges to access points, if any; those without a label have no position."""
    if not job.labelled.has(RTT):
        return {}
    rows = job.labelled.table(RTT, SCHEMAS[RTT]).filter(pl.col("status") != Status.DUPLICATE.label)
    rows, _ = admitted(rows, "bssid", RTT)
    name = pl.concat_str(pl.lit(f"{job.session}/rtt/"), pl.col("row").cast(pl.String).str.zfill(7))
    table = rows.sort("time_ns", maintain_order=True).with_columns(
        range_id=name, building=pl.lit(job.building), session=pl.lit(job.session)
    )
    return {RTT: in_schema(RTT, table.drop("row", "status"))} if len(table) else {}


def _windows(job: SessionJob, trajectory: pl.DataFrame) -> tuple[dict[str, pl.DataFrame], list[Finding]]:
    """The windows of magnetic and inertial readings, if any, and the number of dropped ones."""
    sensors = job.labelled.table("sensors", SCHEMAS["sensors"])
    magnetic = magnetic_windows(sensors, job.session, job.building, job.settings.magnetic_window_s)
    inertial = imu_windows(sensors, trajectory, job.session, job.settings.imu)
    windows = {MAGNETIC: magnetic, IMU_WINDOWS: inertial.table.with_columns(building=pl.lit(job.building))}
    findings = [
        finding
        for cause, count in inertial.dropped.items()
        for finding in finding_if(count, "imu_windows_dropped", f"windows of inertial readings were skipped: {cause}")
    ]
    return {name: table for name, table in windows.items() if len(table)}, findings


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


def survey_findings(outcomes: Sequence[SessionOutcome]) -> list[Finding]:
    """Sum the sessions' findings; count sessions without a label, devices without a reading, and no reading at all."""
    findings = pooled(finding for outcome in outcomes for finding in outcome.findings)
    failed = [outcome for outcome in outcomes if outcome.error is not None]
    if failed:
        message = f"sessions could not be mapped and have no labels; the first: {failed[0].error}"
        findings.append(Finding(kind=FAILED, file="", count=len(failed), message=message))
    devices = {outcome.device for outcome in outcomes}
    silent = sorted(devices - {outcome.device for outcome in outcomes if outcome.technologies})
    if len(silent) == len(devices):
        message = "sessions, but none has radio readings, so the data set has no fingerprints"
        findings.append(Finding(kind="no_radio_reading", file="", count=len(outcomes), message=message))
    elif silent:
        message = f"devices have no radio reading in any session: {', '.join(silent)}"
        findings.append(Finding(kind="device_without_scan", file="", count=len(silent), message=message))
    return findings


PLANS = "plans"


@dataclass(frozen=True)
class LabelledSource:
    """One labelled survey, the building it is of, and its plans by floor number.

    ``floors`` are those of the labels, with the current georeference of the raw survey, if known.
    """

    labelled: LabelledSurvey
    building: str
    floors: tuple[FloorRecord, ...]
    plans: dict[int, Path]
    survey: Path | None
    """The raw survey, if known."""
    site: Site | None
    """That of the raw survey."""
    named: Path
    """The given folder: the labels, or the survey that was processed first."""
    plans_left_out: tuple[Finding, ...] = ()
    """Names the plans that come from outside the survey."""
    prefixed: bool = True
    """Whether its sessions get the building's name as prefix."""

    def record(self, settings: DatasetSettings) -> DatasetSource:
        """Its entry in the manifest."""
        run = self.labelled.root / RUN_FILE
        return DatasetSource(
            kind="process",
            name=self.labelled.survey,
            version=self.labelled.version,
            settings={
                "process": dict(self.labelled.settings),
                "dataset": settings.model_dump(mode="json"),
                **({"rebase": list(self.labelled.rebase)} if self.labelled.rebase else {}),
            },
            inputs={RUN_FILE: hashlib.sha256(read_bytes(run)).hexdigest()},
        )


def open_sources(
    outs: Sequence[Path],
    buildings: Sequence[str],
    surveys: Sequence[Path | None],
    named: Sequence[Path],
    scratch: Folder,
    *,
    follow_links: bool = False,
) -> tuple[LabelledSource, ...]:
    """Open output folders of ``process``; ``surveys`` are their raw surveys, if known, for the plans.

    ``named`` are the given folders, for messages. Plans that are not images are drawn to ``scratch``. Plans and
    sessions that links lead to outside the survey are skipped, unless ``follow_links``.

    Raises DatasetError if a folder is not such an output or no session remains, UsageError unless there is one
    building name for each, or if a survey does not match.
    """
    if buildings and len(buildings) != len(outs):
        raise UsageError(
            f"--building: got {len(buildings)} names for {len(outs)} sources; give one for each, in their order"
        )
    opened = [open_labelled(out, follow_links=follow_links) for out in outs]
    names = list(buildings) or _buildings(opened)
    several = bool(buildings) or len(set(names)) > 1
    found = []
    for i, (labelled, building, survey, folder) in enumerate(zip(opened, names, surveys, named, strict=True)):
        if survey is None:
            found.append(LabelledSource(labelled, building, labelled.floors, {}, None, None, folder, prefixed=several))
            continue
        if not follow_links:
            labelled = without_sessions(labelled, slugs_from_outside(survey))
        site, findings = read_site(survey, follow_links=follow_links)
        floors, plans = _of_site(site, survey, labelled, scratch.folder(str(i)))
        left_out = tuple(left_out_of(findings))
        found.append(LabelledSource(labelled, building, floors, plans, survey, site, folder, left_out, several))
    return tuple(found)


def _buildings(opened: Sequence[LabelledSurvey]) -> list[str]:
    """Building of each source by its site; sources without a name are of the only named building."""
    named = {each.building for each in opened} - {""}
    return [next(iter(named)) if len(named) == 1 else each.building for each in opened]


def _of_site(
    site: Site, survey: Path, labelled: LabelledSurvey, scratch: Folder
) -> tuple[tuple[FloorRecord, ...], dict[int, Path]]:
    """Floors with georeferences, and plans, of a survey; raises UsageError if its floors differ from those labelled."""
    for record in labelled.floors:
        floors = [floor for floor in site.floors if floor.number == record.number]
        if [floor.extent_m for floor in floors] != [_extent(record)]:
            raise UsageError(
                f"--survey {survey}: floor {record.number} differs from the floor of the labels in {labelled.root}; "
                "give the survey of these labels, or process this one again"
            )
    drawn = {floor.number: plan_file(floor, scratch) for floor in site.floors}
    earth = {floor.number: floor.georeference for floor in site.floors if floor.georeference is not None}
    records = tuple(
        record.model_copy(update={"georeference": earth.get(record.number, record.georeference)})
        for record in labelled.floors
    )
    plans = {number: plan for number, plan in drawn.items() if plan is not None}
    return records, plans


def _extent(record: FloorRecord) -> tuple[float, float, float, float] | None:
    if record.width_m is None or record.height_m is None:
        return None
    left, low = record.lower_left_m
    return left, left + record.width_m, low, low + record.height_m


def merged_floors(sources: Sequence[LabelledSource]) -> tuple[tuple[FloorInfo, ...], dict[str, Path]]:
    """List the floors of all sources, sorted, and their plans by the path that they get in the data set.

    Raises DatasetError if two sources have different floors of one number in one building.
    """
    found: dict[tuple[str, int], tuple[FloorInfo, LabelledSource]] = {}
    plans: dict[str, Path] = {}
    for source in sources:
        for record in source.floors:
            key = (source.building, record.number)
            plan = source.plans.get(record.number)
            path = None if plan is None else plan_path(source.building, record.number, plan)
            if path is not None and plan is not None:
                plans.setdefault(path, plan)
            if key in found:
                _refuse_clash(*found[key], record, source)
            if key not in found or (path and found[key][0].plan is None):
                found[key] = (_floor(record, source.building, path), source)
    return tuple(info for _, (info, _) in sorted(found.items(), key=lambda item: item[0])), plans


def plan_path(building: str, number: int, plan: Path) -> str:
    """Path of a floor's plan in a data set's folder."""
    stem = f"floor_{number}" if not building else f"{unique_slugs([building])[0]}.floor_{number}"
    return f"{PLANS}/{stem}{plan.suffix.lower()}"


def _floor(record: FloorRecord, building: str, plan: str | None) -> FloorInfo:
    return FloorInfo(building=building, plan=plan, **record.model_dump())


def named_rooms(floor: Floor, settings: WalkableSettings | None = None) -> tuple[RoomInfo, ...]:
    """The rooms and corridors of a floor that have a name; none without a plan, or without the extra that reads it."""
    try:
        from vislam2tag.site.rooms import room_boxes  # packages of extras

        boxes = room_boxes(floor, settings)
    except ModuleNotFoundError as error:
        if missing_extra(error) is None:
            raise
        return ()  # the coverage of the floor names the extra
    return tuple(RoomInfo(name=name, boxes_m=tuple(map(tuple, own.round(2).tolist()))) for name, own in boxes.items())


def _refuse_clash(floor: FloorInfo, first: LabelledSource, record: FloorRecord, second: LabelledSource) -> None:
    for name, unit in (("width_m", "wide"), ("height_m", "deep"), ("elevation_m", "high up")):
        one, other = getattr(floor, name), getattr(record, name)
        if one != other and one is not None and other is not None:
            raise DatasetError(
                f"floor {record.number} is {one:g} m {unit} in {first.named} and {other:g} m in "
                f"{second.named}: if these are two buildings, give a --building NAME for each source"
            )


def named_sessions(sources: Sequence[LabelledSource]) -> list[tuple[str, LabelledSource, LabelledSession]]:
    """Name every session of the sources, sorted by name: its slug, with the building's name as prefix if there is one.

    Raises DatasetError if two sources have a session of one name.
    """
    found: dict[str, tuple[LabelledSource, LabelledSession]] = {}
    for source in sources:
        prefix = f"{unique_slugs([source.building])[0]}." if source.building and source.prefixed else ""
        for session in source.labelled.sessions:
            name = prefix + session.slug
            if name in found:
                raise DatasetError(
                    f"session {session.slug} is in {found[name][0].named} and in {source.named}: give each walk "
                    "once; for two buildings, give a --building NAME for each source"
                )
            found[name] = (source, session)
    return [(name, *found[name]) for name in sorted(found)]
