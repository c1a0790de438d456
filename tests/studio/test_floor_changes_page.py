"""Floors that are renamed, renumbered, resized and removed in the studio."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.cli.command import vislam2tag
from tests.cli.three_plans import draw
from tests.studio.running import running_studio
from tests.studio.test_from_plan_to_link import WIDE, sound, step
from tests.studio.test_page import watched_page
from tests.surveys import bytes_of
from tests.views.browser import running_browser
from vislam2tag.site.discover import read_site
from vislam2tag.site.site_file import read_site_file


@pytest.fixture
def survey(tmp_path: Path) -> Path:
    """Floors 1, with planned landmarks, and 2."""
    draw(tmp_path)
    site = tmp_path / "survey"
    for options in (("second.dxf", "--floor", "1"), ("first.pdf", "--floor", "2", "--scale", "1:200")):
        done = vislam2tag("site", "init", site, "--plan", tmp_path / options[0], *options[1:])
        assert done.returncode == 0, done.stderr
    (site / "floor_1" / "marker_dict.csv").write_text("id,x,y\n1,12.0,7.0\n2,28.0,9.0\n")
    states = "id,state,source,x,y\n1,planned,plan,12.0,7.0\n2,planned,plan,28.0,9.0\n"
    (site / "floor_1" / "landmark_states.csv").write_text(states)
    return site


def test_a_floor_is_changed_as_by_the_command_line(survey: Path) -> None:
    with running_studio(survey, "--jobs", "1") as studio:
        assert studio.enter().status_code == 204
        wish = {"floor": 1, "number": 3, "name": "Upper", "elevation_m": 7.5, "width_m": 44.0}
        notes = studio.post("/api/prepare/floors/change", wish)["notes"]
        assert [note.partition(":")[0] for note in notes] == [
            "2 landmarks of floor 1 were planned for the plan as it was",
            "sheets and plans that were made before say floor 1",
        ]
        floor = studio.get("/api/survey")["floors"][1]
        assert (floor["number"], floor["name"], floor["elevation_m"]) == (3, "Upper", 7.5)
        assert floor["extent_m"] == pytest.approx((0, 44, 0, 17.6), abs=0.01)
        assert read_site(survey)[0].landmarks.floor.tolist() == [3, 3]
        (survey / "floor_2" / "phone" / "walk").mkdir(parents=True)
        before = bytes_of(survey)
        refused = [
            ({"floor": 2, "name": "Lower", "number": 3}, "already has a floor 3"),
            ({"floor": 2, "name": "Lower", "number": 4}, "floor 2 has 1 recorded walk"),
            ({"floor": 2, "width_m": 0.01}, "width_m: "),
            ({"floor": 7, "name": "None"}, "--floor 7: "),
        ]
        answers = [studio.client.post("/api/prepare/floors/change", json=asked) for asked, _ in refused]
        for answer, (_, message) in zip(answers, refused, strict=True):
            assert (answer.status_code, message in answer.json()["message"]) == (422, True), answer.text
        assert "floor 2 has 1 recorded walk" in studio.client.delete("/api/prepare/floors/2").json()["message"]
        assert bytes_of(survey) == before
        studio.post("/api/prepare/floors/change", {"floor": 3, "number": -1})
        notes = studio.client.delete("/api/prepare/floors/-1").json()["notes"]
        assert f"its files are kept in {survey / 'removed_floor_-1'}" in notes[1]
        assert [floor["number"] for floor in studio.get("/api/survey")["floors"]] == [2]


@pytest.mark.slow
def test_a_floor_is_renamed_renumbered_and_removed_by_clicks(survey: Path) -> None:
    with (
        running_browser() as browser,
        running_studio(survey, "--jobs", "1") as server,
        watched_page(browser, server.url, server.token, viewport=WIDE) as page,
    ):
        step(page, "Plan and scale")
        page.get_by_role("button", name="Change Floor 1").click()
        page.get_by_label("Name", exact=True).fill("Upper")
        page.get_by_label("Elevation (m)").fill("3.6")
        sound(page)
        page.get_by_role("button", name="Save", exact=True).click()
        expect(page.get_by_role("heading", name="Floor 1: Upper")).to_be_visible()
        part = read_site_file(survey).floors[0]
        assert (part.name, part.elevation_m, part.plan and part.plan.extent) == ("Upper", 3.6, None)

        page.get_by_role("button", name="Change Floor 1: Upper").click()
        page.get_by_label("Floor", exact=True).fill("5")
        page.get_by_label("Width of the plan (m)").fill("44")
        page.get_by_role("button", name="Save", exact=True).click()
        expect(page.get_by_role("heading", name="Floor 5: Upper")).to_be_visible()
        expect(page.get_by_text("sheets and plans that were made before say floor 1")).to_be_visible()
        expect(page.locator(".map-tools select").first).to_have_value("5")
        assert [part.number for part in read_site_file(survey).floors] == [2, 5]
        assert read_site(survey)[0].floor(5).extent_m == pytest.approx((0, 44, 0, 17.6), abs=0.01)
        assert read_site(survey)[0].landmarks.floor.tolist() == [5, 5]

        (survey / "floor_2" / "phone" / "walk").mkdir(parents=True)
        before = (survey / "site.toml").read_bytes()
        page.get_by_role("button", name="Remove Floor 2").click()
        page.get_by_role("button", name="Remove floor 2", exact=True).click()
        expect(page.get_by_role("alert")).to_contain_text(
            "floor 2 has 1 recorded walk, and recordings are never changed"
        )
        page.get_by_role("alert").get_by_role("button", name="Close").click()
        page.get_by_role("button", name="Keep it").click()
        assert (survey / "site.toml").read_bytes() == before

        page.get_by_role("button", name="Remove Floor 5: Upper").click()
        expect(page.get_by_text("No file is deleted")).to_be_visible()
        sound(page)
        page.get_by_role("button", name="Remove floor 5", exact=True).click()
        expect(page.get_by_text("its files are kept in")).to_be_visible()
        expect(page.locator(".map-tools select").first).to_have_value("2")
        assert [part.number for part in read_site_file(survey).floors] == [2]
        assert (survey / "removed_floor_5" / "marker_dict.csv").exists()
