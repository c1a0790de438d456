"""Landmark and control point files in a new frame: what else stands in them stays as it is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.site.frame_change import FrameChange
from vislam2tag.site.names import landmark_id
from vislam2tag.site.site_table import SiteTable, finite_or_none, read_site_table
from vislam2tag.site.table_columns import CONTROL_POINTS, LANDMARKS, TableColumns


def changed_landmarks_text(root: Path, path: Path, changes: Mapping[int, FrameChange], folder: int | None) -> str:
    """A landmark file with its positions, sigmas and headings in the new frame; heights above the floor stay.

    ``folder`` is the floor that the file lies under; None: its column ``floor`` tells. Raises SurveyError where a row
    cannot be read, or lies on a floor without a change.
    """
    table = _table(root, path, LANDMARKS)
    if (problem := table.missing_columns(LANDMARKS)) is not None:
        raise SurveyError(f"{path}: {problem}")
    rows: list[Sequence[str]] = [table.header]
    for line, fields in table.rows:
        said = table.cell(fields, "floor")
        change = _change(changes, said or folder, f"{path}:{line}")
        row = [*fields, *[""] * (len(table.header) - len(fields))]
        for column, text in _changed(table.header, row, change, f"{path}:{line}").items():
            row[table.header.index(column)] = text
        rows.append(row)
    return csv_rows(rows)


def changed_points_text(root: Path, path: Path, change: FrameChange) -> str:
    """A control point file in the new frame; raises SurveyError where a row cannot be read."""
    rows = []
    for line, fields in _table(root, path, CONTROL_POINTS).rows:
        x, y = _numbers(fields[:2], f"{path}:{line}")
        if x is None or y is None:
            raise SurveyError(f"{path}:{line}: expected x,y in metres; correct it")
        rows.append([*_moved(x, y, change), *fields[2:]])
    return csv_rows(rows)


def _table(root: Path, path: Path, columns: TableColumns) -> SiteTable:
    try:
        return read_site_table(root, path, has_header=columns is LANDMARKS, columns=columns)
    except OSError as error:
        raise SurveyError(f"{path}: cannot be opened ({error.strerror})") from error


def _change(changes: Mapping[int, FrameChange], floor: str | int | None, place: str) -> FrameChange:
    try:
        number = int(landmark_id(str(floor)))
    except ValueError as error:
        raise SurveyError(f"{place}: floor '{floor}' is no number; correct it") from error
    if number not in changes:
        raise SurveyError(f"{place}: there is no change for floor {number}; add it to rebase.toml")
    return changes[number]


def _changed(header: Sequence[str], row: Sequence[str], change: FrameChange, place: str) -> dict[str, str]:
    """New text of those columns that depend on the frame and are filled."""
    names = [name for name in ("x", "y", "sigma_m", "heading_rad") if name in header]
    known = dict(zip(names, _numbers([row[header.index(name)] for name in names], place), strict=True))
    found: dict[str, str] = {}
    x, y = known["x"], known["y"]
    if x is not None and y is not None:
        found["x"], found["y"] = _moved(x, y, change)
    if (sigma_m := known.get("sigma_m")) is not None:
        found["sigma_m"] = repr(sigma_m * change.new_T_old.scale)
    if (heading := known.get("heading_rad")) is not None:
        found["heading_rad"] = repr(math.remainder(heading + change.new_T_old.rotation_rad, math.tau))
    return found


def _moved(x: float, y: float, change: FrameChange) -> tuple[str, str]:
    place = (change.new_T_old @ np.array([x, y])).tolist()
    return repr(place[0]), repr(place[1])


def _numbers(texts: Sequence[str], place: str) -> list[float | None]:
    try:
        return [finite_or_none(text) for text in texts]
    except ValueError as error:
        raise SurveyError(f"{place}: {error}; correct it") from error
