"""Registered positions as the site's own files; what else stands in them stays as it is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from vislam2tag.common.errors import OutputError, SurveyError
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.preparation.registration.record import RegisteredPoint
from vislam2tag.site.landmark_file import CONTROL_POINT_FILE, LANDMARK_FILE, table_path
from vislam2tag.site.landmark_states import LandmarkState, StateRow, read_states
from vislam2tag.site.names import landmark_id
from vislam2tag.site.site_table import SiteTable, finite_or_none, read_site_table
from vislam2tag.site.table_columns import CONTROL_POINTS, LANDMARKS

SAME_M = 5e-5
"""Positions that differ less are written alike."""
_OPTIONAL = ("z", "sigma_m", "heading_rad", "heading_sigma_rad")


def landmark_text(root: Path, folder: Path, floor: int, landmarks: Sequence[RegisteredPoint], *, replace: bool) -> str:
    """The floor's landmark file with these landmarks in it: rows of others, and other columns, as they were.

    A position that was only planned is replaced in any case. Raises OutputError where a landmark has another position
    there and ``replace`` is not given, SurveyError where the file there is no landmark file.
    """
    table = _table(root, table_path(folder / LANDMARK_FILE))
    header = list(table.header) if table.rows or table.header else ["id", "x", "y"]
    if table.header and (problem := table.missing_columns(LANDMARKS)) is not None:
        raise SurveyError(f"{folder / LANDMARK_FILE}: {problem}")
    wanted = {one.point: one for one in landmarks}
    header += [name for name in _OPTIONAL if name not in header and any(_cells(one)[name] for one in landmarks)]
    rows: list[list[str]] = []
    changed: list[str] = []
    states, _ = read_states(root, folder)
    for line, fields in table.rows:
        row = [*fields, *[""] * (len(header) - len(fields))]
        name = landmark_id(fields[0])
        if name in wanted and _floor_of(table, fields) in ("", str(floor)):
            if _differs(table, fields, wanted[name]) and not _is_planned(table, fields, states.get(name)):
                changed.append(f"{name} ({table.place(line)})")
            _fill(row, header, wanted.pop(name))
        rows.append(row)
    if changed and not replace:
        raise OutputError(
            f"{folder / LANDMARK_FILE}: holds other positions of landmark {', '.join(changed)}; give --replace to put "
            "the registered ones in their place"
        )
    for one in wanted.values():
        row = [""] * len(header)
        row[0] = one.point
        if "floor" in header:
            row[header.index("floor")] = str(floor)
        _fill(row, header, one)
        rows.append(row)
    return csv_rows([header, *rows])


def control_point_text(root: Path, folder: Path, points: Sequence[RegisteredPoint], *, replace: bool) -> str:
    """The floor's control point file with these in it, each in the row of its number.

    Raises OutputError where one has another position there and ``replace`` is not given, or the numbers leave a gap.
    """
    path = table_path(folder / CONTROL_POINT_FILE)
    try:
        rows = [
            list(fields) for _, fields in read_site_table(root, path, has_header=False, columns=CONTROL_POINTS).rows
        ]
    except FileNotFoundError:
        rows = []
    except OSError as error:
        raise SurveyError(f"{path}: cannot be opened ({error.strerror})") from error
    for one in sorted(points, key=lambda one: int(one.point)):
        number, cells = int(one.point), [f"{one.x_m:.4f}", f"{one.y_m:.4f}"]
        if number > len(rows):
            raise OutputError(f"{path}: control point {len(rows)} is missing: they are numbered from 0 without gaps")
        if number == len(rows):
            rows.append(cells)
            continue
        if not replace and not _same(rows[number][:2], one):
            raise OutputError(
                f"{path}: has another position of control point {number} (line {number + 1}); give --replace to put "
                "the registered one in its place"
            )
        rows[number] = cells
    return csv_rows(rows)


def _table(root: Path, path: Path) -> SiteTable:
    try:
        return read_site_table(root, path, columns=LANDMARKS)
    except FileNotFoundError:
        return SiteTable(path.relative_to(root).as_posix(), (), ())
    except OSError as error:
        raise SurveyError(f"{path}: cannot be opened ({error.strerror})") from error


def _floor_of(table: SiteTable, fields: tuple[str, ...]) -> str:
    return landmark_id(table.cell(fields, "floor"))


def _differs(table: SiteTable, fields: tuple[str, ...], one: RegisteredPoint) -> bool:
    """Whether a row has a position, and another one."""
    cells = [table.cell(fields, "x"), table.cell(fields, "y")]
    return any(cells) and not _same(cells, one)


def _is_planned(table: SiteTable, fields: tuple[str, ...], state: StateRow | None) -> bool:
    """Whether the position of a row was only planned."""
    try:
        x, y = (finite_or_none(table.cell(fields, column)) for column in ("x", "y"))
    except ValueError:
        return False
    return state is not None and x is not None and y is not None and state.plans(x, y)


def measured_states(landmarks: Sequence[RegisteredPoint]) -> list[StateRow]:
    """The states of registered landmarks, with positions as the landmark file has them."""
    return [
        StateRow(one.point, LandmarkState.MEASURED, one.source.value, round(one.x_m, 4), round(one.y_m, 4))
        for one in landmarks
    ]


def _same(cells: Sequence[str], one: RegisteredPoint) -> bool:
    try:
        x, y = (float(cell) for cell in cells)
    except ValueError:
        return False
    return math.isclose(x, one.x_m, abs_tol=SAME_M) and math.isclose(y, one.y_m, abs_tol=SAME_M)


def _cells(one: RegisteredPoint) -> Mapping[str, str]:
    """Text of every column of a landmark, empty where nothing is known."""
    return {
        "x": f"{one.x_m:.4f}",
        "y": f"{one.y_m:.4f}",
        "z": "" if one.z_m is None else f"{one.z_m:.4f}",
        "sigma_m": f"{one.sigma_m:.5f}",
        "heading_rad": "" if one.heading_rad is None else f"{one.heading_rad:.6f}",
        "heading_sigma_rad": "" if one.heading_sigma_rad is None else f"{one.heading_sigma_rad:.6f}",
    }


def _fill(row: list[str], header: Sequence[str], one: RegisteredPoint) -> None:
    """Put what was registered into a row; a height or heading that was not measured stays as it is."""
    for column, text in _cells(one).items():
        if text:
            row[header.index(column)] = text
