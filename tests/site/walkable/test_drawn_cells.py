"""Cells of a floor, as its plan draws them and as they are painted by hand; where drawings tell a session to walk."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from tests.estimation.dead_reckoning.ilc20 import make_site
from tests.preparation.planning.floors import write_ring_site
from tests.site.walkable.hand_made import plan
from vislam2tag.common.errors import SurveyError
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.sessions.prepared import SessionTask, prepared_session
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.corrections.file import Corrections
from vislam2tag.site.discover import read_site
from vislam2tag.site.plans.source import FloorPlan, PlanText
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.drawn_cells import cells_in, drawing_mark, drawn_area, line_walls, plan_grid
from vislam2tag.site.walkable.painted_cells import (
    GREEN,
    RED,
    corrected_cells,
    floor_mask,
    inside_of,
    largest_region,
    read_mask,
    refuse_other_plan,
    regions,
)

GRID = CellGrid((-2.0, 1.0), 0.5, 30, 40)
NUMBER = st.floats(-4, 20, allow_nan=False).map(lambda value: round(value, 3))


@settings(max_examples=30)
@given(st.lists(st.tuples(NUMBER, NUMBER, st.floats(0.5, 6)), min_size=1, max_size=4))
def test_cells_in_polygons_are_those_whose_centre_is(discs: list[tuple[float, float, float]]) -> None:
    rings = [shapely.Point(x, y).buffer(r).difference(shapely.Point(x, y).buffer(r / 2)) for x, y, r in discs]
    shape = shapely.union_all(rings)
    every = np.argwhere(np.ones(GRID.shape))
    centres = shapely.points(GRID.centres_m(every))
    clear = ~shapely.dwithin(shape.boundary, centres, 1e-6)
    expected = shapely.contains(shape, centres)
    assert (cells_in(shape, GRID)[every[:, 0], every[:, 1]] == expected)[clear].all()


def test_no_polygon_holds_no_cell() -> None:
    assert not cells_in(shapely.GeometryCollection(), GRID).any()


def test_lines_are_as_thick_as_walls() -> None:
    cells = line_walls(np.array([((0.0, 5.0), (10.0, 5.0))]), CellGrid((0.0, 0.0), 0.1, 100, 120), 0.3)
    assert int(cells[:, 50].sum()) in (2, 3, 4)
    assert abs(int(cells[:50, 50].sum()) - int(cells[50:, 50].sum())) <= 1


def test_cells_are_larger_on_a_large_plan() -> None:
    plan = FloorPlan((10, 1010, 0, 500), np.zeros((5, 10, 3), dtype=np.uint8))
    grid = plan_grid(plan, WalkableSettings(max_cells=1_000_000))
    assert grid.rows * grid.columns <= 1_001_000
    assert grid.extent_m[0] == 10
    assert grid.extent_m[1] - 1010 < grid.cell_m


SETTINGS = WalkableSettings()


def building(gate_m: float) -> np.ndarray:
    """Walls of a building of 16 x 10 m in the middle of 20 x 14 m, with a gate in its lower wall; cells of 10 cm."""
    walls = np.zeros((140, 200), dtype=np.bool_)
    walls[20:120, 20:180] = True
    walls[22:118, 22:178] = False
    half = round(gate_m * 5)
    walls[20:22, 100 - half : 100 + half] = False
    return walls


def test_an_entrance_keeps_the_outside_out() -> None:
    inside, findings = inside_of(building(2.0), 0.1, SETTINGS)
    assert inside[30:110, 30:170].all()
    assert not inside[:12].any()
    assert not findings


def test_a_wall_that_is_half_open_leaves_no_inside() -> None:
    inside, findings = inside_of(building(14.0), 0.1, SETTINGS)
    assert [finding.kind for finding in findings] == ["no_outer_wall"]
    assert inside[5, 5]


def test_the_largest_region_is_kept_and_gaps_too_narrow_for_people_part() -> None:
    free = np.zeros((60, 100), dtype=np.bool_)
    free[5:55, 5:60] = True
    free[5:55, 62:95] = True
    free[30:34, 60:62] = True  # 40 cm
    region, (finding,) = largest_region(free, CellGrid((3.0, 7.0), 0.1, 60, 100), SETTINGS)
    assert region[10, 10]
    assert not region[10, 80]
    x, y = (float(text) for text in finding.message.split("at (")[1].split(")")[0].split(","))
    assert 10 < x < 12
    assert 8.5 < y < 11.5
    free[30:38, 60:62] = True  # 80 cm
    joined, findings = largest_region(free, CellGrid((3.0, 7.0), 0.1, 60, 100), SETTINGS)
    assert joined[10, 80]
    assert not findings


def test_closed_off_regions_are_named_by_their_room_labels() -> None:
    free = np.zeros((60, 100), dtype=np.bool_)
    free[5:55, 5:60] = free[5:55, 62:95] = True
    labels = [PlanText("1.07", (8.0, 3.0)), PlanText("1.01", (2.0, 3.0)), PlanText("9.99", (-5.0, 3.0))]
    _, (finding,) = largest_region(free, CellGrid((0.0, 0.0), 0.1, 60, 100), SETTINGS, labels)
    assert "excluded: 1.07: 13 m2 at (" in finding.message


def test_corners_of_a_region_are_whole() -> None:
    free = np.zeros((40, 40), dtype=np.bool_)
    free[5:35, 5:35] = True
    region, _ = largest_region(free, CellGrid((0.0, 0.0), 0.1, 40, 40), SETTINGS)
    assert (region == free).all()


def test_nothing_free_is_no_region() -> None:
    region, findings = largest_region(np.zeros((9, 9), dtype=np.bool_), CellGrid((0, 0), 0.1, 9, 9), SETTINGS)
    assert not region.any()
    assert not findings


MASK_GRID = CellGrid((0.0, 0.0), 0.5, 20, 40)


@pytest.mark.parametrize("factor", [1, 3, 0.5])
def test_a_mask_of_any_size_covers_the_plan(factor: float) -> None:
    rows, columns = round(20 * factor), round(40 * factor)
    mask = np.full((rows, columns, 3), 128, dtype=np.uint8)
    mask[: rows // 2, : columns // 2] = GREEN
    mask[rows // 2 :, columns // 2 :] = RED
    walkable, blocked = corrected_cells(mask, MASK_GRID)
    assert walkable[11:, :19].all()  # row 0 of the image is at the top, row 0 of the grid at the bottom
    assert not walkable[:9].any()
    assert blocked[:9, 21:].all()
    assert not blocked[:, :19].any()


def test_colours_that_say_nothing() -> None:
    colours = [(255, 255, 255), (0, 0, 0), (128, 128, 128), (0, 0, 255), (255, 255, 0), (200, 170, 160)]
    mask = np.repeat(np.array([colours], dtype=np.uint8), 2, axis=0)
    walkable, blocked = corrected_cells(mask, MASK_GRID)
    assert not (walkable | blocked).any()


def test_transparent_paint_says_nothing(tmp_path: Path) -> None:
    image = Image.new("RGBA", (40, 20), (0, 255, 0, 0))
    image.paste((255, 0, 0, 255), (0, 0, 5, 5))
    image.save(tmp_path / "mask.png")
    walkable, _ = corrected_cells(read_mask(tmp_path / "mask.png"), MASK_GRID)
    assert not walkable.any()


def test_no_mask_corrects_nothing() -> None:
    walkable, blocked = corrected_cells(None, MASK_GRID)
    assert not (walkable | blocked).any()


def test_a_file_that_is_no_image_is_told(tmp_path: Path) -> None:
    (tmp_path / "mask.png").write_text("no image")
    with pytest.raises(SurveyError, match=r"mask\.png.*green"):
        read_mask(tmp_path / "mask.png")


def test_a_mask_without_green_and_red_is_no_correction(tmp_path: Path) -> None:
    Image.new("RGB", (40, 20), "black").save(tmp_path / "mask.png")
    with pytest.raises(SurveyError, match=r"mask\.png: it contains neither green"):
        read_mask(tmp_path / "mask.png")


def test_the_mask_in_a_floors_folder_counts_unless_another_one_is_given(tmp_path: Path) -> None:
    site = write_ring_site(tmp_path / "ring", (1, 2))
    Image.new("RGB", (4, 2), RED).save(site / "floor_1" / "floorplan.mask.png")
    Image.new("RGB", (4, 2), GREEN).save(tmp_path / "other.png")
    first, second = read_site(site)[0].floors
    own, given = floor_mask(first), floor_mask(first, tmp_path / "other.png")
    assert own is not None
    assert given is not None
    assert (tuple(own[0, 0, :3]), tuple(given[0, 0, :3])) == (RED, GREEN)
    assert floor_mask(second) is None


def feature(left: float, low: float, right: float, high: float, use: str) -> dict[str, object]:
    corners = [(left, low), (right, low), (right, high), (left, high), (left, low)]
    return {
        "type": "Feature",
        "properties": {"use": use},
        "geometry": {"type": "Polygon", "coordinates": [corners]},
    }


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A made site whose plan has one block of shops."""
    made = make_site(tmp_path / "site1")
    features = [feature(0, 0, 60, 40, "outline"), feature(20, 10, 40, 30, "obstacle")]
    plan = {"type": "FeatureCollection", "features": features}
    (made / "F1" / "geojson_map.json").write_text(json.dumps(plan), encoding="utf-8")
    return made


def test_a_drawing_tells_a_session_without_poses_where_shops_are(site: Path) -> None:
    survey = open_survey(site)
    area = prepared_session(SessionTask(survey.sessions[0], survey.site, Corrections())).session.camera.area
    assert area is not None
    assert area is drawn_area(survey.site.floor(0)), "it is read once"
    free = area.mask[tuple(area.grid.cells_of(np.array(((5.0, 5.0), (30.0, 20.0), (50.0, 20.0)))).T)]
    assert free.tolist() == [True, False, True]


def test_the_mark_follows_the_drawing(site: Path) -> None:
    floor = open_survey(site).site.floor(0)
    assert floor.plan is not None
    before = drawing_mark(floor)
    floor.plan.write_text(floor.plan.read_text(encoding="utf-8").replace("20", "22"), encoding="utf-8")
    assert None not in (before, drawing_mark(floor))
    assert drawing_mark(floor) != before


def test_images_and_what_cannot_be_read_tell_nothing(site: Path) -> None:
    floor = open_survey(site).site.floor(0)
    assert floor.plan is not None
    assert drawn_area(replace(floor, plan=None)) is None
    assert drawing_mark(replace(floor, plan=floor.plan.with_name("floor_image.png"))) is None
    floor.plan.write_text("no drawing", encoding="utf-8")
    assert drawn_area(floor) is None


@pytest.mark.parametrize("place", [0.0, 2.0, 2.03, 9.95, 10.0])
def test_a_line_is_one_cell_wherever_it_is(place: float) -> None:
    across = np.array([((place, 0.0), (place, 10.0))])
    for lines in (across, across[..., ::-1]):
        cells = line_walls(lines, FINE, 0.1)
        assert int(cells.any(axis=0).sum() * cells.any(axis=1).sum()) == 100


FINE = CellGrid((0.0, 0.0), 0.1, 100, 100)


@settings(deadline=None, max_examples=40)
@given(st.floats(0.1, 0.49), st.floats(0, np.pi), st.floats(-0.1, 0.1))
def test_what_is_between_faces_is_wall_and_holds(apart_m: float, angle: float, aside: float) -> None:
    along = np.array([np.cos(angle), np.sin(angle)])
    ends = np.array([-20.0, 20.0])[:, None] * along + (5.0 + aside, 5.0)
    other = ends + apart_m * np.array([-along[1], along[0]])
    cells = line_walls(np.stack((ends, other)), FINE, 0.1)
    wall = shapely.intersection(shapely.Polygon([*ends, *other[::-1]]), shapely.box(0, 0, 10, 10))
    assert cells.sum() * FINE.cell_m**2 == pytest.approx(wall.area, abs=0.6)
    assert regions(~cells).max() == 2


def test_a_mask_of_another_plan_is_refused() -> None:
    painted = np.array(plan().image)
    painted[100:120, 100:120] = GREEN
    refuse_other_plan(painted, plan())
    refuse_other_plan(np.full_like(painted, GREEN), plan())
    with pytest.raises(SurveyError, match=r"another shape \(200 x 520 pixels\) than the plan \(520 x 440 pixels, 26"):
        refuse_other_plan(np.zeros((520, 200, 3), dtype=np.uint8), plan())
    other = np.full_like(painted, 255)
    other[40:420:30] = 0
    other[100:120, 100:120] = GREEN
    with pytest.raises(SurveyError, match="another drawing than the plan"):
        refuse_other_plan(other, plan())
