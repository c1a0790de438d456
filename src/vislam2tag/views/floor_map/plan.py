"""The floor plan as a small image inside the page."""

from __future__ import annotations

import io

from vislam2tag.survey.model import Floor
from vislam2tag.survey.plans.load import plan_picture
from vislam2tag.views.page import data_uri

MAX_PIXELS = 1400
"""Longer side of the embedded plan, pixels."""

_JPEG_QUALITY = 80


def plan_data_uri(floor: Floor) -> str:
    """Return a floor's plan over its extent, scaled to at most :data:`MAX_PIXELS`, as a JPEG data URI.

    Raises OSError where it is unreadable, as :func:`vislam2tag.survey.plans.load.plan_picture` does.
    """
    buffer = io.BytesIO()
    plan_picture(floor, MAX_PIXELS).save(buffer, "JPEG", quality=_JPEG_QUALITY, optimize=True)
    return data_uri(buffer.getvalue(), "image/jpeg")


def drawn_plan(floor: Floor) -> tuple[str | None, str]:
    """Return a floor's plan as a data URI where it can be drawn, else None and a sentence that says why not."""
    plan = floor.plan
    if plan is None:
        return None, "There is no plan of this floor: a grid is drawn instead."
    if floor.extent_m is None:
        return None, f"{plan.name} is not drawn, as no file gives the floor's size: a grid is drawn instead."
    try:
        return plan_data_uri(floor), ""
    except OSError as error:
        return None, f"{plan.name} {error}: a grid is drawn instead."
