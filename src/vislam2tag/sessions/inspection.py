"""What is in a survey and what is wrong with it, without mapping anything."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.files.store import shown
from vislam2tag.common.findings import NOT_RUN, Answer, Finding, Judgement, Severity, count_of, counted
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.prepared import SessionTask, prepared_session
from vislam2tag.sessions.readings import median_scan_interval_s
from vislam2tag.sessions.registry import open_survey
from vislam2tag.sessions.session_landmarks import other_ids_findings
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.site.corrections.file import Corrections, read_corrections
from vislam2tag.site.corrections.unknown import unknown_landmarks
from vislam2tag.site.landmark_states import LandmarkCounts
from vislam2tag.site.links import Link, link_findings, links_in
from vislam2tag.site.model import Floor, SessionRef, Survey
from vislam2tag.site.settings import SurveySettings
from vislam2tag.site.stored_survey import survey_at_hand
from vislam2tag.site.walkable.plan_costs import plan_mark


class FloorOverview(Record):
    """One floor of the site."""

    number: int
    name: str
    width_m: float | None
    height_m: float | None
    elevation_m: float | None
    plan: str | None
    landmarks: int
    landmarks_planned: int
    """Those whose position was only planned."""
    landmarks_unsurveyed: int
    control_points: int
    sessions: int


class SessionOverview(Record):
    """One session: how much of everything, and what is wrong with it."""

    floor: int
    device: str
    session: str
    format: str
    excluded: bool
    """Left out by corrections.toml, and therefore not read."""
    error: str | None
    """Why it cannot be read; None where it can."""
    frames: int = 0
    usable_frames: int = 0
    duration_s: float = 0.0
    frame_rate_hz: float | None = None
    landmarks_seen: tuple[str, ...] = ()
    landmarks_surveyed: int = 0
    """How many of the landmarks seen have a surveyed position."""
    on_plan: bool = False
    """Whether it saw no landmarks, and the plan of its floor may place it."""
    fixes: int | None = None
    """Known positions that a session without poses is mapped by; None where a tracker was logged."""
    wifi_scans: int = 0
    wifi_rows: int = 0
    scan_interval_s: float | None = None
    sensor_rows: int = 0
    ble_rows: int | None = None
    """None where no BLE was logged."""
    presses: int = 0
    ended: str | None = None
    """How the recording ended, by the recorder's word; None where it says nothing of itself."""
    scans_refused: int | None = None
    columns: str = ""
    """The content of a ``columns.toml`` that names the columns as they were read; empty for formats without names."""
    findings: tuple[Finding, ...] = ()

    @property
    def usable(self) -> bool:
        """Whether the session can be read and has what mapping needs, or is left out."""
        if self.excluded:
            return True
        placed = self.landmarks_surveyed > 0 or self.on_plan or self.fixes is not None
        return self.error is None and placed and all(each.severity != Severity.ERROR for each in self.findings)


class Inspection(Result):
    """A whole survey: site, sessions, findings of the site's own files."""

    main_table: ClassVar[str] = "sessions"

    survey: str
    floors: tuple[FloorOverview, ...]
    sessions: tuple[SessionOverview, ...]
    findings: tuple[Finding, ...]
    links: tuple[Link, ...] = ()
    """All links below the survey's folder; a survey in a store has none."""
    judgement: Judgement = NOT_RUN
    """Whether anything is wrong with what was read: an empty list of findings is not an answer."""

    @property
    def usable(self) -> bool:
        """Whether some session is to be mapped, all that are can be, and no finding about the site is an error."""
        return self.judgement.answer is Answer.NOTHING_WRONG


def inspect_survey(
    root: AnyPath,
    finding_settings: FindingSettings | None = None,
    progress: Progress[int] = silent,
    *,
    survey_settings: SurveySettings | None = None,
) -> Inspection:
    """Read a survey session by session and report what is there; raises SurveyError where it is not a survey.

    ``progress`` is called with the number of sessions done and their total. Corrections are not applied to the
    figures, but sessions they exclude are not read.
    """
    root = Path(root)
    with survey_at_hand(root) as folder:
        settings = survey_settings or SurveySettings()
        survey = open_survey(folder, settings.landmark_sigma_m, use_planned=settings.use_planned)
        found = _inspection(folder, survey, finding_settings or FindingSettings(), progress)
        return found.model_copy(update={"survey": shown(root)})


def _inspection(root: Path, survey: Survey, finding_settings: FindingSettings, progress: Progress[int]) -> Inspection:
    corrections = read_corrections(root)
    sessions = []
    for done, ref in enumerate(survey.sessions):
        progress(done, len(survey.sessions))
        sessions.append(_session_overview(survey, ref, corrections, finding_settings))
    progress(len(survey.sessions), len(survey.sessions))
    links = tuple(links_in(root))
    whole = not any(one.excluded or one.error for one in sessions)
    seen = {name for one in sessions for name in one.landmarks_seen}
    unknown = unknown_landmarks(corrections, survey.site, seen, ()) if whole else []
    findings = (*survey.findings, *unknown, *_id_findings(survey, sessions), *link_findings(links))
    return Inspection(
        survey=str(root),
        floors=tuple(_floor(survey, floor) for floor in survey.site.floors),
        sessions=tuple(sessions),
        findings=findings,
        links=links,
        judgement=_judgement(sessions, findings),
    )


def _id_findings(survey: Survey, sessions: list[SessionOverview]) -> list[Finding]:
    """Ids of the sessions that are of another kind than those of the landmark tables."""
    logged: dict[int, set[str]] = defaultdict(set)
    for session in sessions:
        logged[session.floor] |= set(session.landmarks_seen)
    return other_ids_findings(survey.site.landmarks, logged)


def _judgement(sessions: Sequence[SessionOverview], findings: Sequence[Finding]) -> Judgement:
    """What reading the sessions and the site's files says."""
    excluded = sum(session.excluded for session in sessions)
    read = len(sessions) - excluded
    left_out = f"{counted(excluded, 'session')} excluded by corrections.toml" if excluded else ""
    if not read:
        return Judgement(answer=Answer.NOT_LOOKED_AT, why=f"no session was read: {left_out or 'the survey has none'}")
    wrong = sum(not one.usable for one in sessions) + count_of(Severity.ERROR, findings)
    warnings = sum(count_of(Severity.WARNING, found) for found in (findings, *(one.findings for one in sessions)))
    looked_at = f"the site's files and {counted(read, 'session')}, not mapped"
    return Judgement.of(wrong, read, looked_at, left_out, warnings)


def _floor(survey: Survey, floor: Floor) -> FloorOverview:
    landmarks = LandmarkCounts.of(survey.site.landmarks.on_floor(floor.number))
    return FloorOverview(
        number=floor.number,
        name=floor.name,
        width_m=floor.width_m,
        height_m=floor.height_m,
        elevation_m=floor.elevation_m,
        plan=floor.plan.relative_to(survey.root).as_posix() if floor.plan else None,
        landmarks=landmarks.total,
        landmarks_planned=landmarks.planned,
        landmarks_unsurveyed=landmarks.without_position,
        control_points=len(floor.control_points.ids),
        sessions=sum(ref.key.floor == floor.number for ref in survey.sessions),
    )


def _session_overview(
    survey: Survey, ref: SessionRef, corrections: Corrections, finding_settings: FindingSettings
) -> SessionOverview:
    key = ref.key
    excluded = corrections.excludes(key)
    blank = SessionOverview(
        floor=key.floor, device=key.device, session=key.session, format=ref.format, excluded=excluded, error=None
    )
    if excluded:
        return blank
    try:
        prepared = prepared_session(SessionTask(ref, survey.site, Corrections(), finding_settings=finding_settings))
    except SessionError as error:
        return blank.model_copy(update={"error": str(error)})
    session, landmarks = prepared.session, prepared.landmarks
    return blank.model_copy(
        update={
            **_amounts(session),
            "landmarks_seen": session.landmarks.ids,
            "landmarks_surveyed": len(landmarks.surveyed_ids.intersection(session.landmarks.ids)),
            "on_plan": not session.landmarks.ids
            and bool(session.camera.plans)
            and plan_mark(prepared.task.floor) is not None,
            "findings": tuple(prepared.findings()),
        }
    )


def _amounts(session: Session) -> dict[str, object]:
    rate_hz = session.camera.frame_rate_hz
    wifi = session.tables["wifi"]
    interval_s = median_scan_interval_s(wifi)
    return {
        "frames": len(session.camera.time_ns),
        "usable_frames": int(session.camera.usable.sum()),
        "duration_s": round(session.camera.duration_s, 3),
        "frame_rate_hz": None if rate_hz is None else round(rate_hz, 3),
        "wifi_scans": wifi["scan"].n_unique(),
        "wifi_rows": wifi.height,
        "scan_interval_s": None if interval_s is None else round(interval_s, 3),
        "sensor_rows": session.tables["sensors"].height,
        "ble_rows": session.tables["ble"].height if "ble" in session.tables else None,
        "presses": len(session.presses_ns),
        "columns": session.columns,
        "fixes": None if session.camera.fixes is None else len(session.camera.fixes.time_ns),
        "ended": session.recording.ended if session.recording else None,
        "scans_refused": session.recording.scans_refused if session.recording else None,
    }
