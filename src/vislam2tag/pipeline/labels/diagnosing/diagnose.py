"""The diagnosis: a survey folder goes in; what is wrong with it comes out, with the lines that correct it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

from vislam2tag import __version__
from vislam2tag.common.errors import SurveyError
from vislam2tag.common.extras import MissingExtraError
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.text_paths import AnyPath, path_or_none
from vislam2tag.labeling.settings import ProcessSettings
from vislam2tag.pipeline.labels.diagnosing.diagnose_session import DiagnosedSession, MappedShare, observe_session
from vislam2tag.pipeline.labels.diagnosing.survey_evidence import survey_evidence, thinned
from vislam2tag.pipeline.labels.diagnosing.wifi_clocks import wifi_clocks
from vislam2tag.pipeline.labels.joining.landmark_survey import join_sessions
from vislam2tag.pipeline.labels.joining.odd_references import odd_faults, references
from vislam2tag.pipeline.run.selection import Selection, selected, session_task
from vislam2tag.pipeline.run.workers import process_all
from vislam2tag.quality.diagnosis.id_faults import id_faults
from vislam2tag.quality.diagnosis.record import Diagnosis, Fault, FaultKind, Gain, References
from vislam2tag.quality.diagnosis.search import MIN_FIXES, found_faults, judgement_of
from vislam2tag.quality.diagnosis.stream_faults import stream_faults
from vislam2tag.quality.diagnosis.turned_tables import Inside, with_turns_by_plan
from vislam2tag.sessions.registry import open_survey, true_keys
from vislam2tag.site.corrections.edits import with_entries
from vislam2tag.site.corrections.file import Corrections, read_corrections
from vislam2tag.site.discover import session_folders
from vislam2tag.site.landmark_states import LandmarkCounts
from vislam2tag.site.model import SessionKey, SessionRef, Survey
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.walkable.space import walkable_space

MOST_MAPPED_AGAIN = 12
"""The gain of a correction is told by so many of the sessions that it concerns, the first ones."""


def diagnose(
    survey_root: AnyPath,
    settings: ProcessSettings | None = None,
    *,
    landmarks: AnyPath | None = None,
    selection: Selection | None = None,
    jobs: int = 1,
    progress: Progress[DiagnosedSession] = silent,
) -> Diagnosis:
    """Name what is wrong with a survey, how that is known, what its correction brings, and the lines to correct it.

    ``landmarks`` is a file that replaces the floors' own. With ``jobs`` > 1 sessions run in that many processes (call
    it from under ``if __name__ == "__main__":``). Raises SurveyError where ``survey_root`` is no survey, UsageError for
    a selection that matches nothing; a session that cannot be read is named in ``Diagnosis.failed``.
    """
    survey_root, landmarks = Path(survey_root), path_or_none(landmarks)
    settings = settings or ProcessSettings()
    survey = open_survey(
        survey_root, settings.survey.landmark_sigma_m, landmarks, use_planned=settings.survey.use_planned
    )
    corrections = read_corrections(survey_root)
    chosen = selected(survey, corrections, selection or Selection())
    refs = thinned(chosen)
    sessions: list[DiagnosedSession] = []

    def keep(session: DiagnosedSession) -> None:
        sessions.append(session)
        progress(session, len(refs))

    todo = [session_task(ref, survey, corrections, settings) for ref in refs]
    process_all(partial(observe_session, settings), todo, jobs, keep)
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
    shares = {session.key: session.share for session in sessions}
    failed = [session.error for session in sessions if session.error is not None]
    fixes = sum(session.fixes for session in sessions if session.fixes >= MIN_FIXES)
    return Diagnosis(
        version=__version__,
        sessions=len(sessions),
        left_aside=len(chosen) - len(refs),
        failed=failed,
        faults=_with_gains(survey, settings, refs, faults, shares),
        judgement=judgement_of(evidence, len(sessions), len(failed), len(faults), fixes),
        references=found,
        landmarks=str(LandmarkCounts.of(survey.site.landmarks)) if survey.site.landmarks.ids else "",
    )


def _references(
    survey: Survey, settings: ProcessSettings, sessions: Sequence[DiagnosedSession], faults: Sequence[Fault]
) -> References:
    """How references fit one another; nothing where a whole table is wrong, which then contradicts everywhere."""
    if any(not (fault.landmarks or fault.sessions) for fault in faults):
        return References()
    maps = [session.landmark_map for session in sessions if session.landmark_map is not None]
    return references(join_sessions(survey, maps, settings.survey.landmark_sigma_m))


def _walkable_floors(survey: Survey) -> dict[int, Inside]:
    """What tells of each floor where can be walked, for those with a plan that tells it."""
    found: dict[int, Inside] = {}
    for floor in survey.site.floors:
        if floor.plan is not None:
            with suppress(SurveyError, MissingExtraError):
                from vislam2tag.site.walkable.plan_cells import floor_mask  # a package of an extra

                found[floor.number] = walkable_space(floor_plan(floor), mask=floor_mask(floor)).inside
    return found


def _with_gains(
    survey: Survey,
    settings: ProcessSettings,
    refs: Sequence[SessionRef],
    faults: Sequence[Fault],
    shares: dict[SessionKey, MappedShare],
) -> list[Fault]:
    """Map the sessions that each correction concerns again, all before it applied."""
    lines, before, told = "", dict(shares), []
    folder_key = {folder: key for key, folder in session_folders(survey.root)[0]}
    for fault in faults:
        if fault.odds is None:  # not told by how walks fit, and so nothing that mapping them again would tell
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
    """How well a session is mapped with further corrections; its key, by its folder's, may change by them."""
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
