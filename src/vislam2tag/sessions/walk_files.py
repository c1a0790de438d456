"""Which files of a folder are the tables of a walk, and which of them may be its poses."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.given_files import plain
from vislam2tag.common.files.toml_file import read_toml
from vislam2tag.intake.columns import COLUMNS_FILE, matching_columns
from vislam2tag.sessions.foreign_tables import (
    SENSOR_COLUMNS,
    sensor_columns,
)
from vislam2tag.sessions.registry import HEAD_BYTES, TABLE_SUFFIXES
from vislam2tag.sessions.walk_columns import (
    TableColumns,
    WalkColumns,
    fits,
    is_of_sightings,
    kind_of,
    named_as_poses,
    rotation_columns,
    sensor_of_file,
)
from vislam2tag.site.site_table import is_file

_MOST_FILES = 100
_UNUSED = frozenset({"truth.csv", "fixes.csv", "tachy.csv", "refMarker.csv", "ControlPoint.csv"})
_POSE_WIDTH = 7
"""Columns of poses with one column missing."""
_CAMERA_FILE = re.compile(r"cam|pose|traj|odom|slam", re.IGNORECASE)


def tables_in(folder: Path) -> list[Path]:
    """The tables of a session's folder, except files with a meaning of their own."""
    return [
        path
        for path in sorted(folder.iterdir())
        if path.suffix.lower() in TABLE_SUFFIXES
        and path.name not in _UNUSED
        and not path.name.startswith(".")
        and is_file(path)
    ][:_MOST_FILES]


def nearest_columns_file(folder: Path) -> Path | None:
    """The nearest ``columns.toml``: of the session, its device, its floor or the survey."""
    return next((each / COLUMNS_FILE for each in (folder, *folder.parents[:3]) if is_file(each / COLUMNS_FILE)), None)


def is_wide(columns: Sequence[str]) -> bool:
    """Whether a table has columns for the axes of a sensor, such as ``acc_x``."""
    return any(sensor_columns(columns, sensor)[0] for sensor in SENSOR_COLUMNS)


def partly_poses(file: str, columns: Sequence[str]) -> bool:
    """Whether a table of no other kind has some columns of positions or rotations, and a time or a camera's name.

    It may be a table of poses with columns that are not recognised.
    """
    if kind_of(file, columns) not in (None, "poses") or is_wide(columns) or sensor_of_file(file, columns):
        return False
    if is_of_sightings(file):
        return False
    axes = sum(bool(matching_columns(columns, f"pose_{axis}")) for axis in "xyz")
    turns = len(rotation_columns(columns))
    # Times with x and y alone are those of a total station or of known positions.
    enough = axes + turns >= 4 or (max(axes, turns) >= 2 and len(columns) >= _POSE_WIDTH)
    return enough and (bool(matching_columns(columns, "time")) or bool(_CAMERA_FILE.search(file)))


def first_lines(path: Path) -> list[list[str]]:
    """The first lines of a file, each split into the columns that it would name."""
    try:
        with plain(path).open("rb") as file:
            text = file.read(HEAD_BYTES).decode("utf-8-sig", errors="replace")
    except OSError:  # reading it reports that
        return []
    lines = []
    for line in text.split("\n")[:20]:
        mark = max((";", "\t", "|", ","), key=line.count)
        fields = line.lstrip("# ").split(mark if mark in line else None)
        lines.append([name.strip(' "\r') for name in fields])
    return lines


def has_poses(file: str, lines: Sequence[Sequence[str]], given: TableColumns) -> bool:
    """Whether one of a file's first lines names the columns of poses, also as ``given``, or the file's name says so."""
    if given.file == file:
        return True
    for columns in lines:
        if kind_of(file, columns) == "poses" or fits(columns, "poses", given):
            return True
        letters = [name for name in columns if name[:1].isalpha() and name.lower() not in ("nan", "inf")]
        if named_as_poses(file) and len(columns) >= 4 and len(letters) > len(columns) / 2:
            return True
    return False


def given_poses(folder: Path) -> TableColumns:
    """The section for poses of the nearest ``columns.toml``; empty if there is none, or reading it reports an error."""
    path = nearest_columns_file(folder)
    try:
        return TableColumns() if path is None else read_toml(path, WalkColumns).poses
    except (SurveyError, FileNotFoundError):
        return TableColumns()
