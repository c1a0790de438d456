"""The result of a registration: adjusted points as rows of its tables, and in the site's own files."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import OutputError, SurveyError
from vislam2tag.common.findings import Finding, FindingKind
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.registration.least_squares import SingularError
from vislam2tag.preparation.registration.names import Role, role_of
from vislam2tag.preparation.registration.network import KNOWN, HeightFit, PlaneFit, adjust_plane
from vislam2tag.preparation.registration.record import (
    PositionSource,
    RegisteredPoint,
    Residual,
    ScaleTest,
    StationRow,
)
from vislam2tag.preparation.registration.tape_and_clicks import Click
from vislam2tag.site.landmark_file import CONTROL_POINT_FILE, LANDMARK_FILE, refuse_unreadable, table_path
from vislam2tag.site.landmark_states import LandmarkState, StateRow, read_states
from vislam2tag.site.model import landmark_id
from vislam2tag.site.site_table import (
    CONTROL_POINTS,
    LANDMARKS,
    SiteTable,
    TableColumns,
    finite_or_none,
    readable_table,
)

LEAST_SIGMA_M = 0.002
"""No landmark is stated better than this: a sheet is paper, and its centre a matter of millimetres."""
LEAST_WIDTH_M = 0.05
"""Edges closer than this give no direction."""


CERTAIN_SIGMAS = 3.29
"""A scale this far from 1 is off (one in a thousand)."""


def sheet_pose(fit: PlaneFit, landmark: str) -> tuple[complex, FloatArray] | None:
    """Centre of a landmark's sheet and its covariance (2, 2), m^2, from the shots of its centre, or of its two edges.

    None where neither is there.
    """
    if landmark in fit.places:
        return fit.places[landmark], fit.covariance(landmark)
    left, right = f"{landmark}_L", f"{landmark}_R"
    if left not in fit.places or right not in fit.places:
        return None
    half = np.hstack((np.eye(2), np.eye(2))) / 2
    return (fit.places[left] + fit.places[right]) / 2, half @ fit.covariance(left, right) @ half.T


def _heading(fit: PlaneFit, landmark: str) -> dict[str, float]:
    """Direction of a sheet's X axis and its sigma, where both its edges were shot.

    It points to the right for who looks at the sheet, from the left edge (shot as ``ID_L``) to the right one.
    """
    left, right = f"{landmark}_L", f"{landmark}_R"
    across = fit.places.get(right, 0j) - fit.places.get(left, 0j)
    if left not in fit.places or right not in fit.places or abs(across) < LEAST_WIDTH_M:
        return {}
    square = np.array((-across.imag, across.real)) / abs(across) ** 2
    change = np.concatenate((-square, square))
    sigma = math.sqrt(float(change @ fit.covariance(left, right) @ change))
    return {"heading_rad": round(math.atan2(across.imag, across.real), 6), "heading_sigma_rad": round(sigma, 6)}


def station_points(fit: PlaneFit, known: Collection[str], heights: HeightFit) -> dict[str, RegisteredPoint]:
    """Landmarks and control points that were shot and are not known, by key."""
    found: dict[str, RegisteredPoint] = {}
    for key in fit.places:
        role, identity = role_of(key)
        name = identity if role in (Role.LEFT, Role.RIGHT) else key
        if role is Role.TIE or name in known or name in found:
            continue
        sheet = sheet_pose(fit, name)
        if sheet is None:
            continue
        edges = (name, f"{name}_L", f"{name}_R")
        parts = [i for i, shot in enumerate(fit.measurements) if shot.station and shot.point in edges]
        checked = float(np.mean([fit.reliability(i) for i in parts]))
        further = _heading(fit, name)
        if name in heights.heights:
            z_m, z_sigma_m = heights.heights[name]
            further |= {"z_m": round(z_m, 4), "z_sigma_m": round(max(z_sigma_m, LEAST_SIGMA_M), 5)}
        point = placed_point(identity, *sheet, (PositionSource.STATION, len(parts), checked))
        found[name] = point.model_copy(update=further)
    return found


def clicked_point(click: Click) -> RegisteredPoint:
    """A landmark clicked on the plan."""
    return placed_point(click.landmark, click.place, np.eye(2) * click.sigma_m**2, (PositionSource.CLICK, 1, 0.0))


def placed_point(
    name: str, place: complex, covariance: FloatArray, origin: tuple[PositionSource, int, float]
) -> RegisteredPoint:
    """A point with its covariance (2, 2), m^2; ``origin``: source, how many measurements, how much they are checked."""
    (xx, xy), (_, yy) = _floored(covariance, LEAST_SIGMA_M).tolist()
    source, measurements, checked = origin
    return RegisteredPoint(
        point=name,
        x_m=round(place.real, 4),
        y_m=round(place.imag, 4),
        sigma_m=round(math.sqrt((xx + yy) / 2), 5),
        covariance_m2=((_short(xx), _short(xy)), (_short(xy), _short(yy))),
        source=source,
        measurements=measurements,
        checked=round(checked, 3),
    )


def _floored(covariance: FloatArray, least_m: float) -> FloatArray:
    """The covariance (2, 2), m^2, with no direction known better than the floor."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors @ np.diag(np.maximum(values, least_m**2)) @ vectors.T)


def _short(value: float) -> float:
    return float(f"{value:.4g}")


def scale_test(fit: PlaneFit) -> ScaleTest | None:
    """Return whether distances differ between stations and building; None if unknown (too few points)."""
    scale = fit.scale
    if scale is None:
        try:
            scale = adjust_plane(fit.measurements, fit.maps, free_scale=True).scale
        except SingularError:
            return None
    if scale is None:
        return None
    value, sigma = scale
    return ScaleTest(value=round(value, 7), sigma=round(sigma, 7), off=abs(value - 1) > CERTAIN_SIGMAS * sigma)


def station_rows(fit: PlaneFit) -> tuple[StationRow, ...]:
    """Where each station's frame is."""
    return tuple(
        StationRow(
            station=name,
            x_m=round(bcs_T_station.b.real, 4),
            y_m=round(bcs_T_station.b.imag, 4),
            turn_rad=round(bcs_T_station.rotation_rad, 7),
            shots=sum(shot.station == name for shot in fit.measurements),
        )
        for name, bcs_T_station in fit.maps.items()
        if name != KNOWN
    )


def plane_residuals(fit: PlaneFit) -> tuple[Residual, ...]:
    """Residuals of all that others check at all."""
    found = []
    for i, one in enumerate(fit.measurements):
        reduction, checks = fit.adjusted.reduction_without(fit.adjusted.rows(i))
        if checks:
            off = fit.residual_m(i)
            sigmas = math.sqrt(reduction / checks / fit.adjusted.variance_factor)
            row = Residual(
                measurement=one.label,
                at_m=(round(fit.places[one.point].real, 3), round(fit.places[one.point].imag, 3)),
                by_m=(round(off.real, 5), round(off.imag, 5)),
                off_m=round(abs(off), 5),
                sigmas=round(sigmas, 2),
                checked=round(fit.reliability(i), 3),
            )
            found.append(row)
    return tuple(found)


def network_findings(fit: PlaneFit, heights: HeightFit, scale: ScaleTest | None, known_shot: int) -> list[Finding]:
    """What is odd about the adjustment as a whole; ``known_shot`` is how many known points were shot."""
    messages: list[tuple[FindingKind, int, str]] = []
    if scale is not None and scale.off:
        text = (
            f"distances in the building are {scale.value:.5f} ± {scale.sigma:.5f} times those of the stations. Check "
            "the plan's scale and that all coordinates are in metres; if the grid has a scale of its own, pass "
            "--scale free"
        )
        messages.append(("station_scale", 1, text))
    if not fit.adjusted.plausible:
        text = (
            f"sigma0 is {fit.adjusted.sigma0:.2f}: the measurements scatter more than their stated accuracy; sigmas "
            "are raised, but look for the reason"
        )
        messages.append(("large_sigma0", 1, text))
    if known_shot < 3:
        text = (
            f"only {'1 known point was' if known_shot == 1 else f'{known_shot} known points were'} measured: a wrong "
            "one, or east and north interchanged, would not be detected; measure three or more"
        )
        messages.append(("few_known_points", 1, text))
    if heights.untied and heights.heights:
        text = (
            f"no point of known height was measured from station {', '.join(heights.untied)}: its points get no z; "
            "give the height of at least one known point"
        )
        messages.append(("untied_heights", len(heights.untied), text))
    return [Finding(kind=kind, file="", count=count, message=text) for kind, count, text in messages]


SAME_M = 5e-5
"""Positions that differ less are written alike."""
_OPTIONAL = ("z", "sigma_m", "heading_rad", "heading_sigma_rad")


def landmark_text(root: Path, folder: Path, floor: int, landmarks: Sequence[RegisteredPoint], *, replace: bool) -> str:
    """The floor's landmark file with these landmarks in it: rows of others, and other columns, as they were.

    A position that was only planned is replaced in any case. Raises OutputError where a landmark has another position
    there and ``replace`` is not given, SurveyError where the file there is no landmark file.
    """
    table = _table(root, table_path(folder / LANDMARK_FILE), LANDMARKS)
    header = list(table.header) if table.rows or table.header else ["id", "x", "y"]
    if table.header and (problem := table.missing_columns(LANDMARKS)) is not None:
        raise SurveyError(f"{folder / LANDMARK_FILE}: {problem}")
    wanted = {one.point: one for one in landmarks}
    refuse_unreadable(folder / LANDMARK_FILE, list(wanted), np.array([(one.x_m, one.y_m) for one in landmarks]))
    header += [name for name in _OPTIONAL if name not in header and any(_cells(one)[name] for one in landmarks)]
    rows: list[list[str]] = []
    changed: list[str] = []
    states, _ = read_states(root, folder)
    for line, fields in table.rows:
        row = [*fields, *[""] * (len(header) - len(fields))]
        name = landmark_id(fields[0])
        if name in wanted and landmark_id(table.cell(fields, "floor")) in ("", str(floor)):
            if _differs(table, fields, wanted[name]) and not _is_planned(table, fields, states.get(name)):
                changed.append(f"{name} ({table.place(line)})")
            _fill(row, header, wanted.pop(name))
        rows.append(row)
    if changed and not replace:
        raise OutputError(
            f"{folder / LANDMARK_FILE}: contains other positions of landmark {', '.join(changed)}; pass --replace to "
            "replace them by the registered ones"
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
    table = _table(root, path, CONTROL_POINTS, has_header=False)
    rows = [list(fields) for _, fields in table.rows]
    for one in sorted(points, key=lambda one: int(one.point)):
        number, cells = int(one.point), [f"{one.x_m:.4f}", f"{one.y_m:.4f}"]
        if number > len(rows):
            raise OutputError(f"{path}: control point {len(rows)} is missing: they are numbered from 0 without gaps")
        if number == len(rows):
            rows.append(cells)
            continue
        if not replace and not _same(rows[number][:2], one):
            raise OutputError(
                f"{path}: contains another position of control point {number} (line {number + 1}); pass --replace to "
                "replace it by the registered one"
            )
        rows[number] = cells
    return csv_rows(rows)


def _table(root: Path, path: Path, columns: TableColumns, *, has_header: bool = True) -> SiteTable:
    """A file of the site; without rows where there is none yet."""
    if not path.exists():
        return SiteTable(path.relative_to(root).as_posix(), (), ())
    return readable_table(root, path, has_header=has_header, columns=columns)


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
