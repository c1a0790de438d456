"""What is typed, painted and planned in the browser and not saved is not lost; undo takes back one change alone.

Others change the same survey meanwhile: by an editor, which is here the test.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, expect

from tests.preparation.planning.floors import write_ring_site
from tests.site.plans import drawn_floor
from tests.studio.running import running_studio
from tests.studio.test_from_plan_to_link import WIDE, extent_of, pixel, sound, step
from tests.studio.test_page import open_view, watched_page
from tests.views.browser import running_browser

THEIRS = '# theirs\n[[exclude_landmark]]\nid = "theirs"\n'


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as running:
        yield running


@contextmanager
def opened(browser: Browser, tmp_path: Path) -> Iterator[tuple[Page, Path]]:
    """A page on a survey of two floors with a plan and no walks; also returns its corrections.toml."""
    write_ring_site(tmp_path / "survey", (1, 2))
    with (
        running_studio(tmp_path / "survey", "--jobs", "1") as server,
        watched_page(browser, server.url, server.token, viewport=WIDE) as page,
    ):
        is_loaded(page)
        yield page, tmp_path / "survey" / "corrections.toml"


def is_loaded(page: Page) -> None:
    expect(page.get_by_role("tab", name="Prepare")).to_be_visible()


def add(page: Page, name: str) -> None:
    """Save a correction by the form."""
    open_view(page, "Corrections")
    form = page.locator("details > form")
    if not form.is_visible():
        page.get_by_text("Add a correction").click()
    form.get_by_label("Kind").select_option("exclude_landmark")
    form.get_by_label("id", exact=True).fill(name)
    form.get_by_role("button", name="Show the change").click()
    page.get_by_role("button", name="Save and process again").click()
    expect(page.locator(".cards > li", has_text=name)).to_be_visible()
    expect(page.get_by_role("button", name="Undo", exact=True)).to_be_enabled()


def entry(name: str) -> str:
    return f'[[exclude_landmark]]\nid = "{name}"\n'


def someone_else_writes(page: Page, file: Path, text: str) -> None:
    """Write the file as an editor does, and wait until the page knows of it."""
    with page.expect_response("**/api/corrections"):
        file.write_text(text)


@pytest.mark.slow
def test_undo_and_redo_leave_what_someone_else_wrote(browser: Browser, tmp_path: Path) -> None:
    with opened(browser, tmp_path) as (page, file):
        add(page, "first")
        add(page, "second")
        both = file.read_text()
        someone_else_writes(page, file, THEIRS + "\n" + both.replace('"first"', '"first"\nreason = "fell down"'))
        page.locator("h1").click()  # no text field has the focus
        page.keyboard.press("Control+z")
        expect(page.locator(".cards > li", has_text="second")).to_have_count(0)
        changed = THEIRS + "\n" + entry("first") + 'reason = "fell down"\n'
        assert file.read_text() == changed
        page.keyboard.press("Control+z")
        dialog = page.get_by_role("dialog", name="Not undone")
        expect(dialog).to_contain_text('id = "first"')
        expect(dialog).to_contain_text('reason = "fell down"')
        serious = [one for one in Axe().run(page).response["violations"] if one["impact"] in ("serious", "critical")]
        assert serious == []
        dialog.get_by_role("button", name="Close").click()
        assert file.read_text() == changed
        expect(page.get_by_role("button", name="Undo", exact=True)).to_be_disabled()
        page.keyboard.press("Control+Shift+z")
        expect(page.locator(".cards > li", has_text="second")).to_be_visible()
        assert file.read_text() == changed + "\n" + entry("second")


@pytest.mark.slow
def test_a_typed_text_of_the_file_is_applied_to_what_it_is_now(browser: Browser, tmp_path: Path) -> None:
    with opened(browser, tmp_path) as (page, file):
        add(page, "first")
        before = file.read_text()
        page.get_by_text("Edit as text").click()
        text = page.get_by_role("textbox", name="corrections.toml")
        text.fill(before + "# mine\n")
        someone_else_writes(page, file, before + "\n" + entry("theirs"))
        note = page.get_by_role("note")
        expect(note).to_contain_text("has changed since you began this draft")
        comes_again(page, "Corrections")
        expect(text).to_have_value(before + "# mine\n")
        expect(note).to_contain_text("This is your earlier draft.")
        sound(page)
        page.locator(".form:has(textarea)").get_by_role("button", name="Show the change").click()
        dialog = page.get_by_role("dialog")
        expect(dialog.locator(".added")).to_have_text(["+# mine"])
        expect(dialog.locator(".removed")).to_have_count(0)
        page.get_by_role("button", name="Save and process again").click()
        expect(text).to_have_value(before + "# mine\n\n" + entry("theirs"))
        expect(note).to_have_count(0)
        assert file.read_text() == text.input_value()


@pytest.mark.slow
def test_a_change_of_an_entry_is_kept_and_says_if_someone_else_changed_it(browser: Browser, tmp_path: Path) -> None:
    with opened(browser, tmp_path) as (page, file):
        add(page, "first")
        card = page.locator(".cards > li", has_text="first")
        card.get_by_role("button", name="Edit", exact=True).click()
        card.get_by_label("reason").fill("fell down")
        someone_else_writes(page, file, THEIRS + "\n" + file.read_text())
        comes_again(page, "Corrections")
        expect(card.get_by_label("reason")).to_have_value("fell down")
        card.get_by_role("button", name="Show the change").click()
        expect(page.locator("dialog .added")).to_have_text(['+reason = "fell down"'])
        page.keyboard.press("Escape")
        someone_else_writes(page, file, entry("first") + "floor = 2\n")
        note = page.get_by_role("note")
        expect(note).to_contain_text("someone else changed or removed it")
        expect(note).to_contain_text("You typed: id first · reason fell down")
        comes_again(page, "Corrections")
        expect(note).to_contain_text("You typed: id first · reason fell down")
        note.get_by_role("button", name="Discard").click()
        expect(note).to_have_count(0)


def comes_again(page: Page, tab: str) -> None:
    """Leave the tab and return to it, then load the page again and return to it."""
    open_view(page, "Compare")
    open_view(page, tab)
    page.reload()
    is_loaded(page)
    open_view(page, tab)


@pytest.mark.slow
def test_painted_walls_stay_and_ctrl_z_takes_a_stroke_back(browser: Browser, tmp_path: Path) -> None:
    with opened(browser, tmp_path) as (page, file):
        add(page, "first")
        saved = file.read_text()
        page.get_by_role("tab", name="Prepare").click()
        step(page, "Walls and walkable space")
        area = page.locator("[data-area]")
        expect(area).to_contain_text("are walkable.")
        page.get_by_label("Tool").select_option("brush")
        areas = [area.get_attribute("data-area") or ""]
        extent = extent_of(page, 1)
        for y in (3.0, 5.0):
            page.mouse.move(*pixel(page, extent, 0.5, y))
            page.mouse.down()
            page.mouse.move(*pixel(page, extent, 3.5, y), steps=5)
            page.mouse.up()
            expect(area).not_to_have_attribute("data-area", areas[-1])
            areas.append(area.get_attribute("data-area") or "")

        someone_else_writes(page, file, saved + "\n" + THEIRS)
        expect(area).to_have_attribute("data-area", areas[2])
        page.keyboard.press("Control+z")
        expect(area).to_have_attribute("data-area", areas[1])
        page.keyboard.press("Control+Shift+z")
        expect(area).to_have_attribute("data-area", areas[2])

        open_view(page, "Corrections")
        page.get_by_role("tab", name="Prepare").click()
        expect(area).to_have_attribute("data-area", areas[2])
        page.locator(".map-tools select").first.select_option("2")
        expect(area).not_to_have_attribute("data-area", areas[2])
        page.locator(".map-tools select").first.select_option("1")
        expect(area).to_have_attribute("data-area", areas[2])

        page.reload()
        is_loaded(page)
        expect(page.locator("summary", has_text="Walls").locator(".chip")).to_have_text("draft")
        step(page, "Walls and walkable space")
        expect(area).to_have_attribute("data-area", areas[2])
        note = page.get_by_role("note")
        expect(note).to_contain_text("This is your earlier draft.")
        sound(page)
        for left in (areas[1], areas[0], areas[0]):
            page.locator("h1").click()
            page.keyboard.press("Control+z")
            expect(area).to_have_attribute("data-area", left)
        assert file.read_text() == saved + "\n" + THEIRS
        page.keyboard.press("Control+Shift+z")
        expect(area).to_have_attribute("data-area", areas[1])
        note.get_by_role("button", name="Discard").click()
        expect(area).to_have_attribute("data-area", areas[0])
        expect(note).to_have_count(0)


@pytest.mark.slow
def test_a_plan_of_landmarks_stays_until_it_is_written(browser: Browser, tmp_path: Path) -> None:
    with opened(browser, tmp_path) as (page, file):
        step(page, "Landmarks")
        page.get_by_label("Minimum number").fill("9")
        page.get_by_role("button", name="Plan the landmarks").click()
        told = page.locator("[data-error]")
        rows = page.get_by_role("list", name="Landmarks").locator(".row")
        expect(told).to_be_visible()
        planned = told.get_attribute("data-error") or ""
        rows.first.click()
        page.get_by_role("button", name="Remove", exact=True).click()
        expect(told).not_to_have_attribute("data-error", planned)
        page.keyboard.press("Control+z")
        expect(told).to_have_attribute("data-error", planned)
        rows.nth(1).click()
        page.get_by_role("button", name="Remove", exact=True).click()
        expect(told).not_to_have_attribute("data-error", planned)
        changed, names = told.get_attribute("data-error") or "", rows.all_inner_texts()

        someone_else_writes(page, file, THEIRS)
        expect(told).to_have_attribute("data-error", changed)
        comes_again_to_the_plan(page)
        expect(told).to_have_attribute("data-error", changed)
        assert rows.all_inner_texts() == names
        expect(page.get_by_label("Minimum number")).to_have_value("9")
        expect(page.get_by_role("note")).to_contain_text("This is your earlier draft.")
        sound(page)
        page.get_by_role("button", name="Write to the survey").click()
        expect(page.get_by_text("landmarks were added to the survey.")).to_be_visible()
        expect(told).to_have_count(0)
        assert len(page.request.get("/api/survey").json()["landmarks"]) >= len(names)
        page.reload()
        is_loaded(page)
        expect(page.locator("summary .chip")).to_have_count(0)


def comes_again_to_the_plan(page: Page) -> None:
    """As :func:`comes_again`; the step is open after a change of tab, and closed after a reload."""
    open_view(page, "Compare")
    page.get_by_role("tab", name="Prepare").click()
    expect(page.locator("[data-error]")).to_be_visible()
    page.reload()
    is_loaded(page)
    step(page, "Landmarks")


@pytest.mark.slow
def test_a_dropped_plan_stays_with_what_was_typed_of_it(browser: Browser, tmp_path: Path) -> None:
    with opened(browser, tmp_path) as (page, file):
        step(page, "Plan and scale")
        page.locator(".drop input").set_input_files(drawn_floor.framed_pdf(tmp_path))
        expect(page.get_by_text("Click a point of the plan")).to_be_visible()
        page.get_by_role("button", name="Set a point at the centre of the map").click()
        page.get_by_label("Name", exact=True).fill("Third")
        page.get_by_label("Distance (m)").fill("20")
        page.keyboard.press("Control+z")  # of the text field
        expect(page.get_by_text("Point 1:")).to_be_visible()
        page.get_by_label("Distance (m)").fill("20")
        someone_else_writes(page, file, THEIRS)
        open_view(page, "Compare")
        page.get_by_role("tab", name="Prepare").click()
        expect(page.get_by_label("Distance (m)")).to_have_value("20")
        page.reload()
        is_loaded(page)
        step(page, "Plan and scale")
        expect(page.get_by_label("Name", exact=True)).to_have_value("Third")
        expect(page.get_by_label("Distance (m)")).to_have_value("20")
        expect(page.get_by_text("Point 1:")).to_be_visible()
        page.locator("h1").click()
        page.keyboard.press("Control+z")
        expect(page.get_by_text("Point 1:")).to_have_count(0)
        page.get_by_role("note").get_by_role("button", name="Discard").click()
        expect(page.locator(".drop")).to_be_visible()
