"""Generated buildings: landmarks on walls and facing the corridor, a graph free of walls, a plan that fits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from vislam2tag.common.files.folder import Folder
from vislam2tag.core.arrays import FloatArray
from vislam2tag.simulation.building import draw_plan, make_building
from vislam2tag.simulation.model import count_crossings
from vislam2tag.simulation.settings import BuildingSettings

buildings = st.builds(
    BuildingSettings,
    width_m=st.floats(40, 90),
    height_m=st.floats(28, 50),
    corridor_width_m=st.floats(1.8, 3.0),
    cross_corridors=st.integers(0, 2),
    dead_ends=st.integers(0, 4),
    landmarks=st.integers(6, 20),
)


def distance_to_walls(points: FloatArray, walls: FloatArray) -> FloatArray:
    start, delta = walls[:, 0], walls[:, 1] - walls[:, 0]
    along = ((points[:, None] - start) * delta).sum(axis=-1) / (delta**2).sum(axis=-1)
    nearest = start + along.clip(0, 1)[..., None] * delta
    distance: FloatArray = np.linalg.norm(points[:, None] - nearest, axis=-1).min(axis=1)
    return distance


@settings(max_examples=40)
@given(options=buildings, seed=st.integers(0, 1000))
def test_floors_hold_together(options: BuildingSettings, seed: int) -> None:
    floor = make_building(options, seed).floors[0]
    ends = floor.nodes[floor.edges]
    assert np.all(count_crossings(ends[:, 0], ends[:, 1], floor.walls) == 0)
    assert reachable(len(floor.nodes), floor.edges.tolist()) == len(floor.nodes)
    sheets = floor.landmark_position[:, :2]
    assert len(sheets) == options.landmarks == len(set(floor.landmark_ids))
    assert distance_to_walls(sheets, floor.walls).max() < 0.02
    heading = floor.landmark_heading_rad
    viewer = sheets + 0.6 * np.column_stack((np.sin(heading), -np.cos(heading)))
    assert np.all(distance_to_walls(viewer, floor.walls) > 0.3)
    inside = (floor.control_points > 0) & (floor.control_points < (options.width_m, options.height_m))
    assert inside.all()


def reachable(count: int, edges: list[list[int]]) -> int:
    reached = {0}
    for _ in range(count):
        reached |= {b for a, b in edges if a in reached} | {a for a, b in edges if b in reached}
    return len(reached)


def test_viewer_stands_in_the_corridor() -> None:
    floor = make_building(BuildingSettings(), 5).floors[0]
    heading = floor.landmark_heading_rad
    out_of_wall = np.column_stack((np.sin(heading), -np.cos(heading)))
    corridor_nodes = floor.nodes[np.unique(floor.edges[np.bincount(floor.edges.ravel())[floor.edges].min(axis=1) > 1])]
    for sheet, normal in zip(floor.landmark_position[:, :2], out_of_wall, strict=True):
        offset = (corridor_nodes - sheet) @ normal
        assert np.any(np.abs(offset - 1.1) < 1e-3)


def test_adding_a_floor_changes_no_other() -> None:
    one = make_building(BuildingSettings(), 9, (1,))
    two = make_building(BuildingSettings(), 9, (0, 1))
    np.testing.assert_array_equal(one.floors[0].landmark_position, two.floors[1].landmark_position)
    np.testing.assert_array_equal(one.ap_position, two.ap_position[two.ap_floor == 1])


@pytest.mark.parametrize("name", ["floorplan.jpg", "floorplan.png"])
def test_plan_covers_the_floor(tmp_path: Path, name: str) -> None:
    floor = make_building(BuildingSettings(width_m=50.0, height_m=30.0), 1).floors[0]
    draw_plan(floor, Folder.at(tmp_path), name, 10.0)
    with Image.open(tmp_path / name) as image:
        assert image.size == (500, 300)
        shades = np.asarray(image.convert("L"))
    wall = floor.walls.mean(axis=1)
    rows = ((floor.height_m - wall[:, 1]) * 10).astype(int).clip(0, 299)
    assert shades[rows, (wall[:, 0] * 10).astype(int).clip(0, 499)].mean() < 128


def test_corridors_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="4 cross corridors do not fit"):
        BuildingSettings(width_m=34.0, cross_corridors=4)
