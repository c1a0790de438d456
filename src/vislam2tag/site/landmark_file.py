"""Landmarks and control points of a site's files, and errors that landmarks of a completed file share."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import OutputError, SurveyError, first_line
from vislam2tag.common.files.table_files import parquet_bytes, read_parquet
from vislam2tag.common.findings import Finding, FindingKind, at_lines_if
from vislam2tag.core.arrays import FloatArray, IntArray, joint_columns, of_landmarks
from vislam2tag.core.limits import MAX_CONTROL_POINTS, MAX_JOINT_LANDMARKS
from vislam2tag.core.tracks import Landmarks
from vislam2tag.intake.extents import MAX_LOCAL_M, too_far
from vislam2tag.intake.foreign_table import XLSX
from vislam2tag.site.landmark_states import (
    StateRow,
    SurveyedLandmark,
    copies_of_plan,
    nearly_planned,
    perhaps_planned,
    planned_twice,
    proposals_in,
    read_states,
)
from vislam2tag.site.model import ControlPoints, landmark_id
from vislam2tag.site.site_table import (
    CONTROL_POINTS,
    LANDMARKS,
    LineCounts,
    SiteTable,
    finite_or_none,
    is_file,
    number_or_none,
    read_site_table,
    readable_table,
    site_finding,
    unreadable_file,
)

LANDMARK_FILE = "marker_dict.csv"
CONTROL_POINT_FILE = "refmarker.csv"
USUAL_HEADING_SIGMA_RAD = 0.05
"""Standard deviation of a surveyed heading whose file gives none: as a sheet is held against a wall."""
GREATEST_FLOOR = 999_999
"""As for the names of floor folders."""

_MESSAGES: dict[FindingKind, str] = {
    "malformed_lines": (
        "a row needs an id, numbers for x and y (or neither for an unsurveyed landmark), positive sigmas and, in a "
        "file for several floors, a floor; these rows are skipped: correct them"
    ),
    "non_finite_values": (
        f"coordinates must be finite and at most {MAX_LOCAL_M:g} m; these rows are skipped: correct them (vislam2tag "
        "register --control converts those of a national grid)"
    ),
    "duplicate_landmarks": "an id may appear only once on a floor; the first row is used: remove the others",
}


def read_landmark_file(
    root: Path, folder: Path, floor: int, default_sigma_m: float, taken: set[tuple[int, str]]
) -> tuple[list[SurveyedLandmark], list[Finding]]:
    """Read the landmarks of one floor folder; what cannot be used is a finding.

    ``taken`` holds the (floor, id) pairs that earlier files gave; this file's are added.

    Columns: the first is the id whatever its name, then ``x``, ``y`` (metres, BCS) and the optional ``z``,
    ``floor``, ``sigma_m`` (per axis), ``heading_rad``, ``heading_sigma_rad``, in any order.
    """
    path = table_path(folder / LANDMARK_FILE)
    name = path.relative_to(root).as_posix()
    try:
        table = read_site_table(root, path, columns=LANDMARKS)
    except FileNotFoundError:
        if any(entry.is_dir() for entry in folder.glob("*")):  # walks
            message = (
                f"floor {floor} has walks and no landmarks: add the file if it has; otherwise walks are placed on the "
                "floor's plan by their shape, which needs a plan with walls and walks of about two minutes"
            )
            return [], [Finding(kind="missing_file", file=name, count=1, message=message)]
        message = (
            f"floor {floor} has no landmarks yet: plan them with `vislam2tag plan SITE --out plan --write`, "
            "or add the file"
        )
        return [], [Finding(kind="missing_file", file=name, count=1, message=message)]
    except OSError as error:
        return [], [
            unreadable_file(name, error, "the floor's landmarks are unknown, and its sessions cannot be mapped")
        ]
    if (problem := table.missing_columns(LANDMARKS)) is not None:
        return [], [_no_landmarks("malformed_header", name, problem, table.header_lines)]
    landmarks, findings = landmarks_in(table, floor, default_sigma_m, taken)
    states, state_findings = read_states(root, folder)
    landmarks = [
        replace(one, planned=one.landmark in states and states[one.landmark].plans(one.x_m, one.y_m))
        for one in landmarks
    ]
    findings += state_findings
    findings += perhaps_planned(table, floor, states, proposals_in(root))
    findings += nearly_planned(table.file, landmarks, {(floor, name): state for name, state in states.items()})
    return landmarks, [*findings, *planned_twice(table.file, landmarks)]


def read_site_landmarks(
    root: Path, folders: Mapping[int, Path], default_sigma_m: float, landmark_file: Path | None
) -> tuple[list[SurveyedLandmark], list[Finding]]:
    """Read the landmarks of all floor folders, or those of one file in place of them.

    Rows of such a file that repeat planned positions of the survey are planned. Raises SurveyError as
    :func:`read_completed_file`.
    """
    landmarks: list[SurveyedLandmark] = []
    findings: list[Finding] = []
    if landmark_file is None:
        taken: set[tuple[int, str]] = set()
        for number, folder in folders.items():
            found, problems = read_landmark_file(root, folder, number, default_sigma_m, taken)
            landmarks += found
            findings += problems
        return landmarks, findings
    landmarks, findings = read_completed_file(landmark_file, folders, default_sigma_m)
    states: dict[tuple[int, str], StateRow] = {}
    for floor, folder in folders.items():
        known, problems = read_states(root, folder)
        states |= {(floor, name): state for name, state in known.items()}
        findings += problems
    landmarks = copies_of_plan(landmarks, states, proposals_in(root))
    return landmarks, [*findings, *nearly_planned(landmark_file.name, landmarks, states)]


def read_completed_file(
    path: Path, floors: Collection[int], default_sigma_m: float
) -> tuple[list[SurveyedLandmark], list[Finding]]:
    """Read one file with the landmarks of all ``floors``, in place of the floors' own; rows that cannot be used are
    findings.

    Its columns are those of :func:`read_landmark_file`; ``floor`` may be absent only where there is one floor. Raises
    SurveyError where the file cannot be opened, has a missing column, or has no usable row of any of these floors.
    """
    table = readable_table(path.parent, path, "; expected a landmark file", columns=LANDMARKS)
    if (problem := table.missing_columns(LANDMARKS)) is not None:
        raise SurveyError(f"{':'.join(map(str, (path, *table.header_lines)))}: {problem}")
    if len(floors) > 1 and "floor" not in table.header[1:]:
        raise SurveyError(f"{path}: the column floor is missing, which a landmark file for several floors needs")
    found, findings = landmarks_in(table, next(iter(floors)) if len(floors) == 1 else None, default_sigma_m, set())
    if not any(landmark.floor in floors for landmark in found):
        there = ", ".join(str(floor) for floor in sorted(floors))
        raise SurveyError(f"{path}: contains no usable landmark of the survey's floors ({there})")
    return found, findings


def refuse_unreadable(path: Path, names: Sequence[str], position_bcs: FloatArray) -> None:
    """Raise OutputError if positions (n, 2) that are to be written to a site's file would be skipped by its readers."""
    if problem := too_far(names, position_bcs):
        raise OutputError(f"{path}: nothing was written to it, because {problem}")


def table_path(path: Path) -> Path:
    """The file of this name, or the XLSX that is there in its place."""
    other = path.with_suffix(XLSX)
    try:
        return other if is_file(other) and not is_file(path) else path
    except OSError:  # reported where the file itself is read
        return path


def _no_landmarks(kind: FindingKind, file: str, message: str, lines: tuple[int, ...] = ()) -> Finding:
    return Finding(
        kind=kind, file=file, count=1, message=f"{message}; the floor's sessions cannot be mapped", lines=lines
    )


def landmarks_in(
    table: SiteTable, floor: int | None, default_sigma_m: float, taken: set[tuple[int, str]]
) -> tuple[list[SurveyedLandmark], list[Finding]]:
    """Read the landmarks of a table with our columns; ``floor`` is that of rows without one.

    Rows that cannot be used, or are in ``taken`` (floor, id), are findings; the others' pairs are added to it.
    """
    counts = LineCounts(table.file)
    found: list[SurveyedLandmark] = []
    for line, fields in table.rows:
        try:
            landmark = _landmark_of(table, line, fields, floor, default_sigma_m)
        except ValueError:
            counts.add("malformed_lines", line)
            continue
        if any(math.isinf(value) for value in (landmark.x_m, landmark.y_m, landmark.z_m)):
            counts.add("non_finite_values", line)
        elif (landmark.floor, landmark.landmark) in taken:
            counts.add("duplicate_landmarks", line)
        else:
            taken.add((landmark.floor, landmark.landmark))
            found.append(landmark)
    return found, [*table.findings, *counts.findings(_MESSAGES)]


def _landmark_of(
    table: SiteTable, line: int, fields: tuple[str, ...], folder_floor: int | None, default_sigma_m: float
) -> SurveyedLandmark:
    """Make a landmark of one row; a coordinate that is written but cannot be one comes out infinite."""
    name = landmark_id(fields[0])
    x, y, z = (_coordinate(table.cell(fields, column)) for column in ("x", "y", "z"))
    sigma, heading, heading_sigma = (
        finite_or_none(table.cell(fields, column)) for column in ("sigma_m", "heading_rad", "heading_sigma_rad")
    )
    floor_text = table.cell(fields, "floor")
    floor = _floor_number(floor_text) if floor_text else folder_floor
    bad_sigma = any(value is not None and not 0 < value <= MAX_LOCAL_M for value in (sigma, heading_sigma))
    if not name or floor is None or math.isnan(x) != math.isnan(y) or bad_sigma:
        raise ValueError(f"'{name}' is not a usable landmark")
    return SurveyedLandmark(
        landmark=name,
        floor=floor,
        x_m=x,
        y_m=y,
        z_m=z,
        sigma_m=default_sigma_m if sigma is None else sigma,
        heading_rad=math.nan if heading is None else heading,
        heading_sigma_rad=math.nan if heading is None else heading_sigma or USUAL_HEADING_SIGMA_RAD,
        source=table.place(line),
        sigma_given=sigma is not None,
    )


def _coordinate(text: str) -> float:
    value = number_or_none(text)
    if value is None:
        return math.nan
    return value if abs(value) <= MAX_LOCAL_M else math.inf


def _floor_number(text: str) -> int:
    number = int(landmark_id(text))
    if abs(number) > GREATEST_FLOOR:
        raise ValueError(f"there is no floor {number}")
    return number


def landmarks_from(rows: Sequence[SurveyedLandmark]) -> Landmarks:
    """Put landmarks into arrays: covariance ``sigma_m``² I, infinite on the diagonal where unsurveyed."""
    columns = np.array(
        [(r.x_m, r.y_m, r.z_m, r.sigma_m, r.heading_rad, r.heading_sigma_rad) for r in rows], dtype=np.float64
    ).reshape(len(rows), 6)
    position = columns[:, :2].copy()
    unsurveyed = np.isnan(position).any(axis=1)
    variance = np.where(unsurveyed, np.inf, columns[:, 3] ** 2)
    covariance = np.zeros((len(rows), 2, 2))
    covariance[:, (0, 1), (0, 1)] = variance[:, None]
    return Landmarks(
        ids=tuple(r.landmark for r in rows),
        floor=np.array([r.floor for r in rows], dtype=np.int64),
        position_bcs=position,
        covariance_bcs=covariance,
        z_m=columns[:, 2].copy(),
        heading_rad=columns[:, 4].copy(),
        heading_sigma_rad=columns[:, 5].copy(),
        source=tuple(r.source for r in rows),
        planned=np.array([r.planned for r in rows], dtype=bool),
    )


def read_control_points(root: Path, folder: Path) -> tuple[ControlPoints, list[Finding]]:
    """Read the control points of a floor folder: rows ``x,y`` (metres, BCS) without a header; ids count from 0.

    Only evaluation surveys have the file, so its absence is nothing to report.
    """
    path = table_path(folder / CONTROL_POINT_FILE)
    none = ControlPoints((), np.empty((0, 2)))
    try:
        table = read_site_table(root, path, has_header=False, columns=CONTROL_POINTS)
    except FileNotFoundError:
        return none, []
    except OSError as error:
        name = path.relative_to(root).as_posix()
        return none, [unreadable_file(name, error, "the floor's control points are unknown")]
    points: dict[int, tuple[float, float]] = {}
    for line, fields in table.rows:
        with suppress(ValueError):
            x, y = (finite_or_none(field) for field in fields[:2])
            if x is not None and y is not None and max(abs(x), abs(y)) <= MAX_LOCAL_M:
                points[line] = x, y
    if len(points) > MAX_CONTROL_POINTS:
        message = f"{len(points):,} control points, but a floor may have at most {MAX_CONTROL_POINTS:,}; none is used"
        return none, [*table.findings, site_finding("unreadable_file", table.file, message)]
    positions = np.array(list(points.values()), dtype=np.float64).reshape(len(points), 2)
    ids = tuple(str(i) for i in range(len(points)))
    wrong = [line for line, _ in table.rows if line not in points]
    message = (
        f"a row must be two finite numbers, x,y, of at most {MAX_LOCAL_M:g} m; these rows are skipped: correct them"
    )
    findings = [*table.findings, *at_lines_if("malformed_lines", table.file, wrong, message)]
    return ControlPoints(ids, positions, tuple(table.place(line) for line in points)), findings


SUFFIX = ".covariance.parquet"
"""``completed.csv`` has ``completed.covariance.parquet`` beside it."""
SAME_PLACE_M = 1e-3
"""A row of the landmark file that is elsewhere was changed since: it errs by itself."""
MOST_LANDMARKS = 400
"""Each session is given the whole covariance, which grows with the square of their number."""
_WITH = ("with_x", "with_y", "with_heading")


@dataclass(frozen=True)
class SharedErrors:
    """``k`` landmarks by floor (k,) and id, at ``position_bcs`` (k, 2) metres. ``covariance`` (3k, 3k) of x, y of each,
    then of all headings (m^2, m rad, rad^2; next to infinite where a heading is not known).
    """

    floor: IntArray
    ids: tuple[str, ...]
    position_bcs: FloatArray
    covariance: FloatArray

    def as_bytes(self) -> bytes:
        """The content of their file: a row a landmark, with three rows of the covariance each."""
        k = len(self.ids)
        x, y = self.position_bcs.T
        rows = {"with_x": slice(0, 2 * k, 2), "with_y": slice(1, 2 * k, 2), "with_heading": slice(2 * k, None)}
        every = pl.List(pl.Float64)
        shared = {name: pl.Series(self.covariance[part].tolist(), dtype=every) for name, part in rows.items()}
        return parquet_bytes(pl.DataFrame({"floor": self.floor, "landmark": list(self.ids), "x": x, "y": y} | shared))

    def onto(self, landmarks: Landmarks) -> Landmarks:
        """The landmarks with these errors, where they lie where these were placed; the others err apart."""
        own = list(zip(landmarks.floor.tolist(), landmarks.ids, strict=True))
        row = {place: i for i, place in enumerate(own)}
        places = zip(self.floor.tolist(), self.ids, strict=True)
        here = np.array([row.get(place, -1) for place in places], dtype=np.int64)
        moved_m = np.abs(landmarks.position_bcs[here] - self.position_bcs).max(axis=1, initial=0.0)
        used = np.flatnonzero((here >= 0) & (moved_m < SAME_PLACE_M))
        if not len(used):
            return landmarks
        rows, count = here[used], len(own)
        if count > MAX_JOINT_LANDMARKS:
            raise ValueError(f"{count:,} landmarks, but at most {MAX_JOINT_LANDMARKS:,} can have correlated errors")
        joint = np.diag(np.concatenate((np.zeros(2 * count), np.nan_to_num(landmarks.heading_sigma_rad) ** 2)))
        pair = 2 * np.arange(count)[:, None] + (0, 1)
        apart = np.flatnonzero(landmarks.surveyed)
        joint[pair[apart][:, :, None], pair[apart][:, None, :]] = landmarks.covariance_bcs[apart]
        column = joint_columns(rows, count)
        joint[np.ix_(column, column)] = of_landmarks(self.covariance, used)
        covariance = landmarks.covariance_bcs.copy()
        covariance[rows] = joint[pair[rows][:, :, None], pair[rows][:, None, :]]
        return replace(landmarks, covariance_bcs=covariance, joint_covariance=joint)


def errors_file(landmark_file: Path) -> Path:
    """Where the shared errors of a landmark file's landmarks stand."""
    return landmark_file.with_suffix(SUFFIX)


def with_shared_errors(landmarks: Landmarks, landmark_file: Path) -> Landmarks:
    """Landmarks with the errors that they share, if a file next to theirs contains them.

    Raises SurveyError where that file cannot be used.
    """
    path = errors_file(landmark_file)
    if not path.exists():
        return landmarks
    try:
        return _read(path).onto(landmarks)
    except (OSError, ValueError, TypeError, pl.exceptions.PolarsError, np.linalg.LinAlgError) as error:
        raise SurveyError(
            f"{path}: cannot be used ({first_line(error)}); make {landmark_file.name} again with vislam2tag "
            "survey-landmarks, or remove this file"
        ) from error


def _read(path: Path) -> SharedErrors:
    """Read the file; raises what :func:`with_shared_errors` catches where it is not what it should be."""
    table = read_parquet(path)
    parts = [np.array(table[name].to_list(), dtype=np.float64).reshape(len(table), 3 * len(table)) for name in _WITH]
    covariance = np.concatenate((np.stack(parts[:2], axis=1).reshape(-1, 3 * len(table)), parts[2]))
    position = table.select("x", "y").to_numpy().astype(np.float64)
    if not (np.isfinite(covariance).all() and np.isfinite(position).all() and np.allclose(covariance, covariance.T)):
        raise ValueError("it contains no covariance")
    np.linalg.cholesky(covariance)  # raises where no errors could have it
    return SharedErrors(
        table["floor"].to_numpy().astype(np.int64), tuple(table["landmark"].to_list()), position, covariance
    )
