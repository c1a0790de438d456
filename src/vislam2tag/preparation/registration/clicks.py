"""Landmarks clicked on the plan: the file that the page of ``register --click`` saves."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Finding
from vislam2tag.preparation.registration.settings import RegistrationSettings
from vislam2tag.preparation.registration.text_table import read_text_table
from vislam2tag.site.landmark_file import GREATEST_M
from vislam2tag.site.names import landmark_id
from vislam2tag.site.site_table import LineCounts

HEADER = ("id", "floor", "x", "y", "screen_pixel_m", "plan_pixel_m")
_MESSAGES: dict[FindingKind, str] = {
    "malformed_lines": f"a row must be {','.join(HEADER)}; these rows are left out: correct them",
    "duplicate_landmarks": "an id may appear once; the last row counts: remove the others",
    "other_floor": "these rows are of another floor and left out",
}


@dataclass(frozen=True)
class Click:
    """A landmark where somebody clicked it, BCS metres; ``sigma_m`` per axis."""

    landmark: str
    place: complex
    sigma_m: float
    source: str


def read_clicks(path: Path, floor: int, settings: RegistrationSettings) -> tuple[dict[str, Click], list[Finding]]:
    """Read the clicks of one floor, by landmark; raises SurveyError where the file is no file of clicks."""
    table = read_text_table(path)
    if tuple(field.lower() for field in table.rows[0][1]) != HEADER:
        raise SurveyError(f"{table.place(table.rows[0][0])}: expected the header {','.join(HEADER)}")
    found: dict[str, Click] = {}
    counts = LineCounts.of(table.file)
    for line, fields in table.rows[1:]:
        try:
            name, number = landmark_id(fields[0]), int(fields[1])
            x, y, screen_m, plan_m = (table.number(field) for field in fields[2:6])
            if not name or not max(abs(x), abs(y)) <= GREATEST_M or not (screen_m > 0 and plan_m > 0):
                raise ValueError(f"line {line} is no click")
        except (ValueError, IndexError):
            counts.add("malformed_lines", line)
            continue
        if number != floor:
            counts.add("other_floor", line)
            continue
        if name in found:
            counts.add("duplicate_landmarks", line)
        found[name] = Click(name, complex(x, y), click_sigma_m(screen_m, plan_m, settings), table.place(line))
    return found, [*table.findings, *counts.findings(_MESSAGES)]


def click_sigma_m(screen_pixel_m: float, plan_pixel_m: float, settings: RegistrationSettings) -> float:
    """Standard deviation per axis: of the hand on the screen, of the plan's pixels, and of plan against building."""
    return math.hypot(settings.click_px * screen_pixel_m, plan_pixel_m / math.sqrt(12), settings.plan_sigma_m)
