"""The view is in the page's address: Back and a reload lead to it, and so does a link that someone else opens."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import polars as pl
import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from tests.studio.test_page import WALKS, open_view, picture, studio_page
from tests.views.browser import running_browser


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as running:
        yield running


@pytest.mark.slow
def test_back_reload_and_a_link_lead_to_a_view(browser: Browser, faulty: Path, tmp_path: Path) -> None:
    with studio_page(browser, faulty, tmp_path, viewport={"width": 1400, "height": 900}) as (page, _):
        address_is(page, "#tab=walks&floor=1")
        open_view(page, "Faults")
        floor(page).select_option("2")
        address_is(page, "#tab=diagnose&floor=2")
        open_view(page, "Walks")
        page.locator(WALKS, has_text="Floor 2").first.get_by_role("button").click()
        page.locator(".time .slider").fill("20.5")
        page.get_by_label("Colour by").select_option("sigma")
        page.locator(".map-tools summary").click()
        page.get_by_label("Wi-Fi scans").check()
        page.get_by_label("Walkable space").check()
        page.get_by_label("Events of the walk").uncheck()
        walk = page.request.get("/api/sessions").json()["sessions"]
        (id,) = [each["id"] for each in walk if f"walk={each['id']}&" in page.url]
        address_is(
            page,
            f"#walk={id}&t=20.5&tab=walks&floor=2&colour=sigma&show=contradictions&show=rooms&show=scans&show=walkable",
        )
        page.reload()
        is_shown(page, "20.5")
        leads_back_and_forward(page)
        leads_to_a_moment(page, id)


def address_is(page: Page, hash: str) -> None:
    expect(page).to_have_url(re.compile(re.escape(hash) + "$"))


def floor(page: Page) -> Locator:
    return page.locator(".map-tools select").first


def is_shown(page: Page, time: str) -> None:
    expect(page.get_by_role("tab", name="Walks")).to_have_attribute("aria-selected", "true")
    expect(floor(page)).to_have_value("2")
    expect(page.locator(".time .slider")).to_have_value(time)
    expect(page.get_by_label("Colour by")).to_have_value("sigma")
    page.locator(".map-tools summary").click()
    for name, shown in (
        ("Wi-Fi scans", True),
        ("Walkable space", True),
        ("Events of the walk", False),
        ("95 % confidence band", False),
    ):
        expect(page.get_by_label(name)).to_be_checked(checked=shown)
    page.locator(".map-tools summary").click()


def leads_back_and_forward(page: Page) -> None:
    page.go_back()
    expect(page.locator(".time")).to_have_count(0)
    expect(page.locator(WALKS).first).to_be_visible()
    page.go_back()
    expect(page.get_by_role("tab", name="Faults")).to_have_attribute("aria-selected", "true")
    expect(floor(page)).to_have_value("2")
    page.go_back()
    expect(floor(page)).to_have_value("1")
    page.go_back()
    address_is(page, "#tab=walks&floor=1")
    for _ in range(4):
        page.go_forward()
    is_shown(page, "20.5")


def leads_to_a_moment(page: Page, id: str) -> None:
    """A link as pages made it before; its moment is in the middle of what the legend leaves of the map."""
    page.goto("about:blank")
    page.goto(f"/#walk={id}&t=31.5")
    expect(page.locator(".time .slider")).to_have_value("31.5")
    expect(page.locator(".values dd").first).not_to_have_text("–")
    address_is(page, f"#walk={id}&t=31.5&tab=walks&floor=2")
    page.get_by_role("button", name="One second forward").click()
    expect(page.locator(".time .slider")).to_have_value("32.5")
    picture(page)
    box, legend = page.locator(".map .canvas").bounding_box(), page.locator(".map .over").bounding_box()
    assert box is not None
    assert legend is not None
    page.mouse.move(box["x"] + box["width"] / 2, (box["y"] + legend["y"]) / 2)
    pointed = page.get_by_label("Coordinates at the pointer")
    expect(pointed).to_be_visible()
    track = pl.read_ipc_stream(page.request.get(f"/api/sessions/{id}/track").body())
    [(x, y)] = track.sort((pl.col("t") - 31.5).abs())[:1].select("x", "y").rows()
    assert [float(value) for value in pointed.inner_text().removesuffix(" m").split(", ")] == pytest.approx(
        [x, y], abs=2.5
    )
    address_is(page, "&tab=walks&floor=2")
    assert f"walk={id}&" in page.url
