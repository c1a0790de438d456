"""The odd one out of a survey by name: every reference compared with all others, and those that contradict them."""

from __future__ import annotations

from collections import Counter

from vislam2tag.common.findings import Finding
from vislam2tag.common.records import Record
from vislam2tag.landmark_survey.odd_one_out import Comparison, Verdict, vote
from vislam2tag.pipeline.labels.landmark_survey import JointSurvey

MOST_OF_A_WALK = 0.5
"""A walk of which more of the landmarks that it passed are odd than this is odd itself."""


class Reference(Record):
    """A landmark's survey, or (with a ``session``) what that session saw of it, against all others; metres, BCS."""

    floor: int
    landmark: str
    session: str | None = None
    """Floor / device / session."""
    verdict: Verdict
    x_m: float
    y_m: float
    """Where the landmark hangs by all references but the odd ones."""
    size_m: float | None = None
    """How far off the reference is from where the others have the landmark; None where nothing can be compared."""
    sigma_m: float | None = None
    """How far off it should be expected to be, one standard deviation per axis."""


class OddReference(Record):
    """What to look at again."""

    culprit: str
    summary: str
    """One sentence."""
    references: tuple[Reference, ...]


class References(Record):
    """All references of a survey; ``odd`` ranked by size."""

    odd: tuple[OddReference, ...] = ()
    compared: tuple[Reference, ...] = ()


def references(joint: JointSurvey) -> References:
    """Compare all references of a joint survey; empty where no walk is tied to it."""
    if not joint.joined.tied.any():
        return References()
    votes = vote(joint.joined)
    rows = [(one, _row(joint, one)) for one in votes.odd]
    return References(
        odd=tuple(_ranked(joint, rows)),
        compared=(*(row for _, row in rows), *(_row(joint, one) for one in votes.fitting)),
    )


def odd_findings(found: References) -> list[Finding]:
    """A finding for each reference that is odd."""
    return [Finding(kind="odd_reference", file="", count=len(one.references), message=one.summary) for one in found.odd]


def _row(joint: JointSurvey, one: Comparison) -> Reference:
    place, position = joint.places[one.landmark], joint.joined.position[one.landmark]
    compared = one.verdict is not Verdict.NOTHING
    return Reference(
        floor=place.floor,
        landmark=place.landmark,
        session=None if one.walk is None else str(joint.mapped[one.walk].key),
        verdict=one.verdict,
        x_m=round(position.real, 3),
        y_m=round(position.imag, 3),
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
    return sorted(found, key=lambda one: -max(row.size_m or 0.0 for row in one.references))


def _single(row: Reference) -> OddReference:
    where = f"landmark {row.landmark} on floor {row.floor}"
    by = f"{row.size_m:.2f} m (usual are {row.sigma_m:.2f} m)"
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
