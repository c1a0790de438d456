"""Plans that cannot be used are refused in one sentence that says what to do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pydantic import ValidationError

from tests.mutations import mutate
from tests.site.plans import drawn_floor
from tests.site.plans.drawn_floor import EXTENT, collection, feature, floor_with
from tests.site.site import plan_bytes
from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.folder import Folder
from vislam2tag.site.plans.drawing import plan_suffixes
from vislam2tag.site.plans.images import load_plan
from vislam2tag.site.plans.load import floor_plan, plan_extent, plan_file
from vislam2tag.site.plans.source import Extent, PlanSource

SQUARE = [[0.0, 0.0], [30.0, 0.0], [30.0, 20.0], [0.0, 20.0], [0.0, 0.0]]


def test_a_plan_without_scale(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"plan.png: the plan of floor 1 has no scale: specify extent = "):
        floor_plan(floor_with(drawn_floor.png(tmp_path), {}))


def test_a_floor_without_plan_or_file(tmp_path: Path) -> None:
    floor = floor_with(drawn_floor.png(tmp_path), {"extent": EXTENT})
    (tmp_path / "plan.png").unlink()
    with pytest.raises(
        SurveyError, match=r"plan.png: the plan of floor 1 does not exist: correct its name, or add the file"
    ):
        floor_plan(floor)
    assert plan_file(floor, Folder.at(tmp_path / "drawn")) == tmp_path / "plan.png"


@pytest.mark.parametrize("colour", ["black", "white"])
def test_an_image_of_one_colour(tmp_path: Path, colour: str) -> None:
    Image.new("RGB", (60, 40), colour).save(tmp_path / "plan.png")
    with pytest.raises(SurveyError, match="shows nothing: all its pixels have the same colour"):
        floor_plan(floor_with(tmp_path / "plan.png", {"extent": EXTENT}))


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("plan.xyz", b"", "has an unknown format; plans end with .bmp, .dxf, .geojson"),
        ("plan.dwg", b"AC1032", "is a DWG file, which cannot be read; save it as DXF"),
        ("plan.png", b"no image", "cannot be read as an image"),
        ("plan.svg", b"<html/>", "cannot be read as SVG"),
        ("plan.svg", b"<svg xmlns='http://www.w3.org/2000/svg' width='50%'/>", "has no size"),
        ("plan.svg", b"<svg width='10' height='10' viewBox='0 0 2 1'/>", "a different aspect ratio than its viewBox"),
        ("plan.svg", b"<svg viewBox='0 0 2 1'><oops></svg>", "cannot be read as SVG"),
        ("plan.pdf", b"%PDF-1.4 oops", "cannot be read as PDF"),
        ("plan.dxf", b"oops", "cannot be read as DXF|holds no line"),
        ("plan.geojson", b"{", "is not JSON"),
        ("plan.geojson", b"[]", "is not GeoJSON: expected a FeatureCollection"),
        ("plan.geojson", b'{"features": [3]}', "is not GeoJSON"),
        ("plan.geojson", collection().encode(), "contains nothing to draw"),
        ("plan.geojson", collection(feature("Polygon", [])).encode(), "has a polygon without coordinates"),
        ("plan.geojson", collection(feature("Polygon", [SQUARE[:2]])).encode(), "fewer than three corners"),
        ("plan.geojson", collection(feature("Polygon", [[["a", 1]]])).encode(), "coordinates that are not numbers"),
        ("plan.geojson", collection(feature("Polygon", [SQUARE], use="roof")).encode(), "with the use 'roof', which"),
        ("plan.geojson", collection(feature("LineString", [[0, 0]], use="wall")).encode(), "fewer than two points"),
        ("plan.geojson", collection(feature("LineString", [[0, 0], [9, 0]], use="wall")).encode(), "spans no area"),
    ],
)
def test_damaged_and_unknown_files(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(SurveyError, match=message):
        floor_plan(floor_with(tmp_path / name, {"extent": EXTENT}))


def test_a_page_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"has no page 3: it has 2; correct page"):
        floor_plan(floor_with(drawn_floor.pdf(tmp_path), {"page": 3, "extent": EXTENT}))


def test_layers_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"has no layer Waende; there are: A-DIM, A-WALL"):
        floor_plan(floor_with(drawn_floor.dxf(tmp_path), {"layers": ["Waende"]}))


def test_levels_that_are_not_told(tmp_path: Path) -> None:
    plan = drawn_floor.imdf(tmp_path)
    with pytest.raises(SurveyError, match=r"has the levels 0, 1: choose one with --level"):
        floor_plan(floor_with(plan, {}))
    with pytest.raises(SurveyError, match=r"has no level 7; there are: 0, 1"):
        floor_plan(floor_with(plan, {"level": "7"}))
    (plan / "unit.geojson").write_text("oops")
    with pytest.raises(SurveyError, match=r"contains unit.geojson, which is not JSON"):
        floor_plan(floor_with(plan, {"level": "0"}))


def test_archives_that_are_none(tmp_path: Path) -> None:
    plan = drawn_floor.imdf(tmp_path, archive=True)
    plan.write_bytes(plan.read_bytes()[:100])
    with pytest.raises(SurveyError, match="has an unknown format"):
        floor_plan(floor_with(plan, {}))


def test_wrong_reference_systems(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="EPSG:999999, which is not a known reference system"):
        floor_plan(floor_with(drawn_floor.geojson(tmp_path), {"epsg": 999999}))


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({"extent": EXTENT, "unit_m": 1.0}, "extent and unit_m are given; keep one of them"),
        ({"points": [{"plan": (0, 0), "bcs_m": (0, 0)}] * 2}, "points are identical"),
        (
            {"points": [{"plan": (0, 0), "bcs_m": (5, 0)}, {"plan": (9, 0), "bcs_m": (5, 0)}]},
            "points are identical",
        ),
        ({"distance": {"from": (1, 1), "to": (1, 1), "metres": 3.0}}, "from and to are the same point"),
        ({"extent": {"width_m": 0.0, "height_m": 3.0}}, "greater than or equal to 1"),
        ({"extent": {"width_m": float("nan"), "height_m": 3.0}}, "less than or equal"),
        ({"page": 0}, "greater than or equal to 1"),
        ({"file": "../other/plan.png"}, "is outside the survey; copy it into the survey"),
        ({"file": "/plan.png"}, "is outside the survey"),
        ({"size": 100}, "Extra inputs"),
        ({"extent": {"lower_left_m": (0.0, 0.0)}}, "specify width_m, height_m, or both"),
    ],
)
def test_entries_that_cannot_be(entries: dict[str, object], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        PlanSource.model_validate({"file": "plan.png", **entries})


def test_every_format_is_found() -> None:
    assert {".png", ".jpg", ".svg", ".pdf", ".geojson", ".zip", ".dxf"} <= set(plan_suffixes())


def test_a_jpeg_is_decoded_small_but_no_smaller_than_wanted(tmp_path: Path) -> None:
    Image.new("RGB", (1600, 800), "red").save(tmp_path / "plan.jpg")
    assert load_plan(tmp_path / "plan.jpg", 1).size == (200, 100)
    assert load_plan(tmp_path / "plan.jpg", 400).size == (800, 400)
    assert load_plan(tmp_path / "plan.jpg", 3000).size == (1600, 800)


@pytest.mark.parametrize("content", [b"", b"no image", b"%!PS-Adobe-3.0 EPSF-3.0\n", plan_bytes("JPEG")[:-60]])
def test_what_is_no_image_is_one_kind_of_error(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "plan.jpg").write_bytes(content)
    with pytest.raises(OSError, match=r"^cannot be read as an image$"):
        load_plan(tmp_path / "plan.jpg", 1)


def test_large_plans_are_loaded_and_absurd_ones_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Image.new("1", (300, 200)).save(tmp_path / "plan.png")
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 40_000)
    assert load_plan(tmp_path / "plan.png", 1).size == (300, 200)
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 20_000)
    with pytest.raises(OSError, match=r"^has more than 100 million pixels"):
        load_plan(tmp_path / "plan.png", 1)


@pytest.mark.parametrize("kind", ["JPEG", "PNG", "TIFF"])
def test_damaged_images_raise_nothing_else(tmp_path: Path, kind: str) -> None:
    clean, rng = plan_bytes(kind), np.random.default_rng(5)
    outcomes = set()
    for _ in range(500):
        (tmp_path / "plan.jpg").write_bytes(mutate(clean, rng))
        try:
            load_plan(tmp_path / "plan.jpg", 1)
            outcomes.add("loaded")
        except OSError as error:
            outcomes.add(str(error))
    assert "cannot be read as an image" in outcomes


def test_an_area_beyond_a_picture_is_refused(tmp_path: Path) -> None:
    Image.new("RGB", (200, 100), "white").save(tmp_path / "plan.png")
    source = PlanSource(file="plan.png", area=(10, 20, 200.4, 100), extent=Extent(width_m=20))
    assert plan_extent(tmp_path / "plan.png", source, None)[1] == pytest.approx(20)
    beyond = source.model_copy(update={"area": (10, 20, 240, 100)})
    with pytest.raises(OSError, match="shows only 0,0,200,100, but area reaches up to 40 beyond its edges"):
        plan_extent(tmp_path / "plan.png", beyond, None)
