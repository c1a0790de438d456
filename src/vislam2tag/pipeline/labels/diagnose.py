"""Faults of a survey, and corrections for them.

Each session is read in a worker process; faults are found from all sessions together.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Unpack

import numpy as np
import polars as pl

from vislam2tag import __version__
from vislam2tag.common.errors import MissingExtraError, SessionError, SurveyError
from vislam2tag.common.files.given_files import AnyPath
from vislam2tag.common.findings import FaultKind
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.tabular import TabularResult
from vislam2tag.core.tracks import longest_section
from vislam2tag.estimation.dead_reckoning.bridging import bridged_observations
from vislam2tag.estimation.dead_reckoning.walk import LeftOut
from vislam2tag.estimation.observations import FEWEST_FRAMES
from vislam2tag.estimation.odometry import Odometry
from vislam2tag.estimation.smoother import mapped_path
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.check import doubtful_fixes, reckoned, solved
from vislam2tag.pipeline.labels.landmark_survey import ReducedSession, join_sessions, reduced
from vislam2tag.pipeline.labels.odd_references import odd_faults, references
from vislam2tag.pipeline.labels.survey_evidence import Places, places_of, survey_evidence, thinned
from vislam2tag.pipeline.labels.wifi_clocks import wifi_clocks
from vislam2tag.pipeline.run.failures import done_or_failed
from vislam2tag.pipeline.run.selection import OpenedSurvey, RunChoices, session_task
from vislam2tag.pipeline.run.workers import outcomes_of
from vislam2tag.quality.diagnosis.alignment import WalkPasses
from vislam2tag.quality.diagnosis.id_faults import floors_of_passes, id_faults
from vislam2tag.quality.diagnosis.record import Diagnosis, Fault, Gain, References, answered
from vislam2tag.quality.diagnosis.search import MIN_FIXES, found_faults, judgement_of
from vislam2tag.quality.diagnosis.stream_faults import StreamSigns, stream_faults, stream_signs
from vislam2tag.quality.diagnosis.turned_tables import Inside, with_turns_by_plan
from vislam2tag.quality.diagnosis.wifi_clock import HeardOnWalk
from vislam2tag.quality.self_check import expected_error_m
from vislam2tag.quality.self_check_record import DoubtfulFix
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.prepared import PreparedSession, SessionTask, mappable_session, read_corrected
from vislam2tag.sessions.registry import true_keys
from vislam2tag.sessions.session_landmarks import AmbiguousLandmarksError, clashes, floors_told, walk_id_shift
from vislam2tag.site.corrections.edits import with_entries
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.discover import session_folders
from vislam2tag.site.landmark_states import LandmarkCounts
from vislam2tag.site.model import SessionKey, SessionRef, Survey
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.walkable.plan_costs import plan_costs
from vislam2tag.site.walkable.space import walkable_space

PATH_STEP = 15
"""Number of frames between kept places of the way."""


@dataclass(frozen=True)
class MappedShare:
    """How well a session can be mapped: its frames, those with a small enough sigma, and the sum of their expected
    errors, metres.
    """

    frames: int = 0
    labelled: int = 0
    expected_m: float = 0.0


@dataclass(frozen=True, repr=False)
class DiagnosedSession(TabularResult):
    """Result of a worker."""

    key: SessionKey
    error: str | None = None
    passes: WalkPasses | None = None
    places: Places = field(default_factory=dict)
    signs: StreamSigns | None = None
    share: MappedShare = MappedShare()
    faults: tuple[Fault, ...] = ()
    """Evidence from the session alone."""
    heard: HeardOnWalk | None = None
    """The scans and the way in the frame of the passes."""
    fixes: int = 0
    """Known positions of a session without poses that could be compared with its others."""
    on_plan: bool = False
    """Whether no landmarks connect it to the building, but the plan of its floor may place it."""
    landmark_map: ReducedSession | None = None
    """Its landmarks in its own frame; None if they cannot be joined with other sessions."""


def observe_session(settings: ProcessSettings, task: SessionTask) -> DiagnosedSession:
    """Read a session, reduce it and map it; one that cannot be read becomes an error."""
    key = task.ref.key
    return done_or_failed(key, lambda: _observed_or_told(settings, task), partial(DiagnosedSession, key))


def _observed_or_told(settings: ProcessSettings, task: SessionTask) -> DiagnosedSession:
    try:
        return _observed(settings, task)
    except AmbiguousLandmarksError as error:
        faults = _floors_of_landmarks(settings, task)
        return DiagnosedSession(task.ref.key, error=None if faults else str(error), faults=faults)


def _observed(settings: ProcessSettings, task: SessionTask) -> DiagnosedSession:
    whole = mappable_session(task, inertial=settings.inertial)
    if whole.session.camera.without_poses:
        walk = reckoned(whole, settings)
        left_out = LeftOut.of(walk)
        doubtful = doubtful_fixes(walk, left_out)
        return DiagnosedSession(
            task.ref.key,
            signs=stream_signs(whole.session),
            faults=tuple(_doubtful(task.ref.key, fix) for fix in doubtful),
            fixes=int(np.isfinite(left_out.sigma_m).sum()),
        )
    prepared = whole.longest_section()
    session = prepared.session
    observations, smoothed = solved(prepared, settings.mapping.smoother.sighting_range_m)
    shift = walk_id_shift(session.camera, session.landmarks, prepared.landmarks)
    share = MappedShare(frames=int(session.camera.usable.sum()))
    if smoothed is not None:
        covariance = mapped_path(smoothed)[1]
        labelled = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2) <= settings.labels.max_sigma_m
        expected_m = float(expected_error_m(covariance[labelled]).sum())
        share = MappedShare(share.frames, int(labelled.sum()), expected_m)
    return DiagnosedSession(
        session.key,
        passes=WalkPasses.of(session.key, observations, shift),
        places=places_of(prepared),
        signs=stream_signs(whole.session),
        share=share,
        heard=_heard(session, observations.odometry),
        on_plan=smoothed is None and plan_costs(task.floor) is not None,
        landmark_map=_landmark_map(settings, prepared),
    )


def _landmark_map(settings: ProcessSettings, prepared: PreparedSession) -> ReducedSession | None:
    try:
        return reduced(settings.mapping, prepared)
    except SessionError:
        return None


def _floors_of_landmarks(settings: ProcessSettings, task: SessionTask) -> tuple[Fault, ...]:
    """Add, to a session that could not be prepared because ids are on several floors, the floors of its passes."""
    session, _ = read_corrected(task)
    camera, log = longest_section(session.camera, session.landmarks)
    if camera.usable.sum() < FEWEST_FRAMES:
        return ()
    considered, _ = task.candidate_landmarks(log.ids, floors_told(session))
    doubtful = {name for name, _, _ in clashes(considered, log.ids)}
    places: dict[str, complex] = {}
    sheets: dict[str, dict[int, complex]] = defaultdict(dict)
    for row in np.flatnonzero(considered.surveyed).tolist():
        name, at = considered.ids[row], complex(*considered.position_bcs[row])
        if name in doubtful:
            sheets[name][int(considered.floor[row])] = at
        else:
            places[name] = at
    observations = bridged_observations(camera, log, settings.mapping.smoother.sighting_range_m)
    return tuple(floors_of_passes(WalkPasses.of(session.key, observations), places, sheets))


def _heard(session: Session, odometry: Odometry) -> HeardOnWalk:
    """A session's scans without repeated rows, with the tracker's way."""
    rows = session.tables["wifi"].filter(
        ~pl.col("repeated") & pl.col("rssi_dbm").is_not_null() & pl.col("bssid").is_not_null()
    )
    start_s = float(session.camera.time_ns[session.camera.usable][0]) * 1e-9
    return HeardOnWalk(
        time_s=rows["time_ns"].to_numpy() * 1e-9,
        scan=rows["scan"].cast(pl.Int64).to_numpy(),
        bssid=rows["bssid"].to_numpy().astype(str),
        dbm=rows["rssi_dbm"].cast(pl.Float64).to_numpy(),
        way_s=start_s + odometry.time_s[::PATH_STEP],
        way=odometry.path[::PATH_STEP],
    )


def _doubtful(key: SessionKey, fix: DoubtfulFix) -> Fault:
    east, north = fix.offset_m
    return Fault(
        kind=FaultKind.DOUBTFUL_FIX,
        floor=key.floor,
        sessions=[str(key)],
        summary=f"the fix of {fix.name} of {key} is {fix.size_m:.1f} m from its expected position: "
        "tap it again, or exclude it",
        evidence=f"sensors and the other fixes put the walker {east:+.1f} m along x and {north:+.1f} m along y of it, "
        f"to {fix.sigma_m:.1f} m per axis",
    )


MOST_MAPPED_AGAIN = 12
"""The gain of a correction is estimated from at most this many of the sessions that it concerns."""


def diagnose(
    survey_root: AnyPath,
    settings: ProcessSettings | None = None,
    *,
    progress: Progress[DiagnosedSession] = silent,
    **choices: Unpack[RunChoices],
) -> Diagnosis:
    """Find the faults of a survey, with evidence, the gain of a correction, and lines for corrections.toml.

    ``landmarks``, ``selection`` and ``jobs`` are as :class:`~vislam2tag.pipeline.run.selection.RunChoices` says. Raises
    SurveyError if ``survey_root`` is not a survey, UsageError for a selection that matches nothing; a session that
    cannot be read is named in ``Diagnosis.failed``.
    """
    opened = OpenedSurvey.at(survey_root, settings, **choices)
    survey, settings, chosen = opened.survey, opened.settings, opened.refs
    refs = thinned(chosen)
    sessions = outcomes_of(opened.run_all, partial(observe_session, settings), opened.tasks(refs), progress)
    sessions.sort(key=lambda session: session.key)
    walks = [(session.passes, session.places) for session in sessions if session.passes is not None]
    of_ids, walks = id_faults(survey.site.landmarks, walks)
    evidence = survey_evidence(survey, walks)
    faults, corrected = found_faults(evidence)
    heard = {session.key: session.heard for session in sessions if session.heard is not None}
    ways = {key: one.as_way for key, one in heard.items()}
    faults = with_turns_by_plan(faults, corrected, ways, _walkable_floors(survey))
    clocks = wifi_clocks(corrected, heard)
    signs = {session.key: session.signs for session in sessions if session.signs is not None}
    faults += stream_faults({key: replace(one, wifi=clocks.get(key)) for key, one in signs.items()}, faults)
    faults += [fault for session in sessions for fault in session.faults]
    if any(fault.kind is FaultKind.SHIFTED_IDS for fault in of_ids):
        found = References()  # every place contradicts then
    else:
        found = _references(survey, settings, sessions, faults)
    faults = [*of_ids, *faults, *odd_faults(found, faults)]
    failed = [session.error for session in sessions if session.error is not None]
    fixes = sum(session.fixes for session in sessions if session.fixes >= MIN_FIXES)
    judgement = judgement_of(evidence, len(sessions), len(failed), len(faults), fixes)
    faults, judgement = answered(faults, judgement, opened.corrections.ignore_fault)
    shares = {session.key: session.share for session in sessions}
    return Diagnosis(
        version=__version__,
        sessions=len(sessions),
        left_aside=len(chosen) - len(refs),
        on_plan=sum(session.on_plan for session in sessions),
        failed=failed,
        faults=_with_gains(survey, settings, refs, faults, shares),
        judgement=judgement,
        references=found,
        landmarks=str(LandmarkCounts.of(survey.site.landmarks)) if survey.site.landmarks.ids else "",
    )


def _references(
    survey: Survey, settings: ProcessSettings, sessions: Sequence[DiagnosedSession], faults: Sequence[Fault]
) -> References:
    """How references fit one another; empty if a whole table is wrong, because it then contradicts everywhere."""
    if any(not (fault.landmarks or fault.sessions) for fault in faults):
        return References()
    maps = [session.landmark_map for session in sessions if session.landmark_map is not None]
    return references(join_sessions(survey, maps, settings.survey.landmark_sigma_m))


def _walkable_floors(survey: Survey) -> dict[int, Inside]:
    """Rooms and walkable space of each floor with a usable plan."""
    found: dict[int, Inside] = {}
    for floor in survey.site.floors:
        if floor.plan is not None:
            with suppress(SurveyError, MissingExtraError, ModuleNotFoundError):
                from vislam2tag.site.walkable.painted_cells import floor_mask

                found[floor.number] = walkable_space(floor_plan(floor), mask=floor_mask(floor)).inside
    return found


def _with_gains(
    survey: Survey,
    settings: ProcessSettings,
    refs: Sequence[SessionRef],
    faults: Sequence[Fault],
    shares: dict[SessionKey, MappedShare],
) -> list[Fault]:
    """Map the sessions that each correction concerns again, with all earlier corrections applied."""
    lines, before, told = "", dict(shares), []
    folder_key = {folder: key for key, folder in session_folders(survey.root)[0]}
    for fault in faults:
        # What is not found from how walks fit shows no gain when they are mapped again.
        if fault.odds is None or fault.ignored:
            told.append(fault)
            continue
        lines += f"{fault.lines}\n\n"
        after = with_entries(survey.root, lines)
        concerned = [ref for ref in refs if _concerns(fault, ref)][:MOST_MAPPED_AGAIN]
        now = {ref.key: _mapped_again(survey, settings, ref, folder_key[ref.folder], after) for ref in concerned}
        gain = _gain([before[key] for key in now], list(now.values()))
        told.append(fault.model_copy(update={"gain": gain}))
        before |= now
    return told


def _concerns(fault: Fault, ref: SessionRef) -> bool:
    if fault.sessions:
        return str(ref.key) in fault.sessions
    return fault.floor is None or ref.key.floor == fault.floor


def _mapped_again(
    survey: Survey, settings: ProcessSettings, ref: SessionRef, folder_key: SessionKey, after: Corrections
) -> MappedShare:
    """How well a session is mapped with further corrections, which may change its key."""
    key = true_keys([folder_key], after, survey.site)[0]
    return observe_session(settings, session_task(replace(ref, key=key), survey, after, settings)).share


def _gain(before: Sequence[MappedShare], after: Sequence[MappedShare]) -> Gain:
    def share(parts: Sequence[MappedShare]) -> float:
        return round(sum(one.labelled for one in parts) / max(sum(one.frames for one in parts), 1), 4)

    def expected_m(parts: Sequence[MappedShare]) -> float | None:
        labelled = sum(one.labelled for one in parts)
        return round(sum(one.expected_m for one in parts) / labelled, 4) if labelled else None

    return Gain(
        labelled_before=share(before),
        labelled_after=share(after),
        expected_before_m=expected_m(before),
        expected_after_m=expected_m(after),
    )
