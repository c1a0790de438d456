"""Which landmarks are only planned, and which are measured: ``floor_K/landmark_states.csv``, beside the landmark table.

The table's columns stay as published programs read them. A row of the states says how the position came about that it
repeats; if the table has another position by now, someone measured the landmark and wrote it there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import OutputError
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.core.tracks import Landmarks
from vislam2tag.site.frame_change import FrameChange
from vislam2tag.site.names import landmark_id
from vislam2tag.site.site_table import LineCounts, SiteTable, finite_or_none, read_site_table, unreadable_file
from vislam2tag.site.written_files import write_in_survey

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
    counts = LineCounts.of(table.file)
    found: dict[str, StateRow] = {}
    for line, fields in table.rows:
        row = _state_row(table, fields)
        if row is None:
            counts.add("malformed_lines", line)
        else:
            found[row.landmark] = row
    message = (
        f"a row needs the columns {', '.join(COLUMNS)}, with the state planned or measured; these rows are left out, "
        "their landmarks count as measured: correct them"
    )
    return found, counts.findings({"malformed_lines": message})


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


def updated_states_text(root: Path, folder: Path, rows: Sequence[StateRow]) -> str:
    """The text of the states of a floor folder with these in place of the former ones of their landmarks.

    Raises OutputError where the file there cannot be read as a whole: its rows would be lost.
    """
    known, problems = read_states(root, folder)
    if problems:
        raise OutputError(f"{folder / STATES_FILE}: {problems[0].message}; nothing was written")
    return states_text({**known, **{row.landmark: row for row in rows}}.values())


def write_states(root: Path, folder: Path, rows: Sequence[StateRow]) -> None:
    """Write the states of some landmarks of a floor folder; those of others stay. Raises OutputError if it cannot."""
    write_in_survey(root, folder / STATES_FILE, updated_states_text(root, folder, rows))


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
    found = []
    for floor in np.unique(landmarks.floor).tolist():
        here = landmarks.on_floor(floor)
        if not here.planned_ids:
            continue
        counts, names = LandmarkCounts.of(here), names_shown(here.planned_ids)
        if use_planned:
            message = (
                f"floor {floor} has {counts}. The positions of landmarks {names} come from vislam2tag plan and are not "
                "measured yet; they are used as if measured (--use-planned)"
            )
        else:
            message = (
                f"floor {floor} has {counts}. The positions of landmarks {names} come from vislam2tag plan and are not "
                "measured yet; they are not used. Measure them (vislam2tag register, or write measured positions into "
                f"marker_dict.csv and the state measured into {STATES_FILE}), or use the plan's places with "
                "--use-planned"
            )
        severity = Severity.INFO if use_planned else Severity.WARNING
        count = len(here.planned_ids)
        found.append(Finding(kind="planned_landmarks", file="", count=count, message=message, severity=severity))
    return found
