"""The page on which landmarks are clicked on the plan: one file that needs nothing else."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from vislam2tag.registration.clicks import HEADER
from vislam2tag.survey.model import Floor
from vislam2tag.survey.plans.load import floor_plan
from vislam2tag.views.page import data_uri, embedded, write_page


def write_click_page(
    out_file: Path, floor: Floor, expected: dict[str, tuple[float, float]], ids: Sequence[str]
) -> None:
    """Write the page of a floor; ``ids`` are the landmarks to place, ``expected`` where some of them should be.

    Raises SurveyError where the floor has no usable plan, OutputError where the page cannot be written.
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
    context = {"title": f"{floor.name}: click the landmarks", "image": image, "data": embedded(json.dumps(data))}
    write_page(out_file, "click.html.j2", context)
