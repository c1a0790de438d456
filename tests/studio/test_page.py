"""The page in a browser: every fault of a survey is found, corrected, taken back and compared, by touch on a narrow
screen and by keyboard alone."""

from __future__ import annotations

import io
import itertools
import json
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from axe_playwright_python.sync_playwright import Axe
from PIL import Image
from playwright.sync_api import Browser, ConsoleMessage, Locator, Page, expect

from tests.studio.running import running_studio
from tests.views.browser import running_browser

LATEST_MS = 120_000
expect.set_options(timeout=LATEST_MS)
WALKS = ".walks tbody tr"
KINDS = {"swapped", "mis_surveyed", "moved", "wrong_floor"}
NEAR_M = 0.3
Act = Callable[[Locator], None]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as running:
        yield running


@contextmanager
def studio_page(
    browser: Browser, folder: Path, tmp_path: Path, *options: str, jobs: int = 1, **view: Any
) -> Iterator[tuple[Page, Path]]:
    """A page on a copy of a survey and its labels."""
    survey, labels = tmp_path / "survey", tmp_path / "labels"
    shutil.copytree(folder / "survey", survey)
    shutil.copytree(folder / "labels", labels)
    with (
        running_studio(survey, "--labels", str(labels), "--jobs", str(jobs), *options) as server,
        watched_page(browser, server.url, server.token, **view) as page,
    ):
        expect(page.get_by_role("tab", name="Walks")).to_be_visible(timeout=LATEST_MS)
        yield page, tmp_path


@contextmanager
def watched_page(browser: Browser, url: str, token: str, **view: Any) -> Iterator[Page]:
    """A page of a running studio; whatever the browser complains about fails the test."""
    problems: list[str] = []
    context = browser.new_context(base_url=url, locale="en", reduced_motion="reduce", **view)
    page = context.new_page()
    page.set_default_timeout(LATEST_MS)
    page.on("console", lambda message: problems.append(message.text) if complains(message) else None)
    page.on("pageerror", lambda error: problems.append(f"page error: {error}"))
    page.on("request", lambda request: problems.append(request.url) if foreign(request.url, url) else None)
    page.goto(f"{url}/#{token}")
    yield page
    context.close()
    assert problems == []


def complains(message: ConsoleMessage) -> bool:
    """Tell errors, of the content security policy too, from notes; refused changes (422, 409) are part of a test.

    What has no address is no file of the page's: the browser's driver takes pictures by styles of its own.
    """
    refused = any(status in message.text for status in ("422 (Unprocessable", "409 (Conflict"))
    return message.type == "error" and bool(message.location["url"]) and not refused


def foreign(url: str, own: str) -> bool:
    return not url.startswith((own, "data:", "blob:"))


def click(locator: Locator) -> None:
    locator.click()


def tap(locator: Locator) -> None:
    locator.tap()


def press(locator: Locator) -> None:
    """Go on from key to key until the thing has the focus, then press it."""
    expect(locator).to_be_enabled(timeout=LATEST_MS)
    for _ in range(400):
        if locator.evaluate("element => element === document.activeElement"):
            locator.page.keyboard.press("Enter")
            return
        locator.page.keyboard.press("Tab")
    raise AssertionError(f"the keyboard does not lead to {locator}")


def choose(select: Locator, text: str, act: Act) -> None:
    if act is press:
        select.page.keyboard.press("Tab")
        while not select.evaluate("element => element === document.activeElement"):
            select.page.keyboard.press("Tab")
        select.page.keyboard.type(text)
    else:
        select.select_option(label=text)


CHECK = {"Walks", "Faults", "Landmarks", "Corrections", "Compare"}
"""Views of one step."""


def open_view(page: Page, name: str, act: Act = click) -> None:
    """A view by the tab of its step, and its own where the step has several."""
    if name in CHECK:
        open_tab(page, "Check", act)
    open_tab(page, name, act)


def open_tab(page: Page, name: str, act: Act) -> None:
    """Tabs of one bar: one of them is in the order of the Tab key, arrows lead to the others."""
    tab = page.get_by_role("tab", name=name)
    if act is not press:
        return act(tab)
    bar = page.get_by_role("tablist").filter(has=tab)
    press(bar.locator("[role=tab][aria-selected=true]"))
    for _ in bar.get_by_role("tab").all():
        if tab.get_attribute("aria-selected") == "true":
            return None
        page.keyboard.press("ArrowRight")
    raise AssertionError(f"arrow keys do not lead to {name}")


def idle(page: Page) -> None:
    """Wait until labels follow the corrections: no job is under way, and nothing is left to be mapped again."""
    page.wait_for_timeout(300)
    deadline = LATEST_MS
    while deadline > 0:
        jobs = page.request.get("/api/jobs").json()["jobs"]
        sessions = page.request.get("/api/sessions").json()["sessions"]
        running = [job for job in jobs if job["state"] in ("queued", "running")]
        if not running and not any(session["stale"] for session in sessions):
            return
        page.wait_for_timeout(100)
        deadline -= 100
    raise AssertionError("labels do not follow the corrections")


def correct_all(page: Page, act: Act) -> None:
    open_view(page, "Faults", act)
    cards = page.locator(".cards > li[data-kind]")
    expect(cards).to_have_count(len(KINDS), timeout=LATEST_MS)
    assert {card.get_attribute("data-kind") for card in cards.all()} == KINDS
    for kind in sorted(KINDS):
        act(page.locator(f"li[data-kind={kind}]").get_by_role("button", name="Correct"))
        expect(page.locator(f"li[data-kind={kind}]")).to_have_count(0, timeout=LATEST_MS)
        idle(page)
    expect(page.get_by_text("Only a full search can say that there is none.")).to_be_visible()


def errors_m(folder: Path) -> dict[str, float]:
    """Those of the labels beside a survey of generated walks."""
    return errors_of(folder / "labels", folder / "survey")


def errors_of(labels: Path, survey: Path) -> dict[str, float]:
    """By session: the distance (m) to truth that 95 % of its labelled frames keep; infinite where none is labelled."""
    found = {}
    for path in sorted((labels / "trajectory").glob("*.parquet")):
        frames = pl.read_parquet(path)
        device, session = frames.select("device", "session").row(0)
        (truth_file,) = survey.glob(f"*/{device}/{session.replace(':', '*')}/truth.csv")
        truth = pl.read_csv(truth_file)
        known = frames.filter(pl.col("x").is_not_null()).join_asof(
            truth, on="time_ns", suffix="_true", strategy="nearest"
        )
        off = np.hypot(known["x"] - known["x_true"], known["y"] - known["y_true"])
        right_floor = bool((known["floor"] == known["floor_true"]).all())
        found[path.stem] = float(np.quantile(off, 0.95)) if len(known) and right_floor else np.inf
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("act", "view"),
    [
        pytest.param(tap, {"viewport": {"width": 400, "height": 800}, "has_touch": True}, id="touch"),
        pytest.param(press, {"viewport": {"width": 1000, "height": 700}}, id="keyboard"),
    ],
)
def test_every_fault_is_found_corrected_taken_back_and_compared(
    browser: Browser, faulty: Path, tmp_path: Path, act: Act, view: dict[str, Any]
) -> None:
    assert max(errors_m(faulty).values()) > NEAR_M
    with studio_page(browser, faulty, tmp_path, **view) as (page, folder):
        correct_all(page, act)
        assert max(errors_m(folder).values()) < NEAR_M
        corrections = folder / "survey" / "corrections.toml"
        text = corrections.read_text()
        act(page.get_by_role("button", name="Undo", exact=True))
        expect(page.get_by_role("button", name="Redo", exact=True)).to_be_enabled(timeout=LATEST_MS)
        idle(page)
        assert corrections.read_text() != text
        assert max(errors_m(folder).values()) > NEAR_M
        act(page.get_by_role("button", name="Redo", exact=True))
        expect(page.get_by_role("button", name="Redo", exact=True)).to_be_disabled(timeout=LATEST_MS)
        idle(page)
        assert corrections.read_text() == text
        assert max(errors_m(folder).values()) < NEAR_M

        flip = page.locator(".map-tools").get_by_role("button", name="Before / after")
        for output in ("before", "labels"):
            with page.expect_response(lambda answer, output=output: f"/api/tracks?output={output}" in answer.url):  # type: ignore[misc]
                act(flip)
        adds_an_entry(page, act)
        open_view(page, "Compare", act)
        choose(page.get_by_label("Second"), "before the last change", act)
        act(page.get_by_role("button", name="Compare", exact=True))
        expect(page.get_by_label("Divider between the two maps")).to_be_visible(timeout=LATEST_MS)
        rows = page.get_by_role("region", name="Walks").locator("tbody tr")
        expect(rows).to_have_count(12)


@pytest.mark.slow
def test_the_views_by_hand(browser: Browser, faulty: Path, tmp_path: Path) -> None:
    view: dict[str, Any] = {"viewport": {"width": 1400, "height": 900}}
    others = [made_otherwise(faulty / "labels", tmp_path / name, shift) for name, shift in (("one", 0.0), ("two", 4.0))]
    compared = [option for other in others for option in ("--compare", str(other))]
    with studio_page(browser, faulty, tmp_path, *compared, **view) as (page, folder):
        compares_two_outputs(page)
        filters(page)
        shows_everything_on_the_map(page)
        time_and_span(page)
        drags_a_landmark(page)
        fills_in_every_kind(page)
        types_a_text_of_corrections(page)
        assert not (folder / "survey" / "corrections.toml").exists()
        follows_what_others_change(page, folder / "survey" / "corrections.toml")
        says_it_in_german(page)
        accessible(page)


@pytest.mark.slow
def test_labels_that_are_missing_are_made(browser: Browser, faulty: Path, tmp_path: Path) -> None:
    one = tmp_path / "one"
    shutil.copytree(faulty / "survey", one / "survey", ignore=shutil.ignore_patterns("LG", "OnePlus", "2021-12-22T1*"))
    (one / "labels").mkdir()
    with studio_page(browser, one, tmp_path, jobs=2) as (page, folder):
        walks = page.locator(WALKS)
        count = walks.count()
        expect(walks.filter(has_text="not processed yet")).to_have_count(count)
        page.get_by_role("button", name=f"Process {count} walk").click()
        expect(walks.filter(has_text="%")).to_have_count(count, timeout=LATEST_MS)
        expect(page.get_by_role("button", name="with missing or outdated labels")).to_have_count(0)
        assert len(list((folder / "labels" / "trajectory").glob("*.parquet"))) == count


def made_otherwise(labels: Path, other: Path, shift_m: float) -> Path:
    """A copy of labels, as of another strategy, its walks moved along x."""
    shutil.copytree(labels, other)
    run = json.loads((other / "run.json").read_text())
    run["settings"]["strategy"] = other.name
    (other / "run.json").write_text(json.dumps(run))
    for table in (other / "trajectory").glob("*.parquet"):
        pl.read_parquet(table).with_columns(pl.col("x") + shift_m).write_parquet(table)
    return other


def compares_two_outputs(page: Page) -> None:
    open_view(page, "Compare")
    page.get_by_label("First").select_option(label="other labels: one (one)")
    page.get_by_label("Second").select_option(label="other labels: two (two)")
    page.get_by_role("button", name="Compare", exact=True).click()
    totals = page.get_by_role("region", name="Totals").locator("tbody tr")
    expect(totals.first).to_have_text("walks1212", timeout=LATEST_MS)
    assert totals.last.inner_text().startswith("mean error (m)")
    walks = page.get_by_role("region", name="Walks").locator("tbody tr")
    assert [row.locator("td").last.inner_text() for row in walks.all()] == ["4.00"] * 12
    expect(page.get_by_role("row").filter(has_text="strategy")).to_contain_text("one")
    line = page.get_by_label("Divider between the two maps")
    pictures = {}
    for share in (1, 0, 0.5):
        line.fill(str(share))
        pictures[share] = picture(page)
    middle = pictures[1].shape[1] // 2
    left, right = np.s_[80:, : middle - 40], np.s_[80:, middle + 40 :]  # below the names and beside the line's handle
    assert (pictures[1][left] != pictures[0][left]).any()
    assert (pictures[1][right] != pictures[0][right]).any()
    assert (pictures[0.5][left] == pictures[1][left]).all()
    assert (pictures[0.5][right] == pictures[0][right]).all()
    page.get_by_role("button", name="Stop comparing").click()
    open_view(page, "Walks")


def filters(page: Page) -> None:
    rows = page.locator(WALKS)
    expect(rows).to_have_count(12)
    sorts(page)
    page.get_by_text("Filter", exact=True).click()
    page.locator(".filters").get_by_label("Device").select_option("LG")
    expect(rows).to_have_count(4)
    page.get_by_label("Search").fill("2021-12-22")
    expect(rows).to_have_count(2)
    page.get_by_label("Search").fill("nothing like it")
    expect(page.get_by_text("No walk matches the filter.")).to_be_visible()
    page.get_by_label("Search", exact=True).fill("")
    page.locator(".filters").get_by_label("Device").select_option("")
    page.locator(".filters").get_by_label("Date").select_option("2021-12-21")
    assert 0 < rows.count() < 12
    assert all("2021-12-21" in row.inner_text() for row in rows.all())
    page.locator(".filters").get_by_label("Date").select_option("")
    page.locator(".filters").get_by_label("Finding").select_option("contradicting_landmark")
    assert 0 < rows.count() < 12
    assert all("warning" in row.inner_text() for row in rows.all())
    page.locator(".filters").get_by_label("Finding").select_option("")


def sorts(page: Page) -> None:
    """By the labelled share, down and up; the head says so to readers of the screen."""
    head = page.get_by_role("columnheader").filter(has_text="Labelled")
    shares = []
    for direction in ("ascending", "descending"):
        head.get_by_role("button").click()
        expect(head).to_have_attribute("aria-sort", direction)
        shares.append([float(text.split()[0]) for text in page.locator(f"{WALKS} td:nth-child(2)").all_inner_texts()])
    assert shares[0] == sorted(shares[0])
    assert shares[1] == sorted(shares[0], reverse=True)
    assert shares[0][0] < shares[0][-1]
    page.get_by_role("columnheader").first.get_by_role("button").click()


def shows_everything_on_the_map(page: Page) -> None:
    """Each thing to be shown changes the picture: bands, scans, layers, colours, all floors above one another."""
    page.locator(".map-tools summary").click()
    seen = [picture(page)]
    for name in ("95 % confidence band", "Wi-Fi scans", "Walkable space", "Contradictions"):
        page.get_by_label(name).click()
        seen.append(picture(page))
    for colour in ("sigma", "speed", "session", "device", "age"):
        page.get_by_label("Colour by").select_option(colour)
        seen.append(picture(page))
    page.get_by_label("Colour by").select_option("status")
    page.get_by_label("All floors (3-D)").check()
    seen.append(picture(page))
    page.get_by_label("Rotate").fill("1.5")
    seen.append(picture(page))
    page.get_by_label("All floors (3-D)").uncheck()
    page.locator(".map-tools summary").click()
    assert all((one != other).any() for one, other in itertools.pairwise(seen))


def picture(page: Page) -> np.ndarray[Any, Any]:
    """The map, once it has come to rest."""
    last = None
    for _ in range(60):
        page.wait_for_timeout(600)
        content = page.locator(".map .canvas").screenshot(caret="initial")
        if content == last:
            return np.array(Image.open(io.BytesIO(content)).convert("RGB"))
        last = content
    raise AssertionError("the map does not come to rest")


def follows_what_others_change(page: Page, corrections: Path) -> None:
    """What an editor or a second studio writes is seen, and a change made before it is refused, not written over it."""
    open_view(page, "Landmarks")
    page.locator(".list .row").nth(3).click()
    page.locator(".chosen").get_by_role("button", name="Show the change").first.click()
    save = page.get_by_role("button", name="Save and process again")
    expect(save).to_be_visible(timeout=LATEST_MS)
    theirs = '# theirs\n[[exclude_session]]\nsession = "nobody\'s"\n'
    corrections.write_text(theirs)
    save.click()
    expect(page.get_by_role("alert")).to_contain_text("was changed by someone else", timeout=LATEST_MS)
    assert corrections.read_text() == theirs
    page.get_by_role("button", name="Close").last.click()
    open_view(page, "Corrections")
    entry = page.locator(".cards > li")
    expect(entry).to_contain_text("nobody's", timeout=LATEST_MS)
    expect(entry).to_contain_text("has no effect", timeout=LATEST_MS)
    corrections.unlink()
    expect(page.get_by_text("There are no corrections.")).to_be_visible(timeout=LATEST_MS)


def time_and_span(page: Page) -> None:
    page.locator(f"{WALKS} button").first.click()
    moment = page.locator(".time output")
    expect(moment).to_contain_text("/ 2:", timeout=LATEST_MS)
    expect(page.locator(".strip .landmark").first).to_be_attached()  # keys lead to what has come
    page.get_by_role("button", name="One second forward").click()
    expect(moment).to_contain_text("0:01.0")
    page.keyboard.press(".")
    expect(moment).to_contain_text("0:02.0")
    page.keyboard.press("Shift+F")  # nothing before it
    expect(moment).to_contain_text("0:02.0")
    page.keyboard.press("F")
    expect(moment).not_to_contain_text("0:02.0")
    finding = moment.inner_text()
    page.keyboard.press("Shift+L")
    expect(moment).not_to_have_text(finding)
    page.locator(".time .slider").fill("1")
    page.keyboard.press("[")
    page.get_by_label("Jump to").select_option("landmark")
    page.get_by_role("button", name="Next", exact=True).click()
    expect(moment).not_to_contain_text("0:01.0")
    page.get_by_role("button", name="End the span here").click()
    page.get_by_text("Correct this walk").click()
    page.get_by_role("button", name="Exclude the span").click()
    lines = page.get_by_role("dialog")
    expect(lines).to_contain_text("[[exclude_span]]")
    expect(lines).to_contain_text("from_s = 1")
    expect(lines).to_contain_text("1 walk will be processed again")
    page.get_by_role("button", name="Do not save").click()


def drags_a_landmark(page: Page) -> None:
    open_view(page, "Landmarks")
    page.locator(".list .row").nth(3).click()
    page.wait_for_timeout(1000)
    x, y = page.get_by_label("x (m)"), page.get_by_label("y (m)")
    before = float(x.input_value()), float(y.input_value())
    box = page.locator(".map .canvas").bounding_box()
    assert box is not None
    covered = page.locator(".over").evaluate("element => element.clientHeight")
    middle = box["x"] + box["width"] / 2 - 20, box["y"] + (box["height"] - covered) / 2  # of what nothing covers
    page.mouse.move(*middle)
    page.mouse.down()
    page.mouse.move(middle[0] + 30, middle[1], steps=3)
    page.mouse.move(middle[0] + 60, middle[1], steps=3)
    page.mouse.up()
    expect(x).not_to_have_value(f"{before[0]:g}")
    assert float(x.input_value()) > before[0]
    assert float(y.input_value()) == pytest.approx(before[1], abs=0.3)
    page.locator(".chosen").get_by_role("button", name="Show the change").first.click()
    expect(page.get_by_role("dialog")).to_contain_text("[[move_landmark]]")
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_have_count(0)


ENTRIES: dict[str, dict[str, str]] = {
    "exclude_session": {"device": "LG"},
    "exclude_span": {"from (s)": "1.5"},
    "exclude_landmark": {"id": "3"},
    "swap_landmarks": {"id 1": "3", "id 2": "5"},
    "move_landmark": {"id": "3", "x (m)": "1", "y (m)": "2", "from": "2022-01-10T08:30:00"},
    "shift_clock": {"table": "wifi", "seconds to add": "-0.35"},
    "rename_landmark": {"id": "3", "change to": "3 (second)", "walk": "2021-12-21T10:00:00", "to (s)": "20"},
    "set_landmark_floor": {"id": "3", "change to": "2"},
    "landmark_units": {"unit": "ft", "floor": "1"},
    "turn_landmarks": {"floor": "1", "shift (m) 1": "60", "reason": "of an older plan"},
    "set_floor": {"change to": "2", "floor": "1"},
    "set_device": {"change to": "LG", "device": "Pixel"},
    "drop_repeated_scans": {},
    "set_tap": {"at (s)": "12.5", "x (m)": "1", "y (m)": "2", "walk": "2021-12-20T09:00:00"},
    "ignore_fault": {"fault": "swapped", "landmarks": "2, 9", "reason": "known"},
    "move_control_point": {"id": "0", "x (m)": "1", "y (m)": "2", "floor": "1"},
}
"""Something to fill in for each kind of correction."""


def fills_in_every_kind(page: Page) -> None:
    page.set_viewport_size({"width": 400, "height": 800})
    open_view(page, "Corrections")
    page.get_by_text("Add a correction").click()
    form = page.locator("form")
    kinds = form.get_by_label("Kind").locator("option")
    assert {kind.get_attribute("value") for kind in kinds.all()} == ENTRIES.keys()
    for kind, values in ENTRIES.items():
        form.get_by_label("Kind").select_option(kind)
        for label, value in values.items():
            if label in ("table", "unit", "fault"):
                form.locator("label", has_text=label).locator("select").last.select_option(value)
            else:
                form.get_by_label(label, exact=True).fill(value)
        form.get_by_role("button", name="Show the change").click()
        lines = page.locator("dialog .added")
        expect(lines.first).to_have_text(f"+[[{kind}]]", timeout=LATEST_MS)
        assert len([line for line in lines.all_inner_texts() if " = " in line]) >= len(
            {label.rstrip(" 12") for label in values}
        )
        page.keyboard.press("Escape")
    found = Axe().run(page).response["violations"]
    assert [one["id"] for one in found if one["impact"] in ("serious", "critical")] == []
    assert page.evaluate("document.documentElement.scrollWidth") == 400
    page.set_viewport_size({"width": 1400, "height": 900})
    open_view(page, "Walks")
    open_view(page, "Corrections")
    expect(form.get_by_label("Kind")).to_have_value(kind)  # a draft, which is open
    form.get_by_role("button", name="Discard").click()
    form.get_by_label("device", exact=True).fill("nobody's")
    form.get_by_role("button", name="Show the change").click()
    page.get_by_role("button", name="Save and process again").click()
    page.get_by_role("button", name="Edit", exact=True).click()
    page.locator(".cards form").get_by_label("reason").fill("too far")
    page.locator(".cards form").get_by_role("button", name="Show the change").click()
    expect(page.get_by_role("dialog")).to_contain_text('+reason = "too far"')
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Remove", exact=True).click()
    page.get_by_role("button", name="Save and process again").click()
    expect(page.get_by_text("There are no corrections.")).to_be_visible(timeout=LATEST_MS)
    idle(page)


def adds_an_entry(page: Page, act: Act) -> None:
    """By the form that every kind of correction has; it is not saved."""
    open_view(page, "Corrections", act)
    act(page.get_by_text("Add a correction"))
    choose(page.get_by_label("Kind"), "drop repeated scans", act)
    act(page.locator("form").get_by_role("button", name="Show the change"))
    expect(page.get_by_role("dialog")).to_contain_text("+[[drop_repeated_scans]]", timeout=LATEST_MS)
    act(page.get_by_role("button", name="Do not save"))


def types_a_text_of_corrections(page: Page) -> None:
    open_view(page, "Corrections")
    page.get_by_text("Edit as text").click()
    page.get_by_label("corrections.toml").fill("[[swap_landmarks]]\nids = [1]\n")
    page.locator(".form:has(textarea)").get_by_role("button", name="Show the change").click()
    expect(page.get_by_role("alert")).to_contain_text("swap_landmarks")
    page.get_by_role("button", name="Close").click()


def every_tab(page: Page) -> Iterator[Locator]:
    """Each tab, opened: those of the steps, and those of a step's views."""
    steps, views = page.get_by_role("tablist").first, page.get_by_role("tablist").nth(1)
    for step in steps.get_by_role("tab").all():
        step.click()
        yield step
        for view in views.get_by_role("tab").all() if views.count() else ():
            view.click()
            yield view


def accessible(page: Page) -> None:
    """No serious violation in any view, in light and dark, wide and narrow, English and German."""
    for dark in (False, True):
        for width in (1400, 400):
            page.set_viewport_size({"width": width, "height": 900})
            for tab in every_tab(page):
                found = Axe().run(page).response["violations"]
                serious = [
                    (one["id"], one["nodes"][0]["html"]) for one in found if one["impact"] in ("serious", "critical")
                ]
                assert (dark, width, tab.inner_text(), serious) == (dark, width, tab.inner_text(), [])
            page.locator(".tools button[lang]").click()
        page.locator(".tools button").last.click()


def says_it_in_german(page: Page) -> None:
    open_view(page, "Faults")
    expect(page.locator(".cards > li[data-kind]")).to_have_count(len(KINDS), timeout=LATEST_MS)
    english = page.locator(".cards h3, .cards h3 + p").all_inner_texts()
    page.get_by_role("button", name="Deutsch").click()
    german = page.locator(".cards h3, .cards h3 + p").all_inner_texts()
    assert len(german) == len(english) == 2 * len(KINDS)
    assert not set(german) & set(english)
    assert "die Landmarken 2 und 9 von Stockwerk 1 sind vertauscht" in german
    page.get_by_role("tab", name="Korrekturen").click()
    expect(page.get_by_text("Als Text bearbeiten")).to_be_visible()  # open since it was typed in
    page.get_by_label("corrections.toml").fill("[[exclude_span]]\nfloor = 1\nfrom_s = 5\nto_s = 2\n")
    page.locator(".form:has(textarea)").get_by_role("button", name="Änderung zeigen").click()
    expect(page.get_by_role("alert")).to_contain_text("from_s muss kleiner als to_s sein", timeout=LATEST_MS)
    page.get_by_role("button", name="Schließen").click()
    page.get_by_role("button", name="English").click()
