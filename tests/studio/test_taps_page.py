"""Taps of a walk without tracker in the browser: one dragged, one typed by keyboard, one placed, one taken out."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.sessions.test_without_poses import simulated
from tests.studio.running import running_studio
from tests.studio.test_from_plan_to_link import WIDE, extent_of, pixel, sound
from tests.studio.test_page import WALKS, idle, press, watched_page
from tests.views.browser import running_browser
from vislam2tag.pipeline.labels.process import process

AT_S = "25.5"


@pytest.mark.slow
def test_taps_are_dragged_typed_placed_and_taken_out(tmp_path: Path) -> None:
    survey, labels = simulated(tmp_path / "survey"), tmp_path / "labels"
    process(survey, labels)
    with (
        running_browser() as browser,
        running_studio(survey, "--labels", str(labels), "--jobs", "1") as server,
        watched_page(browser, server.url, server.token, viewport=WIDE) as page,
    ):
        page.locator(f"{WALKS} button").first.click()
        rows = page.get_by_role("list", name="Taps").locator("li")
        expect(rows).to_have_count(4)
        sound(page)
        drags_one(page)
        types_one(page)
        places_one(page)
        expect(rows).to_have_count(5)
        takes_one_out(page)
        expect(rows).to_have_count(4)
        page.get_by_role("button", name="Undo", exact=True).click()
        expect(rows).to_have_count(5)


def drags_one(page: Page) -> None:
    """What is dragged is held until it is saved."""
    first = page.request.get(f"/api/sessions/{walk_of(page)}/taps").json()["taps"][0]
    extent = extent_of(page, 0)
    page.mouse.move(*pixel(page, extent, first["x"], first["y"]))
    page.mouse.down()
    page.mouse.move(*pixel(page, extent, first["x"] + 2, first["y"] + 1), steps=5)
    page.mouse.up()
    expect(page.get_by_label("x (m)")).not_to_have_value("")
    moved = float(page.get_by_label("x (m)").input_value()), float(page.get_by_label("y (m)").input_value())
    assert moved == pytest.approx((first["x"] + 2, first["y"] + 1), abs=0.3)
    saves(page)
    (entry,) = entries(page)
    assert (entry["at_s"], entry["x"], entry["y"]) == (first["at_s"], *moved)
    expect(page.get_by_text("The walk is placed at")).to_be_visible()


def types_one(page: Page) -> None:
    """By keyboard alone; a second change of the same tap changes its entry."""
    press(page.get_by_role("list", name="Taps").locator(".row").first)
    x = page.get_by_label("x (m)")
    x.focus()
    page.keyboard.press("Control+A")
    page.keyboard.type("7.25")
    press(page.locator("section, details").get_by_role("button", name="Show the change").last)
    expect(page.get_by_role("dialog")).to_contain_text("+x = 7.25")
    press(page.get_by_role("button", name="Save and process again"))
    idle(page)
    (entry,) = entries(page)
    assert entry["x"] == 7.25


def places_one(page: Page) -> None:
    page.locator(".time .slider").fill(AT_S)
    page.get_by_role("button", name="Add a tap at this moment").click()
    page.get_by_role("button", name="Use the centre of the map").click()
    typed = page.get_by_label("x (m)").input_value()
    page.get_by_role("button", name="Click the position on the map").click()
    box = page.locator(".map .canvas").bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + 0.4 * box["width"], box["y"] + 0.5 * box["height"])
    expect(page.get_by_label("x (m)")).not_to_have_value(typed)
    saves(page)
    assert [entry["at_s"] for entry in entries(page)][-1] == float(AT_S)


def takes_one_out(page: Page) -> None:
    page.get_by_role("list", name="Taps").locator(".row").last.click()
    page.get_by_role("button", name="Remove this tap").click()
    page.get_by_role("button", name="Save and process again").click()
    idle(page)
    assert "x" not in entries(page)[-1]


def saves(page: Page) -> None:
    page.locator("details", has_text="Taps").get_by_role("button", name="Show the change").click()
    page.get_by_role("button", name="Save and process again").click()
    idle(page)


def walk_of(page: Page) -> str:
    return str(page.request.get("/api/sessions").json()["sessions"][0]["id"])


def entries(page: Page) -> list[dict[str, float]]:
    """Values of the survey's taps in corrections.toml."""
    found = page.request.get("/api/corrections").json()["entries"]
    assert {entry["table"] for entry in found} == {"set_tap"}
    return [entry["values"] for entry in found]
