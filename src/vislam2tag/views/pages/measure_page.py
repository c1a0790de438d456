"""The page on which a known distance is clicked on a plan that has no scale yet: one file that needs nothing else."""

from __future__ import annotations

import io
import json
from pathlib import Path

from vislam2tag.survey.plans.load import look_at_plan, plan_called, unplaced_picture
from vislam2tag.survey.plans.source import PlanSource
from vislam2tag.views.page import data_uri, embedded, write_page

_SIDE_PX = 2400


def write_measure_page(out_file: Path, plan: Path, source: PlanSource, command: str) -> None:
    """Write the page of a plan; what is clicked completes ``command``, an option each for distance and area.

    Raises SurveyError where the plan cannot be read, OutputError where the page cannot be written.
    """
    with plan_called(plan):
        look = look_at_plan(plan, source)
        picture = unplaced_picture(plan, source, _SIDE_PX)
    buffer = io.BytesIO()
    picture.save(buffer, "PNG", optimize=True)
    image = data_uri(buffer.getvalue())
    data = {
        "box": look.box,
        "downwards": look.downwards,
        "picture": look.is_picture,
        "size": picture.size,
        "command": command,
    }
    context = {"title": f"{plan.name}: click a known distance", "image": image, "data": embedded(json.dumps(data))}
    write_page(out_file, "measure.html.j2", context)
