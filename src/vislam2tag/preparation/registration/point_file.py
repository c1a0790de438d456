"""Files of points by surveyors: tables, Leica GSI and LandXML."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.findings import Finding, FindingKind
from vislam2tag.intake.extents import MAX_GRID_M, refused_positions
from vislam2tag.preparation.registration.instrument_files import instrument_table
from vislam2tag.preparation.registration.network import Measurement
from vislam2tag.preparation.registration.point_columns import (
    CUSTOMARY,
    PointColumn,
    point_columns,
    with_labels_as_columns,
)
from vislam2tag.preparation.registration.text_table import TextTable, parsed, raw_file, refuse_longer_rows, text_table
from vislam2tag.site.model import landmark_id
from vislam2tag.site.site_table import LineCounts


def read_points(
    path: Path, given: Sequence[PointColumn | None] | None = None
) -> tuple[list[Measurement], list[Finding]]:
    """Read a file of points; rows that cannot be used are findings.

    ``given`` names the columns of a table in order, if its own header does not. A row's ``station`` is empty if there
    is no such column, its sigma NaN. Raises SurveyError if the file is of another format or has no usable row.
    """
    raw = raw_file(path)
    table = instrument_table(path, raw)
    if table is None:
        table = with_labels_as_columns(text_table(path, raw))
    else:
        given = None
    columns, below, findings = point_columns(table, given)
    refuse_longer_rows(below, len(below.unit_m) or max(len(given or ()), len(CUSTOMARY)))
    counts = LineCounts(table.file)
    rows: list[Measurement] = []
    for line, row in parsed(below.rows, counts, partial(_point, below, columns)):
        if max(abs(row.place.real), abs(row.place.imag)) > MAX_GRID_M:
            counts.add("non_finite_values", line)
        else:
            rows.append(row)
    if not rows:
        last = (below.rows or table.rows)[0]
        raise SurveyError(
            f"{path}: no line is a point (the first is line {last[0]}, '{table.quoted(last)}'); expected "
            "point, E, N, H separated by ; , tab or blanks, or name the columns with --columns"
        )
    places = np.array([(one.place.real, one.place.imag) for one in rows])
    if problem := refused_positions([one.point for one in rows], places):
        raise SurveyError(f"{path}: {problem}")
    return rows, [*table.findings, *findings, *counts.findings(_messages(below, counts))]


def _messages(table: TextTable, counts: LineCounts) -> dict[FindingKind, str]:
    malformed = {
        line: table.quoted((line, fields))
        for line, fields in table.rows
        if line in counts.lines.get("malformed_lines", [])[:1]
    }
    return {
        "malformed_lines": (
            f"rows such as '{next(iter(malformed.values()), '')}' are skipped: a row needs the name of a point and "
            "numbers for E and N (H may be empty, and a sigma must be above 0). Correct them"
        ),
        "non_finite_values": f"coordinates must be at most {MAX_GRID_M:g} m; these rows are skipped: correct them",
    }


def _point(table: TextTable, columns: dict[PointColumn, int], line: int, fields: tuple[str, ...]) -> Measurement:
    texts = {column: fields[index] for column, index in columns.items() if index < len(fields)}
    east, north, height, sigma = (
        table.length(fields, columns.get(column, len(fields)))
        for column in (PointColumn.EAST, PointColumn.NORTH, PointColumn.HEIGHT, PointColumn.SIGMA)
    )
    name = landmark_id(texts.get(PointColumn.POINT, ""))
    if not name or math.isnan(east) or math.isnan(north) or sigma <= 0:
        raise ValueError(f"line {line} is not a point")
    return Measurement(
        point=name,
        station=texts.get(PointColumn.STATION, ""),
        place=complex(east, north),
        sigma_m=sigma,
        height_m=height,
        code=texts.get(PointColumn.CODE, ""),
        source=table.place(line),
        decimals=max(table.decimals(fields, columns[column]) for column in (PointColumn.EAST, PointColumn.NORTH)),
    )
