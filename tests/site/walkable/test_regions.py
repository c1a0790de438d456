from __future__ import annotations

import numpy as np

from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.site.walkable.plan_cells import inside_of, largest_region
from vislam2tag.site.walkable.space import WalkableSettings

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


def test_corners_of_a_region_are_whole() -> None:
    free = np.zeros((40, 40), dtype=np.bool_)
    free[5:35, 5:35] = True
    region, _ = largest_region(free, CellGrid((0.0, 0.0), 0.1, 40, 40), SETTINGS)
    assert (region == free).all()


def test_nothing_free_is_no_region() -> None:
    region, findings = largest_region(np.zeros((9, 9), dtype=np.bool_), CellGrid((0, 0), 0.1, 9, 9), SETTINGS)
    assert not region.any()
    assert not findings
