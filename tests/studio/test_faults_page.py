"""Faults in a browser: each can be corrected, ignored and taken back, and a second click does nothing."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Locator, Page, Route, expect

from tests.studio.test_page import KINDS, WALKS, idle, open_view, studio_page
from tests.views.browser import running_browser

WIDE: dict[str, Any] = {"viewport": {"width": 1400, "height": 900}}
OPEN_LABELS_ALONE = "No fault shows in the labels alone. Only a full search can say that there is none."


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as running:
        yield running


def written(folder: Path) -> dict[str, Any]:
    file = folder / "survey" / "corrections.toml"
    return tomllib.loads(file.read_text()) if file.exists() else {}


def cards(page: Page, state: str, count: int) -> Locator:
    """The faults of a state, which is chosen."""
    page.get_by_role("button", name=f"{state} {count}", exact=True).click()
    found = page.locator("[data-kind]")
    expect(found).to_have_count(count)
    return found


def mapping_jobs(page: Page) -> int:
    return sum(job["kind"] == "process" for job in page.request.get("/api/jobs").json()["jobs"])


@pytest.mark.slow
def test_faults_are_ignored_corrected_and_taken_back(browser: Browser, faulty: Path, tmp_path: Path) -> None:
    with studio_page(browser, faulty, tmp_path, **WIDE) as (page, folder):
        open_view(page, "Faults")
        cards(page, "Open", len(KINDS))
        ignores_one(page, folder)
        corrects_one_by_two_clicks(page, folder)
        corrects_all_at_once(page, folder)
        lists_what_affects_a_walk(page)


def ignores_one(page: Page, folder: Path) -> None:
    moved = page.locator("[data-kind=moved]")
    moved.get_by_text("Ignore this fault").click()
    moved.get_by_label("Reason").fill("the sheet is on a door")
    moved.get_by_role("button", name="Ignore", exact=True).click()
    cards(page, "Open", len(KINDS) - 1)
    ignored = cards(page, "Ignored", 1)
    expect(ignored).to_contain_text("the sheet is on a door")
    (entry,) = written(folder)["ignore_fault"]
    assert (entry["kind"], entry["reason"]) == ("moved", "the sheet is on a door")
    assert mapping_jobs(page) == 0
    assert not any(session["stale"] for session in page.request.get("/api/sessions").json()["sessions"])
    ignored.get_by_role("button", name="Do not ignore").click()
    cards(page, "Open", len(KINDS))
    assert written(folder) == {}


def corrects_one_by_two_clicks(page: Page, folder: Path) -> None:
    floor = page.locator(".map-tools select").first
    floor.select_option("2")
    button = page.locator("[data-kind=mis_surveyed]").get_by_role("button", name=re.compile("^Correct: put it where"))
    expect(button).to_have_text(re.compile(r"where the walks have it \(-?\d+\.\d\d, -?\d+\.\d\d\), sigma 0\.\d\d m$"))
    button.dblclick()
    cards(page, "Open", len(KINDS) - 1)
    expect(floor).to_have_value("1")
    line = page.locator(".result")
    expect(line).to_contain_text(re.compile(r"^\s*\d+ walks: \d+\.\d % → \d+\.\d % labelled, expected error \d"))
    idle(page)
    with page.expect_response("**/api/tracks?output=before"):
        line.get_by_role("button", name="Before / after").click()
    expect(page.get_by_role("alert")).to_have_count(0)
    assert [len(entries) for entries in written(folder).values()] == [1]
    assert mapping_jobs(page) == 1
    line.get_by_role("button", name="Before / after").click()
    cards(page, "Corrected", 1).get_by_role("button", name="Undo the correction").click()
    cards(page, "Corrected", 0)
    assert written(folder) == {}
    idle(page)
    cards(page, "Open", len(KINDS))
    line.get_by_role("button", name="Close").click()
    expect(line).to_have_count(0)


def corrects_all_at_once(page: Page, folder: Path) -> None:
    before = mapping_jobs(page)
    page.get_by_role("button", name="Correct all").click()
    expect(page.locator("dialog .added").filter(has_text="[[")).to_have_count(len(KINDS))
    page.get_by_role("button", name="Save and process again").dblclick()
    expect(page.locator("dialog[open]")).to_have_count(0)
    expect(page.locator(".result")).to_be_visible()
    cards(page, "Corrected", len(KINDS))
    cards(page, "Open", 0)
    expect(page.get_by_text(OPEN_LABELS_ALONE)).to_be_visible()
    expect(page.get_by_role("alert")).to_have_count(0)
    assert sum(map(len, written(folder).values())) == len(KINDS)
    assert mapping_jobs(page) == before + 1
    page.get_by_role("button", name="Search for all faults").click()
    expect(page.get_by_text("No faults were found.")).to_be_visible()
    cards(page, "Corrected", len(KINDS))
    found = Axe().run(page).response["violations"]
    assert [one["id"] for one in found if one["impact"] in ("serious", "critical")] == []


def lists_what_affects_a_walk(page: Page) -> None:
    """Those of the site, too; each leads to its entry."""
    open_view(page, "Walks")
    page.locator(f"{WALKS} button").first.click()
    used = page.get_by_role("button", name=re.compile("^swap two landmarks"))
    used.click()
    expect(page.locator(".cards > li:focus")).to_contain_text("swap two landmarks")


@pytest.mark.slow
def test_a_fault_without_a_certain_correction_can_be_corrected(browser: Browser, faulty: Path, tmp_path: Path) -> None:
    place = {"x": 17.75, "y": 16.57}
    mark = {"id": "3", "floor": 1}

    def with_an_outlier(route: Route) -> None:
        content = route.fetch().json()
        content["faults"].append(
            content["faults"][0]
            | {
                "id": "odd",
                "kind": "odd_reference",
                "summary": "landmark 3 on floor 1 is surveyed 0.50 m away",
                "changes": [],
                "alternatives": [
                    {"action": "add", "table": "move_landmark", "values": mark | place},
                    {"action": "add", "table": "exclude_landmark", "values": mark},
                ],
                "by_walks": {"x_m": 17.75, "y_m": 16.57, "sigma_m": 0.03},
            }
        )
        route.fulfill(body=json.dumps(content), content_type="application/json")

    with studio_page(browser, faulty, tmp_path, **WIDE) as (page, folder):
        page.route("**/api/diagnosis", with_an_outlier)
        page.reload()
        open_view(page, "Faults")
        card = page.locator("[data-kind=odd_reference]")
        expect(card).to_contain_text("Or measure it again")
        expect(card.get_by_role("button", name="Exclude landmark 3")).to_be_visible()
        card.get_by_role("button", name="Put it where the walks have it (17.75, 16.57), sigma 0.03 m").click()
        expect(card).to_have_count(0)
        assert written(folder) == {"move_landmark": [mark | place]}
        idle(page)
