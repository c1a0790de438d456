"""The page to click a known distance on, in a real browser; skipped where none is installed."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from tests.cli.command import vislam2tag
from tests.site.plans import drawn_floor
from tests.views.browser import note_problems, running_browser
from vislam2tag.site.discover import read_site

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as running:
        yield running


def click(page: Page, x: float, y: float) -> None:
    """Click where the plan's own coordinates are."""
    script = """([x, y]) => { const b = svg.getBoundingClientRect(), p = toPixel([x, y]);
        by("frame").scrollTop = p[1] / rows * b.height - 100; const c = svg.getBoundingClientRect();
        const inside = (share) => Math.min(Math.max(share, 0.001), 0.999);
        return [c.x + inside(p[0] / columns) * c.width, c.y + inside(p[1] / rows) * c.height]; }"""
    page.mouse.click(*page.evaluate(script, [x, y]))


@pytest.mark.parametrize(
    ("name", "first", "second"),
    [("png", (0, 100), (200, 100)), ("framed_pdf", (120, 300), (686.93, 300)), ("dxf", (0, 0), (20_000, 0))],
)
def test_two_clicks_and_a_distance_give_the_command_that_makes_the_site(
    browser: Browser, tmp_path: Path, name: str, first: tuple[float, float], second: tuple[float, float]
) -> None:
    plan = drawn_floor.dxf(tmp_path, units=0) if name == "dxf" else getattr(drawn_floor, name)(tmp_path)
    done = vislam2tag("site", "init", tmp_path / "site", "--plan", plan, "--click", tmp_path / "scale.html")
    assert (done.returncode, done.stderr) == (0, "")
    assert not (tmp_path / "site").exists()
    problems: list[str] = []
    page = browser.new_page(viewport={"width": 1400, "height": 900})
    note_problems(page, problems)
    page.goto((tmp_path / "scale.html").as_uri())
    click(page, *first)
    assert page.inner_text("#state") == "Points left to click: 1"
    click(page, *second)
    assert page.inner_text("#state") == "Now type the distance"
    page.fill("#metres", "20,0")
    command = shlex.split(page.inner_text("#command"))
    entry = page.inner_text("#toml")
    page.close()
    assert problems == []
    assert entry.startswith("distance = { from = [")
    done = vislam2tag(*command[1:])
    assert (done.returncode, done.stderr) == (0, "")
    extent_m = read_site(tmp_path / "site")[0].floor(1).extent_m
    assert extent_m == pytest.approx((0, 20, 0, 10), abs=0.2)


def test_the_building_on_a_page_is_marked(browser: Browser, tmp_path: Path) -> None:
    plan = drawn_floor.png(tmp_path)
    vislam2tag("site", "init", tmp_path / "site", "--plan", plan, "--click", tmp_path / "scale.html")
    page = browser.new_page(viewport={"width": 1400, "height": 900})
    page.goto((tmp_path / "scale.html").as_uri())
    click(page, 0, 100)
    click(page, 200, 100)
    page.check("#area")
    click(page, 40, 2)
    click(page, 198, 98)
    page.fill("#metres", "20")
    command = page.inner_text("#command")
    page.close()
    assert "--area " in command
    assert vislam2tag(*shlex.split(command)[1:]).returncode == 0
    assert read_site(tmp_path / "site")[0].floor(1).width_m == pytest.approx(15.8, abs=0.2)
