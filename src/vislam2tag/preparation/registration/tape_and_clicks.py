"""Tape distances and clicks on a plan, from their files."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.findings import Finding, FindingKind
from vislam2tag.intake.extents import MAX_LOCAL_M
from vislam2tag.preparation.registration.record import RegistrationSettings
from vislam2tag.preparation.registration.text_table import TextTable, parsed, read_text_table, refuse_longer_rows
from vislam2tag.site.model import landmark_id
from vislam2tag.site.site_table import LineCounts

LONGEST_M = 200.0
"""No tape, nor a laser held by hand indoors, is longer."""
LARGEST_SIGMA_M = 1.0
"""A larger one is the second half of a number with a decimal comma."""


@dataclass(frozen=True)
class TapeDistance:
    """One distance from a landmark to a target or another landmark, horizontal, metres."""

    landmark: str
    to: str
    distance_m: float
    sigma_m: float
    source: str = ""
    decimals: int = 2

    @property
    def label(self) -> str:
        """How messages call it."""
        where = f" ({self.source})" if self.source else ""
        return f"distance {self.landmark} to {self.to}{where}"


@dataclass(frozen=True)
class Target:
    """What a distance leads to: a point, or a wall from ``start`` to ``stop`` (the distance is square to it)."""

    name: str
    start: complex
    stop: complex | None
    sigma_m: float


def read_distances(path: Path, settings: RegistrationSettings) -> tuple[list[TapeDistance], list[Finding]]:
    """Read rows landmark, to, distance and, where known, sigma (metres), with or without a header.

    Raises SurveyError where the file cannot be read or has no usable row.
    """
    table = _below_header(read_text_table(path), number_at=2)
    counts = LineCounts(table.file)
    if table.unit_m:
        refuse_longer_rows(table, len(table.unit_m))
    found = [distance for _, distance in parsed(table.rows, counts, partial(_distance, table, settings))]
    if not found:
        _refuse_too_long(path, table)
        raise SurveyError(f"{path}: contains no distance; expected rows landmark,to,distance_m[,sigma_m]")
    message = (
        f"a row needs a landmark, the other end, a distance up to {LONGEST_M:g} m, and a sigma "
        f"above 0 and up to {LARGEST_SIGMA_M:g} m if it has one; these rows are skipped: correct them"
    )
    return found, [*table.findings, *counts.findings({"malformed_lines": message})]


def _refuse_too_long(path: Path, table: TextTable) -> None:
    """Raise SurveyError for the first distance that is too long, as all are in another unit."""
    for line, fields in table.rows:
        try:
            distance = table.length(fields, 2)
        except ValueError:
            continue
        if distance > LONGEST_M:
            raise SurveyError(
                f"{path}: line {line}: {distance:g} m is too long for a tape; expected distance_m in metres, at most "
                f"{LONGEST_M:g}"
            )


def read_targets(path: Path, settings: RegistrationSettings) -> tuple[dict[str, Target], list[Finding]]:
    """Read rows name, x, y of a corner or column, or name, x, y, x2, y2 of a wall, then sigma where known; metres, BCS.

    Raises SurveyError where the file cannot be read or has no usable row.
    """
    whole = read_text_table(path)
    table, columns = _below_header(whole, number_at=1), len(whole.rows[0][1])
    found: dict[str, Target] = {}
    counts = LineCounts(table.file)
    if all(len(fields) > columns for _, fields in table.rows):  # one row may be a wall, without names of its columns
        refuse_longer_rows(table, columns)
    for line, target in parsed(table.rows, counts, partial(_target, table, settings)):
        if target.name in found:
            counts.add("duplicate_targets", line)
        else:
            found[target.name] = target
    if not found:
        raise SurveyError(f"{path}: contains no target; expected rows name,x,y or name,x,y,x2,y2 and then sigma_m")
    messages: dict[FindingKind, str] = {
        "malformed_lines": (
            "a row needs a name and x,y of a point, or x,y,x2,y2 of a wall with a length above 0; a sigma must "
            "be above 0; these rows are skipped: correct them"
        ),
        "duplicate_targets": "a name may appear only once; the first row is used: remove the others",
    }
    return found, [*table.findings, *counts.findings(messages)]


def _below_header(table: TextTable, number_at: int) -> TextTable:
    """The rows below a header, in its units; a header is a first row without a number at its place."""
    first = table.rows[0][1]
    try:
        table.length(first, number_at)
    except ValueError:
        return table.below(first, 1)
    return table


def _distance(table: TextTable, settings: RegistrationSettings, line: int, fields: tuple[str, ...]) -> TapeDistance:
    distance, sigma = table.length(fields, 2), table.length(fields, 3)
    name, to = landmark_id(fields[0]), landmark_id(fields[1])
    if not name or not to or name == to or not 0 <= distance <= LONGEST_M or sigma <= 0 or sigma > LARGEST_SIGMA_M:
        raise ValueError(f"line {line} is not a distance")
    return TapeDistance(
        landmark=name,
        to=to,
        distance_m=distance,
        sigma_m=settings.tape_sigma_m if math.isnan(sigma) else sigma,
        source=table.place(line),
        decimals=table.decimals(fields, 2),
    )


def _target(table: TextTable, settings: RegistrationSettings, line: int, fields: tuple[str, ...]) -> Target:
    x, y, x2, y2, sigma = (table.length(fields, column) for column in range(1, 6))
    if len(fields) == 4:
        x2, sigma = math.nan, x2
    name = landmark_id(fields[0])
    wall = not math.isnan(x2)
    if not name or math.isnan(x) or math.isnan(y) or sigma <= 0 or math.isnan(x2) != math.isnan(y2):
        raise ValueError(f"line {line} is not a target")
    if wall and (x, y) == (x2, y2):
        raise ValueError(f"wall '{name}' has no length")
    stop = complex(x2, y2) if wall else None
    return Target(name, complex(x, y), stop, settings.target_sigma_m if math.isnan(sigma) else sigma)


CLICK_PX = 2.0
"""How well one clicks, pixels of the screen."""
HEADER = ("id", "floor", "x", "y", "screen_pixel_m", "plan_pixel_m")
_MESSAGES: dict[FindingKind, str] = {
    "malformed_lines": f"a row must be {','.join(HEADER)}; these rows are skipped: correct them",
    "duplicate_landmarks": "an id may appear only once; the last row is used: remove the others",
    "other_floor": "these rows are of another floor and are skipped",
}


@dataclass(frozen=True)
class Click:
    """A landmark where somebody clicked it, BCS metres; ``sigma_m`` per axis."""

    landmark: str
    place: complex
    sigma_m: float
    source: str


def read_clicks(path: Path, floor: int, settings: RegistrationSettings) -> tuple[dict[str, Click], list[Finding]]:
    """Read the clicks of one floor, by landmark; raises SurveyError where the file is not a file of clicks."""
    table = read_text_table(path)
    if tuple(field.lower() for field in table.rows[0][1]) != HEADER:
        raise SurveyError(f"{table.place(table.rows[0][0])}: expected the header {','.join(HEADER)}")
    found: dict[str, Click] = {}
    counts = LineCounts(table.file)
    for line, (number, click) in parsed(table.rows[1:], counts, partial(_click, table, settings)):
        if number != floor:
            counts.add("other_floor", line)
            continue
        if click.landmark in found:
            counts.add("duplicate_landmarks", line)
        found[click.landmark] = click
    return found, [*table.findings, *counts.findings(_MESSAGES)]


def _click(table: TextTable, settings: RegistrationSettings, line: int, fields: tuple[str, ...]) -> tuple[int, Click]:
    """A row's floor and click."""
    name, number = landmark_id(fields[0]), int(fields[1])
    x, y, screen_m, plan_m = (table.number(field) for field in fields[2:6])
    if not name or not max(abs(x), abs(y)) <= MAX_LOCAL_M or not (screen_m > 0 and plan_m > 0):
        raise ValueError(f"line {line} is not a click")
    return number, Click(name, complex(x, y), click_sigma_m(screen_m, plan_m, settings), table.place(line))


def click_sigma_m(screen_pixel_m: float, plan_pixel_m: float, settings: RegistrationSettings) -> float:
    """Standard deviation per axis: of the hand on the screen, of the plan's pixels, and of plan against building."""
    return math.hypot(CLICK_PX * screen_pixel_m, plan_pixel_m / math.sqrt(12), settings.plan_sigma_m)
