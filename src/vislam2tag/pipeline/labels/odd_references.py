"""The odd one out of a survey by name: every reference compared with all others, and those that contradict them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from vislam2tag.common.findings import Finding
from vislam2tag.diagnosis.record import Fault, FaultKind
from vislam2tag.diagnosis.references import OddReference, Reference, References
from vislam2tag.landmark_survey.comparison import Comparison, Verdict
from vislam2tag.landmark_survey.odd_one_out import Votes, vote
from vislam2tag.pipeline.labels.landmark_survey import JointSurvey
from vislam2tag.survey.corrections.file import session_start
from vislam2tag.survey.model import SessionKey

MOST_OF_A_WALK = 0.5
"""A walk of which more of the landmarks that it passed are odd than this is odd itself."""


def references(joint: JointSurvey) -> References:
    """Compare all references of a joint survey; empty where no walk is tied to it."""
    if not joint.joined.tied.any():
        return References()
    votes = vote(joint.joined, [_day(session.key) for session in joint.mapped])
    rows = [(one, _row(joint, votes, one)) for one in votes.odd]
    return References(
        odd=tuple(_ranked(joint, rows)),
        compared=(*(row for _, row in rows), *(_row(joint, votes, one) for one in votes.fitting)),
    )


def _day(key: SessionKey) -> str | None:
    """On which a session was made, where its name tells."""
    start = session_start(key.session)
    return None if start is None else start.date().isoformat()


def odd_findings(found: References) -> list[Finding]:
    """A finding for each reference that is odd."""
    return [Finding(kind="odd_reference", file="", count=len(one.references), message=one.summary) for one in found.odd]


def odd_faults(found: References, faults: Sequence[Fault]) -> list[Fault]:
    """References that are odd, as faults without a correction; not those that a fault that was named explains."""
    return [odd for odd in map(_fault, found.odd) if not any(_explains(fault, odd) for fault in faults)]


def _fault(odd: OddReference) -> Fault:
    greatest = max(odd.references, key=lambda one: one.size_m or 0.0)
    return Fault(
        kind=FaultKind.ODD_REFERENCE,
        floor=greatest.floor,
        landmarks=sorted({one.landmark for one in odd.references}),
        sessions=sorted({one.session for one in odd.references if one.session is not None}),
        summary=odd.summary,
        evidence=f"{greatest.size_m:.2f} m off where {greatest.sigma_m:.2f} m are usual",
    )


def _explains(fault: Fault, odd: Fault) -> bool:
    """Whether a fault is of the same landmark, of the same session, or of the whole floor."""
    if fault.landmarks:
        return fault.floor == odd.floor and bool(set(fault.landmarks) & set(odd.landmarks))
    return bool(set(fault.sessions) & set(odd.sessions)) if fault.sessions else fault.floor == odd.floor


def _row(joint: JointSurvey, votes: Votes, one: Comparison) -> Reference:
    place, position = joint.places[one.landmark], votes.joined.position[one.landmark]
    compared = one.verdict is not Verdict.NOTHING
    return Reference(
        floor=place.floor,
        landmark=place.landmark,
        session=None if one.walk is None else str(joint.mapped[one.walk].key),
        day=one.day,
        verdict=one.verdict,
        x_m=round(position.real, 3),
        y_m=round(position.imag, 3),
        offset_m=(round(one.offset.real, 3), round(one.offset.imag, 3)) if compared else None,
        size_m=round(one.size_m, 3) if compared else None,
        sigma_m=round(one.sigma_m, 3) if compared else None,
    )


def _ranked(joint: JointSurvey, rows: list[tuple[Comparison, Reference]]) -> list[OddReference]:
    """By size; sights of one session that is odd itself count as one."""
    odd_sights = Counter(one.walk for one, _ in rows if one.walk is not None)
    whole = {
        walk
        for walk, count in odd_sights.items()
        if count > 1 and count > MOST_OF_A_WALK * len(joint.joined.maps[walk].landmark)
    }
    found = [_single(row) for one, row in rows if one.walk not in whole]
    found += [_of_session([row for one, row in rows if one.walk == walk]) for walk in whole]
    return sorted(found, key=lambda one: -one.size_m)


def _single(row: Reference) -> OddReference:
    where = f"landmark {row.landmark} on floor {row.floor}"
    by = f"{row.size_m:.2f} m (usual are {row.sigma_m:.2f} m)"
    if row.day is not None:
        summary = (
            f"{where} hung {by} from where survey and other days have it on {row.day}, as all walks of that day saw "
            "it: correct its place for these sessions"
        )
        return OddReference(culprit=f"{row.day}, {where}", summary=summary, references=(row,))
    if row.session is None:
        summary = f"{where} is surveyed {by} from where all walks and the other landmarks have it: measure it again"
        return OddReference(culprit=where, summary=summary, references=(row,))
    summary = (
        f"{row.session} saw {where} {by} from where survey and other walks have it: the sheet hung elsewhere then, "
        "another one has its id, or the tracker slipped there"
    )
    return OddReference(culprit=f"{row.session}, {where}", summary=summary, references=(row,))


def _of_session(rows: list[Reference]) -> OddReference:
    session = rows[0].session or ""
    summary = (
        f"{session} contradicts survey and other walks at {len(rows)} landmarks, most of those that it passed: "
        "it may lie under another floor, or its tracker have failed; look at it with vislam2tag inspect"
    )
    return OddReference(culprit=session, summary=summary, references=tuple(rows))
