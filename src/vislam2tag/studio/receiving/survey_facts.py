"""What phones are told of the survey that they hand sessions over to: its name, floors and plans.

docs/reference/phone-handover.md tells more.
"""

from __future__ import annotations

import io
from pathlib import Path

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.records import FiniteRecord
from vislam2tag.core.tracks import Landmarks
from vislam2tag.survey.discover import read_site
from vislam2tag.survey.links import site_name
from vislam2tag.survey.model import Floor
from vislam2tag.survey.plans.load import plan_picture

PLAN_SIDE_PX = 2000
"""Longer side of a plan's picture: more a phone's screen does not show."""
_QUALITY = 85


class FloorFacts(FiniteRecord):
    """A floor: its extent left, right, low, high in the BCS, metres (None: not known), whether it has a plan, and where
    its surveyed landmarks hang, x and y in the BCS, metres.
    """

    number: int
    name: str
    extent_m: tuple[float, float, float, float] | None
    plan: bool
    landmarks: dict[str, tuple[float, float]]


class SurveyFacts(FiniteRecord):
    """A survey's name and its floors, lowest first."""

    name: str
    floors: tuple[FloorFacts, ...]


def survey_facts(root: Path) -> SurveyFacts:
    """Read a survey's site; one without floors has none. The name is that of ``site.toml``, else the folder's.

    What links lead to outside the survey is left out.
    """
    try:
        name = site_name(root)
        site, _ = read_site(root)
    except SurveyError:
        return SurveyFacts(name=root.resolve().name, floors=())
    floors = [
        FloorFacts(
            number=floor.number,
            name=floor.name,
            extent_m=floor.extent_m,
            plan=_has_plan(floor),
            landmarks=_places(site.landmarks.on_floor(floor.number)),
        )
        for floor in site.floors
    ]
    return SurveyFacts(name=name or root.resolve().name, floors=tuple(sorted(floors, key=lambda floor: floor.number)))


def plan_jpeg(root: Path, number: int) -> bytes | None:
    """Draw a floor's plan as JPEG, which fills exactly its extent; None where there is none that can be drawn."""
    try:
        floor = read_site(root)[0].floor(number)
        if not _has_plan(floor):
            return None
        buffer = io.BytesIO()
        plan_picture(floor, PLAN_SIDE_PX).convert("RGB").save(buffer, "jpeg", quality=_QUALITY)
    except (SurveyError, KeyError, OSError):
        return None
    return buffer.getvalue()


def _places(landmarks: Landmarks) -> dict[str, tuple[float, float]]:
    rows = zip(landmarks.ids, landmarks.position_bcs.tolist(), landmarks.surveyed.tolist(), strict=True)
    return {name: (x, y) for name, (x, y), surveyed in rows if surveyed}


def _has_plan(floor: Floor) -> bool:
    return floor.plan is not None and floor.extent_m is not None
