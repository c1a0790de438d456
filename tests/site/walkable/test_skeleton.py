from __future__ import annotations

import pytest

from tests.site.walkable.hand_made import rectangles, space_of
from vislam2tag.site.walkable.skeleton import skeleton
from vislam2tag.site.walkable.space import GraphSettings

SETTINGS = GraphSettings()


def test_a_corridor_is_a_line_without_spurs_into_its_corners() -> None:
    network = skeleton(rectangles(30, 6, (1, 2, 29, 4)), SETTINGS)
    (branch,) = network.branches.values()
    assert branch.length_m == pytest.approx(26, abs=0.4)
    assert branch.line[:, 1] == pytest.approx(3.0, abs=0.1)


def test_a_niche_is_no_dead_end_but_a_side_corridor_is_one() -> None:
    niche = rectangles(30, 9, (1, 2, 29, 4), (10, 4, 12, 4.8))
    assert len(skeleton(niche, SETTINGS).branches) == 1
    side = rectangles(30, 9, (1, 2, 29, 4), (10, 4, 11.6, 8.5))
    assert sorted(len(skeleton(side, SETTINGS).at(node)) for node in skeleton(side, SETTINGS).places) == [1, 1, 1, 3]


def test_a_pillar_makes_no_ring() -> None:
    space = rectangles(20, 8, (1, 1, 19, 7))
    mask = space.area.mask.copy()
    mask[38:43, 98:103] = False
    assert len(skeleton(space_of(mask), SETTINGS).branches) == 1
    mask[30:50, 90:110] = False
    (ring,) = skeleton(space_of(mask), SETTINGS).branches.values()
    assert ring.first == ring.last
