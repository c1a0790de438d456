"""Points as a surveyor's file lists them: shots of stations, or known points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.findings import Finding
from vislam2tag.registration.columns import Column, columns_of
from vislam2tag.registration.text_table import TextTable, read_text_table
from vislam2tag.survey.names import landmark_id
from vislam2tag.survey.site_table import LineCounts

GREATEST_M = 1e8
"""National grids reach some ten thousand kilometres."""
_MESSAGES = {
    "malformed_lines": (
        "a row needs a point's name and numbers for E and N (H may be empty); these rows are left out: correct them"
    ),
    "non_finite_values": f"coordinates must be at most {GREATEST_M:g} m; these rows are left out: correct them",
}


@dataclass(frozen=True)
class PointRow:
    """One row of a point file; metres, NaN where a value is absent."""

    name: str
    east_m: float
    north_m: float
    height_m: float
    sigma_m: float
    code: str
    station: str
    source: str
    """File and 1-based line."""
    decimals: int
    """Digits after the decimal mark, as written: what a typing error can have changed."""


def read_points(path: Path, given: Sequence[Column | None] | None = None) -> tuple[list[PointRow], list[Finding]]:
    """Read a file of points; rows that cannot be used are findings.

    ``given`` names the columns in order where the file's own header does not. A row's ``station`` is empty where there
    is no such column. Raises SurveyError where the file is no table of points, or has no usable row.
    """
    table = read_text_table(path)
    columns, header_rows, findings = columns_of(table, given)
    counts = LineCounts.of(table.file)
    rows: list[PointRow] = []
    for line, fields in table.rows[header_rows:]:
        try:
            row = _point(table, columns, line, fields)
        except ValueError:
            counts.add("malformed_lines", line)
            continue
        if max(abs(row.east_m), abs(row.north_m)) > GREATEST_M:
            counts.add("non_finite_values", line)
        else:
            rows.append(row)
    if not rows:
        last = table.rows[min(header_rows, len(table.rows) - 1)]
        raise SurveyError(
            f"{path}: no line is a point (first tried: line {last[0]}, '{table.separator.join(last[1])}'); expected "
            "point, E, N, H separated by ; , tab or blanks, or name the columns by --columns"
        )
    return rows, [*table.findings, *findings, *counts.findings(_MESSAGES)]


def _point(table: TextTable, columns: dict[Column, int], line: int, fields: tuple[str, ...]) -> PointRow:
    def cell(column: Column) -> str:
        index = columns.get(column, len(fields))
        return fields[index] if index < len(fields) else ""

    name = landmark_id(cell(Column.POINT))
    east, north, height = (table.number(cell(column)) for column in (Column.EAST, Column.NORTH, Column.HEIGHT))
    sigma = table.number(cell(Column.SIGMA))
    if not name or math.isnan(east) or math.isnan(north) or sigma <= 0:
        raise ValueError(f"line {line} is no point")
    return PointRow(
        name=name,
        east_m=east,
        north_m=north,
        height_m=height,
        sigma_m=sigma,
        code=cell(Column.CODE),
        station=cell(Column.STATION),
        source=table.place(line),
        decimals=max(len(cell(column).partition(table.decimal)[2]) for column in (Column.EAST, Column.NORTH)),
    )
