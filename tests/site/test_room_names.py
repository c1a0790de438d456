"""Names of rooms from the survey's table, and which texts of a plan are names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vislam2tag.site.floors import RoomName, names_on_plan, read_room_names, rooms_of
from vislam2tag.site.plan_formats.svg import svg_texts
from vislam2tag.site.plans.source import FloorPlan, PlanPolygon, PlanText, Use


def written(root: Path, text: str) -> tuple[Path, Path | None]:
    (root / "floor_2").mkdir()
    (root / "floor_2" / "rooms.csv").write_text(text)
    return root, rooms_of(root / "floor_2")


@pytest.mark.parametrize(
    "text", ["name,x,y\n2.114,3.5,4\nLab,1,2\n", "Raum;Rechtswert;Hochwert\n2.114;3,5;4,0\nLab;1,0;2,0\n"]
)
def test_a_table_of_the_survey_names_rooms(tmp_path: Path, text: str) -> None:
    names, findings = read_room_names(*written(tmp_path, text))
    assert names == [RoomName("2.114", (3.5, 4.0)), RoomName("Lab", (1.0, 2.0))]
    assert "malformed_lines" not in {finding.kind for finding in findings}
    assert rooms_of(tmp_path / "floor_3") is None
    assert read_room_names(tmp_path, None) == ([], [])


def test_rows_without_a_place_are_left_out_and_told(tmp_path: Path) -> None:
    names, findings = read_room_names(*written(tmp_path, "name,x,y\n2.114,3.5,4\nLab,left,2\n"))
    assert len(names) == 1
    assert [(one.kind, one.file, one.lines) for one in findings] == [("malformed_lines", "floor_2/rooms.csv", (3,))]


def test_a_table_without_places_says_what_it_needs(tmp_path: Path) -> None:
    names, (finding,) = read_room_names(*written(tmp_path, "name,floor\n2.114,2\n"))
    assert (names, finding.kind) == ([], "malformed_header")
    assert "it lacks x and y" in finding.message


def test_dimensions_and_sentences_are_no_names_and_numbers_come_first() -> None:
    texts = ("Office", "24,5 m\u00b2", "3.20 m", "2.114", "Only with the written consent of the house owner", " ")
    plan = FloorPlan(
        (0.0, 9.0, 0.0, 9.0),
        np.zeros((1, 1, 3), np.uint8),
        (PlanPolygon(np.array([(0, 0), (2, 0), (2, 2), (0, 2)], dtype=float), (), Use.WALKABLE, "Foyer"),),
        texts=tuple(PlanText(text, (1.0, 1.0)) for text in texts),
    )
    assert [one.name for one in names_on_plan(plan)] == ["Foyer", "2.114", "Office"]


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
