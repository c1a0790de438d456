"""A real browser for tests of pages, what it complains about, and what a page's markup has."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

BROWSERS = ("chromium", "/usr/bin/chromium", "google-chrome")
ARGUMENTS = ["--headless", "--no-sandbox", "--disable-gpu"]


@contextmanager
def running_browser() -> Iterator[Browser]:
    """Start a browser; skip the test where none is installed."""
    found = next((path for path in map(shutil.which, BROWSERS) if path), None)
    if found is None:
        pytest.skip(f"no browser installed (looked for {', '.join(BROWSERS)})")
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=found, args=ARGUMENTS)
        yield running
        running.close()


def note_problems(page: Page, problems: list[str]) -> None:
    """Note what the browser complains about, and what it asks the network for."""
    page.on("console", lambda message: problems.append(f"console {message.type}: {message.text}"))
    page.on("pageerror", lambda error: problems.append(f"page error: {error}"))
    page.on("dialog", lambda dialog: problems.append(f"dialog: {dialog.message}"))
    page.on("request", lambda request: _note_request(problems, request.url))


def _note_request(problems: list[str], url: str) -> None:
    if not url.startswith(("file:", "data:", "blob:")):
        problems.append(f"request: {url[:100]}")


_READ_BY_PLOTLY = {"text", "hovertext", "hovertemplate", "hover", "name", "ticktext", "title"}
"""Keys of figures whose texts Plotly takes for HTML; ``name`` of a trace alone, which has a type."""
_OURS = re.compile(r"</?(br|b|i|sup|sub|extra)/?>")


def own_part(page: str) -> str:
    """The body up to the packed library, of which any text might be part."""
    return page[page.index("<body>") :].partition('<script type="text/plain"')[0]


def tags_in_figures(page: str) -> list[str]:
    """Texts of a page's figures in which Plotly would find a tag that is none of ours."""
    data = re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', page, re.DOTALL)
    texts = [text for part in data for text in _texts(json.loads(part), wanted=False)]
    assert texts
    return [text for text in texts if "<" in _OURS.sub("", text)]


def _texts(value: Any, *, wanted: bool) -> Iterator[str]:
    if isinstance(value, dict):
        keys = _READ_BY_PLOTLY if "type" in value else _READ_BY_PLOTLY - {"name"}
        for key, inner in value.items():
            yield from _texts(inner, wanted=wanted or key in keys)
    elif isinstance(value, list):
        for inner in value:
            yield from _texts(inner, wanted=wanted)
    elif isinstance(value, str) and wanted:
        yield value
