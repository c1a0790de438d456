from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.image import AxesImage
from matplotlib.patches import Polygon

from tests.datasets.changing import Survey, surveyed, usual_places
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.datasets.changes import CHANGED, Changes, survey_changes
from vislam2tag.datasets.coverage import FloorCoverage, gap_walks
from vislam2tag.datasets.model import Storey
from vislam2tag.site.model import ControlPoints, Floor
from vislam2tag.views.coverage_figures import PLACES, ChangedFloor, CoveredFloor, change_map, coverage_map

FLOOR = Floor(1, "first", 30.0, 10.0, None, None, ControlPoints((), np.zeros((0, 2))))


def corridor(building: str = "", counts: tuple[int, ...] = (3, 0, 0, 0, 25)) -> FloorCoverage:
    """Five cells of 2 m; the middle one is near no fingerprint."""
    found = np.array([counts])
    walkable = np.ones((1, 5), dtype=bool)
    near = np.array([[True, True, False, True, True]])
    return FloorCoverage(Storey(building, 1), CellGrid((20.0, -4.0), 2.0, 1, 5), {"A": found}, walkable, near, 0)


def cells_of(image: AxesImage) -> np.ndarray:
    """What is painted of five cells, 0 where nothing is."""
    return np.asarray(np.ma.filled(np.ma.asarray(image.get_array()), 0)).ravel()


def test_cells_are_coloured_by_count_gap_and_walk() -> None:
    covered = corridor()
    figure = coverage_map([CoveredFloor("Floor 1", FLOOR, covered, gap_walks(covered))])
    (axes,) = figure.axes
    near, gap, *classes = (cells_of(image).tolist() for image in axes.images)
    assert (near, gap) == ([1, 1, 0, 1, 1], [0, 0, 1, 0, 0])
    assert [classes[2], classes[5]] == [[1, 0, 0, 0, 0], [0, 0, 0, 0, 1]]
    assert tuple(axes.images[0].get_extent()) == (20.0, 30.0, -4.0, -2.0)
    assert axes.get_title("left") == "Floor 1: 80 % covered, one gap"
    assert len(axes.lines) == 1


def test_floors_of_a_building_show_the_same_part_and_plan_and_cells_are_whole() -> None:
    other = CoveredFloor("Floor 2", FLOOR, corridor(), ())
    wide = CoveredFloor("Floor 1", FLOOR, corridor(), ())
    whole = np.ones((1, 1), dtype=bool)
    elsewhere = FloorCoverage(Storey("B", 0), CellGrid((0.0, 0.0), 2.0, 1, 1), {}, whole, whole, 0)
    nameless = Floor(0, "", None, None, None, None, FLOOR.control_points)
    one, two, three = coverage_map([other, wide, CoveredFloor("B", nameless, elsewhere)]).axes
    assert one.get_xlim() == two.get_xlim() == (0, 30)
    assert one.get_ylim() == two.get_ylim() == (-4, 10)
    assert three.get_xlim() == (0, 2)


@pytest.mark.parametrize(("counts", "title"), [((1, 1, 1, 1, 1), "F"), ((1, 0, 0, 0, 1), "F: 80 % covered")])
def test_a_share_is_told_where_more_is_walkable_than_holds_fingerprints(counts: tuple[int, ...], title: str) -> None:
    (axes,) = coverage_map([CoveredFloor("F", FLOOR, corridor(counts=counts))]).axes
    assert axes.get_title("left") == title


@pytest.fixture(scope="module")
def changes() -> Changes:
    places = usual_places()
    del places[8]
    after = places | {20: (56.0, 4.0)}
    return survey_changes(surveyed(Survey("base")), surveyed(Survey("later", places=after)), "wifi")


def floors(*numbers: int) -> list[ChangedFloor]:
    dataset = surveyed(Survey("base", rows=(3.0,)))
    return [ChangedFloor(f"Floor {number}", "", dataset.site_floor(Storey("", number))) for number in numbers]


def test_each_place_has_the_colour_of_its_change(changes: Changes) -> None:
    (axes,) = change_map(floors(0), changes).axes
    drawn = [patch for patch in axes.patches if isinstance(patch, Polygon)]
    assert len(drawn) == changes.places.height
    colour = to_rgb(PLACES[CHANGED][0])
    changed = sum(np.allclose(patch.get_facecolor()[:3], colour) for patch in drawn)
    assert changed == changes.places.filter(change=CHANGED).height > 0


def test_access_points_are_marked_and_a_move_is_an_arrow(changes: Changes) -> None:
    (axes,) = change_map(floors(0), changes).axes
    moved, *points = axes.lines
    assert len(np.asarray(moved.get_xydata())) == 6
    assert sorted(str(line.get_marker()) for line in points) == ["X", "o"]
