from __future__ import annotations

import cv2
import numpy as np
import pytest

from vislam2tag.core.arrays import BoolArray
from vislam2tag.site.walkable.door_swings import without_swings

RADII = (10.0, 28.0)


def door(radius: int, *, swing: bool = True, leaf: bool = True, thickness: int = 1) -> BoolArray:
    """A wall along row 80 with a door in it, hinged on its left, that opens to smaller rows."""
    ink = np.zeros((120, 160), dtype=np.uint8)
    cv2.line(ink, (0, 80), (60, 80), 1, thickness)
    cv2.line(ink, (60 + radius, 80), (159, 80), 1, thickness)
    if leaf:
        cv2.line(ink, (60, 80), (60, 80 - radius), 1, 1)
    if swing:
        cv2.ellipse(ink, (60, 80), (radius, radius), 0, -90, 0, 1, 1)
    return ink > 0


@pytest.mark.parametrize("radius", [13, 18, 25])
@pytest.mark.parametrize("thickness", [1, 3])
def test_a_door_is_open(radius: int, thickness: int) -> None:
    walls = without_swings(door(radius, thickness=thickness), RADII)
    assert not walls[: 80 - radius // 2, 62:].any()  # the swing
    assert not walls[80, 66 : 58 + radius].any()  # the gap
    assert walls[80, :55].all()
    assert walls[80, 64 + radius :].all()


def test_a_drawn_sill_is_open_as_well() -> None:
    ink = door(20)
    ink[80] = True
    walls = without_swings(ink, RADII)
    assert not walls[80, 66:76].any()
    assert walls[80, :55].all()


def test_a_leaf_alone_stays() -> None:
    ink = door(20, swing=False)
    assert (without_swings(ink, RADII) == ink).all()


def test_a_rounded_corner_is_no_swing() -> None:
    ink = np.zeros((120, 160), dtype=np.uint8)
    cv2.line(ink, (0, 40), (60, 40), 1, 1)
    cv2.ellipse(ink, (60, 60), (20, 20), 0, -90, 0, 1, 1)
    cv2.line(ink, (80, 60), (80, 119), 1, 1)
    assert (without_swings(ink > 0, RADII) == (ink > 0)).all()
