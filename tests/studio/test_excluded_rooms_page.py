"""Rooms that walks leave out, chosen by click in the browser."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.cli.command import vislam2tag
from tests.cli.three_plans import draw
from tests.studio.running import running_studio
from tests.studio.test_from_plan_to_link import WIDE, extent_of, pixel, sound, step
from tests.studio.test_page import watched_page
from tests.views.browser import running_browser
from vislam2tag.site.site_file import read_site_file


@pytest.fixture
def survey(tmp_path: Path) -> Path:
    draw(tmp_path)
    site = tmp_path / "survey"
    assert vislam2tag("site", "init", site, "--plan", tmp_path / "second.dxf", "--floor", "1").returncode == 0
    return site


def test_the_room_at_a_place_is_left_out_and_counts_again(survey: Path) -> None:
    before = (survey / "site.toml").read_bytes()
    with running_studio(survey, "--jobs", "1") as studio:
        assert studio.enter().status_code == 204
        wish = {"floor": 1, "at": [12.0, 3.0]}
        (room,) = studio.post("/api/prepare/rooms", wish)["excluded"]
        assert room["name"] == "0.02"
        assert min(x for x, _ in room["rings"][0]) == pytest.approx(8.1, abs=0.2)
        assert read_site_file(survey).floors[0].excluded_rooms == ("0.02",)
        assert studio.post("/api/prepare/rooms", wish)["excluded"] == []
        assert (survey / "site.toml").read_bytes() == before
        answer = studio.client.post("/api/prepare/rooms", json={"floor": 1, "at": [20.0, 8.0]})
        assert (answer.status_code, answer.json()["message"][:30]) == (422, "there is no room behind a door")


@pytest.mark.slow
def test_a_click_on_a_room_leaves_it_out(survey: Path) -> None:
    with (
        running_browser() as browser,
        running_studio(survey, "--jobs", "1") as server,
        watched_page(browser, server.url, server.token, viewport=WIDE) as page,
    ):
        step(page, "Landmarks")
        page.get_by_label("Click rooms that walks leave out").check()
        left_out = page.get_by_text("Walks leave out: ")
        expect(left_out).to_have_count(0)
        for names in ("0.02", "0.02, 0.09"):
            at = (12, 3) if names == "0.02" else (28, 12)
            page.mouse.click(*pixel(page, extent_of(page, 1), *at))
            expect(left_out).to_have_text(f"Walks leave out: {names}. Plan again to use this.")
        sound(page)
        page.mouse.click(*pixel(page, extent_of(page, 1), 12, 3))
        expect(left_out).to_have_text("Walks leave out: 0.09. Plan again to use this.")
        page.get_by_label("Drop planned landmarks that were not measured").check()
        page.get_by_role("button", name="Plan the landmarks").click()
        expect(page.locator("[data-error]")).to_be_visible()
        sound(page)
    assert read_site_file(survey).floors[0].excluded_rooms == ("0.09",)
