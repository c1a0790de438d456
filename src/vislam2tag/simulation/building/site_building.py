"""A building for the simulator from plans and landmarks, as generated ones are made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.path_length import arc_lengths, points_along
from vislam2tag.preparation.sheets.settings import SHEET_SIZES
from vislam2tag.simulation.building.building import furnished
from vislam2tag.simulation.building.site_paths import site_paths
from vislam2tag.simulation.model import SimulatedBuilding, SimulatedFloor
from vislam2tag.simulation.settings import SiteBuildingSettings, stream
from vislam2tag.site.walkable.graph import CorridorGraph, NodeKind
from vislam2tag.site.walkable.space import WalkableSpace

_THIN_M = 0.6
"""A wall with floor on both sides is one wall for radio waves where it is thinner than this."""
_OFF_FLOOR_M = 1.0
"""A landmark farther off the walkable space than this hangs on no wall of it."""


@dataclass(frozen=True)
class SiteLandmarks:
    """Landmarks of one floor: ``position`` (m, 2) BCS, ``z_m`` and ``heading_rad`` (m,), NaN where unknown,
    ``sigma_m`` (m,) as surveyed, ``width_m`` (m,) of the image, NaN where it is on A4.
    """

    ids: tuple[str, ...]
    position: FloatArray
    z_m: FloatArray
    sigma_m: FloatArray
    heading_rad: FloatArray
    width_m: FloatArray


@dataclass(frozen=True)
class SiteFloor:
    """One floor of a site, as the simulator needs it; ``extent_m`` is left, right, lower, upper, BCS."""

    number: int
    name: str
    extent_m: tuple[float, float, float, float]
    elevation_m: float | None
    space: WalkableSpace
    graph: CorridorGraph
    landmarks: SiteLandmarks


def site_building(
    floors: Sequence[SiteFloor], seed: int, settings: SiteBuildingSettings | None = None
) -> SimulatedBuilding:
    """Make the building of some floors: where people walk, what they pass, access points, control points.

    Each floor has its own random numbers. Raises SurveyError where a floor has fewer than two landmarks, or one hangs
    off the walkable space.
    """
    chosen = settings or SiteBuildingSettings()
    made = tuple(_floor(floor, chosen, stream(seed, "site", floor.number)) for floor in floors)
    areas = [float(floor.space.area.mask.sum()) * floor.space.area.cell_m**2 for floor in floors]
    return furnished(made, [max(6, round(area / chosen.access_point_m2)) for area in areas], seed)


def _floor(floor: SiteFloor, settings: SiteBuildingSettings, rng: np.random.Generator) -> SimulatedFloor:
    marks = floor.landmarks
    _check(floor)
    heading = np.where(np.isnan(marks.heading_rad), _along_wall(floor.space, marks.position), marks.heading_rad)
    drawn = settings.landmark_height_m + settings.landmark_height_sigma_m * rng.standard_normal(len(marks.ids))
    z_m = np.where(np.isnan(marks.z_m), drawn, marks.z_m)
    ways = site_paths(floor.graph, floor.space, marks.position, heading)
    left, right, low, high = floor.extent_m
    return SimulatedFloor(
        number=floor.number,
        name=floor.name,
        width_m=right - left,
        height_m=high - low,
        elevation_m=floor.number * settings.storey_m if floor.elevation_m is None else floor.elevation_m,
        walls=_single_walls(floor.space),
        nodes=ways.nodes,
        edges=ways.edges,
        landmark_ids=marks.ids,
        landmark_position=np.column_stack((marks.position, z_m)).round(4),
        landmark_heading_rad=heading,
        control_points=_control_points(floor.graph, settings.control_point_spacing_m, rng),
        lower_left_m=(left, low),
        rooms=ways.rooms,
        space=floor.space,
        surveyed_z_m=marks.z_m,
        surveyed_sigma_m=marks.sigma_m,
        sheet_reach=np.maximum(np.nan_to_num(marks.width_m, nan=0.0) / SHEET_SIZES["A4"].image_m, 1.0),
    )


def _check(floor: SiteFloor) -> None:
    """Raise SurveyError for a floor that has too few landmarks, or one where nobody can pass it."""
    if len(floor.landmarks.ids) < 2:
        raise SurveyError(
            f"floor {floor.number}: has {len(floor.landmarks.ids)} landmarks with a position, a survey needs two; plan "
            "some: vislam2tag plan"
        )
    off = _off_walls(floor.space, floor.landmarks.position)[0]
    far = np.flatnonzero((off > _OFF_FLOOR_M) & ~floor.space.inside(floor.landmarks.position))
    if len(far):
        x, y = floor.landmarks.position[far[0]].tolist()
        raise SurveyError(
            f"floor {floor.number}: landmark {floor.landmarks.ids[far[0]]} at ({x:.2f}, {y:.2f}) lies "
            f"{off[far[0]]:.1f} m off the walkable space; correct its position or the walkable space (--mask)"
        )


def _off_walls(space: WalkableSpace, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance (n,) of points to the nearest wall, and that wall's direction (n, 2), the floor on its left."""
    start, leg = space.walls[:, 0], np.diff(space.walls, axis=1)[:, 0]
    length = np.linalg.norm(leg, axis=1)
    share = (np.einsum("nwk,wk->nw", points[:, None] - start, leg) / length**2).clip(0, 1)
    off = np.linalg.norm(points[:, None] - start - share[..., None] * leg, axis=2)
    nearest = off.argmin(axis=1)
    return off[np.arange(len(points)), nearest], (leg / length[:, None])[nearest]


def _along_wall(space: WalkableSpace, points: FloatArray) -> FloatArray:
    """Direction (n,) to the right of who looks at the wall nearest to each point, rad."""
    direction = _off_walls(space, points)[1]
    return np.asarray(np.arctan2(-direction[:, 1], -direction[:, 0]))


def _single_walls(space: WalkableSpace) -> FloatArray:
    """Walls (w, 2, 2) without the second face of thin ones, which radio waves cross once."""
    leg = np.diff(space.walls, axis=1)[:, 0]
    outward = np.column_stack((leg[:, 1], -leg[:, 0])) / np.linalg.norm(leg, axis=1, keepdims=True)
    thin: BoolArray = space.inside(space.walls.mean(axis=1) + _THIN_M * outward)
    second = (outward[:, 1] < -1e-6) | ((np.abs(outward[:, 1]) <= 1e-6) & (outward[:, 0] < 0))
    return np.asarray(space.walls[~(thin & second)])


def _control_points(graph: CorridorGraph, spacing_m: float, rng: np.random.Generator) -> FloatArray:
    """Points (p, 2) on the corridors' middle lines, to the millimetre, clear of their ends."""
    points = [np.empty((0, 2))]
    ways = ~graph.in_room & ~graph.shortcut & (graph.length_m > spacing_m / 2)
    for edge in np.flatnonzero(ways).tolist():
        line = graph.polylines[edge]
        marks = np.arange(spacing_m / 2, arc_lengths(line)[-1] - 1.0, spacing_m)
        marks = marks + rng.uniform(-0.6, 0.6, len(marks))
        points.append(points_along(line, marks))
    found = np.vstack(points)
    return (found if len(found) else graph.nodes[[kind is not NodeKind.ROOM for kind in graph.kinds]][:1]).round(3)
