"""Outliers among the references of a survey, found by comparing each with all others."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from vislam2tag.common.findings import FaultKind, Finding
from vislam2tag.estimation.landmark_survey.comparison import Comparison, Verdict
from vislam2tag.estimation.landmark_survey.device_metre import DeviceMetre
from vislam2tag.estimation.landmark_survey.odd_one_out import Votes, vote
from vislam2tag.pipeline.labels.landmark_survey import JointSurvey
from vislam2tag.quality.diagnosis.record import Fault, OddReference, PlaceByWalks, Reference, References
from vislam2tag.site.corrections.file import session_start
from vislam2tag.site.model import SessionKey

MOST_OF_A_WALK = 0.5
"""A walk is an outlier itself if more than this share of its landmarks are."""


def references(joint: JointSurvey) -> References:
    """Compare all references of a joint survey; empty if no walk is related to it."""
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
    """Date of a session, if its name contains one."""
    start = session_start(key.session)
    return None if start is None else start.date().isoformat()


def odd_findings(found: References) -> list[Finding]:
    """A finding for each outlier."""
    return [
        Finding(kind="odd_reference", file="", count=len(one.references) or 1, message=one.summary) for one in found.odd
    ]


def odd_faults(found: References, faults: Sequence[Fault]) -> list[Fault]:
    """Outliers as faults without a correction, except those that a named fault explains."""
    return [odd for odd in map(_fault, found.odd) if not any(_explains(fault, odd) for fault in faults)]


def _fault(odd: OddReference) -> Fault:
    if not odd.references:
        evidence = f"{odd.size_m:.2f} m at most"
        sessions = sorted(odd.sessions)
        return Fault(kind=FaultKind.ODD_REFERENCE, sessions=sessions, summary=odd.summary, evidence=evidence)
    greatest = max(odd.references, key=lambda one: one.size_m or 0.0)
    return Fault(
        kind=FaultKind.ODD_REFERENCE,
        floor=greatest.floor,
        landmarks=sorted({one.landmark for one in odd.references}),
        sessions=sorted({one.session for one in odd.references if one.session is not None}),
        summary=odd.summary,
        evidence=f"{greatest.size_m:.2f} m (sigma {greatest.sigma_m:.2f} m)",
        by_walks=_place_by_walks(greatest) if len(odd.references) == 1 else None,
        observed_m=_observed_m(greatest) if len(odd.references) == 1 else None,
    )


def _place_by_walks(one: Reference) -> PlaceByWalks | None:
    """Where walks have a landmark whose survey is the outlier."""
    if one.session is not None or one.day is not None or one.place_sigma_m is None:
        return None
    return PlaceByWalks.at(complex(one.x_m, one.y_m), one.place_sigma_m)


def _observed_m(one: Reference) -> tuple[float, float] | None:
    """Where the walk that is the outlier has the landmark."""
    if one.session is None or one.offset_m is None:
        return None
    return round(one.x_m + one.offset_m[0], 2), round(one.y_m + one.offset_m[1], 2)


def _explains(fault: Fault, odd: Fault) -> bool:
    """Whether a fault is about the same landmark, session (all sessions of a device) or floor."""
    if fault.landmarks:
        return fault.floor == odd.floor and bool(set(fault.landmarks) & set(odd.landmarks))
    if fault.sessions:
        return bool(odd.sessions) and set(odd.sessions) <= set(fault.sessions)
    return fault.floor == odd.floor


def _row(joint: JointSurvey, votes: Votes, one: Comparison) -> Reference:
    place, position = joint.places[one.landmark], votes.joined.position[one.landmark]
    compared = one.verdict is not Verdict.NOTHING
    variance = float(votes.joined.position_covariance[one.landmark].trace())
    return Reference(
        floor=place.floor,
        landmark=place.landmark,
        session=None if one.walk is None else str(joint.mapped[one.walk].key),
        day=one.day,
        verdict=one.verdict,
        x_m=round(position.real, 3),
        y_m=round(position.imag, 3),
        place_sigma_m=round(math.sqrt(variance / 2), 3),
        offset_m=(round(one.offset.real, 3), round(one.offset.imag, 3)) if compared else None,
        size_m=round(one.size_m, 3) if compared else None,
        sigma_m=round(one.sigma_m, 3) if compared else None,
    )


def _of_references(joint: JointSurvey, rows: list[tuple[Comparison, Reference]]) -> list[OddReference]:
    """Observations of a session that is an outlier itself count as one."""
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
        f"distances between landmarks from device {odd.device} are {share} of those from survey and other devices "
        f"(sigma {usual}), with errors up to {odd.off_m:.2f} m. Calibrate that phone's camera, or switch off scaling "
        "in its app, and record again; until then exclude its sessions"
    )
    sessions = tuple(str(joint.mapped[walk].key) for walk in odd.walks)
    return OddReference(culprit=f"device {odd.device}", summary=summary, sessions=sessions, off_m=odd.off_m)


def _single(row: Reference) -> OddReference:
    where = f"landmark {row.landmark} on floor {row.floor}"
    by = f"{row.size_m:.2f} m (sigma {row.sigma_m:.2f} m)"
    if row.day is not None:
        summary = (
            f"{where} was {by} from its position in survey and other days on {row.day}, according to all walks of that "
            "day: correct its position for these sessions"
        )
        return OddReference(culprit=f"{row.day}, {where}", summary=summary, references=(row,))
    if row.session is None:
        summary = f"{where} is surveyed {by} from its position according to all walks: measure it again"
        return OddReference(culprit=where, summary=summary, references=(row,))
    summary = (
        f"{row.session} observed {where} {by} from its position in survey and other walks: the sheet had another "
        "position then, another sheet has its id, or the tracker slipped there"
    )
    return OddReference(culprit=f"{row.session}, {where}", summary=summary, references=(row,))


def _of_session(rows: list[Reference]) -> OddReference:
    session = rows[0].session or ""
    summary = (
        f"{session} contradicts survey and other walks at {len(rows)} landmarks, most of those that it passed: "
        "its floor may be wrong, or its tracker may have failed; check it with vislam2tag inspect"
    )
    return OddReference(culprit=session, summary=summary, references=tuple(rows))
