"""One session as every command sees it: read, corrected, with the landmarks that it may use in its own frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vislam2tag.common.errors import SessionError
from vislam2tag.common.findings import Finding, FindingKind, Severity, counted, finding_if
from vislam2tag.core.context import PlaceTies, PlacingHints, TrackerNoise, WalkedWays
from vislam2tag.core.tracks import LandmarkLog, Landmarks, longest_section
from vislam2tag.estimation.observations import FEWEST_FRAMES
from vislam2tag.intake.pose_conventions import pose_findings
from vislam2tag.sessions.companions import with_companions
from vislam2tag.sessions.corrected import corrected_session, with_taps_corrected
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import at_hand, read_session, read_track
from vislam2tag.sessions.session_landmarks import (
    ToldLandmarks,
    ambiguous_floor,
    candidate_landmarks,
    floors_told,
    landmarks_of_session,
    on_known_floors,
    shifted_ids_findings,
    with_fewer_landmarks,
    with_told_floors,
)
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.without_poses import FILES_OF_POSES, inertial_log, with_presses_as_fixes
from vislam2tag.site.corrections.file import Corrections, SetTap
from vislam2tag.site.corrections.landmarks import corrected_landmarks, named_by_floor
from vislam2tag.site.frame_change import FrameChange, changes_from, in_frame_of
from vislam2tag.site.model import Floor, SessionRef, Site
from vislam2tag.site.settings import SurveySettings
from vislam2tag.site.site_table import site_finding
from vislam2tag.site.walkable.drawn_cells import drawn_area
from vislam2tag.site.walkable.plan_costs import plans_of

_REFUSED = ("pose_convention", "far_landmarks", "not_level")
"""Kinds of findings that, as errors, keep a session from being mapped."""


@dataclass(frozen=True)
class SessionTask:
    """All that a worker needs to prepare one session."""

    ref: SessionRef
    site: Site
    corrections: Corrections
    landmark_sigma_m: float = SurveySettings().landmark_sigma_m
    """Per axis, of landmarks whose file gives none, metres."""
    finding_settings: FindingSettings = field(default_factory=FindingSettings)
    told: ToldLandmarks | None = None
    """Landmark priors from the survey and all other sessions; None where it is mapped alone."""
    ways: WalkedWays | None = None
    """Where the other sessions without poses led on its floor; None where it is mapped alone."""
    ties: PlaceTies | None = None
    """Where other sessions say that it was, by what they received; None if they do not constrain it."""
    hints: PlacingHints | None = None
    """What other sessions say of its place on the plan; None where it is mapped alone."""
    tracker: TrackerNoise | None = None
    """How noisy other sessions say that the tracker is; None where it is mapped alone."""

    @property
    def floor(self) -> Floor:
        """The floor that the session is under; the session is mapped in its BCS."""
        return self.site.floor(self.ref.key.floor)

    @property
    def frames(self) -> dict[int, FrameChange]:
        """From the BCS that the session is mapped in to that of each floor; none where all share one."""
        return changes_from(self.site, self.ref.key.floor)

    def candidate_landmarks(self, logged: Sequence[str], told: Sequence[int] = ()) -> tuple[Landmarks, tuple[str, ...]]:
        """All landmarks that matter to the session if it logged these ids and the collector chose these floors, and one
        sentence for each correction used.

        They are corrected, and in the BCS of the session's floor.
        """
        own = self.ref.key.floor
        named = named_by_floor(self.site.landmarks, self.corrections, self.ref.key)
        considered, uses = self._corrected(candidate_landmarks(replace(self.site, landmarks=named), own, logged, told))
        return in_frame_of(considered, self.site, own), uses

    def landmarks_of_all_floors(self) -> Landmarks:
        """The site's landmarks, corrected for the session; ids may repeat from floor to floor."""
        return self._corrected(named_by_floor(self.site.landmarks, self.corrections, self.ref.key))[0]

    def _corrected(self, landmarks: Landmarks) -> tuple[Landmarks, tuple[str, ...]]:
        return corrected_landmarks(landmarks, self.corrections, self.ref.key, self.landmark_sigma_m)


@dataclass(frozen=True)
class PreparedSession:
    """A session that was read and corrected, and the landmarks that it may use, ids unique, in its own frame.

    ``unused`` are the logged ids that only other floors know and that nothing else speaks for; ``corrections`` has one
    sentence for each use of a correction.
    """

    task: SessionTask
    session: Session
    landmarks: Landmarks
    unused: tuple[str, ...]
    corrections: tuple[str, ...]

    def findings(self) -> list[Finding]:
        """What is odd about the session before it is mapped: its files, its presses, its landmarks and floors."""
        task, session = self.task, self.session
        return [
            *session.findings,
            *_damaged_poses(session),
            *press_findings(session, task.floor),
            *landmarks_without_position(session.landmarks, self.landmarks, self.unused),
            *shifted_ids_findings(session.camera, session.landmarks, self.landmarks),
            *told_by_others(task.told, task.ties),
            *ambiguous_floor(task.landmarks_of_all_floors(), session.key, session.camera, session.landmarks),
        ]

    def longest_section(self) -> PreparedSession:
        """Keep only the longest stretch in which the tracker kept one frame of reference.

        Raises SessionError where it has too few usable frames.
        """
        camera, log = longest_section(self.session.camera, self.session.landmarks)
        longest = replace(self, session=replace(self.session, camera=camera, landmarks=log))
        longest.refuse_without_frames()
        return longest

    def refuse_unfit(self, *, inertial: bool) -> None:
        """Raise SessionError if the poses cannot be mapped, by their findings or because their file has no usable one.

        ``inertial``: the user chose to map walks by inertial sensors. Otherwise a damaged file of poses is an error: it
        is not the same as a phone without tracker.
        """
        session = self.session
        refused = [each for each in session.findings if each.kind in _REFUSED and each.severity == Severity.ERROR]
        if refused:
            where = "its landmarks" if refused[0].kind == "far_landmarks" else refused[0].file or "its poses"
            raise SessionError(f"{session.key}: {where}: {refused[0].message}")
        damaged = _damaged_poses(session)
        if damaged and not inertial:
            raise SessionError(f"{session.key}: {damaged[0].message}")

    def refuse_without_frames(self) -> None:
        """Raise SessionError where the session has too few usable frames to be mapped at all."""
        if self.session.camera.usable.sum() < FEWEST_FRAMES:
            raise SessionError(
                f"{self.session.key}: there are fewer than {FEWEST_FRAMES} usable camera frames; vislam2tag inspect "
                "reports why"
            )


def mappable_session(task: SessionTask, *, inertial: bool = False) -> PreparedSession:
    """The session, for mapping; raises SessionError as :func:`prepared_session` and
    :meth:`PreparedSession.refuse_unfit`.
    """
    prepared = prepared_session(task)
    prepared.refuse_unfit(inertial=inertial)
    return prepared


def prepared_session(task: SessionTask) -> PreparedSession:
    """Read a session, correct it and choose its landmarks; raises SessionError where it cannot be read or used."""
    return prepared_from(task, _read(task, read_session))


def prepared_track(task: SessionTask) -> PreparedSession:
    """The same with no more than a map of landmarks needs: readings may be missing, and the session must be fit."""
    prepared = prepared_from(task, _read(task, read_track))
    prepared.refuse_unfit(inertial=False)
    return prepared


def prepared_from(task: SessionTask, read: Session) -> PreparedSession:
    """Correct a session as it was read and choose its landmarks; raises SessionError if it cannot be used."""
    task = replace(task, corrections=with_told_floors(task.corrections, read, task.site.landmarks))
    session, session_uses = corrected_session(read, task.corrections)
    entries = task.corrections.for_session(session.key)
    session, tap_uses = _on_its_floor(session, task, entries.set_tap)
    session = _with_readings(session)
    considered, landmark_uses = task.candidate_landmarks(session.landmarks.ids, floors_told(session))
    named = [entry.name for entry in entries.set_landmark_floor]
    own, unused = landmarks_of_session(considered, session.key, session.camera, session.landmarks, named)
    session = with_fewer_landmarks(session, own.surveyed_ids)
    session = _with_pose_findings(session, own)
    landmarks = own if task.told is None else task.told.onto(own)
    return PreparedSession(task, session, landmarks, unused, (*landmark_uses, *session_uses, *tap_uses))


def read_corrected(task: SessionTask) -> tuple[Session, tuple[str, ...]]:
    """A session with its corrections applied, and one sentence for each use; raises SessionError as reading it does."""
    read = _read(task, read_session)
    return corrected_session(read, with_told_floors(task.corrections, read, task.site.landmarks))


def _read(task: SessionTask, reader: Callable[[SessionRef, FindingSettings], Session]) -> Session:
    with at_hand(task.ref) as ref:
        read = with_companions(reader(ref, task.finding_settings), ref.own)
    return on_known_floors(read, task.site)


def _on_its_floor(session: Session, task: SessionTask, taps: Sequence[SetTap]) -> tuple[Session, tuple[str, ...]]:
    """Add what other sessions know of a session; without poses, also the fixes and walls of its floor.

    ``taps`` correct its fixes; the sentences describe each that did.
    """
    floor = task.floor
    session = with_presses_as_fixes(session, floor.control_points)
    if session.camera.without_poses and session.geographic_fixes is not None:
        fixes, findings = session.geographic_fixes.on(floor)
        camera = replace(session.camera, fixes=fixes)
        session = replace(session, camera=camera, findings=(*session.findings, *findings))
    session, uses = with_taps_corrected(session, taps)
    if not session.camera.without_poses:
        others = replace(session.camera, ties=task.ties, tracker=task.tracker, hints=_hints(task))
        plans = plans_of(task.site.floors)
        return replace(session, camera=replace(others, plans=plans, own_floor=floor.number)), uses
    return replace(session, camera=replace(session.camera, area=drawn_area(floor), ways=task.ways)), uses


def _hints(task: SessionTask) -> PlacingHints | None:
    """Hints of other sessions; the north of a georeferenced floor is known without them."""
    georeference = task.floor.georeference
    if georeference is None:
        return task.hints
    return replace(task.hints or PlacingHints(), north_rad=float(np.radians(georeference.bearing_deg)))


def _with_readings(session: Session) -> Session:
    """Give a session with poses its inertial readings, by which its losses are bridged; not those of a companion."""
    if (
        "sensors" not in session.tables
        or "sensors" in session.attached
        or not session.camera.usable.any()
        or session.camera.inertial is not None
    ):
        return session
    return replace(session, camera=replace(session.camera, inertial=inertial_log(session.tables["sensors"])))


def _with_pose_findings(session: Session, landmarks: Landmarks) -> Session:
    """Add what the poses say against themselves; sessions without poses stay as they are."""
    if session.camera.without_poses or not session.camera.usable.any():
        return session
    file = next((record.name for record in session.files if record.role == "poses"), "")
    found = pose_findings(session.camera, session.landmarks, landmarks, file)
    return replace(session, findings=(*session.findings, *found))


def _damaged_poses(session: Session) -> list[Finding]:
    """Report a file of poses that is there and has no usable pose."""
    if not session.camera.without_poses:
        return []
    closed = [each.file for each in session.findings if each.kind == "unreadable_file" and each.file in FILES_OF_POSES]
    wrong = [
        (each.name, f"has {each.lines} lines and no usable pose") for each in session.files if each.role == "poses"
    ]
    for file, what in [*wrong, *((file, "cannot be opened") for file in closed)]:
        message = (
            f"{file} {what}; copy the file from the phone again, or map the session from its inertial sensors with "
            "--strategy dead-reckoning"
        )
        return [site_finding("no_frames", file, message, Severity.ERROR)]
    return []


_ESTIMATE = ", or estimate them from the walks (process --together, survey-landmarks)"


def landmarks_without_position(log: LandmarkLog, landmarks: Landmarks, unused: Sequence[str] = ()) -> list[Finding]:
    """Report landmarks that were seen but have no surveyed position among ``landmarks``, which the session may use.

    ``unused`` are those that only other floors have, where the session does not seem to have been.
    """
    unknown = [name for name in log.ids if name not in landmarks.surveyed_ids and name not in unused]
    planned = [name for name in unknown if name in landmarks.planned_ids]
    missing = [name for name in unknown if name not in planned]
    # Without any surveyed landmark, there is nothing to estimate positions from.
    estimate = _ESTIMATE if landmarks.surveyed_ids else ""
    odd: tuple[tuple[FindingKind, Sequence[str], str], ...] = (
        (
            "planned_landmarks",
            planned,
            f"landmarks {', '.join(planned)} were observed, but their positions are only planned (vislam2tag plan), "
            f"so they are not used: measure them (vislam2tag register){estimate}, or use the planned positions with "
            "--use-planned",
        ),
        (
            "landmark_without_position",
            missing,
            f"landmarks {', '.join(missing)} were observed but have no surveyed position; only the smoother uses "
            f"them, with less weight: add their positions to marker_dict.csv{estimate}",
        ),
        (
            "landmark_of_other_floor",
            unused,
            f"landmark {', '.join(unused)} was observed, which only other floors have. Nothing else shows that the "
            "walk went there, so it is not used. If it hangs here, add it to this floor's marker_dict.csv; if the "
            "walk took a lift to that floor, pass a second landmark there or log air pressure",
        ),
    )
    return [
        finding
        for kind, names, message in odd
        for finding in finding_if(len(names), kind, message, severity=Severity.WARNING)
    ]


def told_by_others(told: ToldLandmarks | None, ties: PlaceTies | None) -> list[Finding]:
    """Report the priors from other sessions for a session that is mapped together with them."""
    if told is None or not told.ids:
        return []
    sigma_m = np.sqrt(np.diag(told.joint_covariance)[: 2 * len(told.ids)].reshape(-1, 2).mean(axis=1))
    message = (
        f"mapped together with {counted(told.sessions, 'other session')}; they determine the "
        f"{counted(len(told.ids), 'landmark')} that it passed to {np.median(sigma_m):.2f} m (one standard "
        "deviation, median)"
    )
    findings = [*finding_if(len(told.ids), "told_by_others", message)]
    if ties is not None:
        variance_m2 = np.diag(ties.covariance_m2).reshape(-1, 2).mean(axis=1)
        message = (
            f"other sessions received similar Wi-Fi scans, which place this session at {len(ties.time_ns)} moments "
            f"to {np.sqrt(np.median(variance_m2)):.1f} m each (one standard deviation, median)"
        )
        findings += finding_if(len(ties.time_ns), "placed_by_others", message)
    return findings


def press_findings(session: Session, floor: Floor) -> list[Finding]:
    """Report presses on a floor without control points, and a walk without presses on a floor that has some."""
    if not floor.control_points.ids:
        message = f"floor {floor.number} has no control points to compare the presses with: add its refmarker.csv"
        return [*finding_if(len(session.presses_ns), "missing_control_points", message)]
    message = "no presses were recorded, although the floor has control points; none of them is evaluated"
    recorded = any(file.role == "presses" for file in session.files)
    return [*finding_if(int(not recorded), "missing_file", message, "refMarker.csv")]
