"""Plan, walks, one tap, labels: in the browser, from a plan and a walk without landmarks to labels that are right."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.studio.placed_survey import AMBIGUOUS, FLOOR, true_place, write_unplaced_survey
from tests.studio.running import running_studio
from tests.studio.test_from_plan_to_link import WIDE, extent_of, pixel, sound
from tests.studio.test_page import WALKS, errors_of, idle, watched_page
from tests.views.browser import running_browser

NEAR_M = 1.0
"""95 % of the frames of a walk that its shape and one tap place are this exact."""


@pytest.mark.slow
def test_one_tap_on_the_plan_labels_a_walk_that_fits_several_places(tmp_path: Path) -> None:
    survey, labels = write_unplaced_survey(tmp_path, *AMBIGUOUS), tmp_path / "labels"
    with (
        running_browser() as browser,
        running_studio(survey, "--labels", str(labels), "--jobs", "1") as server,
        watched_page(browser, server.url, server.token, viewport=WIDE) as page,
    ):
        page.get_by_role("button", name="Process 1 walk").click()
        idle(page)
        shows_that_a_tap_is_needed(page)
        says_it_in_german(page)
        taps_the_true_place(page, survey)
        expect(page.get_by_text("of the walk is placed on the plan by its shape")).to_be_visible()
        expect(page.get_by_role("list", name="Possible paths")).to_have_count(0)
        expect(page.get_by_role("list", name="Taps").locator("li")).to_have_count(1)
        assert max(errors_of(labels, survey).values()) < NEAR_M
        page.get_by_role("button", name="Undo", exact=True).click()
        expect(page.get_by_text("Not placed: too short")).to_be_visible()
        idle(page)
        page.get_by_role("button", name="Redo", exact=True).click()
        expect(page.get_by_text("Not placed: too short")).to_have_count(0)
        idle(page)
        assert max(errors_of(labels, survey).values()) < NEAR_M


def shows_that_a_tap_is_needed(page: Page) -> None:
    row = page.locator(WALKS)
    expect(row).to_contain_text("0.0 %")
    expect(row).to_contain_text("too short")
    expect(row).to_contain_text("needs a tap at 0:")
    row.get_by_role("button").click()
    expect(page.get_by_text("Not placed: too short")).to_be_visible()
    expect(page.get_by_text("The walk is too short to have only one place on the plan.")).to_be_visible()
    paths = page.get_by_role("list", name="Possible paths").locator("button")
    expect(paths.first).to_contain_text("path 1: ")
    assert paths.count() > 2
    paths.nth(1).click()
    expect(paths.nth(1)).to_have_attribute("aria-pressed", "true")
    sound(page)


def says_it_in_german(page: Page) -> None:
    page.get_by_role("button", name="Deutsch").click()
    expect(page.get_by_text("Nicht verortet: zu kurz")).to_be_visible()
    expect(page.get_by_text("Die Aufnahme ist zu kurz, um nur eine Stelle auf dem Plan zu haben.")).to_be_visible()
    finding = page.locator(".findings li", has_text="100 % der Aufnahme haben keine Position: ihr Weg von ")
    expect(finding).to_contain_text("Bitte einen bekannten Ort im Studio antippen")
    page.get_by_role("button", name="English").click()


def taps_the_true_place(page: Page, survey: Path) -> None:
    """The moment is the one that the page proposes; the tap is saved by one button."""
    (walk,) = page.request.get("/api/sessions").json()["sessions"]
    x, y = true_place(survey, walk["key"]["session"], walk["tap_s"])
    page.get_by_role("button", name="Tap the plan where the walk was at 0:").click()
    expect(page.get_by_text("Click the plan where the walk was at 0:")).to_be_visible()
    page.mouse.click(*pixel(page, extent_of(page, FLOOR), x, y))
    expect(page.get_by_label("x (m)")).not_to_have_value("")
    sound(page)
    page.get_by_role("button", name="Save and process again").click()
    idle(page)
    (entry,) = page.request.get("/api/corrections").json()["entries"]
    assert (entry["table"], entry["values"]["at_s"]) == ("set_tap", walk["tap_s"])
    assert (entry["values"]["x"], entry["values"]["y"]) == pytest.approx((x, y), abs=0.2)
