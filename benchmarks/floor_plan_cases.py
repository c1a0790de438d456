"""Cases of ``floor_plan.py``: buildings, walks in them, and plans of them, right and wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from PIL import Image, ImageDraw
from scipy.ndimage import distance_transform_edt, label
from scipy.spatial import cKDTree

from vislam2tag.core.arrays import FloatArray
from vislam2tag.simulation.building import furnished, make_building
from vislam2tag.simulation.imu import ImuSettings
from vislam2tag.simulation.model import SimulatedFloor, count_crossings
from vislam2tag.simulation.route import room_nodes
from vislam2tag.simulation.scenario import Scenario, regular_survey
from vislam2tag.simulation.settings import BuildingSettings, stream

FLOORS = (0, 1, 2)
ACCESS_POINTS = 14
OURS, REFERENCE = "floor-plan", "smoother"
EAST_RAD = ImuSettings().north_rad - np.pi / 2
"""Direction of east in the BCS."""
OTHER_SEEDS = 100_000
"""So many seeds further on is another building."""
MISSING_SHARE, GAP_M = 0.1, (0.3, 1.5)
WALLS, WALL_M = 12, (2.0, 6.0)
PIECES, PIECE_M = 150, (0.4, 1.6)
AROUND_M, PASSAGE_M, PIXELS_PER_M = 2.5, 0.6, 10
"""A piece of furniture leaves passages of this width as connected as they were, so far around it."""
HALL_M, STANDS, STAND_M, STAND_GAP_M = (237.0, 220.0), 30, (3.0, 14.0), 6.0
KEPT_M, BEFORE_M = 0.8, 1.0
"""Least distance from the hall's stands to the middle of a way, and of its ends before a landmark."""


def building_settings(seed: int) -> BuildingSettings:
    """Size and layout of the building of a seed."""
    rng = stream(seed, "floor plan")

    def drawn(low: float, high: float) -> float:
        return round(float(rng.uniform(low, high)), 1)

    return BuildingSettings(
        width_m=drawn(42, 80),
        height_m=drawn(26, 42),
        corridor_width_m=drawn(1.8, 3.0),
        room_width_m=drawn(3.5, 6.5),
        cross_corridors=int(rng.integers(0, 3)),
        dead_ends=int(rng.integers(0, 4)),
    )


def symmetric_floor(seed: int) -> SimulatedFloor:
    """A floor whose right half is its left half, turned by 180 degrees about the middle."""
    settings = building_settings(seed).model_copy(update={"cross_corridors": 2})  # none in the middle
    floor = make_building(settings, seed).floors[0]
    middle, size = floor.width_m / 2, np.array((floor.width_m, floor.height_m))
    lines = floor.nodes[floor.edges]
    rooms = np.isin(floor.edges, list(room_nodes(floor))).any(axis=1)
    ways = _left_and_turned(lines[~rooms | (lines[..., 0].max(axis=1) < middle - 0.5)], middle, size).round(3)
    nodes, edges = np.unique(ways.reshape(-1, 2), axis=0, return_inverse=True)
    left = np.flatnonzero(floor.landmark_position[:, 0] < middle - 0.5)
    place, heading = floor.landmark_position[left], floor.landmark_heading_rad[left]
    turned = np.column_stack((size - place[:, :2], place[:, 2]))
    return replace(
        floor,
        walls=_left_and_turned(floor.walls, middle, size),
        nodes=nodes,
        edges=edges.reshape(-1, 2),
        landmark_ids=tuple(str(number + 1) for number in range(2 * len(left))),
        landmark_position=np.vstack((place, turned)),
        landmark_heading_rad=np.concatenate((heading, heading + np.pi)),
    )


def _left_and_turned(lines: FloatArray, middle: float, size: FloatArray) -> FloatArray:
    """The parts (w, 2, 2) left of the middle of lines along the axes, and the same turned by 180 degrees."""
    left = lines[lines[..., 0].min(axis=1) < middle]
    left = np.stack((left[..., 0].clip(max=middle), left[..., 1]), axis=-1)
    return np.concatenate((left, size - left))


def hall_floor(seed: int) -> SimulatedFloor:
    """One hall with stands in it, landmarks on their sides, and ways between them."""
    rng, size = stream(seed, "hall"), np.array(HALL_M)
    stands: list[FloatArray] = []
    while len(stands) < STANDS:
        extent = rng.uniform(*STAND_M, 2)
        if len(stands) % 3 == 0:  # a wall
            extent[rng.integers(0, 2)] = 0.2
        low = rng.uniform(STAND_GAP_M, size - extent - STAND_GAP_M)
        if all(((low - STAND_GAP_M > b[1]) | (low + extent + STAND_GAP_M < b[0])).any() for b in stands):
            stands.append(np.stack((low, low + extent)))
    boxes = np.array(stands)
    sides, wide = outlines(boxes), boxes + np.array((-KEPT_M, KEPT_M))[:, None]
    middle = sides.mean(axis=1)
    normal = middle - np.repeat(boxes.mean(axis=1), 4, axis=0)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    grid = np.stack(np.meshgrid(np.arange(6, size[0] - 6, 8), np.arange(6, size[1] - 6, 8)), axis=-1).reshape(-1, 2)
    nodes = np.concatenate((grid + rng.uniform(-1.5, 1.5, grid.shape), middle + BEFORE_M * normal))
    inside = ((nodes[:, None] > wide[:, 0]) & (nodes[:, None] < wide[:, 1])).all(axis=2).any(axis=1)
    nodes = nodes[~inside]
    edges = cKDTree(nodes).query_pairs(11.0, output_type="ndarray")
    edges = edges[count_crossings(nodes[edges[:, 0]], nodes[edges[:, 1]], outlines(wide)) == 0]
    return SimulatedFloor(
        number=0,
        name="Hall",
        width_m=HALL_M[0],
        height_m=HALL_M[1],
        elevation_m=0.0,
        walls=np.concatenate((outlines(np.array([((0, 0), HALL_M)])), sides)),
        nodes=nodes,
        edges=edges,
        landmark_ids=tuple(str(number + 1) for number in range(len(sides))),
        landmark_position=np.column_stack((middle, np.full(len(sides), 1.4))),
        landmark_heading_rad=np.arctan2(normal[:, 0], -normal[:, 1]),
        control_points=nodes[:4],
        rooms=frozenset(),
    )


def _apart(pair: FloatArray) -> float:
    return float(np.linalg.norm(pair[1] - pair[0]))


def outlines(boxes: FloatArray) -> FloatArray:
    """Sides (4 b, 2, 2) of rectangles (b, 2, 2), each given by its lower left and upper right corner, metres."""
    (x0, y0), (x1, y1) = boxes[:, 0].T, boxes[:, 1].T
    corners = np.stack((x0, y0, x1, y0, x1, y1, x0, y1), axis=1).reshape(-1, 4, 2)
    return np.stack((corners, np.roll(corners, -1, axis=1)), axis=2).reshape(-1, 2, 2)


def other_building(floor: SimulatedFloor, seed: int) -> SimulatedFloor:
    """The floor of this number in another building."""
    return make_building(building_settings(seed + OTHER_SEEDS), seed + OTHER_SEEDS, (floor.number,)).floors[0]


def mirrored(floor: SimulatedFloor, _: int) -> SimulatedFloor:
    """Left and right exchanged."""
    return replace(floor, walls=np.stack((floor.width_m - floor.walls[..., 0], floor.walls[..., 1]), axis=-1))


def ink_missing(floor: SimulatedFloor, seed: int) -> SimulatedFloor:
    """Gaps at random places of the walls."""
    rng, walls = stream(seed, "ink", floor.number), list(floor.walls)
    missing_m = MISSING_SHARE * sum(map(_apart, walls))
    while missing_m > 0:
        lengths = np.array([_apart(wall) for wall in walls])
        at = int(rng.choice(len(walls), p=lengths / lengths.sum()))
        (start, stop), gap = walls[at], min(float(rng.uniform(*GAP_M)), lengths[at])
        low = float(rng.uniform(0, lengths[at] - gap))
        ahead = (stop - start) / lengths[at]
        parts = [np.stack((start, start + low * ahead)), np.stack((start + (low + gap) * ahead, stop))]
        walls[at : at + 1] = [part for part in parts if _apart(part) > 0.05]
        missing_m -= gap
    return replace(floor, walls=np.array(walls))


def walls_added(floor: SimulatedFloor, seed: int) -> SimulatedFloor:
    """Walls that are not there."""
    rng = stream(seed, "walls", floor.number)
    start = rng.uniform((0, 0), (floor.width_m, floor.height_m), (WALLS, 2))
    ahead = np.eye(2)[rng.integers(0, 2, WALLS)] * rng.uniform(*WALL_M, (WALLS, 1))
    added = np.stack((start, (start + ahead).clip(max=(floor.width_m, floor.height_m))), axis=1)
    return replace(floor, walls=np.concatenate((floor.walls, added)))


def furnished_floor(floor: SimulatedFloor, seed: int) -> SimulatedFloor:
    """Outlines of furniture in rooms and corridors, which people can still pass."""
    rng, pieces = stream(seed, "furniture", floor.number), np.empty((0, 2, 2))
    while len(pieces) < PIECES:
        extent = rng.uniform(*PIECE_M, 2)
        low = rng.uniform((0, 0), (floor.width_m, floor.height_m) - extent)
        more = np.concatenate((pieces, np.stack((low, low + extent))[None]))
        window = np.stack((low - AROUND_M, low + extent + AROUND_M))
        if _passages(floor.walls, more, window) <= _passages(floor.walls, pieces, window):
            pieces = more
    return replace(floor, walls=np.concatenate((floor.walls, outlines(pieces))))


def _passages(walls: FloatArray, pieces: FloatArray, window: FloatArray) -> int:
    """Number of separate areas (rectangle ``window`` (2, 2), metres) in which a person can walk."""
    low, high = window
    image = Image.new("1", tuple(np.ceil((high - low) * PIXELS_PER_M).astype(int).tolist()), 1)
    canvas = ImageDraw.Draw(image)
    for (x0, y0), (x1, y1) in ((walls - low) * PIXELS_PER_M).tolist():
        canvas.line((x0, y0, x1, y1), fill=0)
    for (x0, y0), (x1, y1) in ((pieces - low) * PIXELS_PER_M).tolist():
        canvas.rectangle((x0, y0, x1, y1), fill=0)
    away = distance_transform_edt(np.asarray(image))
    return int(label(away > PASSAGE_M / 2 * PIXELS_PER_M)[1])


@dataclass(frozen=True)
class Survey:
    """Walks that several cases share: ``walks`` in each of the first ``buildings``; ``made`` makes another floor than
    the simulator.
    """

    severity: str = "default"
    seconds: float = 180.0
    walks: int = 6
    buildings: int = 10**6
    made: Callable[[int], SimulatedFloor] | None = None

    def scenario(self, seed: int) -> Scenario:
        """All walks in the building of a seed."""
        floors = FLOORS if self.made is None else (0,)
        sessions = -(-self.walks // (2 * len(floors)))
        settings = building_settings(seed)
        usual = regular_survey(seed, self.severity, floors, ("LG", "OnePlus"), sessions, self.seconds, settings)
        if self.made is None:
            return usual
        return replace(usual, building=furnished((self.made(seed),), [ACCESS_POINTS], seed))


SURVEYS = {
    "3 min": Survey(),
    "4 min": Survey(seconds=240.0),
    "2 min": Survey(seconds=120.0),
    "60 s": Survey(seconds=60.0),
    "30 s": Survey(seconds=30.0),
    "severe": Survey("severe"),
    "symmetric": Survey(walks=8, buildings=1, made=symmetric_floor),
    "hall": Survey(walks=1, buildings=1, made=hall_floor),
}


@dataclass(frozen=True)
class Case:
    """What the strategy is given of a walk of a survey."""

    survey: str = "3 min"
    drawn: Callable[[SimulatedFloor, int], SimulatedFloor] | None = None
    """What the plan of each floor shows, by the floor and the seed; None: the floor."""
    size: tuple[float, float] = (1.0, 1.0)
    """Size of plans along x and y; the true positions are taken to the plan's frame."""
    own_plan_only: bool = False
    plan_of: int = 0
    """The plan of the session's floor is that of the floor so many further up ..."""
    filed: int = 0
    """... and the session is filed under the floor so many further up."""
    landmarks: int = 0
    """Surveyed landmarks of the floor, spread; no others are in the log."""
    tap: bool = False
    """Whether the true place at the middle of the walk is known, ..."""
    north: bool = False
    """... and the plan's north."""
    strategy: str = OURS
    right: bool = True
    """Whether the plan is that of the walk."""


CASES = {
    **{f"default_{minutes}min": Case(f"{minutes} min") for minutes in (3, 4, 2)},
    "severe_3min": Case("severe"),
    **{f"short_{seconds}s": Case(f"{seconds} s") for seconds in (60, 30)},
    "other_building": Case(drawn=other_building, own_plan_only=True, right=False),
    "mirrored": Case(drawn=mirrored, own_plan_only=True, right=False),
    "other_floor": Case(plan_of=1, own_plan_only=True, right=False),
    "wrong_floor": Case(filed=1, right=False),
    "symmetric": Case("symmetric"),
    "symmetric_tap": Case("symmetric", tap=True),
    "symmetric_north": Case("symmetric", north=True),
    "scale_plus_2": Case(size=(1.02, 1.02)),
    "stretched": Case(size=(1.02, 0.99)),
    "ink_10": Case(drawn=ink_missing),
    "walls_12": Case(drawn=walls_added),
    "furniture_150": Case(drawn=furnished_floor),
    **{f"landmarks_{count}": Case(landmarks=count) for count in (1, 2, 4)},
    **{f"landmarks_{count}_smoother": Case(landmarks=count, strategy=REFERENCE) for count in (1, 2, 4)},
    "hall": Case("hall"),
}
