"""All of a building's work in the browser: from an empty folder and its plans to a link to one walk at one moment."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Locator, Page, expect
from pypdfium2 import PdfDocument

from tests.site.plans import drawn_floor
from tests.studio.receiving.zips import digest, session_zip, signed
from tests.studio.running import running_studio
from tests.studio.sharing.file_servers import plain_server, range_server, shown
from tests.studio.sharing.test_export import WHOLE
from tests.studio.test_page import WALKS, click, errors_of, idle, open_tab, open_view, press, watched_page
from tests.studio.test_prepare import POINTS, station_files
from tests.views.browser import running_browser
from vislam2tag.datasets.folder import open_dataset
from vislam2tag.pipeline.site.show import write_walkable
from vislam2tag.simulation.scenario import SITE_SEED, site_survey
from vislam2tag.simulation.settings import SessionLayout
from vislam2tag.simulation.site_building import site_building, site_floors
from vislam2tag.simulation.survey import WritingOptions, simulate
from vislam2tag.site.discover import read_site
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.studio.receiving.server import UPLOADS

WIDE, NARROW = {"width": 1400, "height": 900}, {"width": 400, "height": 800}
OWN = {"truth.csv", "script.txt"}
"""Files that the simulator puts beside what a phone writes."""
WALKS_S = (40.0, 40.0, 50.0, 60.0)
NEAR_M = 0.3
SIDE_M = 100.0
"""A plan without a scale is drawn so large."""
DROPPED = """([name, text]) => {
  const dropped = new DataTransfer();
  dropped.items.add(new File([Uint8Array.from(atob(text), (one) => one.charCodeAt(0))], name));
  return dropped;
}"""


@pytest.mark.slow
def test_a_building_goes_from_its_plans_to_a_link_to_one_walk(tmp_path: Path) -> None:
    """The surveyor writes two landmarks under each other's name, which the walks tell."""
    survey, labels = tmp_path / "survey", tmp_path / "survey-labels"
    survey.mkdir()
    with running_browser() as browser:
        with (
            running_studio(survey, "--jobs", "1") as server,
            watched_page(browser, server.url, server.token, viewport=WIDE) as page,
        ):
            scales_a_plan_by_two_clicks(page, drawn_floor.framed_pdf(tmp_path))
            adds_a_plan_that_knows_its_scale(page, drawn_floor.dxf(tmp_path))
            area_m2 = mends_a_wall(page)
            landmarks = plans_landmarks_and_drags_one(page)
            makes_sheets(page, len(landmarks))
            walks = walks_on(survey, tmp_path / "walked")
            measured = {one["id"]: complex(one["x"] + 0.03, one["y"] - 0.02) for one in landmarks}
            first, *_, last = measured
            measured[first], measured[last] = measured[last], measured[first]
            registers(page, station_files(tmp_path, measured, 19 + 9j))
            has_nothing_to_share_yet(page)
            receives_walks_and_shows_what_is_covered(page, walks)
            swapped_m = max(errors_of(labels, tmp_path / "walked").values())
            corrects_the_swapped_landmarks(page, {first, last})
            assert max(errors_of(labels, tmp_path / "walked").values()) < min(NEAR_M, 0.7 * swapped_m)
            shares_data_set_and_page(page)
        follows_a_link(browser, tmp_path / "survey-page")

    dataset = open_dataset(tmp_path / "survey-dataset")
    assert dataset.info.tables["fingerprints"].rows > 0
    assert dataset.info.bssid_key is not None
    assert dataset.access_points.collect()["ssid"].drop_nulls().is_empty()

    site, _ = read_site(survey)
    assert [floor.number for floor in site.floors] == [1, 2]
    for floor in site.floors:
        assert floor_plan(floor).extent_m == pytest.approx((0, 20, 0, 10), abs=0.3)
    (found,) = write_walkable(survey, tmp_path / "walkable", [2], WalkableSettings(), None)
    assert found.area_m2 == pytest.approx(area_m2)
    assert dict(zip(site.landmarks.ids, site.landmarks.position_bcs @ (1, 1j), strict=True)) == {
        name: pytest.approx(place, abs=0.002) for name, place in measured.items()
    }
    assert pages(tmp_path / "survey-sheets" / "sheets.pdf") == len(measured)


def scales_a_plan_by_two_clicks(page: Page, pdf: Path) -> None:
    """An empty folder opens at this step."""
    area = page.locator(".drop")
    sound(page)
    text = base64.b64encode(pdf.read_bytes()).decode()
    area.dispatch_event("drop", {"dataTransfer": page.evaluate_handle(DROPPED, [pdf.name, text])})
    expect(page.get_by_text("Click a point of the plan")).to_be_visible()
    scale = SIDE_M / 1190.55
    for x, y in POINTS:
        page.mouse.click(*pixel(page, (0, SIDE_M, 0, 841.89 * scale), x * scale, y * scale))
        page.wait_for_timeout(400)  # two quick clicks are a double click
    page.get_by_label("Distance (m)").fill("20")
    sound(page)
    page.get_by_role("button", name="Add the floor").click()
    expect(page.get_by_text("The floor was added to site.toml.")).to_be_visible()


def adds_a_plan_that_knows_its_scale(page: Page, dxf: Path) -> None:
    page.locator(".drop input").set_input_files(dxf)
    expect(page.get_by_label("Scale")).to_have_value("file")
    assert page.get_by_label("Floor", exact=True).input_value() == "2"
    page.get_by_role("button", name="Add the floor").click()
    expect(page.locator(".drop")).to_be_visible()
    expect(page.locator(".map-tools select").first).to_have_value("2")


def mends_a_wall(page: Page) -> float:
    """The wall from (5, 0) to (5, 6) is prolonged by the brush, and a door opened by a polygon; returns the area."""
    step(page, "Walls and walkable space")
    area = page.locator("[data-area]")
    expect(area).to_contain_text("are walkable.")
    whole = float(area.get_attribute("data-area") or "nan")
    page.get_by_label("Tool").select_option("brush")
    extent = extent_of(page, 2)
    page.mouse.move(*pixel(page, extent, 5, 5.5))
    page.mouse.down()
    page.mouse.move(*pixel(page, extent, 5, 9.95), steps=6)
    page.mouse.up()
    expect(area).not_to_have_attribute("data-area", str(whole))
    cut = float(area.get_attribute("data-area") or "nan")
    assert cut == pytest.approx(whole - 50, abs=4)
    page.get_by_label("Tool").select_option("polygon")
    page.get_by_label("Paint as").select_option(label="floor: walkable")
    sound(page)
    for corner in ((4.5, 8), (5.5, 8), (5.5, 9.5)):
        page.mouse.click(*pixel(page, extent, *corner))
        page.wait_for_timeout(400)
    page.mouse.dblclick(*pixel(page, extent, 4.5, 9.5))
    expect(area).not_to_have_attribute("data-area", str(cut))
    with page.expect_response("**/api/prepare/walls"):
        page.get_by_role("button", name="Write to the survey").click()
    expect(page.get_by_text("The corrections are saved next to the plan.")).to_be_visible()
    kept = float(area.get_attribute("data-area") or "nan")
    assert cut < kept < whole
    return kept


def plans_landmarks_and_drags_one(page: Page) -> list[dict[str, Any]]:
    step(page, "Landmarks")
    page.get_by_label("Longest way without one (m)").fill("6")
    page.get_by_label("Minimum number").fill("9")
    with page.expect_response("**/api/prepare/plans") as answer:
        page.get_by_role("button", name="Plan the landmarks").click()
    first = answer.value.json()["landmarks"][0]
    told = page.locator("[data-error]")
    expect(told).to_be_visible()
    planned = told.get_attribute("data-error") or ""
    sound(page)
    extent = extent_of(page, 2)
    page.mouse.move(*pixel(page, extent, first["x"], first["y"]))
    page.mouse.down()
    page.mouse.move(*pixel(page, extent, 10, 5), steps=4)
    expect(told).not_to_have_attribute("data-error", planned)  # while it is dragged
    page.mouse.move(*pixel(page, extent, 19, 1), steps=4)
    page.mouse.up()
    expect(page.locator(".row[aria-pressed=true]")).to_contain_text(first["id"])
    sound(page)
    page.get_by_role("button", name="Undo", exact=True).last.click()
    expect(told).to_have_attribute("data-error", planned)
    adds_moves_and_takes_one_away_by_keys(page, told, planned)
    page.get_by_role("button", name="Write to the survey").click()
    expect(page.get_by_text("landmarks were added to the survey.")).to_be_visible()
    landmarks: list[dict[str, Any]] = page.request.get("/api/survey").json()["landmarks"]
    return landmarks


def adds_moves_and_takes_one_away_by_keys(page: Page, told: Locator, planned: str) -> None:
    press(page.get_by_role("button", name="Add one at the centre"))
    expect(told).not_to_have_attribute("data-error", planned)
    added = told.get_attribute("data-error") or ""
    page.locator(".map .canvas").focus()
    page.keyboard.press("ArrowRight")
    page.wait_for_timeout(400)
    press(page.get_by_role("button", name="Move to the centre of the map"))
    expect(told).not_to_have_attribute("data-error", added)
    press(page.get_by_role("button", name="Remove", exact=True))
    expect(told).to_have_attribute("data-error", planned)


def makes_sheets(page: Page, count: int) -> None:
    step(page, "Sheets to print")
    page.get_by_role("button", name="Create the sheets").click()
    expect(page.get_by_text(f"{count} sheets in")).to_be_visible()
    sound(page)
    with page.expect_download() as download:
        page.get_by_role("link", name="Download the PDF").click()
    assert pages(download.value.path()) == count


def registers(page: Page, files: Sequence[Path]) -> None:
    step(page, "Positions from surveyors")
    page.locator(".drop input").set_input_files(files)
    page.get_by_role("button", name="Adjust").click()
    expect(page.get_by_role("region", name="Residuals").locator("tbody").first.locator("tr")).to_have_count(8)
    expect(page.get_by_text("Arrows on the map")).to_be_visible()
    sound(page)
    page.get_by_label("Replace existing positions").check()
    page.get_by_role("button", name="Write to the survey").click()
    expect(page.get_by_text("Written: floor_2/marker_dict.csv")).to_be_visible()
    page.get_by_role("button", name="Deutsch").click()
    expect(page.get_by_text("Positions from surveyors")).to_have_count(0)
    page.get_by_role("button", name="English").click()


def walks_on(survey: Path, out: Path) -> list[bytes]:
    """Zips of walks on floor 2 as it is planned, as the phone app hands them over; with their truth in ``out``."""
    building = site_building(site_floors(survey, (2,)), SITE_SEED)
    scenario = site_survey(building, survey, 5, "none", ("LG",), len(WALKS_S))
    timed = [replace(one, duration_s=seconds) for one, seconds in zip(scenario.sessions, WALKS_S, strict=True)]
    simulate(replace(scenario, sessions=tuple(timed)), out, WritingOptions(layout=SessionLayout.PHONE))
    return [
        session_zip({path.name: path.read_bytes() for path in walk.iterdir() if path.name not in OWN}, walk.name)
        for walk in sorted((out / "floor_2" / "LG").iterdir())
    ]


def has_nothing_to_share_yet(page: Page) -> None:
    """What a job says that fails stays on the page."""
    open_tab(page, "Data and radio", click)
    page.get_by_role("button", name="Build the data set").click()
    expect(page.get_by_role("alert")).to_contain_text("survey")
    page.get_by_role("alert").get_by_role("button", name="Close").click()


def receives_walks_and_shows_what_is_covered(page: Page, walks: Sequence[bytes]) -> None:
    open_tab(page, "Collect", click)
    floor = page.locator("li[data-floor='2']")
    page.get_by_role("button", name="Receive from phones").click()
    expect(page.get_by_role("img", name="Code with the address for phones")).to_be_visible()
    collecting = page.request.get("/api/collecting").json()
    assert len(collecting["code"]) == len(collecting["code"][0]) >= 21
    shares, places = [], []
    for number, data in enumerate(walks, start=1):
        assert hand_over(collecting, data).status_code == 200
        expect(page.get_by_role("list", name="Received").locator("li")).to_have_count(number)
        idle(page)
        covered = {one["floor"]: one for one in page.request.get("/api/covered").json()["floors"]}[2]
        shares.append(covered["walked"])
        places.append(covered["next_m"])
        expect(floor).to_contain_text(f"{100 * covered['walked']:.1f} % of")
    assert [*sorted(set(shares))] == shares
    assert len(set(map(tuple, places))) > 1
    drawn = page.request.get("/api/layers/gaps?floor=2").json()["features"]
    assert {feature["shape"] for feature in drawn} == {"area", "line", "point"}
    assert drawn[-1]["coordinates"] == [places[-1]]
    floor.get_by_role("button", name="Show where to walk next").click()
    page.get_by_role("button", name="Stop receiving").click()
    expect(page.get_by_role("button", name="Receive from phones")).to_be_visible()
    with pytest.raises(httpx.ConnectError):
        hand_over(collecting, walks[0])


def hand_over(collecting: dict[str, Any], data: bytes) -> httpx.Response:
    """Bring a zip as the phone app does."""
    address, _, token = collecting["url"].partition("/#")
    headers = signed(token, "PATCH", digest(data), data, 0, len(data))
    port = address.rpartition(":")[2]
    return httpx.patch(f"http://127.0.0.1:{port}{UPLOADS}/{digest(data)}", content=data, headers=headers, timeout=60)


def corrects_the_swapped_landmarks(page: Page, ids: set[str]) -> None:
    open_view(page, "Faults")
    card = page.locator(".cards > li[data-kind=swapped]")
    expect(card).to_contain_text("are interchanged")
    card.get_by_role("button", name="Correct").click()
    expect(card).to_have_count(0)
    idle(page)
    (entry,) = page.request.get("/api/corrections").json()["entries"]
    assert (entry["table"], set(entry["values"]["ids"])) == ("swap_landmarks", ids)


def shares_data_set_and_page(page: Page) -> None:
    for tab, part, file in (("Data", "Data set", "report.html"), ("Share", "Static page", "index.html")):
        open_tab(page, tab, click)
        page.get_by_role("region", name=part).locator("button.main").click()
        expect(page.get_by_role("region", name=part).get_by_role("status")).to_contain_text(f"open {file} in")
    sound(page)


def follows_a_link(browser: Browser, folder: Path) -> None:
    """It is made on a server that gives parts of files, and followed there and on one that gives whole files."""
    with range_server(folder) as url:
        with shown(browser, url, 1200) as (page, answers):
            page.locator(f"{WALKS} button").nth(1).click()
            page.locator(".time .slider").fill("21.5")
            page.get_by_role("button", name="Copy link to this moment").click()
            link = page.url.partition("#")[2]
            assert "&t=21.5&tab=walks" in link
            expect(page.get_by_text(WHOLE)).to_have_count(0)
            assert any(answer.status == 206 for answer in answers)
        with shown(browser, f"{url}#{link}", 1200) as (page, _):
            leads_to_the_moment(page)
            expect(page.locator(".values dd").first).not_to_have_text("–")
    with plain_server(folder) as url, shown(browser, f"{url}#{link}", 400) as (page, _):
        leads_to_the_moment(page)
        expect(page.get_by_text(WHOLE)).to_be_visible()


def leads_to_the_moment(page: Page) -> None:
    expect(page.locator(".time .slider")).to_have_value("21.5")
    expect(page.locator(".time output")).to_contain_text("0:21.5 / 0:39")


def step(page: Page, name: str) -> None:
    page.locator("summary", has_text=name).click()


def extent_of(page: Page, number: int) -> tuple[float, float, float, float]:
    """A floor's extent, which is brought into view as a whole."""
    page.get_by_role("button", name="Show all").click()
    page.wait_for_timeout(500)
    floors = page.request.get("/api/survey").json()["floors"]
    return tuple(next(floor["extent_m"] for floor in floors if floor["number"] == number))


def pixel(page: Page, extent: tuple[float, float, float, float], x: float, y: float) -> tuple[float, float]:
    """Where a point of the map is on the screen while all of an extent is shown."""
    box = page.locator(".map .canvas").bounding_box()
    assert box is not None
    left, right, low, high = extent
    edge = min(40.0, 0.08 * min(box["width"], box["height"]))
    m_px = max((right - left) / (box["width"] - 2 * edge), (high - low) / (box["height"] - 2 * edge))
    across, up = (x - (left + right) / 2) / m_px, (y - (low + high) / 2) / m_px
    return box["x"] + box["width"] / 2 + across, box["y"] + box["height"] / 2 - up


def sound(page: Page) -> None:
    """No serious violation in light and dark, and no scrolling sideways on a narrow screen."""
    for view in (WIDE, NARROW):
        page.set_viewport_size(view)  # type: ignore[arg-type]
        found = Axe().run(page).response["violations"]
        serious = [(one["id"], one["nodes"][0]["html"]) for one in found if one["impact"] in ("serious", "critical")]
        assert serious == []
        assert page.evaluate("document.documentElement.scrollWidth") == view["width"]
        page.locator(".tools button").last.click()
    page.set_viewport_size(WIDE)  # type: ignore[arg-type]


def pages(pdf: Path) -> int:
    with PdfDocument(pdf) as document:
        return len(document)
