"""The page by keyboard and by touch: focus and scroll positions are kept, and the list of keys is true."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from tests.studio.test_page import WALKS, open_view, picture, studio_page, tap
from tests.views.browser import running_browser


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as running:
        yield running


@pytest.mark.slow
def test_the_focus_is_kept_and_the_keys_are_listed(browser: Browser, faulty: Path, tmp_path: Path) -> None:
    with studio_page(browser, faulty, tmp_path, viewport={"width": 1000, "height": 700}) as (page, _):
        focus = page.locator(":focus")
        of_page = keys_listed(page)
        enter(page.get_by_role("button", name="Keyboard shortcuts"))
        page.keyboard.press("Escape")
        expect(focus).to_have_attribute("aria-label", "Keyboard shortcuts")

        row = page.locator(WALKS).nth(2).get_by_role("button")
        name = row.inner_text()
        enter(row)
        expect(focus).to_have_text("← Back to all walks")
        of_walk = keys_listed(page)
        assert set(of_page) < set(of_walk)
        assert of_walk["L"] == "Next landmark"
        expect(focus).to_have_text("← Back to all walks")
        page.keyboard.press("Enter")
        expect(focus).to_have_text(name)
        enter(page.get_by_role("button", name="Labelled", exact=True))
        expect(page.locator("th[aria-sort=ascending]")).to_have_text("Labelled ▴")
        expect(focus).to_have_text("Labelled ▴")

        enter(page.locator(".next button"))
        expect(focus).to_have_attribute("role", "tab")
        open_view(page, "Faults", enter)
        expect(focus).to_have_attribute("id", "tab-diagnose")
        enter(page.locator(".cards").get_by_role("button", name="Correct").first)
        expect(page.locator(".cards > li[data-kind]")).to_have_count(3)
        expect(page.locator(".cards :focus")).to_have_count(1)
        enter(page.get_by_role("button", name="Undo"))
        expect(focus).to_have_attribute("aria-label", "Redo")
        page.keyboard.press("Enter")
        expect(focus).to_have_attribute("aria-label", "Undo")

        open_view(page, "Corrections", enter)
        enter(page.get_by_role("button", name="Remove"))
        expect(page.locator("dialog :focus")).to_have_text("Save and process again")
        page.keyboard.press("Escape")
        expect(focus).to_have_text("Remove")
        page.keyboard.press("Enter")
        expect(page.locator("dialog :focus")).to_have_text("Save and process again")
        page.keyboard.press("Enter")
        expect(page.get_by_text("There are no corrections.")).to_be_visible()
        expect(focus).to_have_text("Add a correction")

        enter(page.get_by_role("button", name="Deutsch"))
        expect(focus).to_have_text("English")
        assert keys_listed(page).keys() != of_page.keys()  # Strg


def enter(locator: Locator) -> None:
    """Press a thing by keyboard."""
    expect(locator).to_be_enabled()
    locator.press("Enter")


def keys_listed(page: Page) -> dict[str, str]:
    """What the list of keys has, opened and closed by keys."""
    page.keyboard.press("?")
    lines = page.locator("dialog .keys")
    expect(lines).to_be_visible()
    keys, texts = lines.locator("dt").all_inner_texts(), lines.locator("dd").all_inner_texts()
    page.keyboard.press("Escape")
    expect(lines).to_have_count(0)
    return dict(zip(keys, texts, strict=True))


@pytest.mark.slow
def test_list_and_map_scroll_apart_on_a_phone(browser: Browser, faulty: Path, tmp_path: Path) -> None:
    view = {"width": 390, "height": 844}
    with studio_page(browser, faulty, tmp_path, viewport=view, has_touch=True, is_mobile=True) as (page, _):
        panel, canvas = page.locator("main.panel"), page.locator(".map .canvas")
        expect(page.locator(".map-tools select").first).to_have_value("1")
        expect(page.locator(".next button")).to_be_visible()  # the last part above the map that is loaded
        before = picture(page)
        swipe(page, panel, 120)
        top = scrolled(panel)
        assert top > 50
        for _ in range(8):  # beyond the end
            swipe(page, panel, 140)
        top = scrolled(panel)
        assert page.evaluate("[scrollY, document.scrollingElement.scrollHeight - innerHeight]") == [0, 0]
        assert np.array_equal(picture(page), before)
        swipe(page, canvas, 60)
        assert not np.array_equal(picture(page), before)
        assert scrolled(panel) == top

        row = page.locator(WALKS).last.get_by_role("button")
        name = row.inner_text()
        tap(row)
        back = page.get_by_role("button", name="Back to all walks")
        expect(back).to_be_in_viewport()
        assert scrolled(panel) == 0
        tap(back)
        expect(page.locator(":focus")).to_have_text(name)
        assert scrolled(panel) == pytest.approx(top, abs=1)
        open_view(page, "Landmarks", tap)
        assert scrolled(panel) == 0
        panel.evaluate("element => new Promise(done => { element.onscrollend = done; element.scrollTo(0, 100) })")
        open_view(page, "Walks", tap)
        assert scrolled(panel) == pytest.approx(top, abs=1)
        open_view(page, "Landmarks", tap)
        assert scrolled(panel) == 100


def scrolled(panel: Locator) -> float:
    return float(panel.evaluate("element => element.scrollTop"))


def swipe(page: Page, part: Locator, by: float) -> None:
    """Drag with one finger from the middle of a part up by so many pixels."""
    box = part.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    session = page.context.new_cdp_session(page)
    for step in range(11):
        point = {"x": x, "y": y - by * step / 10}
        kind = "touchMove" if step else "touchStart"
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [point]})
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
