"""Which positions of a landmark file are measured and which are only planned.

A file beside the table gives the states; positions that a plan seems to have written although no state says so are
findings.
"""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import OutputError
from vislam2tag.common.files.given_files import read_json
from vislam2tag.common.findings import Finding, Severity, at_lines_if, finding_if
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.core.tracks import Landmarks
from vislam2tag.intake.ids import compare_ids
from vislam2tag.site.frame_change import FrameChange
from vislam2tag.site.links import write_in_survey
from vislam2tag.site.model import landmark_id
from vislam2tag.site.site_table import (
    SiteTable,
    finite_or_none,
    number_or_none,
    read_site_table,
    unreadable_file,
)

STATES_FILE = "landmark_states.csv"
COLUMNS = ("id", "state", "source", "x", "y")
EXACT_M = 1e-3
"""A plan has millimetres."""
SAME_M = 0.01
"""A planned position that moved by less is the same: with two decimals a spreadsheet moves it by up to 7 mm."""
NEAR_M = 0.1
"""If it moved by less, it may be measured or rounded: with one decimal a spreadsheet moves it by up to 71 mm."""
PLANNED_SIGMA_M = 0.1
"""How far from its planned place a sheet hangs, per axis, until it is measured."""
PLANNED_HEADING_SIGMA_RAD = 0.05
"""Walls of a plan are true to this."""
_SHOWN = 5


class LandmarkState(StrEnum):
    """How the position of a landmark came about."""

    PLANNED = "planned"
    MEASURED = "measured"


@dataclass(frozen=True)
class StateRow:
    """One row: the state of the landmark while its position is the one given, metres in the floor's BCS."""

    landmark: str
    state: LandmarkState
    source: str
    """What planned or measured it: ``plan``, ``station``, ``tape`` or ``click``."""
    x_m: float
    y_m: float

    def is_about(self, x_m: float, y_m: float, within_m: float = SAME_M) -> bool:
        """Whether a position is the one that the row is about."""
        return self._moved_m(x_m, y_m) < within_m

    def plans(self, x_m: float, y_m: float, within_m: float = SAME_M) -> bool:
        """Whether a position was only planned."""
        return self.state is LandmarkState.PLANNED and self.is_about(x_m, y_m, within_m)

    def nearly_plans(self, x_m: float, y_m: float) -> bool:
        """Whether a position is so close to the planned one that it may be measured or rounded."""
        return self.state is LandmarkState.PLANNED and SAME_M <= self._moved_m(x_m, y_m) < NEAR_M

    def _moved_m(self, x_m: float, y_m: float) -> float:
        return math.hypot(x_m - self.x_m, y_m - self.y_m)


def read_states(root: Path, folder: Path) -> tuple[dict[str, StateRow], list[Finding]]:
    """Read the states of one floor folder by id; none where there is no such file. Bad rows are a finding."""
    path = folder / STATES_FILE
    try:
        table = read_site_table(root, path)
    except FileNotFoundError:
        return {}, []
    except OSError as error:
        consequence = "planned positions count as measured"
        return {}, [unreadable_file(path.relative_to(root).as_posix(), error, consequence)]
    rows = {line: _state_row(table, fields) for line, fields in table.rows}
    found = {row.landmark: row for row in rows.values() if row is not None}
    message = (
        f"a row needs the columns {', '.join(COLUMNS)}, with the state planned or measured; these rows are skipped "
        "and their landmarks count as measured: correct them"
    )
    return found, at_lines_if("malformed_lines", table.file, [line for line in rows if rows[line] is None], message)


def _state_row(table: SiteTable, fields: tuple[str, ...]) -> StateRow | None:
    name, state, source, *place = (table.cell(fields, column) for column in COLUMNS)
    try:
        x, y = (finite_or_none(text) for text in place)
        known = LandmarkState(state.lower())
    except ValueError:
        return None
    if x is None or y is None or not landmark_id(name):
        return None
    return StateRow(landmark_id(name), known, source, x, y)


def states_text(rows: Iterable[StateRow]) -> str:
    """Write states as the file has them."""
    return csv_rows((COLUMNS, *((row.landmark, row.state.value, row.source, row.x_m, row.y_m) for row in rows)))


def updated_states_text(root: Path, folder: Path, rows: Sequence[StateRow], dropped: Collection[str] = ()) -> str:
    """The text of the states of a floor folder with these in place of the former ones of their landmarks.

    Rows of ``dropped`` landmarks are left out. Raises OutputError where the file there cannot be read as a whole: its
    rows would be lost.
    """
    known, problems = read_states(root, folder)
    if problems:
        raise OutputError(f"{folder / STATES_FILE}: {problems[0].message}; nothing was written")
    kept = {name: row for name, row in known.items() if name not in dropped}
    return states_text({**kept, **{row.landmark: row for row in rows}}.values())


def write_states(root: Path, folder: Path, rows: Sequence[StateRow], dropped: Collection[str] = ()) -> None:
    """Write the states of some landmarks of a floor folder; those of others stay, except ``dropped`` ones.

    Raises OutputError if it cannot.
    """
    write_in_survey(root, folder / STATES_FILE, updated_states_text(root, folder, rows, dropped))


def changed_states_text(root: Path, folder: Path, change: FrameChange) -> str | None:
    """The states of a floor folder in another frame; None where it has none."""
    known, _ = read_states(root, folder)
    if not known:
        return None
    places = {name: (change.new_T_old @ np.array([row.x_m, row.y_m])).tolist() for name, row in known.items()}
    return states_text(replace(row, x_m=places[name][0], y_m=places[name][1]) for name, row in known.items())


@dataclass(frozen=True)
class LandmarkCounts:
    """How many landmarks there are, by what is known of them."""

    measured: int
    planned: int
    without_position: int

    @classmethod
    def of(cls, landmarks: Landmarks) -> LandmarkCounts:
        """Count; planned positions may be left out of the landmarks already."""
        planned = landmarks.planned if len(landmarks.planned) else np.zeros(len(landmarks.ids), dtype=bool)
        measured = int(np.count_nonzero(landmarks.surveyed & ~planned))
        return cls(measured, int(planned.sum()), len(landmarks.ids) - measured - int(planned.sum()))

    @property
    def total(self) -> int:
        """All of them."""
        return self.measured + self.planned + self.without_position

    @property
    def short(self) -> str:
        """As a table has it: ``9``, ``9 (1 without position)``, or ``9 (4 measured, 5 planned)`` with planned ones."""
        if self.planned:
            return f"{self.total} ({self._parts})"
        return f"{self.total}" + (f" ({self.without_position} without position)" if self.without_position else "")

    @property
    def _parts(self) -> str:
        kinds = {"measured": self.measured, "planned": self.planned, "without position": self.without_position}
        return ", ".join(f"{count} {kind}" for kind, count in kinds.items() if count)

    def __str__(self) -> str:
        """In words: ``9 landmarks: 4 measured, 5 planned``."""
        return f"{self.total} landmarks: {self._parts}" if self.total else "no landmarks"


def names_shown(names: Sequence[str]) -> str:
    """The first few names, as a message shows them."""
    return ", ".join(names[:_SHOWN]) + (", ..." if len(names) > _SHOWN else "")


def planned_findings(landmarks: Landmarks, *, use_planned: bool) -> list[Finding]:
    """Report the landmarks of each floor whose positions were only planned, and whether these are used."""
    severity = Severity.INFO if use_planned else Severity.WARNING
    found: list[Finding] = []
    for floor in np.unique(landmarks.floor).tolist():
        here = landmarks.on_floor(floor)
        counts, names = LandmarkCounts.of(here), names_shown(here.planned_ids)
        message = (
            f"floor {floor} has {counts}. The positions of landmarks {names} come from vislam2tag plan and are not "
            "measured yet; they are used as if measured (--use-planned)"
            if use_planned
            else f"floor {floor} has {counts}. The positions of landmarks {names} come from vislam2tag plan and are "
            "not measured yet; they are not used. Measure them (vislam2tag register, or write measured positions "
            f"into marker_dict.csv and the state measured into {STATES_FILE}), or use the planned positions with "
            "--use-planned"
        )
        found += finding_if(len(here.planned_ids), "planned_landmarks", message, severity=severity)
    return found


@dataclass(frozen=True)
class SurveyedLandmark:
    """One row of a landmark file; NaN where a value is unknown."""

    landmark: str
    floor: int
    x_m: float
    y_m: float
    z_m: float
    sigma_m: float
    heading_rad: float
    heading_sigma_rad: float
    source: str
    """File and 1-based line, ``floor_1/marker_dict.csv:3``."""
    sigma_given: bool = True
    """Whether the row has a sigma of its own."""
    planned: bool = False
    """Whether the position was only planned."""

    @property
    def line(self) -> int:
        """1-based line of the file."""
        return int(self.source.rpartition(":")[2])

    @property
    def is_surveyed(self) -> bool:
        """Whether there is a position."""
        return math.isfinite(self.x_m) and math.isfinite(self.y_m)

    def distance_m(self, other: SurveyedLandmark) -> float:
        """How far two landmarks of a floor are from one another; NaN without a position."""
        return math.hypot(self.x_m - other.x_m, self.y_m - other.y_m)


CLOSE_M = 5.0
"""A sheet hangs within a few metres of its planned place; other sheets of the floor are further away, most of them."""
_DIGITS = re.compile(r"\d+")


def planned_twice(file: str, landmarks: Sequence[SurveyedLandmark]) -> list[Finding]:
    """Report measured landmarks of a floor that are named like planned ones, by a pattern, and hang where these are."""
    planned = {one.landmark: one for one in landmarks if one.planned}
    series: dict[str, dict[str, SurveyedLandmark]] = defaultdict(dict)
    for one in landmarks:
        if not one.planned and one.is_surveyed:
            series[_DIGITS.sub("#", one.landmark)][one.landmark] = one
    line = {one.landmark: one.line for one in landmarks}
    pairs: dict[str, str] = {}
    for measured in series.values():
        pattern = compare_ids(tuple(planned), tuple(measured)).pattern
        alike = {} if pattern is None else pattern.mapping
        close = sum(measured[one].distance_m(planned[other]) < CLOSE_M for one, other in alike.items())
        if close > len(alike) / 2:
            pairs |= alike
    message = (
        f"landmarks {names_shown(list(pairs))} are measured where landmarks {names_shown(list(pairs.values()))} are "
        "planned, and have similar names: are they the same sheets? Give each sheet one id (that of the plan if "
        "walks log it), and remove the other row"
    )
    return at_lines_if("duplicate_landmarks", file, [line[name] for name in pairs], message, Severity.ERROR)


PLAN_FILE = "plan.json"
"""What ``vislam2tag plan`` keeps of a plan, in its output folder."""

States = Mapping[tuple[int, str], StateRow]
"""States of landmarks by floor and id."""
Proposals = Mapping[tuple[int, str], complex]
"""Places that a plan proposes by floor and id, complex metres."""


def proposals_in(root: Path) -> Proposals:
    """What plans propose whose output folder is in a survey; none where there is no plan that can be read."""
    found: dict[tuple[int, str], complex] = {}
    for path in sorted((*root.glob(PLAN_FILE), *root.glob(f"*/{PLAN_FILE}"))):
        try:
            for floor in read_json(path)["floors"]:
                for one in floor["landmarks"]:
                    found[int(one["floor"]), str(one["id"])] = complex(one["x_m"], one["y_m"])
        except (OSError, ValueError, KeyError, TypeError):
            continue  # something else of that name
    return found


def perhaps_planned(table: SiteTable, floor: int, known: Collection[str], proposals: Proposals) -> list[Finding]:
    """Report rows of a floor's landmark table that are as a plan left them, except those whose state is ``known``."""
    untouched = {
        line: name
        for line, fields in table.rows
        if (name := landmark_id(fields[0])) not in known and _is_untouched(table, fields, proposals.get((floor, name)))
    }
    message = (
        f"landmarks {names_shown(list(untouched.values()))} are where vislam2tag plan proposed them, with the sigmas "
        "of a plan; they are used as measured positions. If they are not measured yet, measure them (vislam2tag "
        f"register); otherwise write the true sigma_m into these rows, and the state measured into {STATES_FILE} "
        "next to the file"
    )
    return at_lines_if("perhaps_planned", table.file, list(untouched), message)


def nearly_planned(file: str, landmarks: Sequence[SurveyedLandmark], states: States) -> list[Finding]:
    """Report landmarks of a file whose positions are so close to planned ones that they may be rounded, not measured.

    A sigma that is not a plan's shows that someone measured them.
    """
    near = [
        one
        for one in landmarks
        if not one.planned
        and _has_no_sigma_of_its_own(one)
        and (state := states.get((one.floor, one.landmark))) is not None
        and state.nearly_plans(one.x_m, one.y_m)
    ]
    message = (
        f"landmarks {names_shown([one.landmark for one in near])} are 1 to 10 cm from where vislam2tag plan proposed "
        "them, without a sigma_m of their own: are they measured, or rounded? They are used as measured positions. "
        "If they are not measured yet, measure them (vislam2tag register); otherwise write their sigma_m into these "
        "rows"
    )
    return at_lines_if("perhaps_planned", file, [one.line for one in near], message)


def copies_of_plan(
    landmarks: Sequence[SurveyedLandmark], states: States, proposals: Proposals
) -> list[SurveyedLandmark]:
    """Landmarks of a file from elsewhere, those marked as planned that repeat planned positions of the survey.

    Such a file has no states. A row with a sigma that is not a plan's is measured, unless it has the very place.
    """
    return [replace(one, planned=_is_copy(one, states, proposals)) for one in landmarks]


def _is_copy(one: SurveyedLandmark, states: States, proposals: Proposals) -> bool:
    key = (one.floor, one.landmark)
    rows = [states[key]] if key in states else []
    if any(row.state is LandmarkState.MEASURED and row.is_about(one.x_m, one.y_m) for row in rows):
        return False
    if key in proposals:
        place = proposals[key]
        rows.append(StateRow(one.landmark, LandmarkState.PLANNED, "plan", place.real, place.imag))
    within_m = SAME_M if _has_no_sigma_of_its_own(one) else EXACT_M
    return any(row.plans(one.x_m, one.y_m, within_m) for row in rows)


def _has_no_sigma_of_its_own(one: SurveyedLandmark) -> bool:
    return not one.sigma_given or one.sigma_m == PLANNED_SIGMA_M


def _is_untouched(table: SiteTable, fields: tuple[str, ...], proposed: complex | None) -> bool:
    """Whether a row has the place that a plan at hand proposed, or, without such a plan, all that a plan writes."""
    try:
        x, y, sigma, heading_sigma, width = (
            number_or_none(table.cell(fields, column))
            for column in ("x", "y", "sigma_m", "heading_sigma_rad", "width_m")
        )
    except ValueError:
        return False
    if x is None or y is None:
        return False
    if proposed is not None:
        return abs(complex(x, y) - proposed) < (SAME_M if sigma == PLANNED_SIGMA_M else EXACT_M)
    by_plan = sigma == PLANNED_SIGMA_M and heading_sigma == PLANNED_HEADING_SIGMA_RAD
    return by_plan and width is not None and bool(table.cell(fields, "sheet"))
