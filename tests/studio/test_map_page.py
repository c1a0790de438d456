"""The map in a browser: what it shows whole, what it explains, what it compares, and its panel of time."""

from __future__ import annotations

import itertools
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeAlias

import pytest
from playwright.sync_api import Browser, Locator, Page, Route, expect

from tests.studio.test_page import WALKS, every_tab, made_otherwise, open_view, picture, studio_page
from tests.views.browser import running_browser

pytestmark = pytest.mark.slow
WIDE: dict[str, Any] = {"viewport": {"width": 1400, "height": 900}}
Box: TypeAlias = tuple[float, float, float, float]
LOW: dict[str, Any] = {"viewport": {"width": 700, "height": 450}}


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as running:
        yield running


@pytest.fixture(scope="module")
def mapped(faulty: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The survey with names of rooms on its first floor and without a plan of the second, and labels moved by 1 m."""
    folder = tmp_path_factory.mktemp("mapped")
    shutil.copytree(faulty / "survey", folder / "survey")
    shutil.copytree(faulty / "labels", folder / "labels")
    (folder / "survey" / "floor_1" / "rooms.csv").write_text("name,x,y\nWorkshop,30.0,15.0\n")
    (folder / "survey" / "floor_2" / "floorplan.jpg").unlink()
    made_otherwise(folder / "labels", folder / "moved", 1.0)
    return folder


def place_at(page: Page, x: float, y: float) -> tuple[float, float]:
    """The coordinates that are shown with the pointer at a part of the map's width and height."""
    box = page.locator(".map .canvas").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + x * box["width"], box["y"] + y * box["height"])
    shown = page.get_by_label("Coordinates at the pointer")
    expect(shown).to_be_visible()
    east, north = re.findall(r"-?[\d.]+", shown.inner_text())
    return float(east), float(north)


def visible(page: Page) -> Box:
    """Left, right, lower and upper edge of the map (m) once it has come to rest."""
    found: list[Box] = []
    while len(found) < 3 or found[-1] != found[-2] or found[-2] != found[-3]:
        (left, high), (right, low) = place_at(page, 0.02, 0.02), place_at(page, 0.98, 0.98)
        found.append((left, right, low, high))
        page.wait_for_timeout(50)
    return found[-1]


def point_at(page: Page, x: float, y: float) -> tuple[float, float]:
    """Move the pointer to a place of the map; where that is on the screen."""
    left, right, low, high = visible(page)
    box = page.locator(".map .canvas").bounding_box()
    assert box is not None
    across, up = 0.02 + 0.96 * (x - left) / (right - left), 0.02 + 0.96 * (high - y) / (high - low)
    pixel = box["x"] + across * box["width"], box["y"] + up * box["height"]
    page.mouse.move(*pixel)
    return pixel


def shows(page: Page, box: Box) -> None:
    """Wait until a box is shown whole."""
    shown = visible(page)
    for _ in range(200):
        if shown[0] < box[0] < box[1] < shown[1] and shown[2] < box[2] < box[3] < shown[3]:
            return
        page.wait_for_timeout(50)
        shown = visible(page)
    raise AssertionError(f"{box} is not shown in {shown}")


def entry(page: Page, name: str) -> Locator:
    return page.locator(".legend").get_by_role("button", name=name, exact=True)


def test_the_map_shows_things_whole_and_explains_them(browser: Browser, mapped: Path, tmp_path: Path) -> None:
    with studio_page(browser, mapped, tmp_path, "--compare", str(mapped / "moved"), **WIDE) as (page, _):
        fits_and_stays(page)
        hides_kinds_by_the_legend(page)
        says_what_is_pointed_at(page)
        drops_late_answers(page)
        draws_a_floor_without_a_plan(page)
        has_a_panel_of_time(page)
        compares_with_names_and_moves(page)


def fits_and_stays(page: Page) -> None:
    """A floor and a session are shown whole, also after the window changed, unless the map was moved."""
    floor = next(each for each in page.request.get("/api/survey").json()["floors"] if each["number"] == 1)
    expect(page.locator(".legend")).to_contain_text("uncertain")
    shows(page, floor["extent_m"])
    page.locator(f"{WALKS} button").first.click()
    session = page.request.get("/api/sessions").json()["sessions"][0]
    expect(page.locator(".time .u-over").first).to_be_visible()
    for size in ({"width": 1400, "height": 900}, {"width": 1000, "height": 640}):
        page.set_viewport_size(size)  # type: ignore[arg-type]
        shows(page, session["bounds"]["1"])
    page.get_by_role("button", name="Zoom in").click()
    before = visible(page)
    page.set_viewport_size(WIDE["viewport"])
    page.wait_for_function("document.querySelector('.map').clientWidth > 900")
    after = visible(page)
    assert after[0] < before[0] < before[1] < after[1]
    assert after[0] + after[1] == pytest.approx(before[0] + before[1], abs=0.3)
    assert after[2] + after[3] == pytest.approx(before[2] + before[3], abs=0.3)
    page.get_by_role("button", name="Back to all walks").click()
    expect(page.locator(".ol-scale-line")).to_have_text(re.compile(r"^\d+ (c?m)$"))


def hides_kinds_by_the_legend(page: Page) -> None:
    page.get_by_role("button", name="Show all").click()
    names = ["labelled (ok)", "uncertain", "landmark", "Contradictions", "Room names"]
    assert page.locator(".legend li span").all_inner_texts() == names
    page.mouse.move(0, 0)
    covered = page.locator(".over").evaluate("element => element.clientHeight")
    seen = [picture(page)[:-covered]]
    for name in ("uncertain", "Room names"):
        entry(page, name).click()
        expect(entry(page, name)).to_have_attribute("aria-pressed", "false")
        seen.append(picture(page)[:-covered])
    assert all((one != other).any() for one, other in itertools.pairwise(seen))
    for name in ("uncertain", "Room names"):
        entry(page, name).click()
    page.get_by_label("Colour by").select_option("sigma")
    assert page.locator(".legend .scale-ends span").all_inner_texts() == ["0 m", "0.25 m", "≥ 0.50 m"]
    page.get_by_label("Colour by").select_option("status")


def says_what_is_pointed_at(page: Page) -> None:
    """By a pointer that rests, and by the keyboard for the middle of the map."""
    tip = page.locator(".map .tip")
    marks = page.request.get("/api/survey").json()["landmarks"]
    mark = next(each for each in marks if (each["floor"], each["id"]) == (1, "11"))
    point_at(page, mark["x"], mark["y"])
    expect(tip).to_contain_text("landmark 11")
    page.mouse.move(0, 0)
    expect(tip).to_be_hidden()
    tick(page, "Wi-Fi scans")
    expect(entry(page, "Wi-Fi scans")).to_be_visible()
    tick(page, "Wi-Fi scans")
    for _ in range(3):
        page.get_by_role("button", name="Zoom out").click()  # until the middle is near something
    page.mouse.move(0, 0)
    page.locator(".map .canvas").focus()
    visible(page)
    page.mouse.move(0, 0)
    page.keyboard.press("Enter")
    expect(tip).to_have_text(re.compile(r"\w"))
    expect(page.get_by_label("Coordinates at the centre of the map")).to_be_visible()
    page.get_by_role("button", name="Show all").click()


def middle(page: Page) -> tuple[float, float]:
    box = page.locator(".map .canvas").bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def tick(page: Page, *layers: str) -> None:
    page.locator(".map-tools summary").click()
    for layer in layers:
        page.get_by_label(layer).click()
    page.locator(".map-tools summary").click()


def drops_late_answers(page: Page) -> None:
    """A layer that is unticked while it loads does not appear."""
    held: list[Route] = []
    page.route("**/api/layers/walkable?*", lambda route: held.append(route))
    with page.expect_request("**/api/layers/walkable?*"):
        tick(page, "Walkable space")
    tick(page, "Walkable space")
    with page.expect_response("**/api/layers/walkable?*") as answer:
        held[0].continue_()
    answer.value.finished()
    tick(page, "Wi-Fi scans")
    expect(entry(page, "Wi-Fi scans")).to_be_visible()
    expect(entry(page, "Walkable space")).to_have_count(0)
    page.unroute("**/api/layers/walkable?*")
    tick(page, "Wi-Fi scans", "Walkable space")
    expect(entry(page, "Walkable space")).to_be_visible()
    tick(page, "Walkable space")


def draws_a_floor_without_a_plan(page: Page) -> None:
    page.locator(".map-tools select").first.select_option("2")
    expect(entry(page, "outline of the walks (no plan)")).to_be_visible()
    grid = page.locator(".legend button", has_text="grid of")
    expect(grid).to_have_text(re.compile(r"grid of \d+ m"))
    with_grid = picture(page)
    grid.click()
    assert (picture(page) != with_grid).mean() > 0.01
    grid.click()
    page.get_by_label("Colour by").select_option("session")
    expect(page.locator(".legend li line[stroke-dasharray]")).to_have_count(5)  # 4 of 12 sessions, and the outline
    page.get_by_label("Colour by").select_option("status")
    page.locator(".map-tools select").first.select_option("1")
    expect(grid).to_have_count(0)


def has_a_panel_of_time(page: Page) -> None:
    """It names its session, has one axis, keeps how it is shown, and is only where it is used."""
    page.locator(f"{WALKS} button").first.click()
    panel = page.get_by_role("region", name="Time")
    expect(panel.get_by_role("heading")).to_contain_text("2021-12-21T09:14:00")
    expect(panel).to_contain_text("heading (°)")
    strip, chart = panel.locator(".strip"), panel.locator(".u-over").first
    expect(chart).to_be_visible()
    one, other = strip.bounding_box(), chart.bounding_box()
    assert one is not None
    assert other is not None
    assert one["x"] == pytest.approx(other["x"], abs=1)
    assert one["width"] == pytest.approx(other["width"], abs=1.5)
    edge = panel.get_by_role("separator")
    height = panel.evaluate("element => element.clientHeight")
    edge.focus()
    page.keyboard.press("ArrowDown")
    expect(edge).to_have_attribute("aria-valuenow", str(height - 24))
    grip = edge.bounding_box()
    assert grip is not None
    page.mouse.move(grip["x"] + 20, grip["y"] + 6)
    page.mouse.down()
    page.mouse.move(grip["x"] + 20, grip["y"] + 106, steps=3)
    page.mouse.up()
    assert abs(panel.evaluate("element => element.clientHeight") - (height - 124)) < 10
    open_view(page, "Prepare")
    expect(panel).to_have_count(0)
    open_view(page, "Share")
    expect(panel).to_have_count(0)
    open_view(page, "Walks")
    panel.get_by_role("button", name="Time", exact=True).click()
    expect(strip).to_have_count(0)
    page.reload()
    expect(page.locator(".legend")).to_be_visible()
    expect(panel.get_by_role("button", name="Time", exact=True)).to_have_attribute("aria-expanded", "false")
    panel.get_by_role("button", name="Time", exact=True).click()
    expect(strip).to_be_visible()
    assert panel.evaluate("element => element.clientHeight") < height - 100
    page.get_by_role("button", name="Back to all walks").click()


def compares_with_names_and_moves(page: Page) -> None:
    """A band is one smooth area beside the walk; two outputs have their names beside the divider, and their moves."""
    tick(page, "95 % confidence band")
    expect(entry(page, "95 % confidence band")).to_be_visible()
    with_band = picture(page)
    entry(page, "95 % confidence band").click()
    assert (picture(page) != with_band).mean() > 0.01
    open_view(page, "Compare")
    page.get_by_label("Second").select_option(label="other labels: moved (moved)")
    page.get_by_role("button", name="Compare", exact=True).click()
    expect(page.locator(".divider .left")).to_contain_text("labels: labels")
    expect(page.locator(".divider .right")).to_have_text("other labels: moved (moved)")
    moves = page.locator(".legend button", has_text="largest moves, up to 1.00 m")
    expect(moves).to_be_visible()
    with_moves = picture(page)
    moves.click()
    assert (picture(page) != with_moves).any()
    page.get_by_role("button", name="Stop comparing").click()


def reached(control: Locator) -> None:
    """It can be clicked where it is: nothing lies over it, and it is on the screen."""
    control.scroll_into_view_if_needed()
    control.click(trial=True, timeout=10_000)


def test_at_200_percent_zoom_everything_can_be_clicked(browser: Browser, mapped: Path, tmp_path: Path) -> None:
    with studio_page(browser, mapped, tmp_path, has_touch=True, **LOW) as (page, _):
        expect(page.locator(".legend")).to_be_visible()
        page.locator(f"{WALKS} button").first.click()
        for tab in every_tab(page):
            expect(tab).to_have_attribute("aria-selected", "true")
            controls = page.locator(
                ".zoom button, .map-tools select, .map-tools summary, .legend summary, .tools button:enabled"
            )
            for control in [
                *controls.all(),
                page.locator("#panel").locator("button:enabled:visible, input:visible, summary:visible").last,
            ]:
                if control.count():
                    reached(control)
            assert page.evaluate("document.documentElement.scrollWidth") == 700
        open_view(page, "Walks")
        panel = page.get_by_role("region", name="Time")
        panel.get_by_role("button", name="Time", exact=True).click()
        page.locator(".legend summary").click()
        for control in [
            *panel.locator("button, select, input").all(),
            *page.locator(".legend button, .zoom button").all(),
        ]:
            reached(control)
        page.locator(".legend summary").click()
        open_view(page, "Landmarks")
        page.get_by_role("button", name=re.compile("^11 ")).first.tap()
        tip = page.locator(".map .tip")
        expect(tip).to_be_hidden()
        picture(page)
        x, y = middle(page)
        covered = page.locator(".over").evaluate("element => element.clientHeight")
        page.touchscreen.tap(x - 20, y - covered / 2)  # the middle of what nothing covers
        expect(tip).to_contain_text("landmark 11")
