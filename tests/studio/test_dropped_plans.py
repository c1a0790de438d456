"""Plans of every other kind dropped in the browser and scaled without a mouse, and walls painted with keys alone."""

from __future__ import annotations

import base64
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.site.plans import drawn_floor
from tests.studio.running import running_studio
from tests.studio.test_from_plan_to_link import DROPPED, WIDE, step
from tests.studio.test_page import press, watched_page
from tests.views.browser import running_browser

HERE = drawn_floor.HERE
GEOREFERENCE = f"""
[georeference]
latitude_deg = {HERE.latitude_deg}
longitude_deg = {HERE.longitude_deg}
bearing_deg = {HERE.bearing_deg}
"""
PLANS: dict[str, tuple[Callable[[Path], Path], int | None]] = {
    "svg": (drawn_floor.svg, 80),
    "image": (drawn_floor.png, 200),
    "geojson": (drawn_floor.geojson, None),
    "imdf": (partial(drawn_floor.imdf, archive=True), None),
}
"""How each is drawn, how wide it is in its own units; None: in degrees, which the survey's georeference scales."""


@pytest.mark.slow
def test_a_plan_of_every_kind_becomes_a_floor_whose_walls_are_painted_with_keys(tmp_path: Path) -> None:
    survey = tmp_path / "survey"
    survey.mkdir()
    with (
        running_browser() as browser,
        running_studio(survey, "--jobs", "1") as server,
        watched_page(browser, server.url, server.token, viewport=WIDE) as page,
    ):
        for number, (draw, wide) in enumerate(PLANS.values(), start=1):
            if number == 3:
                with (survey / "site.toml").open("a", encoding="utf-8") as file:
                    file.write(GEOREFERENCE)
            drops(page, draw(tmp_path), wide)
            floor = page.request.get("/api/survey").json()["floors"][-1]
            left, right, low, high = floor["extent_m"]
            assert (floor["number"], (right - left) / (high - low)) == (number, pytest.approx(2, rel=0.05))
            assert right - left == pytest.approx(drawn_floor.WIDTH_M, rel=0.05)
        paints_walls(page)


def drops(page: Page, path: Path, wide: int | None) -> None:
    """One without a scale has its two points set by keys: in the middle of the map, which arrows move."""
    content = base64.b64encode(path.read_bytes()).decode()
    page.locator(".drop").dispatch_event("drop", {"dataTransfer": page.evaluate_handle(DROPPED, [path.name, content])})
    expect(page.get_by_text(path.name)).to_be_visible()
    if wide is None:
        expect(page.get_by_label("Scale")).to_have_value("file")
        if path.suffix == ".zip":  # its other level shows that one can be chosen
            expect(page.get_by_label("Level")).to_have_value("0")
            page.get_by_label("Level").select_option("1")
            page.get_by_label("Level").select_option("0")
    else:
        sets_two_points(page, wide)
    press(page.get_by_role("button", name="Add the floor"))
    expect(page.locator(".drop")).to_be_visible()


def sets_two_points(page: Page, wide: int) -> None:
    """The distance that is typed follows from where the page says that they are."""
    middle = page.get_by_role("button", name="Set a point at the centre of the map")
    press(middle)
    move(page, "ArrowRight")
    press(middle)
    told = page.get_by_text("in the plan’s units")
    expect(told).to_have_count(2)
    first, second = (float(text.split(": ")[1].split(", ")[0]) for text in told.all_inner_texts())
    page.get_by_label("Distance (m)").focus()
    page.keyboard.type(f"{drawn_floor.WIDTH_M * (second - first) / wide:.4f}")


def move(page: Page, key: str) -> None:
    """Move the map, and wait until it has come to rest."""
    page.locator(".map .canvas").focus()
    page.keyboard.press(key)
    page.wait_for_timeout(400)


def paints_walls(page: Page) -> None:
    """A brush from corner to corner, and a polygon, each corner in the middle of the map; taken back and done again."""
    step(page, "Walls and walkable space")
    area = page.locator("[data-area]")
    expect(area).to_contain_text("are walkable.")
    whole = area.get_attribute("data-area") or ""
    for tool, keys in (("brush", ["ArrowUp"]), ("polygon", ["ArrowRight", "ArrowUp"])):
        page.get_by_label("Tool").focus()
        page.keyboard.type(tool)
        expect(page.get_by_label("Tool")).to_have_value(tool)
        corner = page.get_by_role("button", name="Set a corner at the centre")
        press(corner)
        for key in keys:
            move(page, key)
            press(corner)
        before = area.get_attribute("data-area") or ""
        press(page.get_by_role("button", name="Finish"))
        expect(area).not_to_have_attribute("data-area", before)
    assert float(area.get_attribute("data-area") or "nan") < float(whole)
    for _ in range(2):
        press(page.locator("details.step").get_by_role("button", name="Undo"))
    expect(area).to_have_attribute("data-area", whole)
    press(page.locator("details.step").get_by_role("button", name="Redo"))
    expect(area).not_to_have_attribute("data-area", whole)
