"""Generated drawings of the campaign are read: their walkable area is that of the floor, and oddities are named."""

from __future__ import annotations

from pathlib import Path

import pytest
from drawings import DRAWINGS, RIGHT, run

FEW = ("dxf-it-solids", "osm-levels", "picture-hatched")


def test_there_are_sixty_drawings_of_different_names() -> None:
    assert len({each.name for each in DRAWINGS}) == len(DRAWINGS) == 60


@pytest.mark.parametrize("name", FEW)
def test_a_drawing_is_read_without_a_warning(tmp_path: Path, name: str) -> None:
    (drawing,) = (each for each in DRAWINGS if each.name == name)
    found = run(drawing, 700, tmp_path / name)
    assert found.error is not None, found.said
    assert abs(found.error) <= RIGHT
    assert found.said == ()


def test_what_is_odd_about_a_drawing_is_named(tmp_path: Path) -> None:
    (drawing,) = (each for each in DRAWINGS if each.name == "dxf-wrong-unit")
    (warning,) = run(drawing, 701, tmp_path / drawing.name).said
    assert "use --unit-m 1" in warning
