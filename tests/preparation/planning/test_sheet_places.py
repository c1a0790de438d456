"""Where sheets may hang."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.preparation.planning.floors import INNER, OUTER, rectangle, ring
from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.planning.corridors import Corridors, corridors_of
from vislam2tag.preparation.planning.settings import PlanSettings
from vislam2tag.preparation.planning.sheet_places import (
    MARGIN_M,
    SheetPlaces,
    Stations,
    find_sheet_places,
    first_hits,
    stations_along,
)

SETTINGS = PlanSettings()


def placed(
    forbidden: FloatArray | None = None, settings: PlanSettings = SETTINGS
) -> tuple[Corridors, Stations, SheetPlaces]:
    space, graph = ring()
    ways = corridors_of(graph, settings.turn_rad)
    stations = stations_along(ways, settings.step_m)
    return ways, stations, find_sheet_places(space, ways, stations, settings, forbidden)


@given(st.floats(0.5, 9.5), st.floats(0.5, 4.5), st.floats(-np.pi, np.pi))
def test_a_line_inside_a_rectangle_hits_its_side(x: float, y: float, angle: float) -> None:
    direction = np.array([[np.cos(angle), np.sin(angle)]])
    distance = first_hits(np.array([[x, y]]), direction, rectangle(0.0, 0.0, 10.0, 5.0), 50.0)[0]
    hit_x, hit_y = np.array([x, y]) + distance * direction[0]
    assert -1e-6 <= hit_x <= 10 + 1e-6
    assert -1e-6 <= hit_y <= 5 + 1e-6
    assert min(abs(hit_x), abs(hit_x - 10), abs(hit_y), abs(hit_y - 5)) < 1e-6


def test_walls_behind_and_out_of_reach_are_not_hit() -> None:
    wall = np.array([[(5.0, -1.0), (5.0, 1.0)]])
    origin, ahead = np.zeros((1, 2)), np.array([[1.0, 0.0]])
    assert first_hits(origin, ahead, wall, 6.0)[0] == pytest.approx(5.0)
    assert np.isinf(first_hits(origin, -ahead, wall, 6.0)[0])
    assert np.isinf(first_hits(origin, ahead, wall, 4.0)[0])
    assert np.isinf(first_hits(origin, ahead, np.empty((0, 2, 2)), 4.0)[0])


def test_stations_stand_evenly_along_each_way() -> None:
    ways, stations, _ = placed()
    for way, length in enumerate(ways.length_m.tolist()):
        offsets = stations.offset_m[stations.corridor == way]
        assert len(offsets) == round(length)
        assert np.allclose(np.diff(offsets), length / len(offsets))
        assert np.allclose(stations.point[stations.corridor == way], ways.place(way, offsets))


def test_sheets_hang_on_the_walls_and_face_the_way() -> None:
    _, stations, places = placed()
    assert len(places.station) > 100
    x, y = places.position.T
    on_outer = np.minimum.reduce(
        [np.abs(x - OUTER[0]), np.abs(x - OUTER[2]), np.abs(y - OUTER[1]), np.abs(y - OUTER[3])]
    )
    on_inner = np.minimum.reduce(
        [np.abs(x - INNER[0]), np.abs(x - INNER[2]), np.abs(y - INNER[1]), np.abs(y - INNER[3])]
    )
    assert np.minimum(on_outer, on_inner).max() < 1e-6
    towards = stations.point[places.station] - places.position
    assert np.allclose(towards, places.normal * places.line_m[:, None], atol=1e-6)
    assert np.allclose(places.line_m, 1.0)


def test_sheets_keep_off_corners_and_are_in_view_for_long_enough() -> None:
    _, _, places = placed()
    corners = rectangle(*INNER)[:, 0]
    assert np.linalg.norm(places.position[:, None] - corners, axis=2).min() > MARGIN_M - 1e-6
    assert places.visible_m.min() >= SETTINGS.visible_m
    assert len(placed(settings=SETTINGS.model_copy(update={"visible_m": 5.0}))[2].station) == 0


def test_nothing_hangs_where_it_is_forbidden() -> None:
    everywhere = placed()[2].position
    x0, y0, x1, y1 = area = (5.0, -1.0, 12.0, 3.0)
    inside = (everywhere >= (x0, y0)) & (everywhere <= (x1, y1))
    left = placed(np.array([(area[2], area[3], area[0], area[1])]))[2].position
    assert inside.all(axis=1).any()
    assert len(left) == (~inside.all(axis=1)).sum()


def test_an_uneven_wall_is_no_place() -> None:
    space, graph = ring()
    # Half a metre of the outer wall juts out by 20 cm at x = 10.
    niche = np.array([[(9.7, 0.0), (9.7, 0.2)], [(9.7, 0.2), (10.3, 0.2)], [(10.3, 0.2), (10.3, 0.0)]])
    uneven = type(space)(space.area, np.vstack((space.walls, niche)))
    ways = corridors_of(graph, SETTINGS.turn_rad)
    stations = stations_along(ways, 0.5)
    places = find_sheet_places(uneven, ways, stations, SETTINGS)
    near = (np.abs(places.position[:, 0] - 10.0) < 0.75) & (places.position[:, 1] < 1.0)
    before = find_sheet_places(space, ways, stations, SETTINGS)
    assert ((np.abs(before.position[:, 0] - 10.0) < 0.75) & (before.position[:, 1] < 1.0)).any()
    assert not near.any()
