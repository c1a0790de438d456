"""What lacks of a floor, as the map draws it; walks that phones hand over: tests/studio/test_from_plan_to_link.py."""

from __future__ import annotations

import numpy as np

from vislam2tag.studio.layers.gaps import strips


def test_places_beside_each_other_are_drawn_as_one_strip() -> None:
    places = np.array([(1.0, 2.0), (1.5, 2.0), (3.0, 2.0), (1.0, 2.5)])
    found = strips(places, 0.5)
    assert found[0] == [(0.75, 1.75), (1.75, 1.75), (1.75, 2.25), (0.75, 2.25)]
    assert [corner[0] for corner in found[1:]] == [(2.75, 1.75), (0.75, 2.25)]
    assert strips(np.empty((0, 2)), 0.5) == []
