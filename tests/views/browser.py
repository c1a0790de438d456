"""A real browser for tests of pages, and what it complains about."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager

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
