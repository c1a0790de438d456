"""What a folder or file of this program is, for messages about a path that a command cannot use."""

from __future__ import annotations

import re
from pathlib import Path

from vislam2tag.common.files.given_files import read_json

PROGRAM = "vislam2tag"
PROCESS, RUN = f"{PROGRAM} process", f"{PROGRAM} run"
MODEL_SUFFIX = ".v2t"
_RUN_FILE, _MANIFEST = "run.json", "dataset.json"
SURVEY = "a survey"
FLOOR = re.compile(r"floor_-?\d+")


def written_by(folder: Path) -> str | None:
    """Return the command that wrote a folder, such as ``vislam2tag import``, from its record; None if unknown."""
    for file, key in ((_RUN_FILE, "program"), (_MANIFEST, "made_by")):
        try:
            command = str(read_json(folder / file)[key])
        except (OSError, ValueError, KeyError, TypeError):
            continue
        if file == _MANIFEST:
            command = f"{PROGRAM} {command}" if command else ""
        elif command == PROGRAM:
            command = PROCESS
        return command if command.startswith(f"{PROGRAM} ") else None
    return None


def is_survey(folder: Path) -> bool:
    """Whether the folder contains folders of floors."""
    return any(FLOOR.fullmatch(path.name) for path in folder.glob("floor_*/"))


def survey_around(path: Path) -> Path | None:
    """The survey that a session's folder, or another folder below a floor, is in; None if it is in none."""
    places = (path.resolve(), *path.resolve().parents[:2])
    return next((place.parent for place in places if FLOOR.fullmatch(place.name)), None)


def kind_of(path: Path) -> str:
    """What a path is, such as "the output of `vislam2tag process`"; empty if that is not known."""
    if path.is_file():
        return "a model of `vislam2tag train`" if path.suffix == MODEL_SUFFIX else "a file"
    if not path.is_dir():
        return "missing"
    if (path / _MANIFEST).is_file():
        return "a data set"
    if command := written_by(path):
        return f"the output of `{command}`"
    if is_survey(path):
        return SURVEY
    if survey := survey_around(path):
        return f"a folder of the survey {survey}"
    return "" if any(path.iterdir()) else "an empty folder"


def found_at(path: Path) -> str:
    """The start of a message's cure: "; it is KIND", or nothing if that is not known."""
    kind = kind_of(path)
    return f"; it is {kind}" if kind else ""
