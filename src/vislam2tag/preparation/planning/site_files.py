"""Files of a site that a plan uses: rectangles without landmarks are read, planned landmarks added to its own.

What is in a floor's ``marker_dict.csv`` stays as it is, to the letter.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.planning.records import PlannedLandmark
from vislam2tag.site.landmark_states import (
    PLANNED_HEADING_SIGMA_RAD,
    PLANNED_SIGMA_M,
    LandmarkState,
    StateRow,
)
from vislam2tag.site.site_table import finite_or_none, read_site_table

FORBIDDEN_HEADER = ("floor", "x0", "y0", "x1", "y1")


def read_forbidden(path: Path) -> dict[int, FloatArray]:
    """Rectangles (f, 4) of each floor: two opposite corners x0, y0, x1, y1, metres in the BCS.

    The file is comma separated with the header ``floor,x0,y0,x1,y1``. Raises SurveyError where it cannot be used.
    """
    try:
        table = read_site_table(path.parent, path)
    except OSError as error:
        raise SurveyError(
            f"{path}: cannot be opened ({error.strerror}); expected {','.join(FORBIDDEN_HEADER)}"
        ) from error
    if not set(FORBIDDEN_HEADER) <= set(table.header):
        raise SurveyError(f"{path}: the first line must be: {','.join(FORBIDDEN_HEADER)}")
    found: dict[int, list[list[float]]] = {}
    for line, fields in table.rows:
        try:
            floor = int(table.cell(fields, "floor"))
            corners = [finite_or_none(table.cell(fields, name)) for name in FORBIDDEN_HEADER[1:]]
            if any(value is None for value in corners):
                raise ValueError("a corner is missing")
        except ValueError as error:
            raise SurveyError(f"{path}:{line}: expected a floor's number and four numbers, metres") from error
        found.setdefault(floor, []).append([value for value in corners if value is not None])
    return {floor: np.array(rows) for floor, rows in sorted(found.items())}


MARKER_COLUMNS = ("id", "x", "y", "z", "sigma_m", "heading_rad", "heading_sigma_rad", "sheet", "width_m")


def marker_text(text: str, landmarks: Sequence[PlannedLandmark]) -> str:
    """Text of a floor's ``marker_dict.csv`` with further rows; columns that it lacks are added to its header.

    ``text`` is empty where there is no file yet.
    """
    newline = "\r\n" if "\r\n" in text else "\n"
    head, _, rest = text.partition("\n")
    header = next(csv.reader([head.rstrip("\r")]), [])
    names = [name.strip().lower() for name in header] or list(MARKER_COLUMNS)
    missing = [name for name in MARKER_COLUMNS[1:] if name not in names[1:]]
    first = head.rstrip("\r") if header else ",".join(MARKER_COLUMNS)
    lines = [",".join((first, *missing))]
    if rest.strip("\r\n"):
        lines.append(rest.rstrip("\r\n"))
    rows = (_marker_row(landmark, (*names, *missing)) for landmark in landmarks)
    return newline.join((*lines, csv_rows(rows, newline)))


def planned_states(landmarks: Sequence[PlannedLandmark]) -> list[StateRow]:
    """The states of planned landmarks."""
    return [StateRow(one.id, LandmarkState.PLANNED, "plan", one.x_m, one.y_m) for one in landmarks]


def _marker_row(landmark: PlannedLandmark, names: Sequence[str]) -> list[str]:
    values = {
        "x": landmark.x_m,
        "y": landmark.y_m,
        "z": landmark.z_m,
        "floor": landmark.floor,
        "sigma_m": PLANNED_SIGMA_M,
        "heading_rad": landmark.heading_rad,
        "heading_sigma_rad": PLANNED_HEADING_SIGMA_RAD,
        "sheet": landmark.sheet,
        "width_m": landmark.width_m,
    }
    return [landmark.id, *(str(values.get(name, "")) for name in names[1:])]
