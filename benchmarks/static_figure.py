"""A Plotly figure as an SVG file, drawn by the browser that the report's tests use."""

from __future__ import annotations

import shutil
import urllib.parse
from pathlib import Path

import plotly.graph_objects as go
from playwright.sync_api import sync_playwright

BROWSERS = ("chromium", "google-chrome")
DRAW = "size => Plotly.toImage(document.querySelector('.plotly-graph-div'), {format: 'svg', ...size})"


def write_svg(figure: go.Figure, path: Path, width: int, height: int) -> None:
    """Draw a figure; raises RuntimeError where no browser is installed."""
    found = next((path for path in map(shutil.which, BROWSERS) if path), None)
    if found is None:
        raise RuntimeError(f"drawing {path} needs a browser: install {' or '.join(BROWSERS)}")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=["--headless", "--no-sandbox"])
        page = browser.new_page()
        page.set_content(figure.to_html(include_plotlyjs=True))
        image = page.evaluate(DRAW, {"width": width, "height": height})
        browser.close()
    path.write_text(urllib.parse.unquote(image.split(",", 1)[1]) + "\n", encoding="utf-8")
