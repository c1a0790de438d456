"""How soon pages are painted, and how large they are: every HTML page below a folder, in headless Chromium.

    vislam2tag demo demo && vislam2tag run demo/survey --out demo/run
    python benchmarks/pages.py demo

First contentful paint by the page's own trace, from the opening of the file, on a screen of 1400 x 900 pixels: the
median of ``--repeats``, each in a new window.
"""

from __future__ import annotations

import argparse
import statistics
import sys
from pathlib import Path

from playwright.sync_api import Browser

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.report.browser import running_browser  # noqa: E402

PAINTED = "performance.getEntriesByName('first-contentful-paint')[0]"


def main() -> None:
    """Print a line for each page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    print("| page | size | first paint |\n| --- | ---: | ---: |")
    with running_browser() as browser:
        for path in sorted(arguments.folder.rglob("*.html")):
            paint_ms = statistics.median(first_paint_ms(browser, path) for _ in range(arguments.repeats))
            name = path.relative_to(arguments.folder).as_posix()
            print(f"| {name} | {path.stat().st_size / 1e6:.1f} MB | {paint_ms:.0f} ms |", flush=True)


def first_paint_ms(browser: Browser, path: Path) -> float:
    """Open a page in a new window; milliseconds until it is first painted."""
    page = browser.new_page(viewport={"width": 1400, "height": 900})
    page.goto(path.resolve().as_uri())
    page.wait_for_function(f"{PAINTED} !== undefined")
    found = float(page.evaluate(f"{PAINTED}.startTime"))
    page.close()
    return found


if __name__ == "__main__":
    main()
