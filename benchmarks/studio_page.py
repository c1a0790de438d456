"""How quick the studio's page is, in headless Chromium that draws by software.

    python -m tests.studio.scale_survey big          100 sessions, 3 million frames
    python benchmarks/studio_page.py big             frames drawn while the map moves, first paint, size of the page
    python -m tests.studio.faulty_survey faulty && vislam2tag process faulty/survey --out faulty/labels
    python benchmarks/studio_page.py faulty --correct      from a correction to its labels (on a copy)
    python benchmarks/studio_page.py --fleet 1000          the shared list of so many generated surveys

The frames are those of the page's own trace: intervals between animation frames while the map is dragged and zoomed,
and how many points of walks were in view at each. Of a list the medians of OPENED new browser windows are told.
"""

from __future__ import annotations

import argparse
import gzip
import shutil
import statistics
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Page

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.report.browser import running_browser  # noqa: E402
from tests.studio.running import running_studio  # noqa: E402
from tests.studio.sharing.file_servers import plain_server, range_server  # noqa: E402
from tests.studio.sharing.generated_fleet import generated_rows  # noqa: E402

from vislam2tag.pipeline.fleet.catalogue import Fleet  # noqa: E402
from vislam2tag.settings import Settings  # noqa: E402
from vislam2tag.studio.sharing.fleet import export_fleet  # noqa: E402

BUNDLE = ROOT / "src" / "vislam2tag" / "studio" / "page"
LATEST_MS = 120_000
ZOOMS = 4
SETTLED_MS = 1500
OPENED = 5
ROWS = "document.querySelectorAll('.fleet .row')"
LEAST_POINTS = 20_000
TAKEN = "document.querySelector('.map .canvas').trace.frames.splice(0)"
MIDDLE = 900, 470
"""Of the map, pixels of the page."""


def main() -> None:
    """Open the page on a folder that holds ``survey`` and ``labels``, and print what was measured."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--correct", action="store_true", help="measure a correction instead of the map")
    parser.add_argument("--fleet", type=int, metavar="N", help="measure the list of N surveys, without a folder")
    options = parser.parse_args()
    if options.fleet:
        share(options.fleet)
        return
    if options.folder is None:
        parser.error("give a folder, or --fleet N")
    with tempfile.TemporaryDirectory() as copied:
        folder = options.folder
        if options.correct:
            folder = Path(shutil.copytree(folder, Path(copied) / "copy"))
        labels = ("--labels", str(folder / "labels"), "--jobs", "2")
        with running_studio(folder / "survey", *labels) as server, running_browser() as browser:
            page = browser.new_page(viewport={"width": 1400, "height": 900}, base_url=server.url, locale="en")
            page.set_default_timeout(LATEST_MS)
            page.goto(f"{server.url}/#{server.token}")
            page.locator(".map canvas").first.wait_for()
            correct(page) if options.correct else look(page)


def share(number: int) -> None:
    """Print how soon the list of a fleet is there, from servers with and without ranges, and how large it is."""
    with tempfile.TemporaryDirectory() as made, running_browser() as browser:
        fleet, page = Path(made) / "fleet", Path(made) / "page"
        Fleet(fleet).change(generated_rows(number))
        export_fleet(fleet, page, lambda _: Settings())
        for file in sorted((page / "fleet").iterdir()):
            print(f"{file.name} {file.stat().st_size / 1000:.0f} kB")
        for name, serving in (("with ranges", range_server), ("python -m http.server", plain_server)):
            with serving(page) as url:
                opened = [list_times(browser, url, number) for _ in range(OPENED)]
            painted, listed, found = (statistics.median(ms) for ms in zip(*(one[:3] for one in opened), strict=True))
            print(f"{name}: first paint {painted:.0f} ms, list {listed:.0f} ms, last survey found in {found:.0f} ms")
            print(f"{opened[0][3]} files with {opened[0][4] / 1000:.0f} kB until the list is there")


def list_times(browser: Browser, url: str, number: int) -> tuple[float, float, float, int, int]:
    """Open a list in a new window: milliseconds to its first paint, to its rows, and from a search to what it finds;
    the files that were asked for before the search, and their bytes.
    """
    context = browser.new_context(viewport={"width": 1400, "height": 900}, locale="en", bypass_csp=True)
    page = context.new_page()
    page.goto(url)
    listed = page.wait_for_function(f"{ROWS}.length && performance.now()").json_value()
    page.wait_for_load_state("networkidle")
    painted = page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    sizes = page.evaluate(
        "performance.getEntries().filter((one) => 'encodedBodySize' in one).map((one) => one.encodedBodySize)"
    )
    begun = page.evaluate("performance.now()")
    page.get_by_label("Search").fill(f"survey-{number - 1:06d}")
    found = page.wait_for_function(f"{ROWS}.length === 1 && performance.now()").json_value() - begun
    context.close()
    return painted, listed, found, len(sizes), sum(sizes)


def look(page: Page) -> None:
    """Print first paint, the bundle's size, and the intervals of frames."""
    page.wait_for_load_state("networkidle")
    first = page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    drawn = page.evaluate("performance.getEntriesByName('walks-drawn')[0].startTime")
    print(f"first paint {first:.0f} ms, walks drawn {drawn:.0f} ms after the address was opened")
    files = [file.read_bytes() for file in BUNDLE.rglob("*.*")]
    packed = sum(len(gzip.compress(content)) for content in files)
    print(f"page {sum(map(len, files)) / 1000:.0f} kB, {packed / 1000:.0f} kB packed")
    sessions = page.request.get("/api/sessions").json()["sessions"]
    print(f"{len(sessions)} sessions, {sum(sum(session['frames'].values()) for session in sessions)} frames")
    page.wait_for_timeout(SETTLED_MS)
    trace = Trace(page)
    for stage in range(2 * ZOOMS + 1):
        for step in range(4):
            drag(page, step)
        trace.of(f"dragged at zoom {min(stage, 2 * ZOOMS - stage)}")
        if stage < 2 * ZOOMS:
            page.mouse.move(*MIDDLE)
            page.mouse.wheel(0, -200 if stage < ZOOMS else 200)
            page.wait_for_timeout(SETTLED_MS)
            trace.of("zoomed in" if stage < ZOOMS else "zoomed out")
    print(f"in all: {told(trace.frames)}")


class Trace:
    """Prints, of the frames since it last did: how many, how quick, and how many points were in view."""

    def __init__(self, page: Page) -> None:
        self.page, self.frames = page, list[dict[str, Any]]()
        page.evaluate(TAKEN)  # those of its start

    def of(self, stage: str) -> None:
        """Print them under a name."""
        frames = self.page.evaluate(TAKEN)
        self.frames += frames
        if frames:
            print(f"{stage}: {told(frames)}")


def told(frames: Sequence[dict[str, Any]]) -> str:
    """How quick frames were, and how many points they had in view where not every frame of the labels was."""
    ms = sorted(frame["ms"] for frame in frames)
    points = sorted(frame["points"] for frame in frames if not frame["whole"])
    few = sum(count < LEAST_POINTS for count in points)
    seen = f", {len(points)} of them thinned, with {points[0]} to {points[-1]} points in view" if points else ""
    less = f" ({few} with less than {LEAST_POINTS})" if few else ""
    return f"{len(frames)} frames, 95 % within {ms[int(0.95 * (len(ms) - 1))]:.0f} ms{seen}{less}"


def drag(page: Page, step: int) -> None:
    """Move the map to and fro for about a second and a half."""
    way = 1 if step % 2 else -1
    page.mouse.move(*MIDDLE)
    page.mouse.down()
    for moved in range(60):
        page.mouse.move(MIDDLE[0] + way * 3 * moved, MIDDLE[1] + way * moved)
        page.wait_for_timeout(16)
    page.mouse.up()
    page.wait_for_timeout(400)


def correct(page: Page) -> None:
    """Exclude a span of a walk and print how long it takes until its labels are new."""
    page.locator(".list .row").first.click()
    page.get_by_role("button", name="One second on").click()
    page.get_by_role("button", name="Span to here").click()
    page.get_by_text("Correct this walk").click()
    page.get_by_role("button", name="Exclude the span").click()
    save = page.get_by_role("button", name="Save and map again")
    save.wait_for()
    begun = time.perf_counter()
    save.click()
    page.get_by_text("Labels are new.").wait_for()
    print(f"from the correction to its labels {time.perf_counter() - begun:.1f} s")


if __name__ == "__main__":
    main()
