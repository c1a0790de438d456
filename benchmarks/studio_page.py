"""How quick the studio's page is, in headless Chromium that draws by software.

    python -m tests.studio.scale_survey big          100 sessions, 3 million frames
    python benchmarks/studio_page.py big             frames drawn while the map moves, first paint, size of the page
    python -m tests.studio.faulty_survey faulty && vislam2tag process faulty/survey --out faulty/labels
    python benchmarks/studio_page.py faulty --correct      from a correction to its labels (on a copy)

The frames are those of the page's own trace: intervals between animation frames while the map is dragged and zoomed.
"""

from __future__ import annotations

import argparse
import gzip
import shutil
import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import Page

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.report.browser import running_browser  # noqa: E402
from tests.studio.running import running_studio  # noqa: E402

BUNDLE = ROOT / "src" / "vislam2tag" / "studio" / "page"
LATEST_MS = 120_000


def main() -> None:
    """Open the page on a folder that holds ``survey`` and ``labels``, and print what was measured."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--correct", action="store_true", help="measure a correction instead of the map")
    options = parser.parse_args()
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
    for step in range(6):
        drag(page, step)
    for turn in range(8):
        page.mouse.wheel(0, -200 if turn < 4 else 200)
        page.wait_for_timeout(700)
    for step in range(6):
        drag(page, step)
    print(page.locator(".frames").inner_text())


def drag(page: Page, step: int) -> None:
    """Move the map to and fro for about a second and a half."""
    page.mouse.move(900, 450)
    page.mouse.down()
    for moved in range(60):
        page.mouse.move(900 + (3 * moved if step % 2 else -3 * moved), 450 + moved)
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
