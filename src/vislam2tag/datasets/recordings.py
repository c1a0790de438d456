"""Recordings given instead of a data set: what they are, and the command that reads them."""

from __future__ import annotations

import shlex
from pathlib import Path, PurePosixPath

from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.files.archives import is_archive, names_in
from vislam2tag.common.folder_kinds import FLOOR, MODEL_SUFFIX, PROCESS, RUN, SURVEY, kind_of, survey_around, written_by
from vislam2tag.intake.columns import TIME, find_columns
from vislam2tag.intake.foreign_table import read_foreign_table
from vislam2tag.sessions.registry import FORMATS, UNKNOWN_FORMAT, format_in_zip, format_of, recorded_folder

_WITH_WALK = 4
"""Parts of the path of a survey's file: floor, device, session, file."""


def command_for(path: Path) -> str | None:
    """Say what a recording, survey or data set of this program is, and what to run instead of ``import``.

    None if the path is nothing of this kind.
    """
    given = shlex.quote(str(path))
    if (path / "dataset.json").is_file():
        return "it is already a data set of this program and needs no import"
    kind = kind_of(path)
    if kind == SURVEY or written_by(path) in (PROCESS, RUN):
        return f"it is {kind}; `vislam2tag dataset` makes a data set from it: vislam2tag dataset {given} --out OUT"
    if written_by(path) or path.suffix == MODEL_SUFFIX:
        return f"it is {kind}; expected data of another program"
    if is_archive(path) and any(map(_is_of_survey, names_in(path))):
        return "it is an archive of a survey; unpack it and run: vislam2tag dataset FOLDER --out OUT"
    if path.is_dir():
        return None if (name := format_of(recorded_folder(path))) in (None, UNKNOWN_FORMAT) else _of_folder(path, name)
    if is_archive(path):
        return (
            None
            if (name := _format_in_archive(path)) is None
            else _of_walk(name, given, f"vislam2tag receive SURVEY {given}")
        )
    return _of_file(path)


def table_with_times(path: Path, column: str) -> str:
    """Say which commands give the rows of a table with times in a ``column`` a place."""
    given = shlex.quote(str(path))
    return (
        f"it has times (column {column}) but no place, so it is a recording. If you also recorded a walk: "
        f"vislam2tag label {given} --labels LABELS adds its positions to the rows; vislam2tag attach WALK {given} adds "
        "the rows to the walk"
    )


def _is_of_survey(name: PurePosixPath) -> bool:
    return any(map(FLOOR.fullmatch, name.parts[: 1 - _WITH_WALK]))


def _format_in_archive(path: Path) -> str | None:
    try:
        return format_in_zip(path.parent, path) if path.suffix.lower() == ".zip" else None
    except (DatasetError, OSError):
        return None


def _of_folder(folder: Path, name: str) -> str:
    given = shlex.quote(str(folder))
    if survey := survey_around(folder):
        said = f"vislam2tag dataset {shlex.quote(str(survey))} --out OUT"
        return f"it is a session of a survey; make a data set from that: {said}"
    place = f"copy it to SURVEY/floor_K/DEVICE/{folder.name}, or zip it and run "
    return _of_walk(name, given, f"{place}vislam2tag receive SURVEY {shlex.quote(folder.name + '.zip')}")


def _of_walk(name: str, given: str, with_poses: str) -> str:
    return (
        f"it is a recording (format {name}), not a data set. With poses: {with_poses}. Without poses: "
        f"vislam2tag attach WALK {given}"
    )


def _of_file(file: Path) -> str | None:
    """A file that belongs to the recording of its folder, or a log with a column of times."""
    name = format_of(file.parent)
    if name not in (None, UNKNOWN_FORMAT) and file in FORMATS.named(name).input_files(file.parent):
        return f"it is a file of the recording {file.parent}; pass the folder: {_of_folder(file.parent, name)}"
    if file.suffix.lower() != ".txt":
        return None
    try:
        time = find_columns(read_foreign_table(file, only_head=True).columns, (TIME,)).get(TIME)
    except UsageError:
        return None
    return None if time is None else table_with_times(file, time.name)
