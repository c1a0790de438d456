from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.preparation.planning.floors import write_ring_site
from vislam2tag.common.errors import SurveyError
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.site.discover import read_site
from vislam2tag.site.walkable.plan_cells import GREEN, RED, corrected_cells, floor_mask, read_mask

GRID = CellGrid((0.0, 0.0), 0.5, 20, 40)


@pytest.mark.parametrize("factor", [1, 3, 0.5])
def test_a_mask_of_any_size_covers_the_plan(factor: float) -> None:
    rows, columns = round(20 * factor), round(40 * factor)
    mask = np.full((rows, columns, 3), 128, dtype=np.uint8)
    mask[: rows // 2, : columns // 2] = GREEN
    mask[rows // 2 :, columns // 2 :] = RED
    walkable, blocked = corrected_cells(mask, GRID)
    assert walkable[11:, :19].all()  # row 0 of the image is at the top, row 0 of the grid at the bottom
    assert not walkable[:9].any()
    assert blocked[:9, 21:].all()
    assert not blocked[:, :19].any()


def test_colours_that_say_nothing() -> None:
    colours = [(255, 255, 255), (0, 0, 0), (128, 128, 128), (0, 0, 255), (255, 255, 0), (200, 170, 160)]
    mask = np.repeat(np.array([colours], dtype=np.uint8), 2, axis=0)
    walkable, blocked = corrected_cells(mask, GRID)
    assert not (walkable | blocked).any()


def test_transparent_paint_says_nothing(tmp_path: Path) -> None:
    image = Image.new("RGBA", (40, 20), (0, 255, 0, 0))
    image.paste((255, 0, 0, 255), (0, 0, 5, 5))
    image.save(tmp_path / "mask.png")
    walkable, _ = corrected_cells(read_mask(tmp_path / "mask.png"), GRID)
    assert not walkable.any()


def test_no_mask_corrects_nothing() -> None:
    walkable, blocked = corrected_cells(None, GRID)
    assert not (walkable | blocked).any()


def test_a_file_that_is_no_image_is_told(tmp_path: Path) -> None:
    (tmp_path / "mask.png").write_text("no image")
    with pytest.raises(SurveyError, match=r"mask\.png.*green"):
        read_mask(tmp_path / "mask.png")


def test_a_mask_without_green_and_red_is_no_correction(tmp_path: Path) -> None:
    Image.new("RGB", (40, 20), "black").save(tmp_path / "mask.png")
    with pytest.raises(SurveyError, match=r"mask\.png: nothing in it is green"):
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
