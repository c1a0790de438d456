from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.site.walkable.hand_made import HEIGHT_M, MARGIN_M, WIDTH_M, plan
from vislam2tag.common.errors import OutputError, SurveyError, UsageError
from vislam2tag.common.files.own_files import OWN_FILES
from vislam2tag.pipeline.site.show import RECORD, write_walkable
from vislam2tag.site.settings import WalkableSettings

SETTINGS = WalkableSettings()


@pytest.fixture
def site(tmp_path: Path) -> Path:
    root = tmp_path / "site"
    size = f"{WIDTH_M + 2 * MARGIN_M},{HEIGHT_M + 2 * MARGIN_M}"
    (root / "floor_dimensions.csv").parent.mkdir()
    (root / "floor_dimensions.csv").write_text(f"id,width,height\n0,{size}\n1,{size}\n")
    for number in (0, 1):
        (root / f"floor_{number}").mkdir()
        Image.fromarray(plan(10).image).save(root / f"floor_{number}" / "floorplan.png")
    return root


def test_files_of_every_floor(site: Path, tmp_path: Path) -> None:
    found = write_walkable(site, tmp_path / "out", (), SETTINGS, None)
    assert [one.floor.number for one in found] == [0, 1]
    files = {path.name for path in (tmp_path / "out").iterdir()}
    assert files == {
        OWN_FILES,
        RECORD,
        *(f"floor_{n}{end}" for n in (0, 1) for end in (".png", ".mask.png", ".geojson")),
    }
    record = json.loads((tmp_path / "out" / RECORD).read_text())
    assert record["floors"][0]["nodes"]["door"] == 3
    assert record["settings"]["walkable"]["passage_m"] == SETTINGS.passage_m
    graph = json.loads((tmp_path / "out" / "floor_0.geojson").read_text())
    kinds = {feature["properties"].get("kind") for feature in graph["features"]}
    assert {"door", "room", "open area"} <= kinds
    write_walkable(site, tmp_path / "out", (0,), SETTINGS, None)
    assert not (tmp_path / "out" / "floor_1.png").exists()


def test_settings_count_and_are_kept(site: Path, tmp_path: Path) -> None:
    coarse = SETTINGS.model_copy(update={"passage_m": 1.5})
    write_walkable(site, tmp_path / "out", (0,), coarse, None)
    record = json.loads((tmp_path / "out" / RECORD).read_text())
    assert record["settings"]["walkable"]["passage_m"] == 1.5
    assert record["floors"][0]["nodes"].get("door", 0) == 0


def test_the_mask_that_is_written_gives_the_same_space(site: Path, tmp_path: Path) -> None:
    (found,) = write_walkable(site, tmp_path / "out", (0,), SETTINGS, None)
    (again,) = write_walkable(site, tmp_path / "again", (0,), SETTINGS, tmp_path / "out" / "floor_0.mask.png")
    same = (found.space.area.mask == again.space.area.mask).mean()
    assert same > 0.999
    assert np.isclose(found.area_m2, again.area_m2, rtol=0.01)


def test_what_cannot_be_used_is_told(site: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="does not have this floor; its floors are: 0, 1"):
        write_walkable(site, tmp_path / "out", (3,), SETTINGS, None)
    with pytest.raises(UsageError, match="--mask"):
        write_walkable(site, tmp_path / "out", (), SETTINGS, tmp_path / "mask.png")
    Image.new("RGB", (260, 220), "black").save(site / "floor_1" / "floorplan.png")
    with pytest.raises(SurveyError, match="shows nothing"):
        write_walkable(site, tmp_path / "out", (), SETTINGS, None)
    (site / "floor_dimensions.csv").write_text("id,width,height\n")
    with pytest.raises(SurveyError, match="no scale"):
        write_walkable(site, tmp_path / "out", (0,), SETTINGS, None)
    assert not (tmp_path / "out").exists()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("")
    (site / "floor_dimensions.csv").write_text("id,width,height\n0,26,22\n")
    with pytest.raises(OutputError, match="not made by this command"):
        write_walkable(site, tmp_path / "mine", (0,), SETTINGS, None)
