"""The site's look in a real browser: nothing is cut on a screen or a phone, and pictures follow the scheme."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Literal

import pytest
from playwright.sync_api import Browser, Page, TimeoutError

from tests.docs.pages import DOCS
from tests.docs.test_site import site as site  # the fixture
from tests.views.browser import running_browser

pytestmark = pytest.mark.slow
WIDTHS = {"screen": 1400, "phone": 390}
TOO_WIDE = """() => {
  const wide = [];
  if (document.documentElement.scrollWidth > document.documentElement.clientWidth) wide.push("the page");
  for (const part of document.querySelectorAll(".md-content :is(table, pre, pre > code)")) {
    if (!part.checkVisibility()) continue;
    const outer = part.parentElement.getBoundingClientRect(), own = part.getBoundingClientRect();
    const sticksOut = own.left < outer.left - 0.5 || own.right > outer.right + 0.5;
    if (sticksOut || part.scrollWidth > part.clientWidth) wide.push(`${part.tagName}: ${part.innerText.slice(0, 60)}`);
  }
  return wide;
}"""
"""Tables and blocks of code that are wider than what they are in, or that scroll sideways."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """A browser for all pages."""
    with running_browser() as running:
        yield running


def opened(browser: Browser, file: Path, width: int, scheme: Literal["light", "dark"] = "light") -> Page:
    """The page as it looks once it is loaded."""
    page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
    page.goto(file.as_uri())
    return page


def test_no_table_no_code_and_no_page_scrolls_sideways(site: Path, browser: Browser) -> None:
    page = browser.new_page()
    found = {}
    for file in sorted(site.rglob("*.html")):
        page.goto(file.as_uri())
        for name, width in WIDTHS.items():
            page.set_viewport_size({"width": width, "height": 900})
            if page.evaluate(TOO_WIDE):  # perhaps the page has not taken its new width yet
                with suppress(TimeoutError):
                    page.wait_for_function(f"() => ({TOO_WIDE})().length === 0")
            if wide := page.evaluate(TOO_WIDE):
                found[file.relative_to(site).as_posix(), name] = wide
    assert not found


def test_the_check_sees_what_is_cut(site: Path, browser: Browser) -> None:
    page = opened(browser, site / "how-to" / "many-surveys.html", WIDTHS["phone"])
    page.add_style_tag(content=".md-typeset pre > code { white-space: pre !important; overflow: auto !important }")
    assert page.evaluate(TOO_WIDE)


def test_code_is_copied_without_the_breaks_of_narrow_screens(site: Path, browser: Browser) -> None:
    page = opened(browser, site / "how-to" / "many-surveys.html", WIDTHS["phone"])
    pairs = page.locator("pre > code").evaluate_all("all => all.map(one => [one.innerText, one.textContent])")
    assert pairs
    assert all(shown == written for shown, written in pairs)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_pictures_of_the_studio_follow_the_scheme(
    site: Path, browser: Browser, scheme: Literal["light", "dark"]
) -> None:
    page = opened(browser, site / "how-to" / "studio.html", WIDTHS["screen"], scheme)
    pictures = page.locator(".md-content img").evaluate_all("all => all.map(one => one.src)")
    assert pictures
    assert all(picture.endswith(f"_{scheme}.webp") for picture in pictures)


def test_every_picture_of_the_studio_is_shown_and_has_its_other_scheme() -> None:
    pages = "".join(page.read_text(encoding="utf-8") for page in DOCS.rglob("*.md"))
    there = {path.name for path in (DOCS / "images").glob("studio_*.webp")}
    light = {name for name in there if name.endswith("_light.webp")}
    assert there - light == {name.replace("_light", "_dark") for name in light}
    assert not {name for name in light if name not in pages}


def test_the_logo_is_ours(site: Path, browser: Browser) -> None:
    page = opened(browser, site / "index.html", WIDTHS["screen"])
    logo = page.locator(".md-header .md-logo img")
    assert logo.get_attribute("src") == "./assets/logo.svg"
    assert logo.evaluate("one => one.naturalWidth") > 0
    assert page.locator('link[rel="icon"]').get_attribute("href") == "./assets/logo.svg"
