"""The odd one out of a survey by name: every reference compared with all others, and those that contradict them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from vislam2tag.common.findings import Finding
from vislam2tag.estimation.landmark_survey.comparison import Comparison, Verdict
from vislam2tag.estimation.landmark_survey.device_metre import DeviceMetre
from vislam2tag.estimation.landmark_survey.odd_one_out import Votes, vote
from vislam2tag.pipeline.labels.landmark_survey import JointSurvey
from vislam2tag.quality.diagnosis.record import Fault, FaultKind, OddReference, Reference, References
from vislam2tag.site.corrections.file import session_start
from vislam2tag.site.model import SessionKey

MOST_OF_A_WALK = 0.5
"""A walk of which more of the landmarks that it passed are odd than this is odd itself."""


def references(joint: JointSurvey) -> References:
    """Compare all references of a joint survey; empty where no walk is tied to it."""
    if not joint.joined.tied.any():
        return References()
    keys = [session.key for session in joint.mapped]
    votes = vote(joint.joined, [_day(key) for key in keys], [key.device for key in keys])
    rows = [(one, _row(joint, votes, one)) for one in votes.odd]
    found = [*_of_references(joint, rows), *(_of_device(joint, one) for one in votes.odd_devices)]
    return References(
        odd=tuple(sorted(found, key=lambda one: -one.size_m)),
        compared=(*(row for _, row in rows), *(_row(joint, votes, one) for one in votes.fitting)),
    )


def _day(key: SessionKey) -> str | None:
    """On which a session was made, where its name tells."""
    start = session_start(key.session)
    return None if start is None else start.date().isoformat()


def odd_findings(found: References) -> list[Finding]:
    """A finding for each reference that is odd."""
    return [
        Finding(kind="odd_reference", file="", count=len(one.references) or 1, message=one.summary) for one in found.odd
    ]


def odd_faults(found: References, faults: Sequence[Fault]) -> list[Fault]:
    """References that are odd, as faults without a correction; not those that a fault that was named explains."""
    return [odd for odd in map(_fault, found.odd) if not any(_explains(fault, odd) for fault in faults)]


def _fault(odd: OddReference) -> Fault:
    if not odd.references:
        evidence = f"{odd.size_m:.2f} m off at most"
        sessions = sorted(odd.sessions)
        return Fault(kind=FaultKind.ODD_REFERENCE, sessions=sessions, summary=odd.summary, evidence=evidence)
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
    """Whether a fault is of the same landmark, of the same session (of a device all), or of the whole floor."""
    if fault.landmarks:
        return fault.floor == odd.floor and bool(set(fault.landmarks) & set(odd.landmarks))
    if fault.sessions:
        return bool(odd.sessions) and set(odd.sessions) <= set(fault.sessions)
    return fault.floor == odd.floor


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


def _of_references(joint: JointSurvey, rows: list[tuple[Comparison, Reference]]) -> list[OddReference]:
    """Sights of one session that is odd itself count as one."""
    odd_sights = Counter(one.walk for one, _ in rows if one.walk is not None)
    whole = {
        walk
        for walk, count in odd_sights.items()
        if count > 1 and count > MOST_OF_A_WALK * len(joint.joined.maps[walk].landmark)
    }
    found = [_single(row) for one, row in rows if one.walk not in whole]
    return found + [_of_session([row for one, row in rows if one.walk == walk]) for walk in whole]


def _of_device(joint: JointSurvey, odd: DeviceMetre) -> OddReference:
    share, usual = f"{100 + 100 * odd.excess:.1f} %", f"{100 * odd.sigma:.1f} %"
    summary = (
        f"device {odd.device} sees landmarks {share} as far apart as survey and other devices do (usual are {usual} "
        f"more or less), up to {odd.off_m:.2f} m off: calibrate that phone's camera, or switch scaling off in its app, "
        "and walk again; until then leave its sessions out"
    )
    sessions = tuple(str(joint.mapped[walk].key) for walk in odd.walks)
    return OddReference(culprit=f"device {odd.device}", summary=summary, sessions=sessions, off_m=odd.off_m)


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
