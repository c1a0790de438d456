"""Pages to click positions of landmarks, or a known distance, on a plan."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from vislam2tag.preparation.registration.tape_and_clicks import HEADER
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.load import floor_plan, look_at_plan, plan_called, unplaced_picture
from vislam2tag.site.plans.source import PlanSource
from vislam2tag.views.page import data_uri, embedded, write_page


def write_click_page(
    out_file: Path, floor: Floor, expected: dict[str, tuple[float, float]], ids: Sequence[str]
) -> None:
    """Write the page of a floor; ``ids`` are the landmarks to place, ``expected`` expected positions of some.

    Raises SurveyError if the floor has no usable plan, OutputError if the page cannot be written.
    """
    plan = floor_plan(floor)
    rows, columns = plan.image.shape[:2]
    data = {
        "floor": floor.number,
        "extent_m": plan.extent_m,
        "rows": rows,
        "columns": columns,
        "header": ",".join(HEADER),
        "ids": list(ids),
        "expected": expected,
    }
    buffer = io.BytesIO()
    Image.fromarray(plan.image).save(buffer, "PNG", optimize=True)
    image = data_uri(buffer.getvalue())
    context = {"title": f"{floor.name}: Click the landmarks", "image": image, "data": embedded(json.dumps(data))}
    write_page(out_file, "click.html.j2", context)


_SIDE_PX = 2400


def write_align_page(out_file: Path, floor: Floor, onto: Floor, command: str) -> None:
    """Write the page of two floors on top of each other. Clicks add common points to ``command``.

    Raises SurveyError if a floor has no usable plan, OutputError if the page cannot be written.
    """
    onto_T_floor = onto.site_T_bcs.inverse.compose(floor.site_T_bcs)
    floors = []
    for each in (floor, onto):
        plan, buffer = floor_plan(each, _SIDE_PX), io.BytesIO()
        Image.fromarray(plan.image).save(buffer, "PNG", optimize=True)
        floors.append({"name": each.name, "extent_m": plan.extent_m, "image": data_uri(buffer.getvalue())})
    a, b = onto_T_floor.a, onto_T_floor.b
    data = {"floors": floors, "turn": [a.real, a.imag], "shift": [b.real, b.imag], "command": command}
    context = {
        "title": f"{floor.name} on top of {onto.name}: Click two common points",
        "names": (floor.name, onto.name),
        "data": embedded(json.dumps(data)),
    }
    write_page(out_file, "align.html.j2", context)


def write_measure_page(out_file: Path, plan: Path, source: PlanSource, command: str) -> None:
    """Write the page of a plan. Clicks add an option for distance or area to ``command``.

    Raises SurveyError if the plan cannot be read, OutputError if the page cannot be written.
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
    context = {"title": f"{plan.name}: Click a known distance", "image": image, "data": embedded(json.dumps(data))}
    write_page(out_file, "measure.html.j2", context)
