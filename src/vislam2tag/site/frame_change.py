"""A site in another frame: the change of each floor (``rebase.toml``), and its files in the new frame."""

from __future__ import annotations

import cmath
import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, FiniteFloat, model_validator

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.toml_file import read_toml, toml_value
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import Landmarks
from vislam2tag.core.transforms import Similarity2
from vislam2tag.intake.extents import MAX_LOCAL_M
from vislam2tag.site.model import Floor, Site, landmark_id
from vislam2tag.site.plans.drawing import affine
from vislam2tag.site.site_table import CONTROL_POINTS, LANDMARKS, finite_or_none, readable_table

CHANGE_FILE = "rebase.toml"
_HEAD = (
    "# From old to new coordinates, floor by floor: turned by angle_deg counter-clockwise and scaled, then moved by\n"
    "# x_m, y_m; heights rise by rise_m. residuals_m: how far landmarks that both surveys know lie apart then.\n"
)
_LEAST_SCALE, _GREATEST_SCALE = 1e-3, 1e3
"""Between millimetres and kilometres for metres; beyond, a number is mistyped."""
_Metres = Annotated[FiniteFloat, Field(ge=-MAX_LOCAL_M, le=MAX_LOCAL_M)]


class FrameChange(Record):
    """The change of one floor: ``new = scale R(angle) old + (x, y)``, ``z + rise``."""

    number: int
    """Of the floor."""
    x_m: _Metres = 0.0
    y_m: _Metres = 0.0
    angle_deg: FiniteFloat = 0.0
    scale: Annotated[float, Field(ge=_LEAST_SCALE, le=_GREATEST_SCALE)] = 1.0
    rise_m: _Metres = 0.0
    """What heights above the building's zero gain; heights above the floor stay."""
    residuals_m: dict[str, float] = {}
    """Of an estimate: distance of each landmark of both surveys, changed, from where the new one has it, metres."""

    @classmethod
    def of(
        cls, number: int, similarity: Similarity2, rise_m: float = 0.0, residuals_m: dict[str, float] | None = None
    ) -> Self:
        """The change that a similarity is."""
        x_m, y_m = similarity.b.real, similarity.b.imag
        angle_deg, scale, residuals_m = math.degrees(similarity.rotation_rad), similarity.scale, residuals_m or {}
        return cls(
            number=number, x_m=x_m, y_m=y_m, angle_deg=angle_deg, scale=scale, rise_m=rise_m, residuals_m=residuals_m
        )

    @property
    def new_T_old(self) -> Similarity2:  # noqa: N802 - transforms are named by their frames
        """The map of the plane."""
        return Similarity2(cmath.rect(self.scale, math.radians(self.angle_deg)), complex(self.x_m, self.y_m))

    @property
    def inverse(self) -> FrameChange:
        """The change back."""
        return FrameChange.of(self.number, self.new_T_old.inverse, -self.rise_m)


class FrameChanges(Result):
    """A ``rebase.toml``: the changes of all floors."""

    main_table: ClassVar[str] = "floors"

    floors: Annotated[tuple[FrameChange, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _floors_differ(self) -> Self:
        number, count = Counter(change.number for change in self.floors).most_common(1)[0]
        if count > 1:
            raise ValueError(f"floor {number} is given {count} times; give each floor once")
        return self

    @property
    def by_floor(self) -> dict[int, FrameChange]:
        """The changes by number of the floor."""
        return {change.number: change for change in self.floors}

    @property
    def inverse(self) -> FrameChanges:
        """The changes back."""
        return FrameChanges(floors=tuple(change.inverse for change in self.floors))


def read_changes(path: Path) -> FrameChanges:
    """Read a ``rebase.toml``; raises SurveyError naming file, entry and what was expected."""
    try:
        return read_toml(path, FrameChanges)
    except FileNotFoundError as error:
        raise SurveyError(f"{path}: no such file; expected [[floors]] with number, x_m, y_m, angle_deg") from error


def changes_text(changes: FrameChanges) -> str:
    """Write a ``rebase.toml``."""
    blocks = [
        "".join(
            f"{name} = {toml_value(value)}\n"
            for name, value in change.model_dump().items()
            if name == "number" or value != FrameChange.model_fields[name].default
        )
        for change in changes.floors
    ]
    return _HEAD + "".join(f"\n[[floors]]\n{block}" for block in blocks)


def estimated_changes(old: Site, new: Site, *, rigid: bool = False, without: Collection[str] = ()) -> FrameChanges:
    """Estimate each floor's change from the surveyed landmarks that both sites know, by least squares.

    ``rigid``: the scale stays 1; ``without``: ids of landmarks that do not count (they hang elsewhere now). Floors that
    are not in the new site, or neither has landmarks on, are left out. Raises SurveyError where two sites share fewer
    than two places on a floor, or no floor.
    """
    known = {floor.number: floor for floor in old.floors if len(old.landmarks.on_floor(floor.number).ids)}
    found = [
        _estimated(known[floor.number], floor, old.landmarks, new.landmarks, rigid, without)
        for floor in new.floors
        if floor.number in known
    ]
    if not found:
        raise SurveyError(
            "the old and the new site share no floor with landmarks; pass the change with --by rebase.toml"
        )
    return FrameChanges(floors=tuple(found))


def _estimated(
    before: Floor, after: Floor, old: Landmarks, new: Landmarks, rigid: bool, without: Collection[str]
) -> FrameChange:
    number = after.number
    one, other = (marks.on_floor(number).without_planned_positions() for marks in (old, new))
    ids = [name for name in one.ids if name in one.surveyed_ids & other.surveyed_ids and name not in without]
    rows, others = ([marks.index[name] for name in ids] for marks in (one, other))
    source, target = one.position_bcs[rows], other.position_bcs[others]
    try:
        similarity = Similarity2.fit(source, target)
    except ValueError as error:
        raise SurveyError(
            f"floor {number}: the old and the new site share {len(ids)} surveyed "
            f"landmarks{', all in one place' if len(ids) > 1 else ''}; two in different places "
            "are required; otherwise pass --by rebase.toml"
        ) from error
    if rigid:
        turn = similarity.a / similarity.scale
        middle = Similarity2(turn, 0j) @ source.mean(axis=0)
        similarity = Similarity2(turn, complex(*(target.mean(axis=0) - middle).tolist()))
    apart = np.linalg.norm(similarity @ source - target, axis=1)
    rise_m = _rise(before, after, one.z_m[rows], other.z_m[others])
    residuals = {name: round(float(distance), 4) for name, distance in zip(ids, apart, strict=True)}
    return FrameChange.of(number, similarity, rise_m, residuals)


def _rise(before: Floor, after: Floor, old_z_m: FloatArray, new_z_m: FloatArray) -> float:
    """How much heights above the building's zero grow, metres: by floor's elevation and landmarks' heights (k,)."""
    if before.elevation_m is None or after.elevation_m is None:
        return 0.0
    grown = new_z_m - old_z_m
    above_floor_m = float(np.nanmean(grown)) if np.isfinite(grown).any() else 0.0
    return after.elevation_m - before.elevation_m + above_floor_m


def changes_from(site: Site, own: int) -> dict[int, FrameChange]:
    """From the BCS of floor ``own`` to that of each floor; none where all floors share one frame."""
    frames = {floor.number: floor.site_T_bcs for floor in site.floors}
    if len(set(frames.values())) < 2:
        return {}
    return {number: FrameChange.of(number, frame.inverse.compose(frames[own])) for number, frame in frames.items()}


def in_frame_of(landmarks: Landmarks, site: Site, own: int) -> Landmarks:
    """Turn landmarks of all floors into the BCS of floor ``own``, in which a walk that passed them is mapped.

    Where frames differ they no longer share errors.
    """
    changes = changes_from(site, own)
    if not changes:
        return landmarks
    position, covariance = landmarks.position_bcs.copy(), landmarks.covariance_bcs.copy()
    heading = landmarks.heading_rad.copy()
    for number, change in changes.items():
        if number == own:
            continue
        own_T_other = change.new_T_old.inverse
        rows = np.flatnonzero(landmarks.floor == number)
        surveyed = rows[landmarks.surveyed[rows]]
        position[surveyed] = own_T_other @ position[surveyed]
        turn = affine(own_T_other).matrix
        covariance[surveyed] = turn @ covariance[surveyed] @ turn.T
        heading[rows] += own_T_other.rotation_rad
    return replace(
        landmarks, position_bcs=position, covariance_bcs=covariance, heading_rad=heading, joint_covariance=None
    )


def changed_landmarks_text(root: Path, path: Path, changes: Mapping[int, FrameChange], folder: int | None) -> str:
    """A landmark file with its positions, sigmas and headings in the new frame; heights above the floor stay.

    ``folder`` is the floor that the file is under; None: its column ``floor`` contains it. Raises SurveyError where a
    row cannot be read, or is on a floor without a change.
    """
    table = readable_table(root, path, columns=LANDMARKS)
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
    for line, fields in readable_table(root, path, has_header=False, columns=CONTROL_POINTS).rows:
        x, y = _numbers(fields[:2], f"{path}:{line}")
        if x is None or y is None:
            raise SurveyError(f"{path}:{line}: expected x,y in metres; correct it")
        rows.append([*_moved(x, y, change), *fields[2:]])
    return csv_rows(rows)


def _change(changes: Mapping[int, FrameChange], floor: str | int | None, place: str) -> FrameChange:
    try:
        number = int(landmark_id(str(floor)))
    except ValueError as error:
        raise SurveyError(f"{place}: floor '{floor}' is not a number; correct it") from error
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
