"""The page to click landmarks on, in a real browser; skipped where none is installed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageDraw
from playwright.sync_api import Browser, Page

from tests.views.browser import note_problems, running_browser
from vislam2tag.common.errors import SurveyError
from vislam2tag.preparation.registration.record import RegistrationSettings
from vislam2tag.preparation.registration.tape_and_clicks import read_clicks
from vislam2tag.site.model import ControlPoints, Floor
from vislam2tag.views.click_pages import write_click_page

pytestmark = pytest.mark.slow
IDS = ("7", "8", "</script>")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as running:
        yield running


@pytest.fixture(scope="module")
def floor(tmp_path_factory: pytest.TempPathFactory) -> Floor:
    path = tmp_path_factory.mktemp("plan") / "floorplan.png"
    image = Image.new("RGB", (600, 300), "white")
    ImageDraw.Draw(image).rectangle((100, 50, 400, 200), outline="black", width=4)
    image.save(path)
    return Floor(1, "Floor 1", 60.0, 30.0, None, path, ControlPoints((), np.empty((0, 2))))


@pytest.fixture
def problems() -> list[str]:
    return []


@pytest.fixture
def page(browser: Browser, floor: Floor, tmp_path: Path, problems: list[str]) -> Iterator[Page]:
    write_click_page(tmp_path / "click.html", floor, {"8": (30.0, 15.0)}, IDS)
    page = browser.new_page(viewport={"width": 1200, "height": 800})
    note_problems(page, problems)
    page.goto((tmp_path / "click.html").as_uri())
    yield page
    page.close()


def screen(page: Page, x_m: float, y_m: float) -> tuple[float, float]:
    """Where a point of the building is on the screen."""
    script = (
        "([x, y]) => { const b = svg.getBoundingClientRect(), s = toScreen(x, y); return [s[0] + b.x, s[1] + b.y]; }"
    )
    x, y = page.evaluate(script, [x_m, y_m])
    return x, y


def saved(page: Page, tmp_path: Path) -> Path:
    with page.expect_download() as download:
        page.click("#save")
    assert download.value.suggested_filename == "clicks_floor_1.csv"
    download.value.save_as(tmp_path / "clicks.csv")
    return tmp_path / "clicks.csv"


def test_clicks_come_back_as_landmarks(page: Page, tmp_path: Path, problems: list[str]) -> None:
    page.mouse.click(*screen(page, 10.0, 25.0))
    assert page.input_value("#id") == "8"
    page.mouse.click(*screen(page, 40.0, 10.0))
    clicks, findings = read_clicks(saved(page, tmp_path), 1, RegistrationSettings())
    assert findings == []
    assert clicks["7"].place == pytest.approx(10 + 25j, abs=0.1)
    assert clicks["8"].place == pytest.approx(40 + 10j, abs=0.1)
    assert problems == []


def test_zooming_makes_clicks_surer(page: Page, tmp_path: Path) -> None:
    page.mouse.click(*screen(page, 10.0, 25.0))
    page.mouse.move(*screen(page, 30.0, 15.0))
    page.mouse.wheel(0, -600)
    page.wait_for_function("view.scale > 40")
    page.mouse.click(*screen(page, 31.0, 15.0))
    clicks, _ = read_clicks(saved(page, tmp_path), 1, RegistrationSettings())
    assert clicks["8"].sigma_m < clicks["7"].sigma_m
    assert clicks["8"].place == pytest.approx(31 + 15j, abs=0.03)


def test_a_mark_is_dragged_nudged_and_removed(page: Page, tmp_path: Path) -> None:
    page.mouse.click(*screen(page, 10.0, 25.0))
    page.mouse.move(*screen(page, 10.0, 25.0))
    page.mouse.down()
    page.mouse.move(*screen(page, 15.0, 20.0), steps=4)
    page.mouse.up()
    before = page.evaluate("clicks.get('7')")
    assert (before["x"], before["y"]) == pytest.approx((15, 20), abs=0.1)
    page.locator("#plan").focus()
    page.keyboard.press("ArrowRight")
    after = page.evaluate("clicks.get('7')")
    assert after["x"] - before["x"] == pytest.approx(1 / page.evaluate("view.scale"))
    page.click("#remove")
    assert saved(page, tmp_path).read_text().count("\n") == 1


def test_what_cannot_be_a_landmark_is_told(page: Page) -> None:
    page.mouse.click(*screen(page, -0.5, 15.0))
    assert page.inner_text("#state") == "This position is outside the plan"
    page.fill("#id", "a,b")
    page.mouse.click(*screen(page, 10.0, 15.0))
    assert "no comma" in page.inner_text("#state")
    assert page.evaluate("clicks.size") == 0


def test_expected_places_and_odd_ids_are_shown(page: Page) -> None:
    assert page.locator(".expected text").all_text_contents() == ["8"]
    assert page.locator("#ids option").count() == len(IDS)


def test_a_floor_without_a_plan_is_one_clear_error(floor: Floor, tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="floor 1: has no plan"):
        write_click_page(tmp_path / "click.html", replace(floor, plan=None), {}, ())
    with pytest.raises(SurveyError, match="has no scale"):
        write_click_page(tmp_path / "click.html", replace(floor, width_m=None), {}, ())
    assert not list(tmp_path.iterdir())
