"""A generated survey with one fault of each kind that the studio corrects, for its tests and those of its page.

``python -m tests.studio.faulty_survey FOLDER`` writes FOLDER/survey (with ``truth.csv`` in each session) and
FOLDER/faults.json, which says what is wrong.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from vislam2tag.simulation.model import SimulatedBuilding
from vislam2tag.simulation.scenario import PlannedSession, Scenario, regular_survey
from vislam2tag.simulation.survey import simulate
from vislam2tag.site.landmark_file import LANDMARK_FILE

SEED, SECONDS, SESSIONS = 11, 150.0, 2
FLOOR, OTHER = 1, 2
SWAPPED, MIS_SURVEYED, MOVED = ("2", "9"), "11", "4"
OFF_M = (2.5, -1.5)
ALONG_WALL_M = 4.0
"""How far the moved landmark hangs from where it hung before."""


def write_faulty_survey(folder: Path) -> Path:
    """Write the survey and what is wrong with it; returns the survey's folder."""
    scenario = regular_survey(SEED, "none", (FLOOR, OTHER), ("LG", "OnePlus", "Pixel"), SESSIONS, SECONDS)
    starts = sorted({planned.key.session for planned in scenario.sessions if planned.key.floor == FLOOR})
    since = starts[len(starts) // 2]
    later = [planned for planned in scenario.sessions if planned.key.floor == FLOOR and planned.key.session >= since]
    survey = folder / "survey"
    _simulate(scenario, [planned for planned in scenario.sessions if planned not in later], survey)
    with TemporaryDirectory(dir=folder) as moved:
        _simulate(replace(scenario, building=_with_landmark_moved(scenario.building)), later, Path(moved) / "survey")
        for planned in later:
            place = Path(f"floor_{FLOOR}") / planned.key.device / planned.key.session
            (survey / place).parent.mkdir(parents=True, exist_ok=True)
            (Path(moved) / "survey" / place).rename(survey / place)
    _spoil_table(survey / f"floor_{FLOOR}" / LANDMARK_FILE)
    wrong = next(planned.key for planned in scenario.sessions if planned.key.floor == OTHER)
    place = survey / f"floor_{FLOOR}" / wrong.device / wrong.session
    (survey / f"floor_{OTHER}" / wrong.device / wrong.session).rename(place)
    faults = {
        "floor": FLOOR,
        "swapped": SWAPPED,
        "mis_surveyed": MIS_SURVEYED,
        "moved": {"landmark": MOVED, "since": since},
        "wrong_floor": {"session": wrong.session, "device": wrong.device, "floor": FLOOR, "to": OTHER},
    }
    (folder / "faults.json").write_text(json.dumps(faults, indent=1) + "\n", encoding="utf-8")
    return survey


def _simulate(scenario: Scenario, sessions: Sequence[PlannedSession], out: Path) -> None:
    simulate(replace(scenario, sessions=tuple(sessions)), out)


def _with_landmark_moved(building: SimulatedBuilding) -> SimulatedBuilding:
    floors = []
    for floor in building.floors:
        if floor.number == FLOOR:
            index = floor.landmark_ids.index(MOVED)
            heading = floor.landmark_heading_rad[index]
            position = floor.landmark_position.copy()
            position[index, :2] += ALONG_WALL_M * np.array((np.cos(heading), np.sin(heading)))
            floor = replace(floor, landmark_position=position)
        floors.append(floor)
    return replace(building, floors=tuple(floors))


def _spoil_table(table: Path) -> None:
    """Exchange two landmarks and write a wrong place for a third one."""
    header, *lines = table.read_text(encoding="utf-8").splitlines()
    rows = {fields[0]: fields[1:] for fields in (line.split(",") for line in lines)}
    one, other = SWAPPED
    rows[one], rows[other] = rows[other], rows[one]
    x, y, *rest = rows[MIS_SURVEYED]
    rows[MIS_SURVEYED] = [f"{float(x) + OFF_M[0]:.3f}", f"{float(y) + OFF_M[1]:.3f}", *rest]
    text = "\n".join([header, *(",".join([name, *fields]) for name, fields in rows.items())])
    table.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    made = Path(sys.argv[1])
    made.mkdir(parents=True, exist_ok=True)
    write_faulty_survey(made)
