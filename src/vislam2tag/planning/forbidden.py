"""A file of places where no landmark may hang: rectangles, one a row."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import FloatArray
from vislam2tag.survey.site_table import finite_or_none, read_site_table

HEADER = ("floor", "x0", "y0", "x1", "y1")


def read_forbidden(path: Path) -> dict[int, FloatArray]:
    """Rectangles (f, 4) of each floor: two opposite corners x0, y0, x1, y1, metres in the BCS.

    The file is comma separated with the header ``floor,x0,y0,x1,y1``. Raises SurveyError where it cannot be used.
    """
    try:
        table = read_site_table(path.parent, path)
    except OSError as error:
        raise SurveyError(f"{path}: cannot be opened ({error.strerror}); expected {','.join(HEADER)}") from error
    if not set(HEADER) <= set(table.header):
        raise SurveyError(f"{path}: the first line must be: {','.join(HEADER)}")
    found: dict[int, list[list[float]]] = {}
    for line, fields in table.rows:
        try:
            floor = int(table.cell(fields, "floor"))
            corners = [finite_or_none(table.cell(fields, name)) for name in HEADER[1:]]
            if any(value is None for value in corners):
                raise ValueError("a corner is missing")
        except ValueError as error:
            raise SurveyError(f"{path}:{line}: expected a floor's number and four numbers, metres") from error
        found.setdefault(floor, []).append([value for value in corners if value is not None])
    return {floor: np.array(rows) for floor, rows in sorted(found.items())}
