"""Pictures of the documentation: README's, and views of the studio, light and dark.

``front`` draws a sheet, a phone, and a walk that moves into the plan, all made by the program: it simulates one walk,
maps and labels it. ``studio`` copies the survey first; nothing in the folder is changed. Every picture is to be looked
at before it is committed.

    python benchmarks/pictures.py front docs/images/front.svg
    python -m tests.studio.faulty_survey faulty && vislam2tag process faulty/survey --out faulty/labels
    python benchmarks/pictures.py studio faulty docs/images
    python benchmarks/pictures.py placing FOLDER docs/images  # survey and labels of docs/tutorials/no_landmarks.md
"""

from __future__ import annotations

import argparse
import base64
import io
import shutil
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
import polars as pl
from PIL import Image
from playwright.sync_api import Browser, Page, ViewportSize

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.transforms import Similarity2
from vislam2tag.pipeline.labels.process import process
from vislam2tag.preparation.sheets.images import dead_leaves_picture
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import Scenario, regular_survey
from vislam2tag.simulation.survey import simulate

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.studio.running import running_studio  # noqa: E402
from tests.studio.sharing.file_servers import plain_server  # noqa: E402
from tests.studio.sharing.generated_fleet import generated_rows  # noqa: E402
from tests.studio.test_page import WALKS, open_view  # noqa: E402
from tests.views.browser import running_browser  # noqa: E402

from vislam2tag.pipeline.fleet.add import looked_at  # noqa: E402
from vislam2tag.pipeline.fleet.catalogue import DONE, LABELS, SURVEYS, Fleet  # noqa: E402
from vislam2tag.studio.fleet import export_fleet  # noqa: E402

SEED = 3
DURATION_S = 150.0
WIDTH, HEIGHT = 720, 364
HEAD_Y = 26
PLAN_BOX = (300.0, 62.0, 410.0)
"""Left, top and width of the plan."""
SCREEN_BOX = (176.0, 90.0, 84.0, 196.0)
"""Left, top, width and height of the phone's screen."""
SHEET_BOX = (20.0, 72.0, 104.0, 148.0)
SHEET_PX = 100
GREY_LEVELS = 8
THINNED = 30
"""One point is drawn of so many frames."""
SECONDS = 9
REPEATS = 2
LEAST_DBM, LARGEST_DBM = -85.0, -40.0
WEAK, STRONG = (68, 1, 84), (253, 211, 37)
"""Colours of the weakest and the strongest reading."""
STYLE = (
    "text{font:600 20px sans-serif;fill:#24292f}.note{font-weight:400;font-size:18px;fill:#57606a}"
    "path{fill:none;stroke-linejoin:round}.wall{stroke:#8c959f;stroke-width:1.2}"
    "@media(prefers-color-scheme:dark){text{fill:#e6edf3}.note{fill:#9da7b3}}"
)
RAW, MAPPED = "#d55e00", "#0072b2"

SETTLED_MS = 2500
"""The map has been drawn and animations have ended."""
LATEST_MS = 120_000
TAPPED, TAP = "2021-12-20T12:10:00", ("15.6", "5.8")
"""A walk of docs/tutorials/no_landmarks.md that is not placed, and x and y of its tap."""
DESKTOP = ViewportSize(width=1200, height=760)
PHONE = ViewportSize(width=400, height=800)


def main() -> None:
    """Make the pictures of the subcommand."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_subparsers(dest="what", required=True)
    front = what.add_parser("front", help="of README and of the start page")
    front.add_argument("file", type=Path)
    for name, help in (("studio", "of views of the studio"), ("placing", "of a tap that places a walk on the plan")):
        views = what.add_parser(name, help=help)
        views.add_argument("folder", type=Path, help="contains survey and labels")
        views.add_argument("out", type=Path)
    options = parser.parse_args()
    if options.what == "front":
        scenario = regular_survey(SEED, floors=(0,), devices=("LG",), sessions=1, duration_s=DURATION_S)
        options.file.write_text(picture(example(scenario)), encoding="utf-8")
    elif options.what == "studio":
        take_all(options.folder, options.out)
    else:
        take_placing(options.folder, options.out)


@dataclass(frozen=True)
class Example:
    """What the program makes of one walk; positions in metres on the plan."""

    raw: FloatArray
    """The walk (n, 2) as the tracker logged it, moved, turned and scaled onto the mapped one."""
    mapped: FloatArray
    walls: FloatArray
    landmarks: FloatArray
    scans: FloatArray
    """Of the access point that is heard most often (k, 3): x, y and signal strength in dBm."""
    size_m: tuple[float, float]


def example(scenario: Scenario) -> Example:
    """Simulate the walk, map it and label its readings, as `simulate` and `process` do."""
    with tempfile.TemporaryDirectory() as folder:
        survey, labels = Path(folder) / "survey", Path(folder) / "labels"
        simulate(scenario, survey)
        process(survey, labels, Settings())
        camera = read_session(open_survey(survey).sessions[0]).camera
        trajectory = pl.read_parquet(labels / "trajectory" / "*.parquet")
        wifi = pl.read_parquet(labels / "wifi" / "*.parquet").filter(pl.col("status") == "ok")
    mapped = trajectory.select("x", "y").to_numpy()
    known = np.isfinite(mapped).all(axis=1) & np.isfinite(camera.position_acs).all(axis=1)
    raw = camera.position_acs[known][:, [0, 2]] * (1, -1)
    raw = Similarity2.fit(raw, mapped[known]) @ raw
    often = wifi["bssid"].value_counts(sort=True)["bssid"][0]
    floor = scenario.building.floors[0]
    return Example(
        raw=raw[::THINNED],
        mapped=mapped[known][::THINNED],
        walls=floor.walls,
        landmarks=floor.landmark_position[:, :2],
        scans=wifi.filter(pl.col("bssid") == often).select("x", "y", "rssi_dbm").to_numpy(),
        size_m=(floor.width_m, floor.height_m),
    )


def picture(shown: Example) -> str:
    """Draw the three steps side by side as an SVG."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img">'
        "<title>A printed sheet, a phone, and its walk moved into the plan of the building</title>"
        f"<style>{STYLE}</style>{sheet()}{phone(shown)}{plan(shown)}</svg>\n"
    )


def sheet() -> str:
    """A printed landmark."""
    left, top, width, height = SHEET_BOX
    grey = Image.fromarray(dead_leaves_picture(0, "7")).resize((SHEET_PX, SHEET_PX), Image.Resampling.BOX)
    packed = io.BytesIO()
    grey.quantize(GREY_LEVELS).save(packed, "png", optimize=True)
    image = base64.b64encode(packed.getvalue()).decode("ascii")
    return (
        f'<text x="{left}" y="{HEAD_Y}">1 Print</text><text class="note" x="{left}" y="{HEAD_Y + 24}">sheets</text>'
        f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="#fff" stroke="#57606a"/>'
        f'<image x="{left + 7}" y="{top + 7}" width="{width - 14}" height="{width - 14}" '
        f'href="data:image/png;base64,{image}"/>'
        f'<text x="{left + 9}" y="{top + height - 14}" style="fill:#000;font-size:30px">7</text>'
    )


def phone(shown: Example) -> str:
    """A phone that shows the walk as its tracker logged it."""
    left, top, width, height = SCREEN_BOX
    inner = (width - 12, height - 12)
    turned = shown.raw[:, ::-1]
    least, size = turned.min(axis=0), np.ptp(turned, axis=0)
    scale = min(inner[0] / size[0], inner[1] / size[1])
    track = (turned - least) * scale + (left + 6, top + 6) + (np.array(inner) - size * scale) / 2
    return (
        f'<text x="{left - 8}" y="{HEAD_Y}">2 Walk</text>'
        f'<text class="note" x="{left - 8}" y="{HEAD_Y + 24}">with a phone</text>'
        f'<rect x="{left - 8}" y="{top - 18}" width="{width + 16}" height="{height + 36}" rx="12" fill="#24292f" '
        'stroke="#8c959f"/>'
        f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="#fff"/>'
        f'<path d="{line(track)}" stroke="{RAW}" stroke-width="2"/>'
    )


def plan(shown: Example) -> str:
    """The plan, the walk that moves into it, and the readings with their places."""
    left, top, width = PLAN_BOX
    scale = width / shown.size_m[0]
    height = shown.size_m[1] * scale

    def drawn(points: FloatArray) -> FloatArray:
        return points * (scale, -scale) + (left, top + height)

    walls = "".join(line(drawn(wall)) for wall in shown.walls)
    marks = "".join(
        f'<rect x="{x - 4:.1f}" y="{y - 4:.1f}" width="8" height="8" fill="#24292f" stroke="#fff"/>'
        for x, y in drawn(shown.landmarks)
    )
    scans = "".join(
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" fill="{colour(dbm)}" stroke="#fff" stroke-width=".8"/>'
        for (x, y), dbm in zip(drawn(shown.scans[:, :2]), shown.scans[:, 2], strict=True)
    )
    raw, mapped = line(drawn(shown.raw)), line(drawn(shown.mapped))
    timing = f'keyTimes="0;.25;.5;1" dur="{SECONDS}s" repeatCount="{REPEATS}"'
    return (
        f'<text x="{left}" y="{HEAD_Y}">3 Every reading gets its place</text>'
        f'<g><rect x="{left}" y="{top}" width="{width}" height="{height:.1f}" fill="#fff"/>'
        f'<path class="wall" d="{walls}"/>{marks}'
        f'<path d="{mapped}" stroke="{MAPPED}" stroke-width="2.5">'
        f'<animate attributeName="d" values="{raw};{raw};{mapped};{mapped}" {timing}/>'
        f'<animate attributeName="stroke" values="{RAW};{RAW};{MAPPED};{MAPPED}" {timing}/></path>'
        f'<g>{scans}<animate attributeName="opacity" values="0;0;0;1" {timing}/></g></g>'
        f'<text class="note" x="{left}" y="{top + height + 26:.0f}">■ sheet</text>'
        f'<text class="note" x="{left + 90}" y="{top + height + 26:.0f}">● Wi-Fi scan, bright: strong signal</text>'
        f'<text class="note" x="{left}" y="{top + height + 54:.0f}">'
        f'<tspan fill="{RAW}" style="fill:{RAW}">—</tspan> as logged'
        f'<tspan dx="16" style="fill:{MAPPED}">—</tspan> mapped by vislam2tag</text>'
    )


def line(points: FloatArray) -> str:
    """Points (n, 2) in pixels as the data of an SVG path."""
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)


def colour(dbm: float) -> str:
    """Colour of a reading, from weak to strong."""
    share = float(np.clip((dbm - LEAST_DBM) / (LARGEST_DBM - LEAST_DBM), 0, 1))
    red, green, blue = (round(a + share * (b - a)) for a, b in zip(WEAK, STRONG, strict=True))
    return f"#{red:02x}{green:02x}{blue:02x}"


def walks(page: Page) -> None:
    """A walk with its time."""
    open_view(page, "Walks")
    page.locator(WALKS).first.get_by_role("button").click()
    page.locator(".charts .u-title").first.wait_for()
    page.locator(".time .slider").fill("47")


def diagnose(page: Page) -> None:
    """Faults with their places."""
    page.locator("#stage-check").click()
    page.locator("#tab-diagnose").click()
    page.locator("li[data-kind=mis_surveyed] .line button").first.click()


def conflicts(page: Page) -> None:
    """Landmarks that agree with walks, and those that contradict, by a whole diagnosis."""
    open_view(page, "Faults")
    page.get_by_role("button", name="Search for all faults").click()
    page.locator(".gain").first.wait_for()
    show_all(page)


def radio(page: Page) -> None:
    """The strongest signal of all access points."""
    open_view(page, "Data and radio")
    page.get_by_role("button", name="Create radio maps from these labels").click()
    page.get_by_text("of the mapped cells are shown").wait_for()
    show_all(page)


def collect(page: Page) -> None:
    """What walks have covered, and where to go next."""
    open_view(page, "Collect")
    page.get_by_role("button", name="Show where to walk next").first.wait_for()
    show_all(page)


def prepare(page: Page) -> None:
    """Landmarks planned beside those that hang, on the map of the sigma to expect."""
    open_view(page, "Prepare")
    page.locator(".step > summary").nth(2).click()
    page.locator(".step .form button").click()
    page.locator("[data-error]").wait_for()
    show_all(page)


def landmarks(page: Page) -> None:
    """A landmark to be corrected."""
    open_view(page, "Landmarks")
    page.locator(".list .row").nth(10).click()


def change(page: Page) -> None:
    """A change before it is saved."""
    landmarks(page)
    page.get_by_label("x (m)").fill("7.2")
    page.get_by_label("y (m)").fill("21.93")
    page.locator(".chosen button.main").click()


def compare(page: Page) -> None:
    """Labels before and after the change, once it is saved, swiped."""
    page.get_by_role("dialog").locator("button.main").click()
    page.locator(".result").wait_for()
    open_view(page, "Compare")
    page.get_by_role("button", name="Compare", exact=True).click()
    page.get_by_label("Divider between the two maps").wait_for()
    show_all(page)


def show_all(page: Page) -> None:
    """Bring the whole floor into view."""
    page.locator(".zoom button").last.click()


Scheme: TypeAlias = Literal["light", "dark"]
SCHEMES: tuple[Scheme, ...] = ("light", "dark")
VIEWS: dict[str, Callable[[Page], None]] = {
    view.__name__: view for view in (walks, diagnose, conflicts, radio, collect, prepare, change, compare)
}


def shared_fleet(folder: Path, made: Path) -> Path:
    """The page of a fleet of 1,000 surveys, of which this one can be looked at."""
    fleet, name = made / "hospitals", "ward-7"
    shutil.copytree(folder / "survey", fleet / SURVEYS / name)
    shutil.copytree(folder / "labels", fleet / LABELS / name)
    row, _ = looked_at(fleet, name)
    Fleet(fleet).change([row | {"site": "Hospital 0", "state": DONE, "labels": "copied"}, *generated_rows(999)])
    export_fleet(fleet, made / "page", lambda _: Settings())
    return made / "page"


def opened(
    browser: Browser, address: str, scheme: Scheme, size: ViewportSize, locale: str, there: str = ".map canvas"
) -> Page:
    """The page, once ``there`` is; a studio's address is good for one browser."""
    own = address.partition("/#")[0]
    context = browser.new_context(
        base_url=own,
        color_scheme=scheme,
        viewport=size,
        has_touch=size is PHONE,
        locale=locale,
        reduced_motion="reduce",
    )
    page = context.new_page()
    page.set_default_timeout(LATEST_MS)
    page.goto(address)
    page.locator(there).first.wait_for()
    return page


def take(page: Page, file: Path) -> None:
    """Write a picture, small, once no job is under way."""
    page.locator(".status progress").wait_for(state="detached")
    page.wait_for_timeout(SETTLED_MS)
    Image.open(io.BytesIO(page.screenshot())).save(file, "webp", quality=70, method=6)


def take_all(folder: Path, out: Path) -> None:
    """Take the pictures of the studio, light and dark."""
    with tempfile.TemporaryDirectory() as copied:
        copy = Path(shutil.copytree(folder, Path(copied) / "copy"))
        labels = ("--labels", str(copy / "labels"), "--jobs", "2")
        with running_studio(copy / "survey", *labels) as server, running_browser() as browser:
            address = f"{server.url}/#{server.token}"
            for scheme in SCHEMES:
                page = opened(browser, address, scheme, DESKTOP, "en")
                for name, view in VIEWS.items():
                    view(page)
                    take(page, out / f"studio_{name}_{scheme}.webp")
                page.get_by_role("button", name="Stop comparing").click()
                page.get_by_role("button", name="Undo", exact=True).click()
                page.get_by_role("button", name="Redo this correction").wait_for()
                address = str(page.request.post("/api/invitations", data={}).json()["url"])
                page.close()
                page = opened(browser, address, scheme, PHONE, "de")
                diagnose(page)
                take(page, out / f"studio_phone_{scheme}.webp")
                address = str(page.request.post("/api/invitations", data={}).json()["url"])
                page.close()
        with running_browser() as browser, plain_server(shared_fleet(folder, Path(copied))) as address:
            for scheme in SCHEMES:
                page = opened(browser, address, scheme, DESKTOP, "en", ".fleet .row")
                take(page, out / f"studio_fleet_{scheme}.webp")
                page.close()


def take_placing(folder: Path, out: Path) -> None:
    """Take the pictures of a walk with several possible paths, and of a tap that is not saved, light and dark."""
    with tempfile.TemporaryDirectory() as copied:
        copy = Path(shutil.copytree(folder, Path(copied) / "copy"))
        with running_studio(copy / "survey", "--labels", str(copy / "labels")) as server, running_browser() as browser:
            address = f"{server.url}/#{server.token}"
            for scheme in SCHEMES:
                page = opened(browser, address, scheme, DESKTOP, "en")
                page.locator(WALKS, has_text=TAPPED).get_by_role("button").click()
                page.get_by_role("button", name="Tap the plan where the walk was at").click()
                show_all(page)
                page.get_by_label("x (m)").fill(TAP[0])
                page.get_by_label("y (m)").fill(TAP[1])
                take(page, out / f"studio_placing_{scheme}.webp")
                address = str(page.request.post("/api/invitations", data={}).json()["url"])
                page.close()


if __name__ == "__main__":
    main()
