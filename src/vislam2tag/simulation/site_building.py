"""Makes a building for the simulator from the plans and landmarks of a site's folder.

Its paths are straight edges that lead past every landmark.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.files.table_files import read_csv
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.path_length import arc_lengths, points_along
from vislam2tag.core.tracks import Landmarks
from vislam2tag.preparation.sheets.settings import SHEET_SIZES
from vislam2tag.simulation.building import furnished
from vislam2tag.simulation.model import SimulatedBuilding, SimulatedFloor
from vislam2tag.simulation.settings import (
    CONTROL_POINT_SPACING_M,
    LANDMARK_HEIGHT_M,
    LANDMARK_HEIGHT_SIGMA_M,
    SiteBuildingSettings,
    stream,
)
from vislam2tag.site.corrections.file import CORRECTIONS_FILE
from vislam2tag.site.discover import read_site, site_files
from vislam2tag.site.model import Floor, Site
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.site_file import FLOOR_FILE, SITE_FILE, has_site_file
from vislam2tag.site.walkable.graph import CorridorGraph, NodeKind, corridor_graph
from vislam2tag.site.walkable.painted_cells import floor_mask
from vislam2tag.site.walkable.space import WalkableSpace, walkable_space

PASSED_M = 1.8
"""A sheet within this distance is passed without leaving the path."""
STAND_M = 0.9
"""Distance from a sheet at which a path that leads past it runs."""
_ALONG_SHEET_M = 0.7
"""The path runs along the sheet for this distance on both sides."""
_LEAVE_M = 3.0
"""Distance before a sheet at which the path is left for it, along the path."""
_FARTHEST_M = 12.0
"""Largest distance of a sheet for which the path is left."""


@dataclass(frozen=True)
class SitePaths:
    """Nodes (n, 2), straight edges (e, 2), nodes in rooms and doors of rooms, and landmarks that no path passes."""

    nodes: FloatArray
    edges: IntArray
    rooms: frozenset[int]
    missed: tuple[int, ...]


def site_paths(graph: CorridorGraph, space: WalkableSpace, sheets: FloatArray, heading_rad: FloatArray) -> SitePaths:
    """Make the paths of a graph that lead past the sheets (m, 2); ``heading_rad`` (m,) is the direction of their X
    axes."""
    lines = {edge: line for edge, line in enumerate(graph.polylines) if not graph.shortcut[edge]}
    missed = []
    for landmark, (sheet, heading) in enumerate(zip(sheets, heading_rad.tolist(), strict=True)):
        if not _lead_past(lines, graph, space, sheet, np.array((np.cos(heading), np.sin(heading)))):
            missed.append(landmark)
    return _straight(lines, graph, tuple(missed))


def _lead_past(
    lines: dict[int, FloatArray], graph: CorridorGraph, space: WalkableSpace, sheet: FloatArray, along: FloatArray
) -> bool:
    """Lead the closest line (k, 2) that can see a sheet (2,) past it, along the wall's direction (2,); return whether
    there is one.
    """
    feet = {edge: _foot(line, sheet) for edge, line in lines.items()}
    # Rooms come last, because walks enter few of them.
    order = sorted(feet, key=lambda edge: (bool(graph.in_room[edge]), feet[edge][1], edge))
    for edge in order:
        arc, off = feet[edge]
        if off > _FARTHEST_M:
            continue
        foot = _at(lines[edge], arc)
        if not space.clear_line(foot, sheet)[0]:
            continue
        if off <= PASSED_M:
            return True
        detour = _detour(lines[edge], arc, sheet, along)
        if space.clear_line(detour[:-1], detour[1:]).all() and space.inside(detour).all():
            lines[edge] = detour
            return True
    return False


def _detour(line: FloatArray, arc: float, sheet: FloatArray, along: FloatArray) -> FloatArray:
    """A line (j, 2) that leaves another one (k, 2) for a sheet (2,), leads along it and returns."""
    length = float(arc_lengths(line)[-1])
    leave, rejoin = max(arc - _LEAVE_M, 0.0), min(arc + _LEAVE_M, length)
    outward = np.array((along[1], -along[0]))
    stand = sheet + STAND_M * outward
    onward = np.sign(float((_at(line, rejoin) - _at(line, leave)) @ along)) or 1.0
    beside = np.array([stand - onward * _ALONG_SHEET_M * along, stand + onward * _ALONG_SHEET_M * along])
    arcs = arc_lengths(line)
    before, after = line[arcs < leave - 1e-6], line[arcs > rejoin + 1e-6]
    return np.vstack((before, _at(line, leave), beside, _at(line, rejoin), after))


def _foot(line: FloatArray, point: FloatArray) -> tuple[float, float]:
    """Arc length of the point of a line (k, 2) that is closest to a place (2,), and the distance between both,
    metres."""
    start, legs = line[:-1], np.diff(line, axis=0)
    length = np.linalg.norm(legs, axis=1).clip(1e-9)
    share = (np.einsum("lk,lk->l", point - start, legs) / length**2).clip(0, 1)
    off = np.linalg.norm(start + share[:, None] * legs - point, axis=1)
    nearest = int(off.argmin())
    return float(arc_lengths(line)[nearest] + share[nearest] * length[nearest]), float(off[nearest])


def _at(line: FloatArray, arc: float) -> FloatArray:
    """Point (2,) of a line (k, 2) at an arc length, metres."""
    arcs = arc_lengths(line)
    return np.array([np.interp(arc, arcs, line[:, axis]) for axis in (0, 1)])


def _straight(lines: dict[int, FloatArray], graph: CorridorGraph, missed: tuple[int, ...]) -> SitePaths:
    """Turn every corner of the lines, (k, 2) each, into a node."""
    nodes = list(graph.nodes)
    edges: list[tuple[int, int]] = []
    rooms = {node for node, kind in enumerate(graph.kinds) if kind is NodeKind.ROOM}
    for edge, line in lines.items():
        first, last = graph.edges[edge].tolist()
        corners = [first, *range(len(nodes), len(nodes) + len(line) - 2), last]
        nodes += list(line[1:-1])
        # An edge of no length has no direction.
        edges += [pair for pair in pairwise(corners) if np.linalg.norm(nodes[pair[0]] - nodes[pair[1]]) > 1e-6]
        if graph.in_room[edge]:
            rooms.update(corners[1:-1], (end for end in (first, last) if graph.kinds[end] is NodeKind.DOOR))
    return SitePaths(np.array(nodes), np.array(edges, dtype=np.int64), frozenset(rooms), missed)


_THIN_M = 0.6
"""A wall with floor on both sides is one wall for radio waves if it is thinner than this."""
_OFF_FLOOR_M = 1.0
"""A landmark at a larger distance from the walkable space is not on one of its walls."""


@dataclass(frozen=True)
class SiteFloor:
    """One floor of a site, as the simulator needs it; ``extent_m`` is left, right, bottom, top, BCS."""

    number: int
    name: str
    extent_m: tuple[float, float, float, float]
    elevation_m: float | None
    space: WalkableSpace
    graph: CorridorGraph
    landmarks: Landmarks
    """Landmarks of the floor that have a position."""
    width_m: FloatArray
    """(m,) width of each landmark's image, NaN for A4."""


def site_building(
    floors: Sequence[SiteFloor], seed: int, settings: SiteBuildingSettings | None = None
) -> SimulatedBuilding:
    """Make the building of some floors: paths, landmarks, access points and control points.

    Each floor has its own random numbers. Raises SurveyError if a floor has fewer than two landmarks, or if a landmark
    is not at the walkable space.
    """
    chosen = settings or SiteBuildingSettings()
    made = tuple(_simulated_floor(floor, chosen, stream(seed, "site", floor.number)) for floor in floors)
    areas = [float(floor.space.area.mask.sum()) * floor.space.area.cell_m**2 for floor in floors]
    return furnished(made, [max(6, round(area / chosen.access_point_m2)) for area in areas], seed)


def _simulated_floor(floor: SiteFloor, settings: SiteBuildingSettings, rng: np.random.Generator) -> SimulatedFloor:
    marks = floor.landmarks
    _check(floor)
    heading = np.where(np.isnan(marks.heading_rad), _along_wall(floor.space, marks.position_bcs), marks.heading_rad)
    drawn = LANDMARK_HEIGHT_M + LANDMARK_HEIGHT_SIGMA_M * rng.standard_normal(len(marks.ids))
    z_m = np.where(np.isnan(marks.z_m), drawn, marks.z_m)
    ways = site_paths(floor.graph, floor.space, marks.position_bcs, heading)
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
        landmark_position=np.column_stack((marks.position_bcs, z_m)).round(4),
        landmark_heading_rad=heading,
        control_points=_control_points(floor.graph, CONTROL_POINT_SPACING_M, rng),
        lower_left_m=(left, low),
        rooms=ways.rooms,
        space=floor.space,
        surveyed_z_m=marks.z_m,
        surveyed_sigma_m=np.sqrt(marks.covariance_bcs[:, 0, 0]).round(6),
        sheet_reach=np.maximum(np.nan_to_num(floor.width_m, nan=0.0) / SHEET_SIZES["A4"].image_m, 1.0),
    )


def _check(floor: SiteFloor) -> None:
    """Raise SurveyError for a floor with too few landmarks, or with a landmark that walkers cannot pass."""
    if len(floor.landmarks.ids) < 2:
        raise SurveyError(
            f"floor {floor.number}: it has {len(floor.landmarks.ids)} landmarks with a position, but a survey needs "
            "two; plan some with `vislam2tag plan`"
        )
    off = _off_walls(floor.space, floor.landmarks.position_bcs)[0]
    far = np.flatnonzero((off > _OFF_FLOOR_M) & ~floor.space.inside(floor.landmarks.position_bcs))
    if len(far):
        x, y = floor.landmarks.position_bcs[far[0]].tolist()
        raise SurveyError(
            f"floor {floor.number}: landmark {floor.landmarks.ids[far[0]]} at ({x:.2f}, {y:.2f}) is "
            f"{off[far[0]]:.1f} m from the walkable space; correct its position or the walkable space (--mask)"
        )


def _off_walls(space: WalkableSpace, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance (n,) of points to the nearest wall, and that wall's direction (n, 2), with the floor on its left."""
    start, leg = space.walls[:, 0], np.diff(space.walls, axis=1)[:, 0]
    length = np.linalg.norm(leg, axis=1)
    share = (np.einsum("nwk,wk->nw", points[:, None] - start, leg) / length**2).clip(0, 1)
    off = np.linalg.norm(points[:, None] - start - share[..., None] * leg, axis=2)
    nearest = off.argmin(axis=1)
    return off[np.arange(len(points)), nearest], (leg / length[:, None])[nearest]


def _along_wall(space: WalkableSpace, points: FloatArray) -> FloatArray:
    """Direction (n,) to the viewer's right on the wall closest to each point, rad."""
    direction = _off_walls(space, points)[1]
    return np.asarray(np.arctan2(-direction[:, 1], -direction[:, 0]))


def _single_walls(space: WalkableSpace) -> FloatArray:
    """Walls (w, 2, 2) without the second face of thin walls, which radio waves cross once."""
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


def site_floors(
    root: Path,
    numbers: Sequence[int] = (),
    landmark_file: Path | None = None,
    masks: Mapping[int, Path] | None = None,
    settings: WalkableSettings | None = None,
) -> tuple[SiteFloor, ...]:
    """Read floors of a site: plan, walkable space, graph, and landmarks (the site's own or those of a file).

    Without ``numbers`` all floors with a plan are read. ``masks`` are drawn corrections, by floor. Raises SurveyError
    if a floor or plan is missing, or if nothing is walkable.
    """
    site, _ = read_site(root, landmark_file=landmark_file, follow_links=True)
    widths = {} if landmark_file is None else _widths(landmark_file)
    chosen = [_floor_of(site, number, root) for number in numbers] or [floor for floor in site.floors if floor.plan]
    if not chosen:
        raise SurveyError(f"{root}: no floor has a plan; add floor_K/floorplan.jpg or a {SITE_FILE}")
    masks, settings = masks or {}, settings or WalkableSettings()
    return tuple(_site_floor(floor, site.landmarks, widths, masks.get(floor.number), settings) for floor in chosen)


def _floor_of(site: Site, number: int, root: Path) -> Floor:
    try:
        return site.floor(number)
    except KeyError as error:
        there = ", ".join(str(floor.number) for floor in site.floors)
        raise SurveyError(f"{root}: the site has no floor {number}; it has: {there}") from error


def _site_floor(
    floor: Floor, landmarks: Landmarks, widths: Mapping[str, float], mask: Path | None, settings: WalkableSettings
) -> SiteFloor:
    plan = floor_plan(floor)
    space = walkable_space(plan, settings, floor_mask(floor, mask))
    here = landmarks.on_floor(floor.number)
    here = here.select(np.flatnonzero(np.isfinite(here.position_bcs).all(axis=1)).tolist())
    return SiteFloor(
        number=floor.number,
        name=floor.name,
        extent_m=plan.extent_m,
        elevation_m=floor.elevation_m,
        space=space,
        graph=corridor_graph(space),
        landmarks=here,
        width_m=np.array([widths.get(name, np.nan) for name in here.ids]),
    )


def _widths(landmark_file: Path) -> dict[str, float]:
    """Width of each landmark's image by id, metres, if the file has a column ``width_m``."""
    table = read_csv(landmark_file, infer_schema=False, truncate_ragged_lines=True)
    if "width_m" not in table.columns:
        return {}
    widths = table.select(table.columns[0], pl.col("width_m").cast(pl.Float64, strict=False)).drop_nulls()
    return dict(widths.iter_rows())


def copied_site_files(root: Path, building: SimulatedBuilding, files: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return a survey's own site files, with the site's ``site.toml``, if it has one, and its plans.

    Raises OSError if one cannot be read.
    """
    described = has_site_file(root)
    taken = {path: text for path, text in files.items() if not (described and path == FLOOR_FILE)}
    folders = {f"floor_{floor.number}" for floor in building.floors}
    for path in site_files(root):
        name = path.relative_to(root)
        own_plan = name.parts[0] in folders and name.stem == "floorplan"
        if own_plan or (described and path.suffix != ".csv" and path.name != CORRECTIONS_FILE):
            taken[name.as_posix()] = read_bytes(path)
    return taken
