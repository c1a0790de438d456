"""What it costs to walk through a floor, from plans in any form; and what makes it be computed again."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.site.plans import drawn_floor
from tests.site.walkable.hand_made import CORRIDOR, HEIGHT_M, MARGIN_M, WIDTH_M, plan, walls
from tests.stores import Bucket
from vislam2tag.common.errors import StoreError
from vislam2tag.core.wall_costs import AT_WALL_NATS_M, FINE_M, OUTSIDE_NATS_M, WallCosts
from vislam2tag.sessions.registry import survey_files
from vislam2tag.site.georeference import Georeference
from vislam2tag.site.model import ControlPoints, Floor
from vislam2tag.site.plans.source import Extent, PlanSource
from vislam2tag.site.stored_survey import survey_at_hand
from vislam2tag.site.walkable import plan_costs as module
from vislam2tag.site.walkable.drawn_cells import drawing_mark
from vislam2tag.site.walkable.painted_cells import GREEN, RED
from vislam2tag.site.walkable.plan_costs import plan_costs, plan_fault, plan_mark, plans_of

SIDES_M = (WIDTH_M + 2 * MARGIN_M, HEIGHT_M + 2 * MARGIN_M)
MIDDLE_Y = sum(CORRIDOR) / 2


@pytest.fixture(autouse=True)
def fresh() -> Iterator[None]:
    """Nothing read before, as in a new process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "_costs", {})
        module._hashed.cache_clear()
        yield


LOWER_LEFT_M = (-MARGIN_M, -MARGIN_M)


def floor_with(path: Path, source: PlanSource | None = None) -> Floor:
    """A floor with a plan, by default an image of its extent."""
    points = ControlPoints((), np.empty((0, 2)))
    extent = Extent(width_m=SIDES_M[0], height_m=SIDES_M[1], lower_left_m=LOWER_LEFT_M)
    own = PlanSource(file=path.name, extent=extent) if source is None else source
    return Floor(1, "1", *SIDES_M, None, path, points, LOWER_LEFT_M, own)


@pytest.fixture
def image(tmp_path: Path) -> Floor:
    Image.fromarray(plan(20).image).save(tmp_path / "floorplan.png")
    return floor_with(tmp_path / "floorplan.png")


def at(costs: WallCosts | None, x: float, y: float) -> float:
    """Cost at a place, BCS metres."""
    assert costs is not None
    left, low = costs.origin_m
    return float(costs.cost[int((y - low) / FINE_M), int((x - left) / FINE_M)])


def show_the_floor(costs: WallCosts | None) -> None:
    """Its corridor and a door are free, walls and the outside are not."""
    assert at(costs, 6.0, MIDDLE_Y) == at(costs, 12.0, CORRIDOR[1]) == at(costs, 4.0, 16.0) == 0
    assert at(costs, 6.0, CORRIDOR[1]) > AT_WALL_NATS_M
    assert at(costs, -0.7, 5.0) == OUTSIDE_NATS_M


def test_missing_ink_of_the_outer_wall_does_not_let_the_outside_in(image: Floor) -> None:
    lower = np.array([[(0.0, 0.0), (9.0, 0.0)], [(13.0, 0.0), (WIDTH_M, 0.0)]])
    assert image.plan is not None
    Image.fromarray(plan(20, lines=np.concatenate((lower, walls()[1:]))).image).save(image.plan)
    costs = plan_costs(image)
    assert at(costs, 11.0, 2.0) == 0
    assert at(costs, -0.7, 5.0) == OUTSIDE_NATS_M


def test_an_image(image: Floor) -> None:
    costs = plan_costs(image)
    show_the_floor(costs)
    assert costs is not None
    assert costs.origin_m == LOWER_LEFT_M
    assert costs.cost.shape == tuple(round(side / FINE_M) for side in SIDES_M[::-1])
    assert plan_costs(image) is costs, "it is read once"


def test_a_room_that_walls_close_off_is_free(tmp_path: Path) -> None:
    Image.fromarray(plan(20, lines=walls(doors=False)).image).save(tmp_path / "closed.png")
    costs = plan_costs(floor_with(tmp_path / "closed.png"))
    assert at(costs, 4.0, 16.0) == at(costs, 12.0, MIDDLE_Y) == 0
    assert at(costs, 12.0, CORRIDOR[1]) > AT_WALL_NATS_M


def test_an_svg_drawing(tmp_path: Path) -> None:
    lines = "".join(
        f'<line x1="{x0 + 1}" y1="{21 - y0}" x2="{x1 + 1}" y2="{21 - y1}" stroke="black" stroke-width="0.2"/>'
        for (x0, y0), (x1, y1) in walls().tolist()
    )
    size = f'viewBox="0 0 {SIDES_M[0]:g} {SIDES_M[1]:g}"'
    (tmp_path / "plan.svg").write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {size}>{lines}</svg>')
    extent = Extent(width_m=SIDES_M[0], lower_left_m=LOWER_LEFT_M)
    show_the_floor(plan_costs(floor_with(tmp_path / "plan.svg", PlanSource(file="plan.svg", extent=extent))))


def boxes(*areas: tuple[str, float, float, float, float]) -> str:
    """A GeoJSON plan of rectangles with a use each."""
    features = [
        {
            "type": "Feature",
            "properties": {"use": use},
            "geometry": {
                "type": "Polygon",
                "coordinates": [[(left, low), (right, low), (right, high), (left, high), (left, low)]],
            },
        }
        for use, left, low, right, high in areas
    ]
    return json.dumps({"type": "FeatureCollection", "features": features})


SHOPS = (("outline", 0.0, 0.0, 24.0, 20.0), ("obstacle", 8.0, 6.0, 16.0, 14.0))


def geojson(folder: Path, text: str) -> Floor:
    (folder / "plan.geojson").write_text(text, encoding="utf-8")
    return floor_with(folder / "plan.geojson", PlanSource(file="plan.geojson", unit_m=1.0))


def test_a_geojson_drawing(tmp_path: Path) -> None:
    costs = plan_costs(geojson(tmp_path, boxes(*SHOPS)))
    assert at(costs, 4.0, 10.0) == 0
    assert at(costs, 12.0, 10.0) == OUTSIDE_NATS_M
    assert at(costs, 7.95, 10.0) == pytest.approx(0.8 * AT_WALL_NATS_M)


def test_a_mask_corrects_it(image: Floor) -> None:
    assert image.plan is not None
    mask = Image.new("RGB", (260, 220), "white")
    mask.paste(GREEN, (60, 60, 80, 110))  # through the wall between two rooms and the corridor, x 5 to 7
    mask.paste(RED, (200, 80, 259, 115))  # the right end of the corridor
    mask.save(image.plan.with_name("floorplan.mask.png"))
    masked = replace(image, mask=image.plan.with_name("floorplan.mask.png"))
    costs = plan_costs(masked)
    assert at(costs, 6.0, CORRIDOR[1]) == 0
    assert at(costs, 21.0, MIDDLE_Y) == OUTSIDE_NATS_M
    assert at(costs, 10.0, MIDDLE_Y) == 0
    show_the_floor(plan_costs(image))


def test_plans_that_cannot_be_used_give_none(tmp_path: Path, image: Floor) -> None:
    (tmp_path / "broken.png").write_bytes(b"no image")
    Image.new("RGB", (260, 220), "white").save(tmp_path / "blank.png")
    assert plan_costs(floor_with(tmp_path / "broken.png")) is None
    assert plan_costs(floor_with(tmp_path / "blank.png")) is None
    assert plan_costs(floor_with(tmp_path / "missing.png")) is None
    assert plan_costs(replace(image, plan=None)) is None
    assert plan_costs(replace(image, width_m=None, source=None)) is None, "an image without a size"
    (tmp_path / "mask.png").write_bytes(b"no image")
    assert plan_costs(replace(image, mask=tmp_path / "mask.png")) is None


def test_the_fault_of_a_plan_is_reported(tmp_path: Path, image: Floor, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "broken.png").write_bytes(b"no image")
    Image.new("RGB", (260, 220), "white").save(tmp_path / "blank.png")
    assert (plan_fault(floor_with(tmp_path / "broken.png")) or "").startswith("broken.png: the plan of floor 1 ")
    assert "all its pixels have the same colour" in (plan_fault(floor_with(tmp_path / "blank.png")) or "")
    assert plan_fault(floor_with(tmp_path / "missing.png")) == "missing.png cannot be opened"
    assert plan_fault(replace(image, plan=None)) is None
    assert plan_fault(image) is None
    module._costs.clear()
    monkeypatch.setitem(sys.modules, "cv2", None)
    monkeypatch.delitem(sys.modules, "vislam2tag.site.walkable.painted_cells")
    monkeypatch.delitem(sys.modules, "vislam2tag.site.walkable.space")
    assert plan_fault(image) == "this needs cv2: pip install 'vislam2tag[prepare]'"


def test_each_floor_with_a_plan_is_read_when_it_is_asked_for(
    image: Floor, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[int] = []

    def counted(floor: Floor) -> WallCosts | None:
        read.append(floor.number)
        return plan_costs(floor)

    monkeypatch.setattr(module, "plan_costs", counted)
    plans = plans_of((image, replace(image, number=2), replace(image, number=3, plan=None)))
    assert [one.number for one in plans] == [1, 2]
    assert read == []
    assert plans[1].costs is plans[1].costs
    assert read == [2]


def test_the_mark_follows_all_that_costs_follow_from(image: Floor) -> None:
    assert image.plan is not None
    source = PlanSource(file="floorplan.png", extent=Extent(width_m=26.0))
    other = image.plan.with_name("other.png")
    Image.new("RGB", (26, 22), GREEN).save(other)
    changed = [
        image,
        replace(image, width_m=30.0),
        replace(image, height_m=30.0),
        replace(image, lower_left_m=(0.0, 0.0)),
        replace(image, source=source),
        replace(image, source=None),
        replace(image, georeference=Georeference(latitude_deg=48.0, longitude_deg=9.0)),
        replace(image, mask=other),
    ]
    marks = [plan_mark(floor) for floor in changed]
    assert None not in marks
    assert len(set(marks)) == len(marks)
    assert plan_mark(replace(image, name="Ground", elevation_m=3.0)) == marks[0]
    assert plan_mark(replace(image, plan=None)) is None


@pytest.mark.parametrize("in_place", [True, False])
def test_a_plan_of_the_same_size_and_time_is_noticed(image: Floor, in_place: bool) -> None:
    """Written over, or replaced by a copy that keeps its time, as rsync does."""
    assert image.plan is not None
    before, time_ns = plan_mark(image), image.plan.stat().st_mtime_ns
    content = bytearray(image.plan.read_bytes())
    content[-20] ^= 1
    written = image.plan if in_place else image.plan.with_name("copy.png")
    written.write_bytes(content)
    os.utime(written, ns=(time_ns, time_ns))
    written.replace(image.plan)
    assert plan_mark(image) != before


def test_a_folder_is_a_plan_that_changes_with_its_files(tmp_path: Path) -> None:
    """An unpacked IMDF archive, one file of which is written over with its size and times kept."""
    archive = drawn_floor.imdf(tmp_path)
    floor = drawn_floor.floor_with(archive, {"level": "L0"}, drawn_floor.HERE)
    marks = [plan_mark(floor), drawing_mark(floor)]
    costs = plan_costs(floor)
    assert costs is not None
    unit = archive / "unit.geojson"
    time_ns = unit.stat().st_mtime_ns
    unit.write_bytes(unit.read_bytes().replace(b'"column"', b'"kiosk!"'))
    os.utime(unit, ns=(time_ns, time_ns))
    marks += [plan_mark(floor), drawing_mark(floor)]
    assert plan_costs(floor) is not costs
    (archive / "opening.geojson").rename(archive / "fixture.geojson")
    marks += [plan_mark(floor), drawing_mark(floor)]
    assert None not in marks
    assert len(set(marks)) == 6


def test_a_plan_is_hashed_once_for_many_sessions(image: Floor, monkeypatch: pytest.MonkeyPatch) -> None:
    before = plan_mark(image)
    monkeypatch.setattr(module, "file_mark", lambda path: "another")
    assert plan_mark(image) == before


def stored_site(folder: Path) -> Path:
    """A survey folder of one floor whose plan is an image with a mask."""
    own = folder / "floor_1"
    own.mkdir(parents=True)
    Image.fromarray(plan(20).image).save(own / "floorplan.png")
    mask = Image.new("RGB", (26, 22), "white")
    mask.paste(RED, (20, 8, 25, 12))
    mask.save(own / "floorplan.mask.png")
    (folder / "floor_dimensions.csv").write_text(f"id,width,height\n1,{SIDES_M[0]},{SIDES_M[1]}\n")
    return folder


def test_a_worker_without_the_folder_that_was_opened_reads_image_and_mask(s3: Bucket, tmp_path: Path) -> None:
    local = stored_site(tmp_path / "site")
    (here,) = survey_files(local, 0.02, walked=False).site.floors
    with survey_at_hand(s3.upload(local, "plans")) as root:
        (there,) = survey_files(root, 0.02, walked=False).site.floors
    assert there.plan is not None
    assert there.mask is not None
    assert not there.plan.exists(), "as on another machine"
    assert not there.mask.exists()
    assert plan_mark(there) == plan_mark(here) is not None
    expected = plan_costs(here)
    assert expected is not None
    module._costs.clear()
    found = plan_costs(there)
    assert found is not None
    np.testing.assert_array_equal(found.cost, expected.cost)
    module._costs.clear()
    s3.store("plans").put("floor_1/floorplan.png", b"another")
    with pytest.raises(StoreError, match=r"s3://bucket/plans/floor_1/floorplan.png: was changed during the run"):
        plan_costs(there)
