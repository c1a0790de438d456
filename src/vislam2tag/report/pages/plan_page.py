"""The page about planned landmarks: drawings, lists, what to expect."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path

from vislam2tag.planning.records import PlanSummary
from vislam2tag.report.page import write_page


def write_plan_page(out_file: Path, summary: PlanSummary, images: Mapping[int, tuple[bytes, bytes]]) -> None:
    """Write the page; ``images`` are each floor's plan and sigma map as PNG. Equal input gives equal bytes.

    Raises OutputError where it cannot be written.
    """
    uris = {floor: tuple(_data_uri(image) for image in both) for floor, both in images.items()}
    write_page(out_file, "plan.html.j2", {"title": "Where landmarks stand", "summary": summary, "images": uris})


def _data_uri(png: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")
