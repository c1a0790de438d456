"""A survey with a ``site.toml`` is read by it.

Names of rooms from the survey's table, and which texts of a plan are names.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.site.plans import drawn_floor
from tests.site.plans.hostile import drawings
from tests.site.site import write_survey
from vislam2tag.site.discover import read_site, site_files
from vislam2tag.site.floors import ROOMS_FILE, file_in, names_on_plan, read_room_names
from vislam2tag.site.model import Floor
from vislam2tag.site.plan_formats.svg import svg_texts
from vislam2tag.site.plans.source import FloorPlan, PlanPolygon, PlanText, Use

SITE = """
[georeference]
latitude_deg = 50.0
longitude_deg = 6.0
bearing_deg = 20.0

[[floors]]
number = 1
name = "Ground"
elevation_m = 1.5

[floors.plan]
file = "plan.png"
extent = { width_m = 20.0, height_m = 10.0, lower_left_m = [-3.0, 4.0] }

[[floors]]
number = 2
site_T_bcs = { x_m = 100.0, angle_deg = 90.0 }
"""


def site_with(root: Path, text: str = SITE) -> Path:
    root.mkdir()
    drawn_floor.png(root)
    (root / "site.toml").write_text(text)
    return root


def floors_of(root: Path) -> dict[int, Floor]:
    return {floor.number: floor for floor in read_site(root)[0].floors}


def test_floors_are_as_the_file_says(tmp_path: Path) -> None:
    root = site_with(tmp_path / "site")
    ground, upper = floors_of(root).values()
    assert (ground.name, ground.elevation_m, ground.plan) == ("Ground", 1.5, root / "plan.png")
    assert ground.extent_m == (-3.0, 17.0, 4.0, 14.0)
    assert ground.corners_m.tolist() == [[-3.0, 4.0], [17.0, 14.0]]
    assert ground.georeference is not None
    assert ground.georeference.bearing_deg == 20.0
    assert (upper.name, upper.plan, upper.extent_m) == ("Floor 2", None, None)
    assert upper.georeference is not None
    assert upper.georeference.bearing_deg == pytest.approx(-70.0, abs=2e-3)
    assert site_files(root) == [root / "plan.png", root / "site.toml"]


def test_the_file_comes_before_the_published_layout(tmp_path: Path) -> None:
    root = write_survey(tmp_path)
    drawn_floor.png(root)
    (root / "site.toml").write_text(SITE)
    site, findings = read_site(root)
    assert [floor.number for floor in site.floors] == [1, 2, 4]
    assert site.floor(1).width_m == 20.0
    assert len(site.landmarks.on_floor(1).ids) == 2
    assert len(site.floor(1).control_points.ids) == 2
    told = {(finding.kind, finding.file): finding.message for finding in findings}
    assert "site.toml is read instead" in told["second_file", "floor_dimensions.csv"]
    assert "floor 4 is not in site.toml: it has no plan; add it there" in told["floor_without_size", "floor_4"]
    assert ("missing_file", "floor_2/marker_dict.csv") in told


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        ('file = "plan.png"', "the plan has no scale: specify extent"),
        ('file = "gone.png"\nextent = { width_m = 1.0, height_m = 1.0 }', "the plan does not exist"),
    ],
)
def test_a_plan_that_cannot_be_used_is_a_finding(tmp_path: Path, plan: str, message: str) -> None:
    root = site_with(tmp_path / "site", f"[[floors]]\nnumber = 1\n[floors.plan]\n{plan}\n")
    site, findings = read_site(root)
    assert site.floor(1).extent_m is None
    (odd,) = [finding for finding in findings if finding.kind == "unreadable_plan"]
    assert message in odd.message


@pytest.mark.parametrize("what", ["nested groups", "damaged deflate", "integers beyond floats", "size beyond floats"])
def test_a_hostile_plan_is_a_finding(tmp_path: Path, what: str) -> None:
    name, content = next((name, content) for each, name, content in drawings() if each == what)
    root = site_with(tmp_path / "site", SITE.replace("plan.png", name))
    (root / name).write_bytes(content)
    site, findings = read_site(root)
    assert ("unreadable_plan", name) in [(finding.kind, finding.file) for finding in findings]
    assert site.floors[0].extent_m is None


def written(root: Path, text: str) -> tuple[Path, Path | None]:
    (root / "floor_2").mkdir()
    (root / "floor_2" / "rooms.csv").write_text(text)
    return root, file_in(root / "floor_2", ROOMS_FILE)


@pytest.mark.parametrize(
    "text", ["name,x,y\n2.114,3.5,4\nLab,1,2\n", "Raum;Rechtswert;Hochwert\n2.114;3,5;4,0\nLab;1,0;2,0\n"]
)
def test_a_table_of_the_survey_names_rooms(tmp_path: Path, text: str) -> None:
    names, findings = read_room_names(*written(tmp_path, text))
    assert names == [PlanText("2.114", (3.5, 4.0)), PlanText("Lab", (1.0, 2.0))]
    assert "malformed_lines" not in {finding.kind for finding in findings}
    assert file_in(tmp_path / "floor_3", ROOMS_FILE) is None
    assert read_room_names(tmp_path, None) == ([], [])


def test_rows_without_a_place_are_left_out_and_told(tmp_path: Path) -> None:
    names, findings = read_room_names(*written(tmp_path, "name,x,y\n2.114,3.5,4\nLab,left,2\n"))
    assert len(names) == 1
    assert [(one.kind, one.file, one.lines) for one in findings] == [("malformed_lines", "floor_2/rooms.csv", (3,))]


def test_a_table_without_places_says_what_it_needs(tmp_path: Path) -> None:
    names, (finding,) = read_room_names(*written(tmp_path, "name,floor\n2.114,2\n"))
    assert (names, finding.kind) == ([], "malformed_header")
    assert "it does not contain x and y" in finding.message


def test_dimensions_and_sentences_are_no_names_and_numbers_come_first() -> None:
    texts = ("Office", "24,5 m\u00b2", "3.20 m", "2.114", "Only with the written consent of the house owner", " ")
    plan = FloorPlan(
        (0.0, 9.0, 0.0, 9.0),
        np.zeros((1, 1, 3), np.uint8),
        (PlanPolygon(np.array([(0, 0), (2, 0), (2, 2), (0, 2)], dtype=float), (), Use.WALKABLE, "Foyer"),),
        texts=tuple(PlanText(text, (1.0, 1.0)) for text in texts),
    )
    assert [one.text for one in names_on_plan(plan)] == ["Foyer", "2.114", "Office"]


def test_texts_of_an_svg_stand_where_its_transforms_put_them() -> None:
    drawing = (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="10 0 100 50"><defs><text>no</text></defs>'
        '<g transform="translate(10,5) scale(2)"><text x="5" y="10"><tspan>2.</tspan><tspan>114</tspan></text></g>'
        '<text transform="rotate(90 20 20)" x="30" y="20">up</text></svg>'
    )
    first, second = svg_texts(drawing, 50.0)
    assert (first.text, first.place_m) == ("2. 114", (10.0, 25.0))
    assert second.text == "up"
    assert second.place_m == pytest.approx((10.0, 20.0))


@pytest.mark.parametrize("text", ["<svg", '<!DOCTYPE svg [<!ENTITY a "b">]><svg><text>&a;</text></svg>'])
def test_what_is_no_plain_xml_has_no_texts(text: str) -> None:
    assert svg_texts(text, 1.0) == ()
