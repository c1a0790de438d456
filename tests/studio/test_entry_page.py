"""Getting into the studio with its link, and what the page says once the studio has ended."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.studio.running import Page as Server
from tests.studio.running import running_studio
from tests.studio.test_page import WALKS, open_view
from tests.views.browser import running_browser
from vislam2tag.common.addresses import listen

LATEST_MS = 120_000
NEVER_DONE = """
const add = EventSource.prototype.addEventListener
EventSource.prototype.addEventListener = function (name, heard) {
  add.call(this, name, (event) => name === 'job' && JSON.parse(event.data).state === 'done' || heard(event))
}
"""
"""Hides from the page that a job is done: for the page it runs until the studio ends, however short it is."""
expect.set_options(timeout=LATEST_MS)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as running:
        yield running


@contextmanager
def studio_at(port: int, survey: Path) -> Iterator[Server]:
    labels = survey.with_name("labels")
    with running_studio(survey, "--labels", str(labels), "--jobs", "1", port=port) as server:
        yield server


def new_page(browser: Browser, url: str) -> Page:
    """A page of a browser that knows nothing yet."""
    page = browser.new_context(locale="en").new_page()
    page.add_init_script(NEVER_DONE)
    page.goto(url)
    return page


def is_in(page: Page) -> None:
    """The page shows the survey, and its address contains no token any more."""
    expect(page.get_by_role("tab", name="Walks")).to_be_visible()
    expect(page).to_have_url(re.compile("tab="))


@pytest.mark.slow
def test_a_link_lets_one_browser_in_and_a_studio_that_ended_can_be_started_again(
    browser: Browser, faulty: Path, tmp_path: Path
) -> None:
    for name in ("survey", "labels"):
        shutil.copytree(faulty / name, tmp_path / name)
    with listen("127.0.0.1", 0) as opened:
        port = opened.getsockname()[1]
    with studio_at(port, tmp_path / "survey") as server:
        page = new_page(browser, f"{server.url}/#{server.token}")
        is_in(page)
        lets_in_again_and_others_with_a_link_of_their_own(browser, page, f"{server.url}/#{server.token}")
        connects_again_by_itself(page)
        open_view(page, "Corrections")
        page.get_by_text("Add a correction").click()
        page.locator("form").get_by_label("device", exact=True).fill("nobody's")
        page.request.post(f"{server.url}/api/jobs", data={"kind": "process", "sessions": None})
        expect(page.get_by_role("status").locator("progress")).to_be_visible()
    lost = page.get_by_role("alert")
    expect(lost).to_contain_text("The studio has ended or cannot be reached.")
    options = f"--no-browser --port {port} --labels {tmp_path}/labels --jobs 1"
    expect(lost.locator("code")).to_have_text(f"vislam2tag -q studio {tmp_path}/survey {options}")
    expect(page.get_by_role("status").locator("progress")).to_have_count(0)
    open_view(page, "Faults")
    page.get_by_role("button", name="Search for all faults").click()
    expect(page.get_by_text("Failed to fetch")).to_have_count(0)
    with studio_at(port, tmp_path / "survey") as server:
        expect(page.get_by_text("The studio was started again.")).to_be_visible()
        expect(page.get_by_text("The studio has ended")).to_have_count(0)
        page.goto(f"{server.url}/#{server.token}")
        is_in(page)
        open_view(page, "Corrections")
        expect(page.locator("form").get_by_label("device", exact=True)).to_have_value("nobody's")


def lets_in_again_and_others_with_a_link_of_their_own(browser: Browser, page: Page, link: str) -> None:
    second = page.context.new_page()
    second.goto(link)
    is_in(second)
    second.close()
    other = new_page(browser, link)
    expect(other.get_by_text("This link was already used")).to_contain_text("“Create a link” under Share")
    assert page.url not in (link, other.url)
    open_view(page, "Share")
    page.get_by_role("button", name="Create a link").click()
    link = page.locator("code", has_text="http").inner_text()
    page.goto(link)  # pasted where it is not needed: it stays good for another browser
    expect(page).to_have_url(re.compile("#tab=share"))
    other.goto(link)
    is_in(other)
    other.context.close()


def connects_again_by_itself(page: Page) -> None:
    open_view(page, "Walks")
    page.context.set_offline(True)
    page.locator(f"{WALKS} button").first.click()
    expect(page.get_by_role("alert")).to_contain_text("This page connects again by itself")
    page.context.set_offline(False)
    expect(page.get_by_role("alert")).to_have_count(0)
    expect(page.locator(".values dd").first).not_to_have_text("–")
