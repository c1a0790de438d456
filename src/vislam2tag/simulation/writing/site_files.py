"""The site's own files of a simulated survey: floors, landmarks with their surveyor's errors, control points."""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.core.orientation import wrapped
from vislam2tag.simulation.choices import SiteColumn
from vislam2tag.simulation.model import SimulatedBuilding, SimulatedFloor
from vislam2tag.simulation.settings import stream
from vislam2tag.simulation.writing.writer import comma_separated
from vislam2tag.site.settings import SurveySettings

HEIGHT_SIGMA_M = 0.02
SIGMA_RANGE_M = (0.01, 0.1)
HEADING_SIGMA_RAD = 0.02


def site_text(
    building: SimulatedBuilding, control_points: bool, columns: frozenset[SiteColumn] = frozenset(), seed: int = 0
) -> dict[str, bytes]:
    """Text of the site's own files by path relative to the survey, the plan images excepted.

    Without ``columns`` positions are exact; ``seed`` is for the surveyor's errors.
    """
    files = {"floor_dimensions.csv": _dimensions(building, SiteColumn.ELEVATION in columns)}
    for floor in building.floors:
        files[f"floor_{floor.number}/marker_dict.csv"] = _marker_dict(floor, columns, seed)
        if control_points:
            points = {"x": floor.control_points[:, 0], "y": floor.control_points[:, 1]}
            files[f"floor_{floor.number}/refmarker.csv"] = comma_separated(pl.DataFrame(points), header=False)
    return files


def _dimensions(building: SimulatedBuilding, elevations: bool) -> bytes:
    rows = ["id,width,height" + (",elevation" if elevations else "")]
    for floor in building.floors:
        elevation = f",{floor.elevation_m}" if elevations else ""
        rows.append(f"{floor.number},{floor.width_m},{floor.height_m}{elevation}")
    return "".join(f"{row}\n" for row in rows).encode()


def _marker_dict(floor: SimulatedFloor, columns: frozenset[SiteColumn], seed: int) -> bytes:
    """Landmarks as surveyed; each column has its own random numbers, so that one more leaves the others as they are."""
    place, count = floor.landmark_position, len(floor.landmark_ids)
    rng = {column: stream(seed, "surveyor", floor.number, column.value) for column in columns}
    xy, further = place[:, :2], {}
    if SiteColumn.Z in columns:
        further["z"] = place[:, 2] + HEIGHT_SIGMA_M * rng[SiteColumn.Z].standard_normal(count)
    if SiteColumn.SIGMA in columns:
        further["sigma_m"] = rng[SiteColumn.SIGMA].uniform(*SIGMA_RANGE_M, count).round(3)
        xy = xy + further["sigma_m"][:, None] * rng[SiteColumn.SIGMA].standard_normal((count, 2))
    if SiteColumn.HEADING in columns:
        off = HEADING_SIGMA_RAD * rng[SiteColumn.HEADING].standard_normal(count)
        further["heading_rad"] = wrapped(floor.landmark_heading_rad + off)
        further["heading_sigma_rad"] = np.full(count, HEADING_SIGMA_RAD)
    if floor.surveyed_z_m is not None and np.isfinite(floor.surveyed_z_m).any():
        further.setdefault("z", floor.surveyed_z_m)
    if floor.surveyed_sigma_m is not None and (floor.surveyed_sigma_m != SurveySettings().landmark_sigma_m).any():
        further.setdefault("sigma_m", floor.surveyed_sigma_m)
    frame = pl.DataFrame({"id": floor.landmark_ids, "x": xy[:, 0], "y": xy[:, 1], **further}, nan_to_null=True)
    return comma_separated(frame, header=True)
