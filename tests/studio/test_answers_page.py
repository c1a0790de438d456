"""The list of faults in a browser: nothing wrong, not looked at and could not be judged read differently."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, ViewportSize, expect

from tests.studio.running import running_studio
from tests.studio.test_page import LATEST_MS, open_view, studio_page, watched_page
from tests.surveys import make_survey
from tests.views.browser import running_browser
from vislam2tag.pipeline.labels.process import process

SEARCHING = "The search for faults is still running"
NOTHING = "No faults were found"
SCREENS = {
    "wide": ViewportSize(width=1400, height=900),
    "narrow": ViewportSize(width=390, height=844),
}


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as running:
        yield running


def diagnose_tab(page: Page) -> None:
    open_view(page, "Faults")


@pytest.mark.slow
def test_known_faults_stay_open_while_the_search_runs(browser: Browser, faulty: Path, tmp_path: Path) -> None:
    with studio_page(browser, faulty, tmp_path) as (page, _):
        diagnose_tab(page)
        cards = page.locator(".cards > li[data-kind]")
        expect(cards).to_have_count(4, timeout=LATEST_MS)
        page.get_by_role("button", name="Search for all faults").click()
        expect(page.get_by_text(SEARCHING)).to_be_visible(timeout=LATEST_MS)
        expect(cards).to_have_count(4)
        expect(page.get_by_text(NOTHING)).to_have_count(0)
        expect(page.get_by_text(SEARCHING)).to_have_count(0, timeout=LATEST_MS)
        expect(cards).to_have_count(4)
        page.locator("li[data-kind=moved]").get_by_role("button", name="Correct").click()
        expect(cards).to_have_count(3, timeout=LATEST_MS)
        expect(page.get_by_text(NOTHING)).to_have_count(0)


NONE = ("Not checked: no walk has labels yet.", "Nicht geprüft: noch keine Aufnahme hat Labels.")
SOUND = (f"{NOTHING}. Checked: ", "Es wurden keine Fehler gefunden. Geprüft: ")
NOT_JUDGED = (
    "Could not be judged: no walk passes 3 surveyed landmarks",
    "Nicht zu beurteilen: keine Aufnahme kommt an 3 eingemessenen Landmarken vorbei",
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("labelled", "landmarks", "expected"), [(False, 99, NONE), (True, 99, SOUND), (True, 2, NOT_JUDGED)]
)
def test_three_answers(
    browser: Browser, tmp_path: Path, labelled: bool, landmarks: int, expected: tuple[str, str]
) -> None:
    survey, labels = make_survey(tmp_path / "survey", sessions=2, seconds=120), tmp_path / "labels"
    table = survey / "floor_0" / "marker_dict.csv"
    table.write_text("\n".join(table.read_text().splitlines()[: landmarks + 1]) + "\n")
    if labelled:
        process(survey, labels)
    with (
        running_studio(survey, "--labels", str(labels), "--jobs", "1") as server,
        watched_page(browser, server.url, server.token) as page,
    ):
        diagnose_tab(page)
        if labelled:
            expect(page.locator(".cards")).to_contain_text("Only a full search can say", timeout=LATEST_MS)
            page.get_by_role("button", name="Search for all faults").click()
        for language, sentence in zip(("en", "de"), expected, strict=True):
            page.evaluate(f"localStorage.setItem('language', '{language}')")
            page.reload()
            for name, size in SCREENS.items():
                page.set_viewport_size(size)
                for tab in ("#stage-check", "#tab-diagnose"):
                    page.locator(tab).click()
                expect(page.locator(".cards")).to_contain_text(sentence, timeout=LATEST_MS)
                page.screenshot(path=tmp_path / f"{language}-{name}.png")
