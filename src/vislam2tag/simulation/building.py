"""Generated buildings: floors with corridors and rooms, landmarks, control points and access points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import PurePosixPath

import numpy as np
from PIL import Image, ImageDraw

from vislam2tag.common.files.folder import Folder
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.simulation.ground_plan import GroundPlan, dead_end_inset, make_ground_plan, walkable_graph
from vislam2tag.simulation.model import SimulatedBuilding, SimulatedFloor
from vislam2tag.simulation.settings import LANDMARK_HEIGHT_M, LANDMARK_HEIGHT_SIGMA_M, BuildingSettings, stream

CHANNELS_MHZ = (2412.0, 2437.0, 2462.0, 5180.0, 5220.0, 5260.0, 5500.0, 5580.0)
SSIDS = ("eduroam", "campus-guest", "devices")
STATION_LANDMARKS = ("10", "9")
"""Ids of the landmarks that the total station shoots, as in the published evaluation; both are in one corridor."""

CORNER_M = 1.4
"""Smallest distance of a landmark from a corner: walkers who turn would not see a closer one in time."""


def make_building(
    settings: BuildingSettings, seed: int, floors: Sequence[int] = (0,), *, distinct_ids: bool = False
) -> SimulatedBuilding:
    """Generate a building with the floors of these numbers. With ``distinct_ids`` no two floors share a landmark id.

    Each floor has its own random numbers, so additional floors do not change the others.
    """
    made = tuple(_make_floor(settings, number, stream(seed, "floor", number)) for number in floors)
    if distinct_ids:
        made = tuple(_with_own_ids(floor, rank) for rank, floor in enumerate(made))
    return furnished(made, [settings.access_points] * len(made), seed)


def furnished(floors: tuple[SimulatedFloor, ...], access_points: Sequence[int], seed: int) -> SimulatedBuilding:
    """Hang this number of access points on each floor."""
    parts = [
        _access_points(count, floor, stream(seed, "access-points", floor.number))
        for floor, count in zip(floors, access_points, strict=True)
    ]
    numbers = np.array([floor.number for floor in floors], dtype=np.int64)
    return SimulatedBuilding(
        floors=floors,
        ap_floor=np.repeat(numbers, [len(part[0]) for part in parts]),
        ap_position=np.vstack([part[0] for part in parts]),
        ap_bssid=tuple(bssid for part in parts for bssid in part[1]),
        ap_ssid=tuple(ssid for part in parts for ssid in part[2]),
        ap_frequency_mhz=np.concatenate([part[3] for part in parts]),
        ap_power_dbm=np.concatenate([part[4] for part in parts]),
    )


def _make_floor(settings: BuildingSettings, number: int, rng: np.random.Generator) -> SimulatedFloor:
    layout = make_ground_plan(settings, rng)
    corridors = dead_end_inset(layout.corridors, settings.width_m)
    nodes, edges = walkable_graph(replace(layout, corridors=corridors))
    place, heading = _landmark_places(settings, layout, rng)
    order = _ids_order(place, layout.corridors, settings.corridor_width_m)
    place, heading = place[order], heading[order]
    height = LANDMARK_HEIGHT_M + LANDMARK_HEIGHT_SIGMA_M * rng.standard_normal(len(place))
    return SimulatedFloor(
        number=number,
        name=f"Floor {number}",
        width_m=settings.width_m,
        height_m=settings.height_m,
        elevation_m=round(number * settings.storey_m, 3),
        walls=layout.walls,
        nodes=nodes,
        edges=edges,
        landmark_ids=tuple(str(i) for i in range(1, len(place) + 1)),
        landmark_position=np.column_stack((place, height)).round(4),
        landmark_heading_rad=heading,
        control_points=_control_points(corridors, settings.control_point_spacing_m, rng),
    )


def _with_own_ids(floor: SimulatedFloor, rank: int) -> SimulatedFloor:
    """Number the landmarks of each floor from another hundred: 1, 2, ..., then 101, 102, ..."""
    return replace(floor, landmark_ids=tuple(str(100 * rank + int(name)) for name in floor.landmark_ids))


def _landmark_places(
    settings: BuildingSettings, layout: GroundPlan, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Choose wall places (m, 2) and sheet headings (m,): after turns first, spread over the floor."""
    points, normals, after_turn = _wall_candidates(settings, layout, rng)
    chosen = [int(rng.choice(np.flatnonzero(after_turn)))]
    distance = np.full(len(points), np.inf)
    while len(chosen) < min(settings.landmarks, len(points)):
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
        chosen.append(int(np.argmax(distance * np.where(after_turn, 2.5, 1.0))))
    chosen = chosen[: settings.landmarks]
    # The sheet's X axis points to the viewer's right: the outward normal turned by +90 degrees.
    heading = np.arctan2(normals[chosen, 0], -normals[chosen, 1])
    return points[chosen], heading


def _wall_candidates(
    settings: BuildingSettings, layout: GroundPlan, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return points (w, 2) on corridor walls away from doors, outward normals (w, 2), and a mask (w,) of points just
    after a turn.
    """
    half = settings.corridor_width_m / 2
    points, normals, near = [], [], []
    for start, stop in layout.corridors:
        length = float(np.linalg.norm(stop - start))
        axis = (stop - start) / length
        along = np.arange(half + CORNER_M, length - half - CORNER_M, 0.9)
        along = along + rng.uniform(-0.2, 0.2, len(along))
        for side in (-1.0, 1.0):
            normal = -side * np.array([-axis[1], axis[0]])
            points.append(start + along[:, None] * axis - half * normal)
            normals.append(np.broadcast_to(normal, (len(along), 2)))
            near.append(_turn_distance(points[-1] + half * normal, start, stop, layout.corridors) < half + 3.0)
    place = np.vstack(points)
    free = _clear_of_openings(place, layout.walls)
    return place[free], np.vstack(normals)[free], np.concatenate(near)[free]


def _turn_distance(points: FloatArray, start: FloatArray, stop: FloatArray, corridors: FloatArray) -> FloatArray:
    """Distance (n,) along a corridor, ``start`` to ``stop`` (2,), from points (n, 2) on its centre line to the nearest
    crossing with another of the corridors (c, 2, 2).
    """
    axis = int(start[0] == stop[0])
    across = corridors[corridors[:, 0, axis] == corridors[:, 1, axis]]
    at = start[1 - axis]
    meets = (across[:, 0, 1 - axis] <= at + 1e-6) & (across[:, 1, 1 - axis] >= at - 1e-6)
    crossings = across[meets, 0, axis]
    return np.asarray(np.abs(points[:, axis, None] - crossings).min(axis=1))


def _clear_of_openings(points: FloatArray, walls: FloatArray, margin_m: float = 0.3) -> FloatArray:
    """Return (n,) which points (n, 2) are on a wall segment (w, 2, 2), at least ``margin_m`` from its ends."""
    start, delta = walls[:, 0], walls[:, 1] - walls[:, 0]
    length = np.linalg.norm(delta, axis=1)
    unit = delta / length[:, None]
    offset = points[:, None] - start
    along = np.einsum("pwk,wk->pw", offset, unit)
    across = np.abs(offset[..., 0] * unit[:, 1] - offset[..., 1] * unit[:, 0])
    return np.asarray(((across < 0.01) & (along > margin_m) & (along < length - margin_m)).any(axis=1))


def longest_corridor(corridors: FloatArray) -> int:
    """Index of the longest corridor centre line (c, 2, 2), the first of equals: the total station's corridor."""
    return int(np.argmax(np.linalg.norm(corridors[:, 1] - corridors[:, 0], axis=1).round(3)))


def _ids_order(place: FloatArray, corridors: FloatArray, width_m: float) -> IntArray:
    """Order (m,) of landmarks (m, 2) in which ids 10 and 9 are the outermost ones in the total station's corridor."""
    order = np.arange(len(place))
    slots = [int(i) - 1 for i in STATION_LANDMARKS]
    start, stop = corridors[longest_corridor(corridors)]
    inside = np.flatnonzero(np.abs(place[:, 1] - start[1]) < width_m / 2 + 0.01)
    inside = inside[np.argsort(place[inside, 0])]
    if len(inside) < 2 or max(slots) >= len(place) or start[1] != stop[1]:
        return order
    others = [i for i in order.tolist() if i not in (inside[0], inside[-1])]
    for slot, index in sorted(zip(slots, (inside[0], inside[-1]), strict=True)):
        others.insert(slot, int(index))
    return np.array(others, dtype=np.int64)


def _control_points(corridors: FloatArray, spacing_m: float, rng: np.random.Generator) -> FloatArray:
    """Points (p, 2) on the corridors' centre lines (c, 2, 2), to the millimetre, clear of the crossings."""
    points = []
    for start, stop in corridors:
        length = float(np.linalg.norm(stop - start))
        along = np.arange(spacing_m / 2, length - 1.5, spacing_m)
        along = along + rng.uniform(-0.6, 0.6, len(along))
        points.append(start + along[:, None] * (stop - start) / length)
    return np.vstack(points).round(3)


def _access_points(
    count: int, floor: SimulatedFloor, rng: np.random.Generator
) -> tuple[FloatArray, tuple[str, ...], tuple[str, ...], FloatArray, FloatArray]:
    """Position (a, 3), BSSID, SSID, frequency and power at one metre of each access point of a floor."""
    position = np.column_stack((near_ways(count, floor, rng), rng.uniform(2.4, 3.0, count)))
    bssid = addresses("02", count, rng)
    ssid = tuple(str(rng.choice(SSIDS)) for _ in range(count))
    frequency = rng.choice(CHANNELS_MHZ, count)
    power = rng.normal(-38.0, 3.0, count) - np.where(frequency > 5000, 5.0, 0.0)
    return position, bssid, ssid, frequency, power


def near_ways(count: int, floor: SimulatedFloor, rng: np.random.Generator) -> FloatArray:
    """Places (k, 2) near the walkable paths of a floor, for this number of things."""
    near = floor.nodes[rng.choice(len(floor.nodes), count, replace=count > len(floor.nodes))]
    low, high = floor.corners_m
    return np.asarray((near + rng.normal(0, 0.8, (count, 2))).clip(low + 0.3, high - 0.3))


def addresses(first: str, count: int, rng: np.random.Generator) -> tuple[str, ...]:
    """This number of radio addresses that begin with this octet."""
    octets = rng.integers(0, 256, (count, 5)).tolist()
    return tuple(":".join((first, *(f"{octet:02x}" for octet in row))) for row in octets)


def draw_plan(floor: SimulatedFloor, folder: Folder, name: str, pixels_per_m: float = 20.0) -> None:
    """Write the floor's walls as an image (JPEG or PNG, by the suffix) that covers exactly width x height metres."""
    size = (round(floor.width_m * pixels_per_m), round(floor.height_m * pixels_per_m))
    image = Image.new("RGB", size, "white")
    canvas = ImageDraw.Draw(image)
    limit = np.array(size) - 1
    pixels = np.stack((floor.walls[..., 0], floor.height_m - floor.walls[..., 1]), axis=-1) * pixels_per_m
    for start, stop in pixels.clip(0, limit).tolist():
        canvas.line((*start, *stop), fill=(60, 60, 60), width=max(1, round(0.12 * pixels_per_m)))
    is_jpeg = PurePosixPath(name).suffix.lower() in {".jpg", ".jpeg"}
    with folder.writing(name) as file:
        image.save(file, "JPEG", quality=88) if is_jpeg else image.save(file, "PNG")
