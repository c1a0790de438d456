"""Planned landmarks added to a floor's ``marker_dict.csv``; what is in it stays as it is, to the letter."""

from __future__ import annotations

import csv
from collections.abc import Sequence

from vislam2tag.common.text_tables import csv_rows
from vislam2tag.planning.records import PlannedLandmark

COLUMNS = ("id", "x", "y", "z", "sigma_m", "heading_rad", "heading_sigma_rad", "sheet", "width_m")
PLANNED_SIGMA_M = 0.1
"""Who hangs a sheet where the plan says is off by so much, per axis, until it is surveyed."""
PLANNED_HEADING_SIGMA_RAD = 0.05
"""Walls of a plan are true to this."""


def with_landmarks(text: str, landmarks: Sequence[PlannedLandmark]) -> str:
    """The file's text with further rows; columns that it lacks are added to its header.

    ``text`` is empty where there is no file yet.
    """
    newline = "\r\n" if "\r\n" in text else "\n"
    head, _, rest = text.partition("\n")
    header = next(csv.reader([head.rstrip("\r")]), [])
    names = [name.strip().lower() for name in header] or list(COLUMNS)
    missing = [name for name in COLUMNS[1:] if name not in names[1:]]
    first = head.rstrip("\r") if header else ",".join(COLUMNS)
    lines = [",".join((first, *missing))]
    if rest.strip("\r\n"):
        lines.append(rest.rstrip("\r\n"))
    rows = (_row(landmark, (*names, *missing)) for landmark in landmarks)
    return newline.join((*lines, csv_rows(rows, newline)))


def _row(landmark: PlannedLandmark, names: Sequence[str]) -> list[str]:
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
