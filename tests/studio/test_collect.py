"""What lacks of a floor, as the map draws it; walks that phones hand over: tests/studio/test_from_plan_to_link.py."""

from __future__ import annotations

import numpy as np

from vislam2tag.studio.layers.gaps import outlines


def test_places_beside_each_other_are_one_area_with_holes() -> None:
    around = [(x, y) for x in (1.0, 1.5, 2.0) for y in (2.0, 2.5, 3.0) if (x, y) != (1.5, 2.5)]
    found = sorted(outlines(np.array([*around, (4.0, 2.0)]), 0.5), key=len)
    assert [[sorted(ring) for ring in rings] for rings in found] == [
        [[(3.75, 1.75), (3.75, 2.25), (4.25, 1.75), (4.25, 2.25)]],
        [
            [(0.75, 1.75), (0.75, 3.25), (2.25, 1.75), (2.25, 3.25)],
            [(1.25, 2.25), (1.25, 2.75), (1.75, 2.25), (1.75, 2.75)],
        ],
    ]
    assert outlines(np.empty((0, 2)), 0.5) == []
