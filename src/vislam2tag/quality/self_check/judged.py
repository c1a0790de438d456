"""Whether a check could judge the landmarks and known positions of a survey, and how many of them."""

from __future__ import annotations

from collections.abc import Sequence

from vislam2tag.common.judgement import Answer, Judgement, counted, none_mapped
from vislam2tag.quality.self_check.record import SessionCheck

NO_SESSION = "the survey has no session that is not excluded"
_TOO_FEW = "no session passes enough surveyed landmarks, or has enough known positions, to leave one out in turn"


def judgement_of(sessions: Sequence[SessionCheck], bad: int) -> Judgement:
    """The answer about the landmarks of checked sessions, ``bad`` of which are named."""
    if not sessions:
        return Judgement(answer=Answer.NOT_LOOKED_AT, why=NO_SESSION)
    failed = sum(session.error is not None for session in sessions)
    judging = [session for session in sessions if session.well_founded]
    marks = {(mark.floor, mark.landmark) for session in judging if not session.fixes for mark in session.left_out}
    fixes = sum(len(session.left_out) for session in judging if session.fixes)
    parts = [counted(len(marks), "landmark")] if marks else []
    parts += [counted(fixes, "known position")] if fixes else []
    if not parts:
        return Judgement.of(bad, 0, "", none_mapped(failed) if failed == len(sessions) else _TOO_FEW)
    rest = len(sessions) - len(judging)
    why = f"{counted(rest, 'session')} could not judge any" if rest else ""
    return Judgement.of(bad, len(parts), f"{' and '.join(parts)} in {counted(len(judging), 'session')}", why)
